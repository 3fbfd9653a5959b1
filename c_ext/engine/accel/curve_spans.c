/* Stretches of a polynomial for the acceleration-limited planner: rows at knots
 * (curved_span.c) where they are certified.
 *
 * Between two knots the planner sees q' and q'' of every axis on their chords
 * and a constant path acceleration u. What is driven differs from that by at
 * most |u| h^2/8 max|q'''| + x h^2/8 max|q''''| + |u| h/2 |change of q''| (x =
 * v^2; the last: x changes as well as q'') with bounds that hold everywhere
 * between them (bounds.c). Where that is little at the largest u and x that the
 * rows let through, it is taken off the acceleration. Else the rows carry it
 * along, so that it counts at the u and x that occur: near where a slow axis
 * stands its rows alone let through a hundred times of what is ever driven.
 * Where a part would lose much it is cut; where there would be many stretches
 * then, by what is likely to occur (at a standstill, at constant speed). Where
 * the speed of the parameter changes too much to tell, the constant bounds of
 * the cells are left (piece_curve.c).
 */
#include <limits.h>
#include <math.h>
#include "engine/state/state.h"

#define USABLE 0.999 /* share of the acceleration limit that is planned with   \
                      */
#define LITTLE 0.02  /* share of the limit that may be taken off */
#define LOSS                                                                   \
    0.01 /* share of it that a stretch may lose before it is cut, more where   \
            there would be too many, ... */
#define LOSS_LONG                                                              \
    0.003 /* the same of pieces that take so long that stretches cost nothing  \
           */
#define LONG_S 0.02
#define MORE_LOSS 1.5 /* ... by so much each time ... */
#define MOST_LOSS 1.0 /* ... up to that */
#define GIVEN_UP                                                               \
    0.3 /* from which on constant bounds are better, if there is no room for   \
           more rows */
#define SIGNS 4 /* rows of an axis that carry along what they lose */
#define AT_ONCE                                                                \
    12 /* stretches that a certificate of a whole piece is cut into ... */
#define OF_PART 4 /* ... and one of a part */
#define CLEARLY                                                                \
    2 /* so many times that: it is cut in halves without being looked at */
#define TIGHTER                                                                \
    4 /* about how many times fewer stretches a half needs by its own          \
         certificate */
#define HALVINGS 8
#define STOP_HALVINGS 3 /* at least, between two standstills */
#define SHORTEST_MM 1e-5
#define GENTLE_ACCEL                                                           \
    0.1 /* share of the acceleration that constant bounds may lose ... */
#define GENTLE_RAMP 0.03 /* ... where a ramp takes many pieces ... */
#define MANY_PIECES 8.0
#define GENTLE_SPEED 0.01 /* ... and of speeds squared, if no more */
#define KEPT_ACCEL 0.97   /* share of the acceleration, ... */
#define KEPT_SPEED                                                             \
    0.75 /* ... of squares of speeds that may be kept: the rows of the piece   \
            let that pass */
#define KEPT_PARTS 4 /* that a piece is looked at in, for that: 1, 2, 4 */
#define OVER_FEED                                                              \
    2.0 /* the largest override: what is planned under a lower one must hold   \
           when it comes */
#define ROUNDING 1e-9
#define TINY_MM 1e-9

typedef struct builder {
    struct engine *e;
    struct piece *p;
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

static void set_axes(struct builder *builder) {
    for (int i = 0; i < builder->c->axes; i++) {
        double v = piece_v_max(builder->e, builder->p, i);
        builder->usable[i] = USABLE * piece_a_max(builder->e, builder->p, i);
        builder->v2[i] = v * v;
    }
}

/* The largest u and x that meet |q' u + q'' x| <= room on all axes: two axes
 * together bound both, one axis the one by the other. */
static struct extent extent_at(const struct builder *builder,
                               const struct knot *knot) {
    const struct piece *piece = builder->p;
    double u = piece->limits.path_acceleration > 0
                   ? (double)piece->limits.path_acceleration
                   : NEVER,
           x = builder->fast2;
    for (int i = 0; i < builder->c->axes; i++) {
        double d1 = knot->d1[i], d2 = knot->d2[i], room = builder->room[i];
        if (x * d1 * d1 > builder->v2[i]) {
            x = builder->v2[i] / (d1 * d1);
        }
        for (int j = 0; j < i; j++) {
            double cross = fabs(d1 * knot->d2[j] - knot->d1[j] * d2);
            double along =
                       fabs(d2) * builder->room[j] + fabs(knot->d2[j]) * room,
                   across =
                       fabs(d1) * builder->room[j] + fabs(knot->d1[j]) * room;
            if (u * cross > along) {
                u = along / cross;
            }
            if (x * cross > across) {
                x = across / cross;
            }
        }
    }
    for (int i = 0; i < builder->c->axes; i++) {
        double d1 = fabs(knot->d1[i]),
               most = builder->room[i] + fabs(knot->d2[i]) * x;
        if (u * d1 > most) {
            u = most / d1;
        }
    }
    for (int i = 0; i < builder->c->axes; i++) {
        double d2 = fabs(knot->d2[i]),
               most = builder->room[i] + fabs(knot->d1[i]) * u;
        if (x * d2 > most) {
            x = most / d2;
        }
    }
    return (struct extent){u, x};
}

static void knot_at(const struct builder *builder,
                    double w,
                    double s,
                    struct knot *knot) {
    double bend2 = 0.0;
    curve_derivatives(builder->c, w, knot->d1, knot->d2);
    for (int i = 0; i < builder->c->axes; i++) {
        if (builder->p->dir < 0) {
            knot->d1[i] = -knot->d1[i];
        }
        if (builder->c->metric >> i & 1) {
            bend2 += knot->d2[i] * knot->d2[i];
        }
    }
    knot->bend = sqrt(bend2);
    knot->w = w;
    knot->s = s;
}

/* What can be reached at a knot. */
static void reach_at(const struct builder *builder, place *out) {
    const struct knot *knot = &out->at;
    out->most = out->likely = extent_at(builder, knot);
    for (int i = 0; builder->likely && i < builder->c->axes; i++) {
        if (out->likely.u * fabs(knot->d1[i]) > builder->room[i]) {
            out->likely.u = builder->room[i] / fabs(knot->d1[i]);
        }
        if (out->likely.x * fabs(knot->d2[i]) > builder->room[i]) {
            out->likely.x = builder->room[i] / fabs(knot->d2[i]);
        }
    }
}

static void place_at(const struct builder *builder,
                     double w,
                     double s,
                     place *out) {
    knot_at(builder, w, s, &out->at);
    reach_at(builder, out);
}

/* Inside of a piece, at the parameter w. */
static void knot_inside(const struct builder *builder,
                        double w,
                        struct knot *knot) {
    knot_at(builder,
            w,
            builder->p->dir
                * (curve_length_to(builder->c, w) * builder->scale
                   - builder->p->from),
            knot);
}

static void place_inside(const struct builder *builder, double w, place *out) {
    knot_inside(builder, w, &out->at);
    reach_at(builder, out);
}

static double parameter_behind(const struct builder *builder, double s) {
    return curve_parameter(builder->c,
                           (builder->p->from + builder->p->dir * s)
                               / builder->scale);
}

/* s mm behind the start of the piece. */
static void place_behind(const struct builder *builder, double s, place *out) {
    if (s <= 0.0 || s >= builder->p->length) {
        out->at = builder->ends[s > 0.0];
        reach_at(builder, out);
        return;
    }
    place_at(builder, parameter_behind(builder, s), s, out);
}

static struct extent extent_between(const struct extent *extent,
                                    const struct extent *extent_z,
                                    double h) {
    double u = lesser(extent->u, extent_z->u), added = 2.0 * u * h;
    return (struct extent){u,
                           lesser(greater(extent->x, extent_z->x),
                                  lesser(extent->x, extent_z->x) + added)};
}

/* ------------------------------------------------------------------------------------------------
 * stretches */
/* Constant bounds, cell by cell. */
static void add_constant(struct builder *builder, double from, double to) {
    for (double at = from; at < to;) {
        int cell;
        double end =
            lesser(to, curve_cell_behind(builder->c, builder->p, at, &cell));
        struct span *span = &builder->spans[builder->p->span_count++];
        curve_cell_span(builder->e,
                        builder->p,
                        cell,
                        builder->reserve,
                        end - at,
                        span);
        at = end;
    }
}

/* Whether there is room for a stretch whose rows carry along what they lose,
 * and one row an axis for all behind it. */
static bool has_more_rows(const struct builder *builder) {
    int64_t left = builder->has->row_numbers
                   - (builder->rows - builder->has->rows),
            behind = (int64_t)builder->has->count - builder->p->span_count - 1;
    return left >= (SIGNS + behind) * SPAN_ROW * builder->c->axes;
}

/* Rows between two knots, or constant bounds where too little would be left of
 * an axis. */
static void add_stretch(struct builder *builder,
                        const place *from,
                        const place *to,
                        const double *third,
                        const double *fourth) {
    double h = to->at.s - from->at.s, part = 0.125 * h * h, room[NC_AXES],
           turn2 = 0.0;
    if (h < TINY_MM) {
        return;
    }
    bent_loss lost;
    struct extent most = extent_between(&from->most, &to->most, h);
    bool more_rows = has_more_rows(builder);
    for (int i = 0; i < builder->c->axes; i++) {
        lost.above[i] = part * third[i] + ROUNDING;
        lost.u[i] =
            lost.above[i] + 0.5 * h * fabs(to->at.d2[i] - from->at.d2[i]);
        lost.x[i] = part * fourth[i];
        room[i] = builder->room[i];
        if (builder->c->metric >> i & 1) {
            turn2 += lost.x[i] * lost.x[i];
        }
        double loss = lost.u[i] * most.u + lost.x[i] * most.x;
        if (more_rows && loss > LITTLE * builder->room[i]) {
            continue;
        }
        builder->starved |= loss > LITTLE * builder->room[i];
        if (!(loss <= GIVEN_UP * builder->room[i])) {
            add_constant(builder, from->at.s, to->at.s);
            return;
        }
        room[i] -= loss;
        lost.u[i] = lost.x[i] = 0.0;
    }
    struct knot knot = from->at, knot_z = to->at;
    knot.bend = knot_z.bend = greater(knot.bend, knot_z.bend) + sqrt(turn2);
    struct span *span = &builder->spans[builder->p->span_count++];
    builder->rows += bent_rows(builder->e,
                               builder->p,
                               &knot,
                               &knot_z,
                               room,
                               &lost,
                               span,
                               builder->rows);
    for (int k = 0; k < 2; k++) {
        span->cap2[k] = lesser(span->cap2[k], builder->fast2);
    }
}

/* Into how many stretches a part of length h has to be cut where that is
 * reached. */
static int parts_for(const struct builder *builder,
                     struct extent most,
                     double h,
                     const double *third,
                     const double *fourth) {
    double worst = 0.0;
    for (int i = 0; i < builder->c->axes; i++) {
        double loss =
            h * h * (0.625 * third[i] * most.u + 0.125 * fourth[i] * most.x);
        if (loss > worst * builder->room[i]) {
            worst = loss / builder->room[i];
        }
    }
    if (worst >= 0.0 && worst <= builder->loss) {
        return 1;
    }
    double n = ceil(sqrt(worst / builder->loss));
    return n < INT_MAX ? (int)n : INT_MAX;
}

static int parts_needed(const struct builder *builder,
                        const place *from,
                        const place *to,
                        const double *third,
                        const double *fourth) {
    double h = to->at.s - from->at.s;
    return parts_for(builder,
                     builder->likely
                         ? extent_between(&from->likely, &to->likely, h)
                         : extent_between(&from->most, &to->most, h),
                     h,
                     third,
                     fourth);
}

static void add_stretches(struct builder *builder,
                          const place *from,
                          const place *to,
                          int count,
                          const double *third,
                          const double *fourth) {
    place last = *from, next;
    for (int k = 1; k < count; k++) {
        double w = from->at.w + (to->at.w - from->at.w) * k / count;
        place_at(builder,
                 w,
                 last.at.s
                     + builder->scale
                           * curve_length_between(builder->c, last.at.w, w),
                 &next);
        add_stretch(builder, &last, &next, third, fourth);
        last = next;
    }
    add_stretch(builder, &last, to, third, fourth);
}

/* As many stretches as constant bounds from the parameter w on can take. */
static int most_constant(const struct builder *builder, double w) {
    int cells = 0;
    for (int k = 0; k < builder->c->cells; k++) {
        cells += builder->p->dir > 0 ? builder->c->w[k + 1] > w
                                     : builder->c->w[k] < w;
    }
    return cells + builder->strips + HALVINGS;
}

static bool cut_in_halves(struct builder *builder,
                          const place *from,
                          const place *to,
                          int halvings,
                          int least,
                          int about);

/* From one place to another; cut in halves at least `least` times, `halvings`
 * at the most. `about`: so many stretches, by the certificate of a part twice
 * as long or more; 0: that says nothing. */
static void refine(struct builder *builder,
                   const place *from,
                   const place *to,
                   int halvings,
                   int least,
                   int about) {
    double parts[2][NC_AXES];
    if (least > 0 && cut_in_halves(builder, from, to, halvings, least, about)) {
        return;
    }
    int left = builder->counting
                   ? INT_MAX
                   : (int)builder->has->count - (int)builder->p->span_count
                         - most_constant(builder, from->at.w);
    bool clearly = about > CLEARLY * OF_PART && halvings > 0 && left > 1;
    if (clearly && cut_in_halves(builder, from, to, halvings, least, about)) {
        return;
    }
    bool whole = builder->certified && from->at.s <= 0.0
                 && to->at.s >= builder->p->length;
    bool sure =
        whole
        || curve_certify(builder->c, from->at.w, to->at.w, parts[0], parts[1]);
    const double *third = whole ? builder->third : parts[0],
                 *fourth = whole ? builder->fourth : parts[1];
    int count = sure ? parts_needed(builder, from, to, third, fourth) : INT_MAX,
        most = halvings < HALVINGS ? OF_PART : AT_ONCE;
    if (count > most && halvings > 0 && left > 1
        && cut_in_halves(builder,
                         from,
                         to,
                         halvings,
                         least,
                         count < INT_MAX ? count : 0)) {
        return;
    }
    if (count > most) {
        count = most;
    }
    builder->starved |= left < count;
    if (count > left) {
        count = left < 1 ? 1 : left;
    }
    if (builder->counting) {
        builder->count += count;
    } else if (sure) {
        add_stretches(builder, from, to, count, third, fourth);
    } else {
        add_constant(builder, from->at.s, to->at.s);
    }
}

static bool cut_in_halves(struct builder *builder,
                          const place *from,
                          const place *to,
                          int halvings,
                          int least,
                          int about) {
    place middle;
    if (to->at.s - from->at.s < SHORTEST_MM) {
        return false;
    }
    place_inside(builder, 0.5 * (from->at.w + to->at.w), &middle);
    if (!(middle.at.s > from->at.s && middle.at.s < to->at.s)) {
        return false;
    }
    refine(builder, from, &middle, halvings - 1, least - 1, about / TIGHTER);
    refine(builder, &middle, to, halvings - 1, least - 1, about / TIGHTER);
    return true;
}

/* False if there was no room for stretches that lose as little as they should.
 */
static bool add_strips(struct builder *builder,
                       const strip *strips,
                       bool stands) {
    struct piece *piece = builder->p;
    double *rows = builder->rows;
    place from = {0}, to;
    piece->span_count = 0;
    builder->starved = false;
    for (int k = 0; k < builder->strips; k++) {
        double end = k + 1 == builder->strips ? piece->length
                                              : from.at.s + strips[k].length;
        if (!(end > from.at.s)) {
            continue;
        }
        builder->reserve = strips[k].reserve;
        for (int i = 0; i < builder->c->axes; i++) {
            builder->room[i] = builder->usable[i] - builder->reserve[i];
        }
        place_behind(builder, from.at.s, &from);
        place_behind(builder, end, &to);
        refine(builder, &from, &to, HALVINGS, stands ? STOP_HALVINGS : 0, 0);
        from = to;
    }
    if (builder->starved) {
        builder->rows = rows;
    }
    return !builder->starved;
}

/* Room for as many stretches as there should be; where there may not be so many
 * each loses more: with k times as many stretches 1/k^2 as much. */
static void make_room(struct builder *builder,
                      span_room *has,
                      const strip *strips,
                      bool stands) {
    builder->counting = true;
    add_strips(builder, strips, stands);
    builder->counting = false;
    double extra = most_constant(builder, builder->p->dir > 0 ? 0.0 : 1.0);
    spans_grow(builder->e, has, builder->count + extra, SIGNS);
    builder->has = has;
    builder->spans = has->spans;
    builder->rows = has->rows;
    double share = builder->count / greater(1.0, has->count - extra);
    if (share > 1.0) {
        builder->loss =
            lesser(MOST_LOSS,
                   builder->loss * greater(MORE_LOSS, share * share));
    }
}

/* About how long the piece takes: at the programmed feed, or up to full speed
 * and down again with the slowest axis alone. */
static double seconds_about(const struct engine *engine,
                            const struct piece *piece) {
    double a = NEVER;
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        if (piece->moving >> i & 1) {
            a = lesser(a, piece_a_max(engine, piece, i));
        }
    }
    return greater(piece->length / reachable(piece, 1.0),
                   0.5 * sqrt(piece->length / a));
}

/* ------------------------------------------------------------------------------------------------
 * gentle pieces */
/* Largest |q'|, |q''| of an axis over a piece, and |q'| at its ends. */
typedef struct swing {
    double d1, d2, ends[2];
} swing;

/* What constant bounds may lose of the path acceleration that the axes have: on
 * a ramp over many pieces it adds up. */
static double gentle_loss(const struct builder *builder, double free) {
    return builder->fast2 > 2.0 * free * MANY_PIECES * builder->p->length
               ? GENTLE_RAMP
               : GENTLE_ACCEL;
}

/* Constant bounds of a strip that hold up to the speed squared x; false where
 * they would cost too much of the path acceleration. */
static bool gentle_strip(const struct builder *builder,
                         const struct swing *swing,
                         const double *reserve,
                         double length,
                         double x,
                         struct span *out) {
    double accel = NEVER, free[2] = {NEVER, NEVER};
    for (int i = 0; i < builder->c->axes; i++) {
        double room = builder->usable[i] - reserve[i],
               left = room - swing[i].d2 * x;
        if (accel * swing[i].d1 > left) {
            accel = left / swing[i].d1;
        }
        for (int k = 0; k < 2; k++) {
            if (free[k] * swing[i].ends[k] > room) {
                free[k] = room / swing[i].ends[k];
            }
        }
    }
    for (int k = 0; k < 2; k++) {
        if (accel < (1.0 - gentle_loss(builder, free[k])) * free[k]) {
            return false;
        }
    }
    if (builder->p->limits.path_acceleration > 0) {
        accel = lesser(accel, (double)builder->p->limits.path_acceleration);
    }
    *out = (struct span){.length = length, .accel = accel, .v_hard = sqrt(x)};
    return true;
}

/* Whether x is about the speed squared that the axes allow at both ends. */
static bool fast_enough(const struct builder *builder,
                        const struct swing *swing,
                        double x) {
    for (int k = 0; k < 2; k++) {
        double fast = builder->fast2;
        for (int i = 0; i < builder->c->axes; i++) {
            double d = swing[i].ends[k];
            if (fast * d * d > builder->v2[i]) {
                fast = builder->v2[i] / (d * d);
            }
        }
        if (x < (1.0 - GENTLE_SPEED) * fast) {
            return false;
        }
    }
    return true;
}

/* Whether the piece bends little enough at its ends. */
static bool gentle_ends(const struct builder *builder) {
    for (int k = 0; k < 2; k++) {
        double free = NEVER, accel = NEVER;
        for (int i = 0; i < builder->c->axes; i++) {
            double d = fabs(builder->ends[k].d1[i]),
                   left = builder->usable[i]
                          - fabs(builder->ends[k].d2[i]) * builder->fast2;
            if (free * d > builder->usable[i]) {
                free = builder->usable[i] / d;
            }
            if (accel * d > left) {
                accel = left / d;
            }
        }
        if (accel < (1.0 - gentle_loss(builder, free)) * free) {
            return false;
        }
    }
    return true;
}

/* The bounds of its derivatives all over the piece, or a part of it between
 * `ends`; the speed squared that its axes and the program allow on it. */
static double swings_of(const struct builder *builder, struct swing *swing) {
    const struct piece *piece = builder->p;
    double h = builder->ends[1].s - builder->ends[0].s, bend = 0.0,
           x = builder->fast2, h2 = 0.125 * h * h;
    for (int i = 0; i < builder->c->axes; i++) {
        for (int k = 0; k < 2; k++) {
            swing[i].ends[k] = fabs(builder->ends[k].d1[i]);
        }
        swing[i].d1 = greater(swing[i].ends[0], swing[i].ends[1])
                      + h2 * builder->third[i] + ROUNDING;
        swing[i].d2 =
            greater(fabs(builder->ends[0].d2[i]), fabs(builder->ends[1].d2[i]))
            + h2 * builder->fourth[i];
        if (x * swing[i].d1 * swing[i].d1 > builder->v2[i]) {
            x = builder->v2[i] / (swing[i].d1 * swing[i].d1);
        }
        if (builder->c->metric >> i & 1) {
            bend += swing[i].d2 * swing[i].d2;
        }
    }
    if (piece->limits.radial_acceleration > 0 && bend > 0.0) {
        x = lesser(x, (double)piece->limits.radial_acceleration / sqrt(bend));
    }
    if (piece->limits.path_velocity > 0) {
        x = lesser(x,
                   (double)piece->limits.path_velocity
                       * (double)piece->limits.path_velocity);
    }
    return x;
}

/* More than can be reached at either end: what the axes allow one by one. */
static struct extent reach_bound(const struct builder *builder) {
    double u = builder->p->limits.path_acceleration > 0
                   ? (double)builder->p->limits.path_acceleration
                   : NEVER;
    for (int i = 0; i < builder->c->axes; i++) {
        double d1 = fabs(builder->ends[0].d1[i]),
               most = builder->room[i]
                      + fabs(builder->ends[0].d2[i]) * builder->fast2;
        if (u * d1 > most) {
            u = most / d1;
        }
    }
    return (struct extent){u, builder->fast2};
}

/* Into how many stretches a part between `ends` would be cut; not looked at
 * closely where they are few. */
static int about_parts(struct builder *builder) {
    double h = builder->ends[1].s - builder->ends[0].s;
    int count = parts_for(builder,
                          reach_bound(builder),
                          h,
                          builder->third,
                          builder->fourth);
    if (count * KEPT_PARTS < (int)SPANS_FEW) {
        return count;
    }
    struct extent at[2] = {extent_at(builder, &builder->ends[0]),
                           extent_at(builder, &builder->ends[1])};
    return parts_for(builder,
                     extent_between(&at[0], &at[1], h),
                     h,
                     builder->third,
                     builder->fourth);
}

/* Largest speed squared that may be kept between two places, with what the rows
 * there will lose. `count`: how many stretches there will be. */
static double kept_between(struct builder *builder,
                           const struct knot *from,
                           const struct knot *to,
                           int *count) {
    struct swing swing[NC_AXES];
    builder->ends[0] = *from;
    builder->ends[1] = *to;
    if (!curve_certify(builder->c,
                       from->w,
                       to->w,
                       builder->third,
                       builder->fourth)) {
        return 0.0;
    }
    int number = about_parts(builder);
    *count += number < (int)SPANS_FEW ? number : (int)SPANS_FEW;
    double x = KEPT_SPEED * swings_of(builder, swing);
    for (int i = 0; i < builder->c->axes; i++) {
        if (x * swing[i].d2 > KEPT_ACCEL * builder->room[i]) {
            x = greater(0.0, KEPT_ACCEL * builder->room[i] / swing[i].d2);
        }
    }
    return x;
}

/* A speed squared that all limits let be kept all over the piece, `wanted` or
 * more if that can be shown. In more parts the certificates are sharper. */
double curve_cruise2(struct engine *engine,
                     struct piece *piece,
                     const double *reserve,
                     double wanted) {
    const struct curve *curve = curve_of(engine, piece);
    double top = reachable(piece, OVER_FEED), x = 0.0;
    struct builder builder; /* of which little is of use here: not cleared */
    builder.e = engine;
    builder.p = piece;
    builder.c = curve;
    builder.scale = piece->whole / curve_length(curve);
    builder.fast2 = top * top;
    builder.loss = LOSS;
    set_axes(&builder);
    for (int i = 0; i < curve->axes; i++) {
        builder.room[i] = builder.usable[i] - reserve[i];
    }
    struct knot at[KEPT_PARTS + 1];
    knot_at(&builder, parameter_behind(&builder, 0.0), 0.0, &at[0]);
    knot_at(&builder,
            parameter_behind(&builder, piece->length),
            piece->length,
            &at[KEPT_PARTS]);
    for (int step = KEPT_PARTS; step > 0 && x < wanted; step /= 2) {
        int count = 0;
        x = NEVER;
        for (int k = 0; k < KEPT_PARTS && (x >= wanted || step == KEPT_PARTS);
             k += step) {
            struct knot *to = &at[k + step];
            if (k + step < KEPT_PARTS && k / step % 2 == 0) {
                knot_inside(&builder, 0.5 * (at[k].w + at[k + 2 * step].w), to);
            }
            x = lesser(x, kept_between(&builder, &at[k], to, &count));
        }
        if (count >= (int)SPANS_FEW) {
            x = 0.0;
        }
    }
    return x;
}

/* Where a piece bends so little that constant bounds lose next to nothing. They
 * let the speed rise and fall on one stretch, which a constant path
 * acceleration between two knots does not. */
static bool add_gentle(struct builder *builder, const strip *strips) {
    const struct piece *piece = builder->p;
    struct swing swing[NC_AXES];
    if (!gentle_ends(builder)) {
        return false;
    }
    builder->certified = curve_certify(builder->c,
                                       builder->ends[0].w,
                                       builder->ends[1].w,
                                       builder->third,
                                       builder->fourth);
    if (!builder->certified) {
        return false;
    }
    double x = swings_of(builder, swing), at = 0.0;
    int count = 0;
    if (!fast_enough(builder, swing, x)) {
        return false;
    }
    for (int i = 0; i < builder->strips; i++) {
        double end =
            i + 1 == builder->strips ? piece->length : at + strips[i].length;
        if (!(end > at)) {
            continue;
        }
        if (!gentle_strip(builder,
                          swing,
                          strips[i].reserve,
                          end - at,
                          x,
                          &builder->spans[count++])) {
            return false;
        }
        at = end;
    }
    builder->p->span_count = (uint32_t)count;
    return true;
}

/* Stretches of p, cut where the strips (zones of jumps) begin and end.
 * `stands`: at both ends, and only there. */
void curve_piece_spans(struct engine *engine,
                       struct piece *piece,
                       span_room *has,
                       const strip *strips,
                       int count,
                       bool stands) {
    const struct curve *curve = curve_of(engine, piece);
    double top =
        reachable(piece, greater(engine->plan.reserve_override, OVER_FEED));
    span_room first = spans_first(engine, has);
    struct builder builder = {
        .e = engine,
        .p = piece,
        .c = curve,
        .spans = has->spans,
        .rows = has->rows,
        .has = &first,
        .scale = piece->whole / curve_length(curve),
        .fast2 = top * top,
        .strips = count,
        .loss = seconds_about(engine, piece) > LONG_S ? LOSS_LONG : LOSS};
    set_axes(&builder);
    knot_at(&builder, parameter_behind(&builder, 0.0), 0.0, &builder.ends[0]);
    knot_at(&builder,
            parameter_behind(&builder, piece->length),
            piece->length,
            &builder.ends[1]);
    double reached = reachable(piece, engine->plan.reserve_override);
    builder.fast2 =
        reached * reached; /* these are made anew when the override comes above
                              1, and taken then if what is driven meets them */
    if (add_gentle(&builder, strips)) {
        return;
    }
    builder.fast2 = top * top;
    if (add_strips(&builder, strips, stands)) {
        return;
    }
    builder.likely = true;
    make_room(&builder, has, strips, stands);
    while (!add_strips(&builder, strips, stands) && builder.loss < MOST_LOSS) {
        builder.loss *= MORE_LOSS;
    }
}
