/* Changes that ask for less speed than the plan has.  A reduced override: a
 * ramp down to it.  Feed hold: the shortest legal stop on the path, found by
 * halving the distance to the standstill. */
#include <math.h>
#include "jerk/state.h"

#define STOP_TRIES 3
#define STOP_ITERATIONS 28
#define NEARLY_MET                                                             \
    0.03 /* share of the rows' first residuals that is left where a solver has \
            failed closely */
#define CLOSE_ENOUGH 0.01
#define MAX_HALVINGS 12
#define PREVIEW_TRIES 4 /* distances that are tried where none is found, and   \
                         */
#define PREVIEW_STEP_S 0.003 /* as TRY_AGAIN_S; */
#define PREVIEW_GROWS                                                          \
    1.3 /* longer and longer, so that looking ahead takes a bounded time */
#define NEAR_ENOUGH                                                            \
    1.05 /* a stored tail so much longer than the estimate is a stop already   \
          */

typedef struct brake {
    double top, distance; /* highest speed on the way, mm/s; mm */
} brake;

/* From (v, a) down to the speed v1 with the smallest limits along the path: to
 * a = 0, then two jerk ramps. */
static struct brake brake_estimate(const jerk_planner *planner, double v1) {
    double v = planner->scale * sqrt(planner->x),
           a = fmax(0.0, planner->scale * planner->scale * planner->u),
           acc = 1e30, jerk = 1e30;
    const jerk_interval *interval = ring_at(planner, planner->head);
    for (int i = 0; i < planner->cfg.axes; i++) {
        double d = fmax(fabs(interval->d1[0][i]), 1e-9);
        acc = fmin(acc, acc_max(planner, interval, i) / d);
        jerk = fmin(jerk, jerk_max(planner, interval, i) / d);
    }
    double t1 = a / jerk, top = v + 0.5 * a * t1, drop = fmax(0.0, top - v1),
           ramp = fmin(acc, sqrt(drop * jerk));
    double rise = v * t1 + 0.5 * a * t1 * t1 - jerk * t1 * t1 * t1 / 6.0;
    return (struct brake){
        top,
        rise
            + (ramp > 0.0 ? 0.5 * (top + v1) * (drop / ramp + ramp / jerk)
                          : 0.0)};
}

double jerk_stop_distance(const jerk_planner *planner) {
    return planner->at_rest ? 0.0 : brake_estimate(planner, 0.0).distance;
}

/* The speed is above what a reduced override allows: a window that comes down
 * to it without falling below. */
bool plan_ramp(jerk_planner *p) {
    static const double tries[] = {1.03, 1.15, 1.5};
    struct grid *g = &p->grid;
    for (int i = 0; i < 3; i++) {
        grid_window(p, g, 1e30);
        if (g->n < 2) {
            return false;
        }
        double target = g->seg[0].soft;
        struct brake b = brake_estimate(p, p->scale * sqrt(target));
        double top = 1.01 * b.top * b.top / (p->scale * p->scale);
        allow_present(p, g, tries[i] * b.distance, top);
        g->land_cap = target;
        g->land_from = tries[i] * b.distance;
        g->land_to = 3.0 * g->land_from;
        if (solve_window(p, g, true, 1.0)) {
            return plan_accept(p, g, p->prob.solved);
        }
    }
    return false;
}

/* What iterates took off limits is given back: of a distance that is too short,
 * or of another guess, they say nothing. */
static void give_back(struct grid *grid) {
    for (int k = 0; k < grid->n; k++) {
        struct segment *segment = &grid->seg[k];
        *segment->tight = segment->before;
        segment->share = segment->jump * segment->before;
    }
}

/* Solve for a stop over the grid: from a profile of constant limits, and where
 * that fails closely from the stop that is there, which was found over `found`
 * mm (0: none was). */
static bool solve_stop(jerk_planner *planner, struct grid *grid, double found) {
    problem_from_grid(planner, grid, planner->x, planner->u);
    bool legal = guess_stop(planner, grid)
                 && solve_guess(planner, grid, STOP_TRIES, STOP_ITERATIONS);
    if (!legal && found > 0.0 && planner->prob.missed < NEARLY_MET) {
        give_back(grid);
        problem_from_grid(planner, grid, planner->x, planner->u);
        legal = guess_stop_like(planner, grid, found)
                && solve_guess(planner, grid, STOP_TRIES, STOP_ITERATIONS);
    }
    if (!legal) {
        give_back(grid);
    }
    return legal;
}

static bool try_stop(jerk_planner *planner, double distance, double found) {
    struct grid *grid = &planner->grid;
    if (!grid_to(planner, grid, distance) || grid->n < 2) {
        return false;
    }
    allow_present(planner, grid, INFINITY, INFINITY);
    planner->stats.hold_solves++;
    if (!solve_stop(planner, grid, found)) {
        return false;
    }
    grid->stands = false;
    return plan_accept(planner, grid, true);
}

/* Replace the plan by the shortest stop; the stored tail is the longest that is
 * considered. False if none was found that is shorter by much; given up after
 * so many tries without one. */
static bool shortest_stop(jerk_planner *planner, int hopeless) {
    double low = 0.0, high = 0.0;
    bool found = false;
    for (int k = planner->plan.next; k < planner->plan.n; k++) {
        high += planner->plan.h[k];
    }
    planner->stats.holds++;
    double d = fmin(0.999 * high, 1.02 * brake_estimate(planner, 0.0).distance);
    for (int i = 0; i < (found ? MAX_HALVINGS : hopeless)
                    && high - low > CLOSE_ENOUGH * high;
         i++) {
        if (try_stop(planner, d, found ? high : 0.0)) {
            high = d, found = true;
        } else {
            low = d;
        }
        double near = low > 0.0 && i < 3 ? fmin(0.5 * (low + high), 1.1 * low)
                                         : 0.5 * (low + high);
        d = low > 0.0 ? near : 0.92 * high;
    }
    return found || high <= NEAR_ENOUGH * brake_estimate(planner, 0.0).distance;
}

bool plan_stop(jerk_planner *p) {
    return shortest_stop(p, MAX_HALVINGS);
}

static double follow(jerk_planner *planner, double seconds) {
    jerk_law law;
    double way = 0.0;
    for (double t = 0.0;
         t < seconds && jerk_next_within(planner, &law, seconds - t);
         t += law.time) {
        way += law.length;
    }
    return way;
}

/* What a hold would do that comes when `later` seconds more are handed out: as
 * it is driven, the plan is followed where no stop is found (planner.c), but it
 * is given up sooner there. `scratch`: made like p, its content is lost. */
void jerk_stop_preview(const jerk_planner *planner,
                       jerk_planner *scratch,
                       double later,
                       jerk_preview *out) {
    planner_copy(scratch, planner);
    *out = (jerk_preview){.before = follow(scratch, later),
                          .v = jerk_speed(scratch)};
    scratch->changed = false; /* what comes now is known */
    scratch->hold = true;
    for (double step = planner->hold ? planner->again_s : 0.0;
         !scratch->at_rest;
         step = fmax(PREVIEW_STEP_S, PREVIEW_GROWS * step)) {
        out->way += follow(scratch, step);
        if (scratch->at_rest || (planner->hold && !planner->changed)) {
            break;
        }
        if (shortest_stop(scratch, PREVIEW_TRIES)) {
            break;
        }
    }
    for (int k = scratch->plan.next; k < scratch->plan.n && !scratch->at_rest;
         k++) {
        out->way += scratch->plan.h[k];
    }
}
