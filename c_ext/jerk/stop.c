/* Changes that ask for less speed than the plan has.  A reduced override: a
 * ramp down to it.  Feed hold: the shortest legal stop on the path, found by
 * halving the distance to the standstill. */
#include <math.h>
#include "jerk/path/grid.h"
#include "jerk/solver/constraints.h"
#include "jerk/solver/initial_guess.h"
#include "jerk/state/state.h"
#include "jerk/stop.h"
#include "jerk/window.h"

typedef struct brake {
    double top, distance; /* highest speed on the way, mm/s; mm */
} brake;

/* From (v, a) down to the speed v1 with the smallest limits along the path: to
 * a = 0, then two jerk ramps. */
static struct brake brake_estimate(const jerk_planner *planner, double v1) {
    double v = planner->scale * sqrt(planner->x);
    double a = fmax(0.0, planner->scale * planner->scale * planner->accel);
    double acc = 1e30;
    double jerk = 1e30;
    const jerk_interval *interval = ring_at(planner, planner->head);
    for (int i = 0; i < planner->cfg.axes; i++) {
        double along = fmax(fabs(interval->d1[0][i]), 1e-9);
        acc = fmin(acc, acc_max(planner, interval, i) / along);
        jerk = fmin(jerk, jerk_max(planner, interval, i) / along);
    }
    double t1 = a / jerk;
    double top = v + 0.5 * a * t1;
    double drop = fmax(0.0, top - v1);
    double ramp = fmin(acc, sqrt(drop * jerk));
    double rise = v * t1 + 0.5 * a * t1 * t1 - jerk * t1 * t1 * t1 / 6.0;
    return (struct brake){
        top,
        rise
            + (ramp > 0.0 ? 0.5 * (top + v1) * (drop / ramp + ramp / jerk)
                          : 0.0)};
}

double jerk_stop_distance(const jerk_planner *planner) {
    return planner->at_standstill ? 0.0 : brake_estimate(planner, 0.0).distance;
}

/* The speed is above what a reduced override allows: a window that comes down
 * to it without falling below. */
bool plan_ramp(jerk_planner *planner) {
    static const double tries[] = {1.03, 1.15, 1.5};
    struct grid *grid = &planner->grid;
    for (int i = 0; i < 3; i++) {
        grid_window(planner, grid, 1e30);
        if (grid->count < 2) {
            return false;
        }
        double target = grid->seg[0].soft;
        struct brake brake =
            brake_estimate(planner, planner->scale * sqrt(target));
        double top =
            1.01 * brake.top * brake.top / (planner->scale * planner->scale);
        allow_present(planner, grid, tries[i] * brake.distance, top);
        grid->land_cap = target;
        grid->land_from = tries[i] * brake.distance;
        grid->land_to = 3.0 * grid->land_from;
        if (solve_window(planner, grid, true, 1.0)) {
            return plan_accept(planner, grid, planner->prob.solved);
        }
    }
    return false;
}

/* What iterates took off limits is given back: of a distance that is too short,
 * or of another guess, they say nothing. */
static void give_back(struct grid *grid) {
    for (int k = 0; k < grid->count; k++) {
        struct segment *segment = &grid->seg[k];
        *segment->tight = segment->before;
        segment->share = segment->jump * segment->before;
    }
}

/* Solve for a stop over the grid: from a profile of constant limits, and where
 * that fails closely from the stop that is there, which was found over `found`
 * mm (0: none was). */
static bool solve_stop(jerk_planner *planner, struct grid *grid, double found) {
    problem_from_grid(planner, grid, planner->x, planner->accel);
    bool legal = guess_stop(planner, grid)
                 && solve_guess(planner, grid, STOP_TRIES, STOP_ITERATIONS);
    if (!legal && found > 0.0 && planner->prob.missed < NEARLY_MET) {
        give_back(grid);
        problem_from_grid(planner, grid, planner->x, planner->accel);
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
    if (!grid_to(planner, grid, distance) || grid->count < 2) {
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
bool shortest_stop(jerk_planner *planner, int hopeless) {
    double low = 0.0;
    double high = 0.0;
    bool found = false;
    for (int k = planner->plan.next; k < planner->plan.count; k++) {
        high += planner->plan.lengths[k];
    }
    planner->stats.holds++;
    double distance =
        fmin(0.999 * high, 1.02 * brake_estimate(planner, 0.0).distance);
    for (int i = 0; i < (found ? MAX_HALVINGS : hopeless)
                    && high - low > CLOSE_ENOUGH * high;
         i++) {
        if (try_stop(planner, distance, found ? high : 0.0)) {
            high = distance, found = true;
        } else {
            low = distance;
        }
        double near = low > 0.0 && i < 3 ? fmin(0.5 * (low + high), 1.1 * low)
                                         : 0.5 * (low + high);
        distance = low > 0.0 ? near : 0.92 * high;
    }
    return found || high <= NEAR_ENOUGH * brake_estimate(planner, 0.0).distance;
}

bool plan_stop(jerk_planner *planner) {
    return shortest_stop(planner, MAX_HALVINGS);
}
