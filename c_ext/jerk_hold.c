/* Feed hold: the shortest legal stop on the path, found by halving the distance to the standstill. */
#include <math.h>
#include "jerk_internal.h"

#define STOP_ITERATIONS 25
#define CLOSE_ENOUGH 0.01
#define MAX_HALVINGS 12

/* Distance to stop from (v, a) with the smallest limits along the path: the first try. */
static double stop_distance(const jerk_planner *p) {
    double v = p->scale * sqrt(p->x), a = p->scale * p->scale * p->u, acc = 1e30, jerk = 1e30, s = 0.0;
    const jerk_interval *q = ring_at(p, p->head);
    for (int i = 0; i < p->cfg.axes; i++) {
        double d = fmax(fabs(q->d1[0][i]), 1e-9);
        acc = fmin(acc, p->cfg.a_max[i] / d);
        jerk = fmin(jerk, p->cfg.j_max[i] / d);
    }
    double t1 = fmax(0.0, a / jerk); /* to a = 0, then a symmetric stop */
    s += v * t1 + 0.5 * a * t1 * t1 - jerk * t1 * t1 * t1 / 6.0;
    double top = v + 0.5 * fmax(0.0, a) * t1;
    double ramp = fmin(acc, sqrt(top * jerk));
    return s + 0.5 * top * (top / ramp + ramp / jerk);
}

static bool try_stop(jerk_planner *p, double distance) {
    grid *g = &p->grid;
    if (!grid_to(p, g, distance) || g->n < 2) return false;
    for (int k = 0; k < g->n; k++) g->seg[k].soft = g->seg[k].cap;
    p->stats.hold_solves++;
    problem_from_grid(p, g, p->x, p->u);
    if (!guess_stop(p, g)) return false;
    ipm_solve(&p->prob, STOP_ITERATIONS);
    double worst = plan_check(p, g, &p->prob);
    if (!(worst <= CHECK_SLACK)) return false;
    p->stats.worst_ratio = fmax(p->stats.worst_ratio, worst);
    g->stands = false;
    plan_accept(p, g, true);
    return true;
}

/* Replace the plan by the shortest stop; the stored tail is the longest that is considered. */
void plan_stop(jerk_planner *p) {
    double low = 0.0, high = 0.0;
    for (int k = p->plan.next; k < p->plan.n; k++) high += p->plan.h[k];
    p->stats.holds++;
    double d = fmin(0.999 * high, 1.02 * stop_distance(p));
    for (int i = 0; i < MAX_HALVINGS && high - low > CLOSE_ENOUGH * high; i++) {
        if (try_stop(p, d)) high = d;
        else low = d;
        double near = low > 0.0 && i < 3 ? fmin(0.5 * (low + high), 1.1 * low) : 0.5 * (low + high);
        d = low > 0.0 ? near : 0.92 * high;
    }
}
