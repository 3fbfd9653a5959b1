/* Stops over one distance: from a profile of constant limits, from a stop that
 * is there, or from a brake. */
#include <math.h>
#include "jerk/path/grid.h"
#include "jerk/solver/constraints.h"
#include "jerk/solver/initial_guess.h"
#include "jerk/stop/tries.h"
#include "jerk/window/window.h"

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

bool try_stop(jerk_planner *planner, double distance, double found) {
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

bool try_shorter(jerk_planner *planner, double share) {
    struct grid *grid = &planner->grid;
    double found = planner->plan.remaining;
    if (!grid_to(planner, grid, share * found) || grid->count < 2) {
        return false;
    }
    allow_present(planner, grid, INFINITY, INFINITY);
    planner->stats.hold_solves++;
    grid->usable = STOP_USABLE;
    problem_from_grid(planner, grid, planner->x, planner->accel);
    if (!guess_stop_like(planner, grid, found)
        || !solve_guess(planner, grid, STOP_TRIES, STOP_ITERATIONS)) {
        give_back(grid);
        return false;
    }
    grid->stands = false;
    return plan_accept(planner, grid, true);
}

bool take_brake(jerk_planner *planner, const brake_path *brake) {
    struct grid *grid = &planner->grid;
    if (!grid_to(planner, grid, brake->s[brake->count]) || grid->count < 2) {
        return false;
    }
    allow_present(planner, grid, INFINITY, INFINITY);
    planner->stats.hold_solves++;
    problem_from_grid(planner, grid, planner->x, planner->accel);
    brake_speeds(planner, grid, brake, planner->scratch);
    if (!guess_from(planner, grid, planner->scratch)
        || !solve_guess(planner, grid, STOP_TRIES, STOP_ITERATIONS)) {
        give_back(grid);
        return false;
    }
    grid->stands = false;
    return plan_accept(planner, grid, true);
}
