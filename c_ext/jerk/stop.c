/* Changes that ask for less speed than the plan has.  A reduced override: a ramp down to it.  Feed hold: the shortest legal stop on the path, found by halving the distance to the standstill. */
#include <math.h>
#include "jerk/state.h"

#define STOP_TRIES 3
#define STOP_ITERATIONS 28
#define NEARLY_MET 0.03 /* share of the rows' first residuals that is left where a solver has failed closely */
#define CLOSE_ENOUGH 0.01
#define MAX_HALVINGS 12
#define PREVIEW_TRIES 4      /* distances that are tried where none is found, and */
#define PREVIEW_STEP_S 0.003 /* as TRY_AGAIN_S; */
#define PREVIEW_GROWS 1.3    /* longer and longer, so that looking ahead takes a bounded time */
#define NEAR_ENOUGH 1.05 /* a stored tail so much longer than the estimate is a stop already */

typedef struct brake {
    double top, distance; /* highest speed on the way, mm/s; mm */
} brake;

/* From (v, a) down to the speed v1 with the smallest limits along the path: to a = 0, then two jerk ramps. */
static brake brake_estimate(const jerk_planner *p, double v1) {
    double v = p->scale * sqrt(p->x), a = fmax(0.0, p->scale * p->scale * p->u), acc = 1e30, jerk = 1e30;
    const jerk_interval *q = ring_at(p, p->head);
    for (int i = 0; i < p->cfg.axes; i++) {
        double d = fmax(fabs(q->d1[0][i]), 1e-9);
        acc = fmin(acc, acc_max(p, q, i) / d);
        jerk = fmin(jerk, jerk_max(p, q, i) / d);
    }
    double t1 = a / jerk, top = v + 0.5 * a * t1, drop = fmax(0.0, top - v1), ramp = fmin(acc, sqrt(drop * jerk));
    double rise = v * t1 + 0.5 * a * t1 * t1 - jerk * t1 * t1 * t1 / 6.0;
    return (brake){top, rise + (ramp > 0.0 ? 0.5 * (top + v1) * (drop / ramp + ramp / jerk) : 0.0)};
}

double jerk_stop_distance(const jerk_planner *p) { return p->at_rest ? 0.0 : brake_estimate(p, 0.0).distance; }

/* The speed is above what a reduced override allows: a window that comes down to it without falling below. */
bool plan_ramp(jerk_planner *p) {
    static const double tries[] = {1.03, 1.15, 1.5};
    grid *g = &p->grid;
    for (int i = 0; i < 3; i++) {
        grid_window(p, g, 1e30);
        if (g->n < 2) return false;
        double target = g->seg[0].soft;
        brake b = brake_estimate(p, p->scale * sqrt(target));
        double top = 1.01 * b.top * b.top / (p->scale * p->scale);
        allow_present(p, g, tries[i] * b.distance, top);
        g->land_cap = target;
        g->land_from = tries[i] * b.distance;
        g->land_to = 3.0 * g->land_from;
        if (solve_window(p, g, true, 1.0)) return plan_accept(p, g, p->prob.solved);
    }
    return false;
}

/* What iterates took off limits is given back: of a distance that is too short, or of another guess, they say nothing. */
static void give_back(grid *g) {
    for (int k = 0; k < g->n; k++) {
        segment *s = &g->seg[k];
        *s->tight = s->before;
        s->share = s->jump * s->before;
    }
}

/* Solve for a stop over the grid: from a profile of constant limits, and where that fails closely from the stop that is there, which was
 * found over `found` mm (0: none was). */
static bool solve_stop(jerk_planner *p, grid *g, double found) {
    problem_from_grid(p, g, p->x, p->u);
    bool legal = guess_stop(p, g) && solve_guess(p, g, STOP_TRIES, STOP_ITERATIONS);
    if (!legal && found > 0.0 && p->prob.missed < NEARLY_MET) {
        give_back(g);
        problem_from_grid(p, g, p->x, p->u);
        legal = guess_stop_like(p, g, found) && solve_guess(p, g, STOP_TRIES, STOP_ITERATIONS);
    }
    if (!legal) give_back(g);
    return legal;
}

static bool try_stop(jerk_planner *p, double distance, double found) {
    grid *g = &p->grid;
    if (!grid_to(p, g, distance) || g->n < 2) return false;
    allow_present(p, g, INFINITY, INFINITY);
    p->stats.hold_solves++;
    if (!solve_stop(p, g, found)) return false;
    g->stands = false;
    return plan_accept(p, g, true);
}

/* Replace the plan by the shortest stop; the stored tail is the longest that is considered. False if none was found that is shorter by much;
 * given up after so many tries without one. */
static bool shortest_stop(jerk_planner *p, int hopeless) {
    double low = 0.0, high = 0.0;
    bool found = false;
    for (int k = p->plan.next; k < p->plan.n; k++) high += p->plan.h[k];
    p->stats.holds++;
    double d = fmin(0.999 * high, 1.02 * brake_estimate(p, 0.0).distance);
    for (int i = 0; i < (found ? MAX_HALVINGS : hopeless) && high - low > CLOSE_ENOUGH * high; i++) {
        if (try_stop(p, d, found ? high : 0.0)) high = d, found = true;
        else low = d;
        double near = low > 0.0 && i < 3 ? fmin(0.5 * (low + high), 1.1 * low) : 0.5 * (low + high);
        d = low > 0.0 ? near : 0.92 * high;
    }
    return found || high <= NEAR_ENOUGH * brake_estimate(p, 0.0).distance;
}

bool plan_stop(jerk_planner *p) { return shortest_stop(p, MAX_HALVINGS); }

static double follow(jerk_planner *p, double seconds) {
    jerk_law law;
    double way = 0.0;
    for (double t = 0.0; t < seconds && jerk_next_within(p, &law, seconds - t); t += law.time) way += law.length;
    return way;
}

/* What a hold would do that comes when `later` seconds more are handed out: as it is driven, the plan is followed where no stop is found
 * (planner.c), but it is given up sooner there. `scratch`: made like p, its content is lost. */
void jerk_stop_preview(const jerk_planner *p, jerk_planner *scratch, double later, jerk_preview *out) {
    planner_copy(scratch, p);
    *out = (jerk_preview){.before = follow(scratch, later), .v = jerk_speed(scratch)};
    scratch->changed = false; /* what comes now is known */
    scratch->hold = true;
    for (double step = p->hold ? p->again_s : 0.0; !scratch->at_rest; step = fmax(PREVIEW_STEP_S, PREVIEW_GROWS * step)) {
        out->way += follow(scratch, step);
        if (scratch->at_rest || (p->hold && !p->changed)) break;
        if (shortest_stop(scratch, PREVIEW_TRIES)) break;
    }
    for (int k = scratch->plan.next; k < scratch->plan.n && !scratch->at_rest; k++) out->way += scratch->plan.h[k];
}
