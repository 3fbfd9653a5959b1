/* Where the solver starts: a speed profile over the grid, then the nearest one that meets the dynamics. */
#include <math.h>
#include "jerk_internal.h"

#define EASY_ACC 0.45    /* share of the limits that the guess uses */
#define EASY_JERK 0.5
#define EASY_SPEED 0.9
#define EASY_BEND 0.6
#define STIFFNESS 0.05   /* weight of jerk against the distance from the profile */

/* What curvature alone allows on a segment. */
static double curve_cap(const jerk_planner *p, const segment *s) {
    double f = p->scale, bend = 0.0, twist = 0.0;
    for (int a = 0; a < p->cfg.axes; a++) {
        bend = fmax(bend, fmax(fabs(s->q->d2[0][a]), fabs(s->q->d2[1][a])) / p->cfg.a_max[a]);
        twist = fmax(twist, fmax(fabs(s->q->d3[0][a]), fabs(s->q->d3[1][a])) / p->cfg.j_max[a]);
    }
    double v = cbrt(EASY_BEND * s->share / fmax(1e-30, twist * f * f * f));
    return fmin(EASY_BEND / fmax(1e-30, bend * f * f), v * v);
}

static void path_limits(const jerk_planner *p, const segment *s, double *acc, double *jerk) {
    double f = p->scale;
    *acc = *jerk = 1e30;
    for (int a = 0; a < p->cfg.axes; a++) {
        double d1 = fmax(fabs(s->q->d1[0][a]), 1e-9);
        *acc = fmin(*acc, p->cfg.a_max[a] / (d1 * f * f));
        *jerk = fmin(*jerk, s->share * p->cfg.j_max[a] / (d1 * f * f * f));
    }
}

/* x at distance d from a standstill under constant path jerk. */
static double from_rest(double d, double jerk) { return 0.25 * jerk * jerk * pow(6.0 * d / jerk, 4.0 / 3.0); }

/* A slow profile that needs about half of every limit. */
static void slow_profile(jerk_planner *p, const grid *g, double *x) {
    int n = g->n;
    double whole = g->from_start[n], x0 = g->rest_start ? 0.0 : p->x;
    double curve = curve_cap(p, &g->seg[0]);
    for (int k = 1; k < n; k++) {
        double acc, jerk, before = curve, soft = fmin(g->seg[k - 1].soft, g->seg[k].soft);
        path_limits(p, &g->seg[k], &acc, &jerk);
        double cap = EASY_SPEED * fmin(soft, g->knot_cap[k]);
        curve = curve_cap(p, &g->seg[k]);
        cap = fmin(cap, fmin(before, curve));
        if (g->from_start[k] > whole - p->rest_length * 2.0) cap = fmin(cap, from_rest(whole - g->from_start[k], EASY_JERK * jerk));
        if (g->rest_start && g->from_start[k] < p->rest_length * 2.0) cap = fmin(cap, from_rest(g->from_start[k], EASY_JERK * jerk));
        x[k] = cap;
    }
    x[0] = x0;
    x[n] = 0.0;
    for (int k = n - 1; k >= 1; k--) {
        double acc, jerk;
        path_limits(p, &g->seg[k], &acc, &jerk);
        if (k < n - 1) x[k] = fmin(x[k], x[k + 1] + 2.0 * EASY_ACC * acc * g->seg[k].h);
    }
    for (int k = 1; k < n; k++) {
        double acc, jerk;
        path_limits(p, &g->seg[k - 1], &acc, &jerk);
        if (k > 1 || !g->rest_start) x[k] = fmin(x[k], x[k - 1] + 2.0 * EASY_ACC * acc * g->seg[k - 1].h);
        if (!g->rest_start) x[k] = fmax(x[k], x[k - 1] - 2.0 * acc * g->seg[k - 1].h);
        x[k] = fmax(x[k], 1e-14);
    }
}

/* x of the plan at a distance ahead of what was handed out; negative behind its end. */
static void plan_x(const plan *pl, const grid *g, double *x) {
    double start = 0.0;
    int i = pl->next;
    for (int k = 0; k < g->n; k++) {
        double at = g->from_start[k];
        while (i < pl->n && at >= start + pl->h[i] - 1e-12) start += pl->h[i++];
        if (i >= pl->n) {
            x[k] = -1.0;
            continue;
        }
        double d = at - start, h = pl->h[i];
        if (i == pl->n - 1) x[k] = pl->x[i] * pow(fmax(0.0, 1.0 - d / h), 4.0 / 3.0);
        else if (i == 0 && pl->rest_start) x[k] = pl->x[1] * pow(d / h, 4.0 / 3.0);
        else x[k] = pl->x[i] + 2.0 * pl->u[i] * d + pl->c[i] * d * d;
    }
}

/* The nearest profile that meets the dynamics: least squares of x against the guess and of the axis jerks. */
static bool project(jerk_planner *p, const grid *g, double stiffness) {
    problem *b = &p->prob;
    for (int k = 0; k < b->blocks * LANES; k++)
        b->cost.xx[k] = b->cost.xu[k] = b->cost.uu[k] = b->cost.xc[k] = b->cost.uc[k] = b->cost.cc[k] = 0.0;
    for (int k = 0; k < b->blocks * LANES; k++) b->grad.x[k] = b->grad.u[k] = b->grad.c[k] = 0.0;
    for (int k = b->first; k < b->n; k++) {
        double acc, jerk, xk = fmax(b->guess[k], 1e-14);
        path_limits(p, &g->seg[k], &acc, &jerk);
        b->cost.xx[k] = 1.0 / (xk * xk);
        b->cost.uu[k] = stiffness / (acc * acc);
        b->cost.cc[k] = stiffness * xk / (jerk * jerk) + 1e-12;
    }
    if (!riccati_factor(b)) return false;
    /* the problem is homogeneous in the deviation from a start trajectory: a first rollout with no input */
    double x = b->x0, u = b->u0;
    if (b->rest_start) x = u = 0.0;
    int last = b->n - 1;
    for (int k = b->first; k <= last; k++) {
        b->x[k] = x;
        b->u[k] = u;
        double h = b->h[k], c = 0.0;
        if (k == last - 1) c = b->ric.kx[k] * x + b->ric.ku[k] * u;
        b->c[k] = k < last ? c : 0.0;
        if (k == last) break;
        x += 2.0 * h * u + h * h * c;
        u += h * c;
    }
    for (int k = b->first; k < b->n; k++) {
        b->grad.x[k] = b->cost.xx[k] * (b->x[k] - b->guess[k]);
        b->grad.u[k] = b->cost.uu[k] * b->u[k];
        b->grad.c[k] = b->cost.cc[k] * b->c[k];
    }
    riccati_solve(b, &b->grad);
    for (int k = b->first; k < b->n; k++) {
        b->x[k] += b->dx[k];
        b->u[k] += b->du[k];
        b->c[k] += b->dc[k];
    }
    if (b->rest_start) b->x[0] = b->u[0] = b->c[0] = 0.0;
    return true;
}

/* Present plan where it reaches, slow profile behind it. */
bool guess_window(jerk_planner *p, const grid *g, bool warm) {
    problem *b = &p->prob;
    slow_profile(p, g, b->guess);
    if (warm && p->plan.next < p->plan.n) {
        plan_x(&p->plan, g, p->scratch);
        for (int k = 1; k < g->n; k++)
            if (p->scratch[k] > b->guess[k]) b->guess[k] = fmin(p->scratch[k], fmax(b->guess[k], fmin(g->seg[k - 1].soft, g->seg[k].soft)));
    }
    bound_rows(p, g);
    return project(p, g, STIFFNESS);
}

/* From a profile over the same grid. */
bool guess_from(jerk_planner *p, const grid *g, const double *x) {
    problem *b = &p->prob;
    for (int k = 0; k <= g->n; k++) b->guess[k] = fmax(1e-14, x[k]);
    b->guess[g->n] = 0.0;
    bound_rows(p, g);
    return project(p, g, 0.2 * STIFFNESS);
}

/* A stop from the present state over the whole grid. */
bool guess_stop(jerk_planner *p, const grid *g) {
    problem *b = &p->prob;
    double d = g->from_start[g->n], beta = fmin(4.0, fmax(0.0, 2.0 * p->u * d / fmax(p->x, 1e-12) + 4.0 / 3.0));
    b->guess[0] = p->x;
    for (int k = 1; k < g->n; k++) {
        double t = g->from_start[k] / d;
        b->guess[k] = fmax(1e-14, p->x * pow(1.0 - t, 4.0 / 3.0) * (1.0 + beta * t));
    }
    b->guess[g->n] = 0.0;
    bound_rows(p, g);
    return project(p, g, STIFFNESS);
}
