/* Stops over one distance: from a stop that is there, or from a brake. */
#include <math.h>
#include "jerk/path/grid.h"
#include "jerk/rows/constraints.h"
#include "jerk/solver/initial_guess.h"
#include "jerk/stop/tries.h"
#include "jerk/window/window.h"

/* The rows of a stop over the grid, from the stop that is there, which was
 * found over `found` mm. */
static bool solve_like(jerk_planner *planner, struct grid *grid, double found) {
    problem_from_grid(planner, grid, planner->x, planner->accel);
    return guess_stop_like(planner, grid, found)
           && solve_guess(planner, grid, TIGHTENINGS, STOP_ITERATIONS);
}

/* The grid of a stop; false: there is none. */
static bool lay_stop(jerk_planner *planner, double distance) {
    struct grid *grid = &planner->grid;
    if (!grid_to(planner, grid, distance) || grid->count < 2) {
        return false;
    }
    allow_present(planner, grid, INFINITY, INFINITY);
    grid->stops = true;
    planner->stats.hold_solves++;
    return true;
}

static bool take_stop(jerk_planner *planner, bool legal) {
    struct grid *grid = &planner->grid;
    if (!legal) {
        give_back(planner, grid);
        return false;
    }
    grid->stands = false;
    return plan_accept(planner, grid, true);
}

bool try_shorter(jerk_planner *planner, double share) {
    double found = planner->plan.remaining;
    if (!lay_stop(planner, share * found)) {
        return false;
    }
    planner->grid.usable = STOP_USABLE;
    return take_stop(planner, solve_like(planner, &planner->grid, found));
}

bool take_brake(jerk_planner *planner, const brake_path *brake) {
    struct grid *grid = &planner->grid;
    if (!lay_stop(planner, brake->s[brake->count])) {
        return false;
    }
    problem_from_grid(planner, grid, planner->x, planner->accel);
    brake_speeds(planner, grid, brake, planner->scratch);
    return take_stop(
        planner,
        guess_from(planner, grid, planner->scratch)
            && solve_guess(planner, grid, TIGHTENINGS, STOP_ITERATIONS));
}
