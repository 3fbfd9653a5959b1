/* Stretches of a polynomial for the acceleration-limited planner: rows at knots
 * (curved_span.c) where they are certified. */
#ifndef ENGINE_ACCEL_CURVE_PARTS_H
#define ENGINE_ACCEL_CURVE_PARTS_H
#include "curve/curve.h"
#include "engine/state/state.h"
#include "rows/nc_block.h"

typedef struct builder {
    struct engine *engine;
    struct piece *piece;
    const struct curve *c;
    struct span *spans;
    double *rows, scale, room[NC_AXES];
    double usable[NC_AXES],
        v2[NC_AXES]; /* of the axes: acceleration that is planned with, squares
                        of their speeds */
    double fast2; /* speeds squared that occur at the most: feed and override */
    const double *reserve;
    double loss;  /* share of the acceleration that a stretch may lose before it
                     is cut */
    bool starved; /* there was no room for as many stretches */
    bool likely;  /* cut by what is likely to occur, not by what could occur at
                     the most */
    const span_room *has;
    bool counting; /* only how many there would be, whatever the room */
    int count;
    int strips;
    struct knot ends[2]; /* of the piece */
    bool certified; /* the whole piece is, with these bounds of its derivatives
                     */
    double third[NC_AXES], fourth[NC_AXES];
} builder;

/* Largest path acceleration, speed squared. */
typedef struct extent {
    double u, x;
} extent;

typedef struct place {
    struct knot at;
    struct extent most,
        likely; /* at the most; u at a standstill, x at constant speed */
} place;

void set_axes(struct builder *builder);

/* The largest u and x that meet |q' u + q'' x| <= room on all axes: two axes
 * together bound both, one axis the one by the other. */
struct extent extent_at(const struct builder *builder, const struct knot *knot);
void knot_at(const struct builder *builder,
             double w,
             double s,
             struct knot *knot);

/* Inside of a piece, at the parameter w. */
void knot_inside(const struct builder *builder, double w, struct knot *knot);
double parameter_behind(const struct builder *builder, double s);

/* s mm behind the start of the piece. */
void place_behind(const struct builder *builder, double s, place *out);
struct extent extent_between(const struct extent *extent,
                             const struct extent *extent_z,
                             double h);

/* Into how many stretches a part of length h has to be cut where that is
 * reached. */
int parts_for(const struct builder *builder,
              struct extent most,
              double h,
              const double *third,
              const double *fourth);

/* As many stretches as constant bounds from the parameter w on can take. */
int most_constant(const struct builder *builder, double w);

/* From one place to another; cut in halves at least `least` times, `halvings`
 * at the most. `about`: so many stretches, by the certificate of a part twice
 * as long or more; 0: that says nothing. */
void refine(struct builder *builder,
            const place *from,
            const place *to,
            int halvings,
            int least,
            int about);
#endif
