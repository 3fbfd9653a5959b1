/* The checker: what the planner hands out is recomputed here, from the path as it was pushed and in plain units.
 *
 * It integrates the accelerations again, evaluates the true limits of every axis at both ends and in the middle of each
 * interval, and looks for minima of speed inside.  Nothing of the planner's rows is used.
 */
#include <math.h>
#include "jerk_internal.h"

#define JUMP_SLACK 1.01
#define SMALL_JUMPS 5e-3 /* share of the jerk limit */
#define LEAST_DIP 1e-4 /* smallest x inside an interval, over the largest */

typedef struct motion {
    double v, a, c; /* speed, acceleration, its slope over the path; or path jerk / v */
} motion;

/* Largest ratio of an axis value to its limit at derivatives d1, d2, d3. */
static double ratio_at(const jerk_planner *p, const jerk_interval *q, const double *d1, const double *d2, const double *d3, motion m, double share) {
    double worst = 0.0, v2 = m.v * m.v;
    if (!isfinite(m.v + m.a + m.c)) return INFINITY;
    for (int a = 0; a < p->cfg.axes; a++) {
        if (d1[a] == 0.0 && d2[a] == 0.0 && d3[a] == 0.0) continue; /* it rests */
        double v = fabs(d1[a]) * m.v / p->cfg.v_max[a];
        double acc = fabs(d1[a] * m.a + d2[a] * v2) / acc_max(p, q, a);
        double jerk = m.v * fabs(d3[a] * v2 + 3.0 * d2[a] * m.a + d1[a] * m.c) / (jerk_max(p, q, a) * share);
        if (!isfinite(v + acc + jerk)) return INFINITY;
        if (v > worst) worst = v;
        if (acc > worst) worst = acc;
        if (jerk > worst) worst = jerk;
    }
    return worst;
}

/* The polynomial of degree 5 for the tangent that meets the tangent and its two derivatives at both ends: Hermite's basis at a share
 * of the interval, for the start (s) and end (e) and the first, second, third of them; then its derivatives by the share. */
typedef struct hermite {
    double s1, s2, s3, e1, e2, e3;
    double ds1, ds2, ds3, de2, de3; /* de1 = -ds1 */
    double dds1, dds2, dds3, dde2, dde3;
} hermite;

#define PARTS 12 /* shares that are looked at are twelfths */
#define HERMITE(t, r) {(r) * (r) * (r) * (1.0 + 3.0 * (t) + 6.0 * (t) * (t)), (r) * (r) * (r) * (t) * (1.0 + 3.0 * (t)), 0.5 * (r) * (r) * (r) * (t) * (t), \
     (t) * (t) * (t) * (1.0 + 3.0 * (r) + 6.0 * (r) * (r)), -(t) * (t) * (t) * (r) * (1.0 + 3.0 * (r)), 0.5 * (t) * (t) * (t) * (r) * (r), \
     -30.0 * (t) * (t) * (r) * (r), (r) * (r) * (1.0 + 2.0 * (t) - 15.0 * (t) * (t)), 0.5 * (t) * (r) * (r) * (2.0 - 5.0 * (t)), \
     (t) * (t) * (1.0 + 2.0 * (r) - 15.0 * (r) * (r)), -0.5 * (r) * (t) * (t) * (2.0 - 5.0 * (r)), \
     -60.0 * (t) * (r) * (1.0 - 2.0 * (t)), -12.0 * (t) * (r) * (3.0 - 5.0 * (t)), (r) * (1.0 - 8.0 * (t) + 10.0 * (t) * (t)), \
     12.0 * (t) * (r) * (3.0 - 5.0 * (r)), (t) * (1.0 - 8.0 * (r) + 10.0 * (r) * (r))}
#define TWELFTH(i) HERMITE(i / 12.0, (12 - i) / 12.0)

static const hermite BASIS[PARTS + 1] = {TWELFTH(0), TWELFTH(1), TWELFTH(2), TWELFTH(3), TWELFTH(4), TWELFTH(5), TWELFTH(6),
                                         TWELFTH(7), TWELFTH(8), TWELFTH(9), TWELFTH(10), TWELFTH(11), TWELFTH(12)};

/* The derivatives at `part` twelfths of the interval. */
static void derivatives_at(const jerk_interval *q, int part, int axes, double *d1, double *d2, double *d3) {
    const hermite *b = &BASIS[part];
    double h = q->length;
    for (int i = 0; i < axes; i++) {
        double p0 = q->d1[0][i], p1 = q->d1[1][i], v0 = h * q->d2[0][i], v1 = h * q->d2[1][i];
        double w0 = h * h * q->d3[0][i], w1 = h * h * q->d3[1][i];
        d1[i] = b->s1 * p0 + b->s2 * v0 + b->s3 * w0 + b->e1 * p1 + b->e2 * v1 + b->e3 * w1;
        d2[i] = (b->ds1 * (p0 - p1) + b->ds2 * v0 + b->ds3 * w0 + b->de2 * v1 + b->de3 * w1) / h;
        d3[i] = (b->dds1 * (p0 - p1) + b->dds2 * v0 + b->dds3 * w0 + b->dde2 * v1 + b->dde3 * w1) / (h * h);
    }
}

/* Three motions at start, middle and end of an interval. */
static double ratio_of(const jerk_planner *p, const segment *s, const motion m[3]) {
    double d1[JERK_AXES], d2[JERK_AXES], d3[JERK_AXES], share = s->jump;
    derivatives_at(s->q, PARTS / 2, p->cfg.axes, d1, d2, d3);
    double worst = ratio_at(p, s->q, s->q->d1[0], s->q->d2[0], s->q->d3[0], m[0], share);
    worst = fmax(worst, ratio_at(p, s->q, d1, d2, d3, m[1], share));
    return fmax(worst, ratio_at(p, s->q, s->q->d1[1], s->q->d2[1], s->q->d3[1], m[2], share));
}

/* Constant path jerk over the interval h with the speed v at the moving end; `sign` -1: it ends at rest. */
static double rest_ratio(const jerk_planner *p, const segment *s, double v, double sign) {
    double t = 3.0 * s->h / v, j = 2.0 * v / (t * t);
    double tm = t * cbrt(0.5), vm = 0.5 * j * tm * tm;
    motion at = {v, sign * j * t, j / v}, mid = {vm, sign * j * tm, j / vm}, rest = {0.0, 0.0, 0.0};
    double worst = sign > 0 ? ratio_of(p, s, (motion[3]){rest, mid, at}) : ratio_of(p, s, (motion[3]){at, mid, rest});
    for (int a = 0; a < p->cfg.axes; a++)
        worst = fmax(worst, fabs(s->q->d1[sign > 0 ? 0 : 1][a]) * j / (jerk_max(p, s->q, a) * s->jump));
    return worst;
}

/* Where the speed peaks inside the interval, with the derivatives of its middle. */
static double peak_ratio(const jerk_planner *p, const segment *s, motion m) {
    double d1[JERK_AXES], d2[JERK_AXES], d3[JERK_AXES];
    derivatives_at(s->q, PARTS / 2, p->cfg.axes, d1, d2, d3);
    return ratio_at(p, s->q, d1, d2, d3, m, s->jump);
}

static motion motion_of(double x, double u, double c) { return (motion){sqrt(x), u, c}; }

static bool bends(const jerk_planner *p, const jerk_interval *q) {
    for (int a = 0; a < p->cfg.axes; a++)
        if (q->d2[0][a] != 0.0 || q->d2[1][a] != 0.0) return true;
    return false;
}

/* Points to look at inside: more of them where the third derivative changes much over the interval. */
static int points_inside(const jerk_planner *p, const jerk_interval *q) {
    double change = 0.0, most = 0.0;
    for (int a = 0; a < p->cfg.axes; a++) {
        change = fmax(change, fabs(q->d3[1][a] - q->d3[0][a]));
        most = fmax(most, fmax(fabs(q->d3[0][a]), fabs(q->d3[1][a])));
    }
    return change > 0.2 * most ? 12 : 4;
}

/* Between the points that have rows the path may bend otherwise than the rows know. */
static double inside_ratio(const jerk_planner *p, const segment *s, double x, double u, double c) {
    double worst = 0.0, d1[JERK_AXES], d2[JERK_AXES], d3[JERK_AXES];
    int n = points_inside(p, s->q);
    for (int k = 1; k < n; k++) {
        double t = (double)k / n, d = t * s->h;
        if (2 * k == n) continue; /* the middle has been looked at */
        derivatives_at(s->q, k * PARTS / n, p->cfg.axes, d1, d2, d3);
        worst = fmax(worst, ratio_at(p, s->q, d1, d2, d3, motion_of(x + 2.0 * d * u + d * d * c, u + d * c, c), s->jump));
    }
    return worst;
}

/* For the planner, ahead of a check: largest ratio inside an interval, and at its ends. */
double bend_inside(const jerk_planner *p, const segment *s, double x, double u, double c, double *ends) {
    double d1[JERK_AXES], d2[JERK_AXES], d3[JERK_AXES], h = s->h;
    motion m[2] = {motion_of(x, u, c), motion_of(x + 2.0 * h * u + h * h * c, u + h * c, c)};
    if (!bends(p, s->q)) return *ends = 0.0;
    *ends = 0.0;
    for (int e = 0; e < 2; e++) *ends = fmax(*ends, ratio_at(p, s->q, s->q->d1[e], s->q->d2[e], s->q->d3[e], m[e], s->jump));
    derivatives_at(s->q, PARTS / 2, p->cfg.axes, d1, d2, d3);
    double middle = ratio_at(p, s->q, d1, d2, d3, motion_of(x + h * u + 0.25 * h * h * c, u + 0.5 * h * c, c), s->jump);
    return fmax(middle, inside_ratio(p, s, x, u, c));
}

/* Largest speed over its cap: the feed or what was allowed on the way down to it. */
static double feed_ratio(const jerk_planner *p, const grid *g, int k, double x0, double x1, double top_x) {
    double f2 = p->scale * p->scale, cap = fmin(g->seg[k].soft / g->seg[k].slower, g->seg[k].cap) * f2;
    double most = k == 0 ? fmax(x1, fmin(top_x, x1)) : fmax(top_x, fmax(x0, x1));
    return isfinite(most) ? sqrt(most / cap) * CHECK_SLACK / FEED_SLACK : INFINITY;
}

/* One interval with free input; x, u advance. */
static double free_ratio(const jerk_planner *p, grid *g, int k, double *x, double *u, double c) {
    segment *s = &g->seg[k];
    double h = s->h, x0 = *x, u0 = *u;
    double x1 = x0 + 2.0 * h * u0 + h * h * c, u1 = u0 + h * c;
    double xm = x0 + h * u0 + 0.25 * h * h * c, um = u0 + 0.5 * h * c, top_x = fmax(x0, x1), low = fmin(x0, x1);
    if (u0 * u1 < 0.0) {
        double turn = x0 - u0 * u0 / c; /* u = 0 inside */
        top_x = fmax(top_x, turn);
        low = fmin(low, turn);
    }
    *x = x1;
    *u = u1;
    if (!(low > LEAST_DIP * top_x) || !isfinite(x1) || !isfinite(u1)) return INFINITY;
    motion m[3] = {motion_of(x0, u0, c), motion_of(xm, um, c), motion_of(x1, u1, c)};
    double limits = ratio_of(p, s, m);
    if (bends(p, s->q)) limits = fmax(limits, inside_ratio(p, s, x0, u0, c));
    if (u0 * u1 < 0.0 && c < 0.0) limits = fmax(limits, peak_ratio(p, s, motion_of(top_x, 0.0, c)));
    double feed = feed_ratio(p, g, k, x0, x1, top_x);
    s->excess = limits > CHECK_SLACK ? limits : 0.0;
    s->fast = feed > CHECK_SLACK ? feed : 0.0;
    return fmax(limits, feed);
}

/* Where the direction jumps, an acceleration u along the path jumps with it: that shows beside what the intervals around knot k
 * are planned with. Larger than the bound: they must leave more. */
static double kink_ratio(const jerk_planner *p, grid *g, int k, double x, double u) {
    const jerk_interval *l = g->seg[k - 1].q, *r = g->seg[k].q;
    double dt = p->cfg.cycle_s, most = 0.0, share = fmax(g->seg[k - 1].share, g->seg[k].share);
    if (!g->seg[k - 1].last) return 0.0;
    for (int a = 0; a < p->cfg.axes; a++) {
        double turn = fabs(r->d1[0][a] - l->d1[1][a]), bend = 0.75 * fabs(r->d2[0][a] - l->d2[1][a]) * x / dt;
        double kink = 0.75 * turn * fabs(u) / dt;
        if (kink > 0.0) most = fmax(most, (bend + turn * sqrt(x) / (dt * dt) + kink) / fmin(jerk_max(p, l, a), jerk_max(p, r, a)));
    }
    if (most + share <= CHECK_SLACK) return most + share;
    for (int i = k - 1; i <= k; i++) g->seg[i].leave = fmax(g->seg[i].leave, most);
    return most + share;
}

/* Jumps of q' and q'' at knot k, as samples show them, against the share that the intervals around it leave. */
static bool jump_fits(const jerk_planner *p, const grid *g, int k, double x) {
    const jerk_interval *l = g->seg[k - 1].q, *r = g->seg[k].q;
    double dt = p->cfg.cycle_s, room = 1.0 - fmin(g->seg[k - 1].jump, g->seg[k].jump), used = 0.0;
    if (!g->seg[k - 1].last) return true;
    for (int a = 0; a < p->cfg.axes; a++) {
        double bend = 0.75 * fabs(r->d2[0][a] - l->d2[1][a]) * x / dt, corner = fabs(r->d1[0][a] - l->d1[1][a]) * sqrt(x) / (dt * dt);
        used = fmax(used, (bend + corner) / fmin(jerk_max(p, l, a), jerk_max(p, r, a)));
    }
    return used <= room * JUMP_SLACK + SMALL_JUMPS;
}

/* The input that meets the rest interval exactly: what the way there has gathered in rounding ends here. */
static double last_input(const grid *g, double x, double u) {
    double h = g->seg[g->n - 2].h, t = 1.5 * g->seg[g->n - 1].h;
    return -(x + (2.0 * h + t) * u) / (h * (h + t));
}

/* Largest ratio of anything to its limit over the plan (infinite: no plan at all).  On the way x and u of the problem
 * are replaced by what the inputs integrate to. */
double plan_check(const jerk_planner *p, grid *g, problem *b) {
    double f2 = p->scale * p->scale, worst = 0.0, x = b->x0 * f2, u = b->u0 * f2;
    int last = g->n - 1, k = 0;
    if (g->n < (g->rest_start ? 3 : 2)) return INFINITY;
    if (g->rest_start) {
        u = b->u[1] * f2;
        x = 1.5 * g->seg[0].h * u;
        if (!(x > 0.0)) return INFINITY;
        worst = fmax(rest_ratio(p, &g->seg[0], sqrt(x), 1.0), feed_ratio(p, g, 0, 0.0, x, x));
        b->x[0] = b->u[0] = b->c[0] = 0.0;
        k = 1;
    }
    for (; k < last; k++) {
        b->x[k] = x / f2;
        b->u[k] = u / f2;
        if (k > 0 && !jump_fits(p, g, k, x)) return INFINITY;
        if (k > 0) worst = fmax(worst, kink_ratio(p, g, k, x, u));
        if (k == last - 1) b->c[k] = last_input(g, x, u) / f2;
        double ratio = free_ratio(p, g, k, &x, &u, b->c[k] * f2);
        if (!(ratio <= worst)) worst = ratio;
        if (!isfinite(worst)) return INFINITY;
    }
    double meet = 1.5 * g->seg[last].h * -u;
    if (!(x > 0.0) || !(fabs(x - meet) <= 1e-6 * x)) return INFINITY;
    if (!jump_fits(p, g, last, x)) return INFINITY;
    worst = fmax(worst, kink_ratio(p, g, last, x, u));
    b->x[last] = x / f2;
    b->u[last] = u / f2;
    b->x[g->n] = b->u[g->n] = b->c[last] = 0.0;
    worst = fmax(worst, feed_ratio(p, g, last, x, 0.0, x));
    return fmax(worst, rest_ratio(p, &g->seg[last], sqrt(x), -1.0));
}
