/* The checker: what the planner hands out is recomputed here, from the path as it was pushed and in plain units.
 *
 * It integrates the accelerations again, evaluates the true limits of every axis at both ends and in the middle of each
 * interval, and looks for minima of speed inside.  Nothing of the planner's rows is used.
 */
#include <math.h>
#include <stddef.h>
#include "jerk/state.h"

#define JUMP_SLACK 1.01
#define SMALL_JUMPS 5e-3 /* share of the jerk limit */
#define TURN_PARTS 4 /* parts of an interval in each of which the acceleration is taken to change its sign once at most */
#define TURN_STEPS 4
#define LEAST_DIP 1e-4 /* smallest x inside an interval, over the largest */

typedef struct motion {
    double v, a, j; /* along the path */
} motion;

/* Largest ratio of an axis value to its limit at derivatives d1, d2, d3; `miss`: what d3 may be more (NULL: it is exact). */
static double ratio_at(const jerk_planner *p, const segment *s, const double *d1, const double *d2, const double *d3, const float *miss, motion m) {
    const jerk_interval *q = s->q;
    double worst = 0.0, v2 = m.v * m.v;
    if (!isfinite(m.v + m.a + m.j)) return INFINITY;
    for (int a = 0; a < p->cfg.axes; a++) {
        if (d1[a] == 0.0 && d2[a] == 0.0 && d3[a] == 0.0) continue; /* it rests */
        double v = fabs(d1[a]) * m.v / p->cfg.v_max[a];
        double acc = fabs(d1[a] * m.a + d2[a] * v2) / (acc_max(p, q, a) * s->acc[a]);
        double jerk = (fabs(m.v * (d3[a] * v2 + 3.0 * d2[a] * m.a) + d1[a] * m.j) + (miss ? (double)miss[a] * v2 * m.v : 0.0)) / (jerk_max(p, q, a) * s->jump);
        if (!isfinite(v + acc + jerk)) return INFINITY;
        if (v > worst) worst = v;
        if (acc > worst) worst = acc;
        if (jerk > worst) worst = jerk;
    }
    return worst;
}

/* The derivatives at the share t of the interval: the polynomial of degree 5 for the tangent that meets the tangent and its two
 * derivatives at both ends, in Hermite's basis. */
static void derivatives_at(const jerk_interval *q, double t, int axes, double *d1, double *d2, double *d3) {
    double h = q->length, r = 1.0 - t, t2 = t * t, r2 = r * r;
    double s1 = r2 * r * (1.0 + 3.0 * t + 6.0 * t2), s2 = h * r2 * r * t * (1.0 + 3.0 * t), s3 = 0.5 * h * h * r2 * r * t2;
    double e2 = -h * t2 * t * r * (1.0 + 3.0 * r), e3 = 0.5 * h * h * t2 * t * r2;
    double first = -30.0 * t2 * r2 / h, b2 = r2 * (1.0 + 2.0 * t - 15.0 * t2), b3 = 0.5 * h * t * r2 * (2.0 - 5.0 * t);
    double f2 = t2 * (1.0 + 2.0 * r - 15.0 * r2), f3 = -0.5 * h * r * t2 * (2.0 - 5.0 * r);
    double second = -60.0 * t * r * (1.0 - 2.0 * t) / (h * h), g2 = -12.0 * t * r * (3.0 - 5.0 * t) / h, g3 = r * (1.0 - 8.0 * t + 10.0 * t2);
    double k2 = 12.0 * t * r * (3.0 - 5.0 * r) / h, k3 = t * (1.0 - 8.0 * r + 10.0 * r2);
    for (int i = 0; i < axes; i++) {
        double p0 = q->d1[0][i], p1 = q->d1[1][i], v0 = q->d2[0][i], v1 = q->d2[1][i], w0 = q->d3[0][i], w1 = q->d3[1][i];
        d1[i] = s1 * p0 + s2 * v0 + s3 * w0 + (1.0 - s1) * p1 + e2 * v1 + e3 * w1;
        d2[i] = first * (p0 - p1) + b2 * v0 + b3 * w0 + f2 * v1 + f3 * w1;
        d3[i] = second * (p0 - p1) + g2 * v0 + g3 * w0 + k2 * v1 + k3 * w1;
    }
}

static double ratio_inside(const jerk_planner *p, const segment *s, double t, motion m) {
    double d1[JERK_AXES], d2[JERK_AXES], d3[JERK_AXES];
    derivatives_at(s->q, t, p->cfg.axes, d1, d2, d3);
    return ratio_at(p, s, d1, d2, d3, s->q->miss, m);
}

static double ratio_at_end(const jerk_planner *p, const segment *s, int end, motion m) {
    return ratio_at(p, s, s->q->d1[end], s->q->d2[end], s->q->d3[end], NULL, m);
}

/* Constant path jerk over the interval h with the speed v at the moving end; `sign` -1: it ends at rest. */
static double rest_ratio(const jerk_planner *p, const segment *s, double v, double sign) {
    double t = 3.0 * s->h / v, j = 2.0 * v / (t * t);
    double tm = t * cbrt(0.5), vm = 0.5 * j * tm * tm;
    motion at = {v, sign * j * t, j}, mid = {vm, sign * j * tm, j};
    double worst = fmax(ratio_at_end(p, s, sign > 0, at), ratio_inside(p, s, 0.5, mid));
    for (int a = 0; a < p->cfg.axes; a++)
        worst = fmax(worst, fabs(s->q->d1[sign > 0 ? 0 : 1][a]) * j / (jerk_max(p, s->q, a) * s->jump));
    return worst;
}

/* The motion of a law that begins at 0 at the time t; `s` gets the place. */
static motion motion_at(const jerk_law *law, double t, double *s) {
    jerk_state at;
    jerk_at(law, t, &at);
    *s = at.s;
    return (motion){at.v, at.a, law_jerk(law, t)};
}

static double ratio_at_time(const jerk_planner *p, const segment *s, const jerk_law *law, double t) {
    double at;
    const motion m = motion_at(law, t, &at);
    return ratio_inside(p, s, at / s->h, m);
}

static double ends_ratio(const jerk_planner *p, const segment *s, const jerk_law *law) {
    double at;
    return fmax(ratio_at_end(p, s, 0, motion_at(law, 0.0, &at)), ratio_at_end(p, s, 1, motion_at(law, law->time, &at)));
}

/* Parts of the time at which it is looked at: more of them where the third derivative changes much over the interval. */
static int points_inside(const jerk_planner *p, const jerk_interval *q) {
    double change = 0.0, most = 0.0;
    for (int a = 0; a < p->cfg.axes; a++) {
        change = fmax(change, fabs(q->d3[1][a] - q->d3[0][a]));
        most = fmax(most, fmax(fabs(q->d3[0][a]), fabs(q->d3[1][a])));
    }
    return change > 0.2 * most ? 12 : 6;
}

/* Between the points that have rows the path may bend otherwise than the rows know. */
static double inside_ratio(const jerk_planner *p, const segment *s, const jerk_law *law) {
    double worst = 0.0;
    int n = points_inside(p, s->q);
    for (int k = 1; k < n; k++)
        if (2 * k != n) worst = fmax(worst, ratio_at_time(p, s, law, law->time * k / n)); /* the middle has been looked at */
    return worst;
}

/* The law over an interval h with the inputs c; x, u: at its end. */
static jerk_law law_of(double h, double *x, double *u, const double c[2]) {
    double x0 = *x, u0 = *u;
    jerk_law law = {0};
    *x = x_behind(h, x0, u0, c[0], c[1]);
    *u = u_behind(h, u0, c[0], c[1]);
    double v0 = sqrt(x0), v1 = sqrt(*x);
    law_between(&law, h, v0, u0, c[0] * v0, v1, *u, c[1] * v1);
    return law;
}

/* How much larger than at the ends it is inside an interval; ends far below the rest say nothing. */
static double bulge(double most, double ends) { return most > 0.0 ? most / fmax(ends, 0.8 * most) : 1.0; }

/* For the planner, ahead of a check: largest ratio of the interval; `*more`: by what it is more than at the ends. */
double bend_inside(const jerk_planner *p, const segment *s, double x, double u, const double c[2], double *more) {
    const jerk_law law = law_of(s->h, &x, &u, c);
    double ends = ends_ratio(p, s, &law), most = fmax(ends, fmax(ratio_at_time(p, s, &law, 0.5 * law.time), inside_ratio(p, s, &law)));
    *more = bulge(most, ends);
    return most;
}

/* Largest speed over its cap: the feed or what was allowed on the way down to it. */
static double feed_ratio(const jerk_planner *p, const grid *g, int k, double x0, double x1, double top_x) {
    double f2 = p->scale * p->scale, cap = fmin(g->seg[k].soft / g->seg[k].slower, g->seg[k].cap) * f2;
    double most = k == 0 ? fmax(x1, fmin(top_x, x1)) : fmax(top_x, fmax(x0, x1));
    return isfinite(most) ? sqrt(most / cap) * CHECK_SLACK / FEED_SLACK : INFINITY;
}

static double acceleration(const jerk_law *law, double t) {
    return law->a0 + t * (law->jerk + t * (law->snap / 2.0 + t * (law->crackle / 6.0 + t * law->pop / 24.0)));
}

/* Times in the law at which the acceleration changes its sign: how many. */
static int turning_points(const jerk_law *law, double t[TURN_PARTS]) {
    double from = law->a0;
    int n = 0;
    for (int i = 1; i <= TURN_PARTS; i++) {
        double low = law->time * (i - 1) / TURN_PARTS, high = law->time * i / TURN_PARTS, a0 = from, a1 = acceleration(law, high);
        from = a1;
        if (!(a0 * a1 < 0.0)) continue;
        t[n] = low;
        for (int k = 0; k < TURN_STEPS; k++) { /* secants, inside the bracket */
            t[n] = (low * a1 - high * a0) / (a1 - a0);
            double a = acceleration(law, t[n]);
            if (a * a0 > 0.0) low = t[n], a0 = a;
            else high = t[n], a1 = a;
            if (a == 0.0) break;
        }
        n++;
    }
    return n;
}

/* One interval with free inputs; x, u advance. */
static double free_ratio(const jerk_planner *p, grid *g, int k, double *x, double *u, const double c[2]) {
    segment *s = &g->seg[k];
    double x0 = *x, at, turns[TURN_PARTS];
    const jerk_law law = law_of(s->h, x, u, c);
    double x1 = *x, top_x = fmax(x0, x1), low = fmin(x0, x1);
    if (!(low > LEAST_DIP * top_x) || !isfinite(law.time + law.snap + law.crackle + law.pop)) return INFINITY;
    double ends = ends_ratio(p, s, &law), limits = fmax(ends, ratio_at_time(p, s, &law, 0.5 * law.time));
    limits = fmax(limits, inside_ratio(p, s, &law));
    s->bulge = bulge(limits, ends);
    for (int i = turning_points(&law, turns) - 1; i >= 0; i--) {
        double v = motion_at(&law, turns[i], &at).v;
        if (v * v > top_x) limits = fmax(limits, ratio_at_time(p, s, &law, turns[i]));
        top_x = fmax(top_x, v * v);
        low = v > 0.0 ? fmin(low, v * v) : 0.0;
    }
    if (!(low > LEAST_DIP * top_x)) return INFINITY;
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
        b->x[0] = b->u[0] = b->c[0][0] = b->c[1][0] = 0.0;
        k = 1;
    }
    for (; k < last; k++) {
        b->x[k] = x / f2;
        b->u[k] = u / f2;
        if (k > 0 && !jump_fits(p, g, k, x)) return INFINITY;
        if (k > 0) worst = fmax(worst, kink_ratio(p, g, k, x, u));
        if (k == last - 1) b->c[0][k] = b->c[1][k] = last_input(g, x, u) / f2;
        const double c[2] = {b->c[0][k] * f2, b->c[1][k] * f2};
        double ratio = free_ratio(p, g, k, &x, &u, c);
        if (!(ratio <= worst)) worst = ratio;
        if (!isfinite(worst)) return INFINITY;
    }
    double meet = 1.5 * g->seg[last].h * -u;
    if (!(x > 0.0) || !(fabs(x - meet) <= 1e-6 * x)) return INFINITY;
    if (!jump_fits(p, g, last, x)) return INFINITY;
    worst = fmax(worst, kink_ratio(p, g, last, x, u));
    b->x[last] = x / f2;
    b->u[last] = u / f2;
    b->x[g->n] = b->u[g->n] = b->c[0][last] = b->c[1][last] = 0.0;
    worst = fmax(worst, feed_ratio(p, g, last, x, 0.0, x));
    return fmax(worst, rest_ratio(p, &g->seg[last], sqrt(x), -1.0));
}
