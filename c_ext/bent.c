/* Curved stretches for the acceleration-limited planner: limits as rows over (x, u), x = v^2, u = dv/dt along the path.
 *
 * A stretch between two knots has a constant u, so x is linear in the path, and every axis meets
 *     |q' u + q'' x| <= its acceleration
 * at both knots. That is TOPP2 (Bobrow; Pham and Stonyakin's reachability form): backwards the largest x from which the
 * next knot can be met, forwards the largest u. Straight stretches are the special case of a constant |u|, in closed form.
 */
#include <math.h>
#include "engine_internal.h"

#define SPEED_FLOOR 1e-12
#define STANDS 1e-12       /* speeds squared */
#define SHORTEST_MM 1e-12
#define INSIDE 0.004       /* of the limits: what the chord of a row over a part of a stretch may miss */
#define HOP 0.5            /* share of the limits used between two standstills without a knot between */
#define ROUNDING 1.0000001 /* speeds squared may miss by rounding */

/* ------------------------------------------------------------------------------------------------ rows of a stretch */
/* `room`: acceleration of every axis that is left. Returns the number of doubles written. */
int bent_rows(const engine *e, const piece *p, const knot *a, const knot *b, const double *room, span *out, double *rows) {
    int n = 0;
    const knot *ends[2] = {a, b};
    out->rows = rows;
    out->accel = p->limits.path_acceleration > 0 ? (double)p->limits.path_acceleration : NEVER;
    out->length = b->s - a->s;
    for (int k = 0; k < 2; k++) out->cap2[k] = knot_cap2(e, p, ends[k], room);
    out->v_hard = sqrt(lesser(out->cap2[0], out->cap2[1]));
    for (int i = 0; i < e->cfg.axis_count; i++) {
        if (fabs(a->d1[i]) + fabs(b->d1[i]) + fabs(a->d2[i]) + fabs(b->d2[i]) < 1e-12) continue;
        double inv = 1.0 / room[i], *r = rows + 4 * n++;
        r[0] = a->d1[i] * inv;
        r[1] = a->d2[i] * inv;
        r[2] = b->d1[i] * inv;
        r[3] = b->d2[i] * inv;
    }
    out->n_rows = (uint8_t)n;
    return 4 * n;
}

/* Largest x at a knot: axis speeds, acceleration at constant speed, limits of the path. */
double knot_cap2(const engine *e, const piece *p, const knot *k, const double *room) {
    double x = NEVER, path = p->limits.path_velocity, radial = p->limits.radial_acceleration;
    for (int i = 0; i < e->cfg.axis_count; i++) {
        double d1 = fabs(k->d1[i]), d2 = fabs(k->d2[i]);
        if (d1 > SPEED_FLOOR) {
            double v = piece_v_max(e, p, i) / d1;
            x = lesser(x, v * v);
        }
        /* |q' u + q'' x| <= A can be met at a larger x where the path acceleration helps, but only while x changes */
        if (d2 * x > room[i] && d1 < 1e-6) x = room[i] / d2;
    }
    if (path > 0) x = lesser(x, path * path);
    if (radial > 0 && k->bend > 1e-12) x = lesser(x, radial / k->bend);
    return x;
}

/* The stretch from s (mm behind its start) on, as rows over x at s: cu u + cx x. */
typedef struct part {
    double h, cap2, end_cap2, accel;
    int n;
    double cu[2 * NC_AXES], cx[2 * NC_AXES];
} part;

static void part_from(const span *sp, double s, part *o) {
    double t = s > 0.0 ? s / sp->length : 0.0;
    o->h = greater(sp->length - s, SHORTEST_MM);
    o->cap2 = sp->cap2[0] + t * (sp->cap2[1] - sp->cap2[0]);
    if (sp->cap2[0] >= NEVER || sp->cap2[1] >= NEVER) o->cap2 = lesser(sp->cap2[0], sp->cap2[1]);
    o->end_cap2 = sp->cap2[1];
    o->accel = sp->accel;
    o->n = 2 * sp->n_rows;
    for (int i = 0; i < sp->n_rows; i++) {
        const double *r = sp->rows + 4 * i;
        o->cu[2 * i] = r[0] + t * (r[2] - r[0]);
        o->cx[2 * i] = r[1] + t * (r[3] - r[1]);
        o->cu[2 * i + 1] = r[2] + 2.0 * o->h * r[3];
        o->cx[2 * i + 1] = r[3];
    }
}

/* Range of u at x, with the slope by x of what bounds it. */
typedef struct range {
    double low, high, low_slope, high_slope;
} range;

static range range_at(const part *o, double x, double low, double high) {
    double inv_h = 0.5 / o->h;
    range r = {(low - x) * inv_h, (high - x) * inv_h, -inv_h, -inv_h};
    if (o->accel < r.high) r.high = o->accel, r.high_slope = 0.0;
    if (-o->accel > r.low) r.low = -o->accel, r.low_slope = 0.0;
    for (int k = 0; k < o->n; k++) {
        double cu = o->cu[k], cx = o->cx[k];
        if (fabs(cu) < 1e-12) continue;
        double inv = 1.0 / cu, slope = -cx * inv, middle = slope * x, half = fabs(inv);
        if (middle + half < r.high) r.high = middle + half, r.high_slope = slope;
        if (middle - half > r.low) r.low = middle - half, r.low_slope = slope;
    }
    return r;
}

static double controllable(const part *o, double soft2, double next) {
    double x = lesser(soft2, o->cap2), end = lesser(lesser(next, soft2), o->end_cap2);
    for (int k = 0; k < 8 * NC_AXES; k++) {
        range r = range_at(o, x, 0.0, end);
        double gap = r.low - r.high, slope = r.low_slope - r.high_slope;
        if (gap <= 1e-13 * (fabs(r.low) + 1.0)) return x;
        if (!(slope > 0.0)) return 0.0;
        x = greater(0.0, x - gap / slope);
    }
    return x;
}

/* Largest x at s of the stretch from which `next` can be met at its end. */
double bent_need(const span *sp, double s, double soft2, double next) {
    part o;
    part_from(sp, s, &o);
    return controllable(&o, soft2, next);
}

/* Path acceleration that all rows allow at a standstill. */
static double standing(const part *o) {
    double most = 1.0 / o->accel;
    for (int k = 0; k < o->n; k++) {
        double cu = k & 1 ? o->cu[k] - 2.0 * o->h * o->cx[k] : o->cu[k];
        most = greater(most, fabs(cu));
    }
    return 1.0 / greater(most, 1e-30);
}

/* As hard as the limits allow: to rest inside, or over the whole stretch. */
static bent_step brake_over(const part *o, double x) {
    range r = range_at(o, x, -NEVER, NEVER);
    double u = lesser(r.low, r.high);
    if (x + 2.0 * o->h * u <= 0.0) u = lesser(greater(u, -standing(o)), r.high);
    if (u < 0.0 && x + 2.0 * o->h * u <= 0.0) {
        double h = -x / (2.0 * u);
        if (h < o->h) return (bent_step){u, h, 0.0};
        return (bent_step){-x / (2.0 * o->h), o->h, 0.0};
    }
    return (bent_step){u, o->h, x + 2.0 * o->h * u};
}

/* From rest to rest: up over the first half, down over the second; the way up. */
static bent_step hop(const part *o, double soft2) {
    double half = 0.5 * o->h, bend = 0.0, u = HOP * standing(o);
    for (int k = 0; k < o->n; k++) bend = greater(bend, fabs(o->cx[k]));
    double peak2 = lesser(2.0 * half * u, lesser(soft2, lesser(o->cap2, o->end_cap2)));
    if (bend * peak2 > HOP) peak2 = HOP / bend;
    return (bent_step){peak2 / (2.0 * half), half, peak2};
}

/* From x at s of the stretch: as fast as `next` allows at its end, or as hard down as the limits allow. */
bent_step bent_forward(const span *sp, double s, double x, double soft2, double next, bool brake) {
    part o;
    part_from(sp, s, &o);
    if (brake || soft2 <= 0.0) return brake_over(&o, x);
    double end = lesser(lesser(next, soft2), o.end_cap2), inv_h = 0.5 / o.h;
    if (x + end <= STANDS) return hop(&o, soft2);
    range r = range_at(&o, x, -NEVER, NEVER);
    double meets = (end - x) * inv_h, u = r.high < r.low ? 0.5 * (r.high + r.low) : r.high;
    if (meets <= u) {
        bool near = meets >= r.low - INSIDE * (fabs(r.low) + fabs(meets)) || x + 2.0 * o.h * r.low <= end * ROUNDING + 1e-9;
        return near ? (bent_step){meets, o.h, end} : brake_over(&o, x);
    }
    if (x + 2.0 * o.h * u <= 0.0) return (bent_step){-x * inv_h, o.h, 0.0};
    return (bent_step){u, o.h, x + 2.0 * o.h * u};
}
