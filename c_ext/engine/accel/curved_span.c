/* Curved stretches for the acceleration-limited planner: limits as rows over
 * (x, u), x = v^2, u = dv/dt along the path.
 *
 * A stretch between two knots has a constant u, so x is linear in the path, and
 * every axis meets |q' u + q'' x| <= its acceleration at both knots. That is
 * TOPP2 (Bobrow; Pham and Stonyakin's reachability form): backwards the largest
 * x from which the next knot can be met, forwards the largest u. Straight
 * stretches are the special case of a constant |u|, in closed form.
 */
#include <math.h>
#include "engine/accel/curved_span.h"
#include "engine/accel/tuning.h"
#include "engine/state/state.h"
#include "rows/nc_block.h"

/* Rows of a stretch while they are written; largest |r0|, |r2|, and |r1|, |r3|
 * of them. */
typedef struct row_writer {
    double *at, length, most, bend;
} row_writer;

/* The stretch from s (mm behind its start) on: bounds of u over x at s. */
typedef struct part {
    double h, v2_limit, end_cap2, accel;
    const struct span *span;
    const double *bounds; /* two per axis, four numbers, `step` apart */
    int n, step;
    double t, local[4 * MOST_ROWS];
} part;

/* Range of u at x, with the slope by x of what bounds it. */
typedef struct range {
    double low, high, low_slope, high_slope;
} range;

/* Largest x at a knot: acceleration at constant speed, limits of the path. */
static double knot_cap2(const engine_config *cfg,
                        const struct piece *piece,
                        const struct knot *knot,
                        const double *room) {
    double x = NEVER, path = piece->limits.path_velocity,
           radial = piece->limits.radial_acceleration;
    /* |q' u + q'' x| <= A can be met at a larger x where the path acceleration
     * helps, but only while x changes */
    for (int i = 0; i < cfg->axis_count; i++) {
        if (fabs(knot->d1[i]) < 1e-6 && fabs(knot->d2[i]) * x > room[i]) {
            x = room[i] / fabs(knot->d2[i]);
        }
    }
    if (path > 0) {
        x = lesser(x, path * path);
    }
    if (radial > 0 && knot->bend > 1e-12) {
        x = lesser(x, radial / knot->bend);
    }
    return x;
}

/* Speeds of the axes: V^2 / q'^2 is convex where q' does not change its sign,
 * so its tangent in the middle stays below. `slack`: by how much q' can be
 * above its chord. */
static void add_axis_speeds(const engine_config *cfg,
                            const struct piece *piece,
                            const struct knot *knot,
                            const struct knot *knot_b,
                            const double *slack,
                            double *v2_limit) {
    for (int i = 0; i < cfg->axis_count; i++) {
        double above = slack ? slack[i] : 0.0, first = fabs(knot->d1[i]),
               last = fabs(knot_b->d1[i]), v = piece_v_max(cfg, piece, i);
        double most = greater(first, last) + above;
        if (most < 1e-12) {
            continue;
        }
        bool turns = knot->d1[i] * knot_b->d1[i] <= 0.0;
        double middle = 0.5 * (first + last) + above,
               share = turns ? 1.0 : (last - first) / middle;
        double top2 = v * v / (middle * middle), least2 = v * v / (most * most);
        bool tangent = fabs(share) < TANGENT_SHARE;
        v2_limit[0] =
            lesser(v2_limit[0], tangent ? top2 * (1.0 + share) : least2);
        v2_limit[1] =
            lesser(v2_limit[1], tangent ? top2 * (1.0 - share) : least2);
    }
}

/* Of a row |cu u + cx x| <= 1: middle and half of the range of u, which is
 * slope x +- half. */
static void set_bound(double cu, double cx, double *bound) {
    if (fabs(cu) < 1e-12) { /* then it is a bound of x: knot_cap2 */
        bound[0] = NEVER;
        bound[1] = 0.0;
        return;
    }
    double inv = 1.0 / cu;
    bound[0] = fabs(inv);
    bound[1] = -cx * inv;
}

/* |r0 u + r1 x| <= 1 at the start, |r2 u + r3 x| <= 1 at the end, and what it
 * bounds. */
static inline void add_row(struct row_writer *row_writer,
                           double u0,
                           double x0,
                           double u1,
                           double x1) {
    double *r = row_writer->at;
    r[0] = u0;
    r[1] = x0;
    r[2] = u1;
    r[3] = x1;
    set_bound(r[0], r[1], r + 4);
    set_bound(r[2] + 2.0 * row_writer->length * r[3],
              r[3],
              r + 6); /* in terms of x at the start */
    row_writer->most =
        greater(row_writer->most, greater(fabs(r[0]), fabs(r[2])));
    row_writer->bend =
        greater(row_writer->bend, lesser(fabs(r[1]), fabs(r[3])));
    row_writer->at += SPAN_ROW;
}

/* |q' u + q'' x| + lost_u |u| + lost_x x <= room: rows for every sign of the
 * losses. */
static void add_lossy_rows(struct row_writer *row_writer,
                           const struct knot *knot,
                           const struct knot *knot_b,
                           int i,
                           double inv,
                           double lost_u,
                           double lost_x) {
    double eu = lost_u * inv, ex = lost_x * inv;
    double u0 = knot->d1[i] * inv, x0 = knot->d2[i] * inv,
           u1 = knot_b->d1[i] * inv, x1 = knot_b->d2[i] * inv;
    if (lesser(fabs(fabs(u0) - eu), fabs(fabs(u1) - eu)) < 1e-9 * eu) {
        eu *= 1.0 + 1e-6; /* no row without u */
    }
    for (int k = -1; k <= 1; k += 2) {
        for (int count = -1; count <= 1; count += 2) {
            add_row(row_writer,
                    u0 + k * eu,
                    x0 + count * ex,
                    u1 + k * eu,
                    x1 + count * ex);
        }
    }
}

uint32_t curved_rows(const engine_config *cfg,
                     const struct piece *piece,
                     const struct knot *knot,
                     const struct knot *knot_b,
                     const double *room,
                     const chord_loss *lost,
                     struct span *out,
                     double *rows) {
    out->rows = rows;
    out->accel = piece->limits.path_acceleration > 0
                     ? (double)piece->limits.path_acceleration
                     : NEVER;
    out->length = knot_b->s - knot->s;
    out->v2_limit[0] = knot_cap2(cfg, piece, knot, room);
    out->v2_limit[1] = knot_cap2(cfg, piece, knot_b, room);
    add_axis_speeds(cfg,
                    piece,
                    knot,
                    knot_b,
                    lost ? lost->above : NULL,
                    out->v2_limit);
    struct row_writer row_writer = {.at = rows,
                                    .length = out->length,
                                    .most = 1.0 / out->accel};
    for (int i = 0; i < cfg->axis_count; i++) {
        if (fabs(knot->d1[i]) + fabs(knot_b->d1[i]) + fabs(knot->d2[i])
                + fabs(knot_b->d2[i])
            < 1e-12) {
            continue;
        }
        double inv = 1.0 / room[i];
        if (lost && lost->u[i] > 0.0) {
            add_lossy_rows(&row_writer,
                           knot,
                           knot_b,
                           i,
                           inv,
                           lost->u[i],
                           lost->x[i]);
        } else {
            add_row(&row_writer,
                    knot->d1[i] * inv,
                    knot->d2[i] * inv,
                    knot_b->d1[i] * inv,
                    knot_b->d2[i] * inv);
        }
    }
    out->stand = 1.0 / greater(row_writer.most, 1e-30);
    out->bend = (float)row_writer.bend;
    out->n_rows = (uint8_t)((row_writer.at - rows) / SPAN_ROW);
    return SPAN_ROW * out->n_rows;
}

static double between(double a, double b, double t) {
    return a + t * (b - a);
}

/* A row inside a stretch, at the share t: of a law that keeps u over the whole
 * stretch, on the chord between what it takes at both ends. So the law that was
 * found for the stretch is always allowed, and what is certified for it holds.
 */
static double row_u(const struct span *sp, const double *r, double t) {
    return between(r[0], r[2], t)
           + 2.0 * sp->length * t * (1.0 - t) * (r[3] - r[1]);
}

static void part_from(const struct span *sp, double s, struct part *part) {
    part->span = sp;
    part->end_cap2 = sp->v2_limit[1];
    part->accel = sp->accel;
    part->n = sp->n_rows;
    if (s <= 0.0) {
        part->h = sp->length;
        part->v2_limit = sp->v2_limit[0];
        part->bounds = sp->rows + 4;
        part->step = SPAN_ROW;
        part->t = 0.0;
        return;
    }
    part->t = lesser(1.0, s / sp->length);
    part->h = greater(sp->length - s, SHORTEST_STEP_MM);
    part->v2_limit = greater(sp->v2_limit[0], sp->v2_limit[1]) < NEVER
                         ? between(sp->v2_limit[0], sp->v2_limit[1], part->t)
                         : lesser(sp->v2_limit[0], sp->v2_limit[1]);
    part->bounds = part->local;
    part->step = 4;
    for (int i = 0; i < part->n; i++) {
        const double *r = sp->rows + SPAN_ROW * (uint32_t)i;
        set_bound(row_u(sp, r, part->t),
                  between(r[1], r[3], part->t),
                  part->local + 4 * i);
        set_bound(r[2] + 2.0 * part->h * r[3], r[3], part->local + 4 * i + 2);
    }
}

static struct range range_at(const struct part *part,
                             double x,
                             double low,
                             double high) {
    double inv_h = 0.5 / part->h;
    struct range range = {(low - x) * inv_h,
                          (high - x) * inv_h,
                          -inv_h,
                          -inv_h};
    if (part->accel < range.high) {
        range.high = part->accel, range.high_slope = 0.0;
    }
    if (-part->accel > range.low) {
        range.low = -part->accel, range.low_slope = 0.0;
    }
    const double *b = part->bounds;
    for (int i = 0; i < part->n; i++, b += part->step) {
        for (int k = 0; k < 4; k += 2) {
            double middle = b[k + 1] * x, upper = middle + b[k],
                   lower = middle - b[k];
            if (upper < range.high) {
                range.high = upper, range.high_slope = b[k + 1];
            }
            if (lower > range.low) {
                range.low = lower, range.low_slope = b[k + 1];
            }
        }
    }
    return range;
}

static double controllable(const struct part *part, double soft2, double next) {
    double x = lesser(soft2, part->v2_limit),
           end = lesser(lesser(next, soft2), part->end_cap2);
    for (int k = 0; k < 8 * NC_AXES; k++) {
        struct range range = range_at(part, x, 0.0, end);
        double gap = range.low - range.high,
               slope = range.low_slope - range.high_slope;
        if (gap <= 1e-13 * (fabs(range.low) + 1.0)) {
            return x;
        }
        if (!(slope > 0.0)) {
            return 0.0;
        }
        x = greater(0.0, x - gap / slope);
    }
    return x;
}

double curved_controllable_v2(const struct span *sp,
                              double s,
                              double soft2,
                              double next) {
    struct part part;
    part_from(sp, s, &part);
    return controllable(&part, soft2, next);
}

/* Path acceleration that all rows allow at a standstill. */
static double standing(const struct part *part) {
    if (part->t <= 0.0) {
        return part->span->stand;
    }
    double most = 1.0 / part->accel;
    for (int i = 0; i < part->n; i++) {
        const double *r = part->span->rows + SPAN_ROW * (uint32_t)i;
        most = greater(most,
                       greater(fabs(between(r[0], r[2], part->t)), fabs(r[2])));
    }
    return 1.0 / greater(most, 1e-30);
}

/* As hard as the limits allow: to rest inside, or over the whole stretch. */
static curved_step brake_over(const struct part *part, double x) {
    struct range range = range_at(part, x, -NEVER, NEVER);
    double u =
        range.low <= range.high ? range.low : 0.5 * (range.low + range.high);
    if (x + 2.0 * part->h * u <= 0.0) {
        u = lesser(greater(u, -standing(part)), range.high);
    }
    if (u < 0.0 && x + 2.0 * part->h * u <= 0.0) {
        double h = -x / (2.0 * u);
        if (h < part->h) {
            return (curved_step){u, h, 0.0};
        }
        return (curved_step){-x / (2.0 * part->h), part->h, 0.0};
    }
    double left = x + 2.0 * part->h * u;
    return left <= NEAR_REST * x
               ? (curved_step){-x / (2.0 * part->h), part->h, 0.0}
               : (curved_step){u, part->h, left};
}

/* From rest to rest: up over the first half, down over the second; the way up.
 */
static curved_step hop(const struct part *part, double soft2) {
    double half = 0.5 * part->h, bend = 0.0, u = HOP * standing(part);
    for (int i = 0; i < part->n; i++) {
        bend = greater(
            bend,
            greater(fabs(part->span->rows[SPAN_ROW * (uint32_t)i + 1]),
                    fabs(part->span->rows[SPAN_ROW * (uint32_t)i + 3])));
    }
    double peak2 =
        lesser(2.0 * half * u,
               lesser(soft2, lesser(part->v2_limit, part->end_cap2)));
    if (bend * peak2 > HOP) {
        peak2 = HOP / bend;
    }
    return (curved_step){peak2 / (2.0 * half), half, peak2};
}

/* Part of a stretch from s0 to s1, its rows on the chord. */
static void sub_span(const struct span *sp,
                     double s0,
                     double s1,
                     struct span *out,
                     double *rows) {
    double t0 = s0 / sp->length, t1 = s1 / sp->length;
    bool bounded = greater(sp->v2_limit[0], sp->v2_limit[1]) < NEVER;
    double most = 1.0 / sp->accel;
    *out = (struct span){.length = s1 - s0,
                         .accel = sp->accel,
                         .rows = rows,
                         .n_rows = sp->n_rows,
                         .bend = sp->bend};
    out->v2_limit[0] = bounded ? between(sp->v2_limit[0], sp->v2_limit[1], t0)
                               : lesser(sp->v2_limit[0], sp->v2_limit[1]);
    out->v2_limit[1] = bounded ? between(sp->v2_limit[0], sp->v2_limit[1], t1)
                               : lesser(sp->v2_limit[0], sp->v2_limit[1]);
    if (s0 <= 0.0) {
        out->v2_limit[0] = sp->v2_limit[0];
    }
    if (s1 >= sp->length) {
        out->v2_limit[1] = sp->v2_limit[1];
    }
    for (uint32_t i = 0; i < sp->n_rows; i++) {
        const double *from = sp->rows + SPAN_ROW * i;
        double *r = rows + SPAN_ROW * i;
        r[0] = row_u(sp, from, t0);
        r[1] = between(from[1], from[3], t0);
        r[2] = row_u(sp, from, t1);
        r[3] = between(from[1], from[3], t1);
        set_bound(r[0], r[1], r + 4);
        set_bound(r[2] + 2.0 * out->length * r[3], r[3], r + 6);
        most = greater(most, greater(fabs(r[0]), fabs(r[2])));
    }
    out->stand = 1.0 / greater(most, 1e-30);
}

/* Range of u by the rows at the start alone. */
static struct range range_here(const struct part *part, double x) {
    struct range range = {-part->accel, part->accel, 0.0, 0.0};
    for (int i = 0; i < part->n; i++) {
        const double *b = part->bounds + part->step * i;
        range.high = lesser(range.high, b[1] * x + b[0]);
        range.low = greater(range.low, b[1] * x - b[0]);
    }
    return range;
}

/* Whether the rows at s allow u at x. */
static bool rows_allow(const struct span *sp, double s, double x, double u) {
    double t = s / sp->length;
    for (uint32_t i = 0; i < sp->n_rows; i++) {
        const double *r = sp->rows + SPAN_ROW * i;
        if (fabs(row_u(sp, r, t) * u + between(r[1], r[3], t) * x)
            > 1.0 + INSIDE) {
            return false;
        }
    }
    return true;
}

/* Only a part of a long stretch, from whose end one u still meets everything:
 * as far as the u is good that the beginning allows. No step (h = 0) where even
 * the shortest part is too long. */
static curved_step fine_forward(const struct span *sp,
                                const struct part *part,
                                double s,
                                double x,
                                double soft2,
                                double end) {
    static const double at[PARTS] = {1.0 / 1024,
                                     1.0 / 256,
                                     1.0 / 64,
                                     1.0 / 32,
                                     1.0 / 16,
                                     0.125,
                                     0.25,
                                     0.4,
                                     0.6,
                                     0.8,
                                     15.0 / 16,
                                     63.0 / 64};
    struct range here = range_here(part, x);
    curved_step best = {0};
    for (int k = 0; k < PARTS; k++) {
        double h = at[k] * part->h,
               top = curved_controllable_v2(sp, s + h, soft2, end),
               u = lesser(here.high, (top - x) / (2.0 * h));
        double x1 = u < here.high ? top : x + 2.0 * h * u;
        bool good = u >= here.low && x1 >= 0.0 && x + x1 > STANDS
                    && rows_allow(sp, s + h, x1, u);
        if (!good
            || (best.h > 0.0
                && u < best.u - (1.0 - WORTH) * fabs(best.u) - 1e-9)) {
            break;
        }
        best = (curved_step){u, h, x1};
    }
    return best;
}

/* As hard down as the limits allow over the next `way` mm, not as at the far
 * end of the stretch. */
static curved_step brake_near(const struct span *sp,
                              double s,
                              double x,
                              double way) {
    struct span near;
    double rows[SPAN_ROW * MOST_ROWS];
    struct part first;
    sub_span(sp,
             s,
             lesser(sp->length, s + greater(way, SHORT_STRETCH_MM)),
             &near,
             rows);
    part_from(&near, 0.0, &first);
    return brake_over(&first, x);
}

/* As hard down as the limits allow. The stored tail takes whole stretches, a
 * hold parts of them. */
static curved_step brake(const struct span *sp,
                         double s,
                         double x,
                         const struct part *part,
                         bool is_long,
                         bool tail) {
    if (tail && !is_long) {
        return brake_over(part, x);
    }
    double low = -range_here(part, x).low,
           way = low > 0.0 ? 1.05 * x / (2.0 * low) : part->h;
    if (!tail) {
        way = lesser(way, greater(sp->length / HOLD_PARTS, SHORT_STRETCH_MM));
    }
    return way >= part->h ? brake_over(part, x) : brake_near(sp, s, x, way);
}

/* Whether more than one u would be worth it over the rest of the stretch. */
static bool wants_parts(const struct part *part,
                        double x,
                        double u,
                        double end,
                        double soft2) {
    struct range here = range_here(part, x);
    double top = lesser(soft2, part->v2_limit);
    if (x < NEAR * top && u < WORTH * here.high) {
        return true;
    }
    return end < NEAR * x && u > WORTH * here.low;
}

curved_step curved_forward(const struct span *sp,
                           double s,
                           double x,
                           double soft2,
                           double next,
                           bool braking) {
    struct part this_part;
    part_from(sp, s, &this_part);
    double stand = standing(&this_part), ramp2 = this_part.h * 2.0 * stand;
    if (braking || soft2 <= 0.0) {
        return brake(sp, s, x, &this_part, ramp2 > LONG * x, braking);
    }
    double top = lesser(soft2, this_part.v2_limit);
    if ((double)sp->bend * top > 1.0) {
        top = 1.0 / (double)sp->bend;
    }
    double end = lesser(lesser(next, soft2), this_part.end_cap2),
           inv_h = 0.5 / this_part.h;
    bool is_long = ramp2 > LONG * greater(end, x);
    if (x + end <= STANDS && !is_long) {
        return hop(&this_part, soft2);
    }
    struct range range = range_at(&this_part, x, -NEVER, NEVER);
    double meets = (end - x) * inv_h, u = range.high < range.low
                                              ? 0.5 * (range.high + range.low)
                                              : range.high;
    bool near = meets >= range.low - INSIDE * (fabs(range.low) + fabs(meets))
                || x + 2.0 * this_part.h * range.low <= end * FEASIBLE + 1e-9;
    if (is_long && this_part.h > SHORT_STRETCH_MM
        && wants_parts(&this_part, x, lesser(u, meets), end, soft2)) {
        curved_step part = fine_forward(sp, &this_part, s, x, soft2, end);
        if (part.h > 0.0) {
            return part;
        }
    }
    if (x + end <= STANDS) {
        return hop(&this_part, soft2);
    }
    if (meets <= u) {
        return near ? (curved_step){meets, this_part.h, end}
                    : brake_over(&this_part, x);
    }
    if (x + 2.0 * this_part.h * u <= 0.0) {
        return (curved_step){-x * inv_h, this_part.h, 0.0};
    }
    return (curved_step){u, this_part.h, x + 2.0 * this_part.h * u};
}
