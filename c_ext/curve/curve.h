/* A polynomial of degree <= 5 per axis, parametrised by arc length.
 *
 * By length (`natural`): the parameter runs with the length of a path elsewhere
 * (the tool tip's), the axes follow. Otherwise the length is measured over the
 * axes in `metric` (the main axes, or all others where the main axes rest).
 * Cells cut the parameter so that an 8-point Gauss rule over any part of a cell
 * is exact to rounding; s -> parameter is a cubic Hermite guess and at most
 * CURVE_STEPS steps of third order, so its time is bounded. No state, no
 * allocation: also used by the smoothing stage.
 */
#ifndef CURVE_H
#define CURVE_H
#include <stdbool.h>
#include <stdint.h>
#include "rows/nc_block.h"

#define CURVE_ORDER 6 /* coefficients per axis */
#define CURVE_CELLS 24
#define CURVE_STEPS 4

typedef struct curve {
    double c[NC_AXES][CURVE_ORDER]; /* ascending powers of w = parameter / its
                                       end, 0..1 */
    double w[CURVE_CELLS + 1];      /* cell limits ... */
    double s[CURVE_CELLS + 1];      /* ... and the length up to there, mm */
    double dwds[CURVE_CELLS + 1];
    double bend[NC_AXES]; /* largest |second derivative by length| of each axis,
                             set by the engine */
    double natural;  /* > 0: the parameter runs with the path length, which is
                        this long */
    uint16_t metric; /* bit per axis that the length is measured over */
    uint16_t moving; /* bit per axis that moves at all */
    uint8_t axes, cells;
} curve;

/* Position and derivatives with respect to arc length at one point. */
typedef struct curve_point {
    double q[NC_AXES], d1[NC_AXES], d2[NC_AXES];
} curve_point;

/* Fill `c` from axes * (degree + 1) coefficients over 0..end; false if the
 * curve does not move, turns back on itself (speed zero) or is too wild for
 * CURVE_CELLS cells. `main`: bit mask of the main axes. */
bool curve_build(struct curve *curve,
                 const double *coefficients,
                 int axes,
                 int degree,
                 double end,
                 uint16_t main);
/* The same with the parameter running with the path length, which is given:
 * whatever the axes do, it does not stand. */
bool curve_build_by_length(struct curve *curve,
                           const double *coefficients,
                           int axes,
                           int degree,
                           double end,
                           double length);
static inline double curve_length(const struct curve *curve) {
    return curve->s[curve->cells];
}
double curve_parameter(const struct curve *curve, double s);
double curve_length_to(const struct curve *curve, double parameter);
double curve_length_between(const struct curve *curve, double from, double to);
void curve_position(const struct curve *curve,
                    double parameter,
                    double *position);
void curve_tangent(const struct curve *curve, double parameter, double *d1);
void curve_derivatives(const struct curve *curve,
                       double parameter,
                       double *d1,
                       double *d2); /* by arc length */
void curve_at(const struct curve *curve,
              double parameter,
              struct curve_point *curve_point);
void curve_third(const struct curve *curve,
                 double parameter,
                 double *d3); /* third derivative by arc length */
/* Bounds of the third and the fourth derivative by length over a part of the
 * curve; false: the speed of the parameter changes too much there. */
bool curve_certify(const struct curve *curve,
                   double from,
                   double to,
                   double *third,
                   double *fourth);
#endif
