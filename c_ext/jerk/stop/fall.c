/* A stop where the path bends.
 *
 * How soon the speed may fall at one place depends on the bends behind it.  So
 * the plan is slowed down first (slower.c), which needs no solver.  Over the
 * way that this takes the solver looks for the lowest speeds: once down to half
 * of the speed, with all checks, and from there once more, roughly.  Where that
 * fall has nearly ended, the rest of the way is short and can be estimated.  A
 * stop over this length is solved for, with the fall as its guess.
 */
#include <math.h>
#include <string.h>
#include "jerk/stop/fall.h"
#include "jerk/path/grid.h"
#include "jerk/rows/constraints.h"
#include "jerk/solver/initial_guess.h"
#include "jerk/stop/tries.h"
#include "jerk/path/way.h"
#include "jerk/window/slower.h"
#include "jerk/window/window.h"
#include "maths/order.h"

/* Down to the squared speed `asked`, or to the feed where that is less. */
static void ask_for(struct grid *grid, double asked) {
    for (int k = 0; k < grid->count; k++) {
        grid->seg[k].asked = lesser(grid->seg[k].soft, asked);
    }
    grid->sinks = true;
}

/* To half of the speed, legally, over `reach` mm. */
static bool fall_over(jerk_planner *planner, double reach) {
    struct grid *grid = &planner->grid;
    double asked = DEEPEST_FALL * planner->x;
    if (!grid_to(planner, grid, reach) || grid->count < 2) {
        return false;
    }
    allow_present(planner, grid, INFINITY, INFINITY);
    ask_for(grid, asked);
    grid->ramp = INFINITY;
    grid->stops = true;
    if (!solve_window(planner, grid, true, 1.0)) {
        give_back(planner, grid);
        return false;
    }
    return true;
}

/* From that fall to `asked`: as far as it comes in a few iterations. */
static bool deeper_fall(jerk_planner *planner, double asked) {
    struct grid *grid = &planner->grid;
    memcpy(planner->scratch,
           planner->prob.x,
           sizeof(double) * (size_t)(grid->count + 1));
    ask_for(grid, asked);
    problem_from_grid(planner, grid, planner->x, planner->accel);
    return guess_from(planner, grid, planner->scratch)
           && solve_roughly(planner, FALL_ITERATIONS);
}

/* The fall as a brake, up to where it has nearly come down to `asked` (0: to
 * the share that slow_to was asked for), then to rest. */
static void end_fall(const jerk_planner *planner,
                     double asked,
                     brake_path *out) {
    const struct grid *grid = &planner->grid;
    const struct problem *problem = &planner->prob;
    int last = grid->count < BRAKE_STEPS ? grid->count : BRAKE_STEPS;
    int k = 0;
    for (;; k++) {
        out->s[k] = grid->from_start[k];
        out->v[k] = planner->scale * sqrt(greater(0.0, problem->x[k]));
        out->a[k] = planner->scale * planner->scale * problem->accel[k];
        double low = asked > 0.0 ? asked : SLOWER_FOR_NOW * problem->guess[k];
        bool fallen = k > 0 && problem->x[k] <= FALL_ENDS * low;
        if (fallen || k + 2 >= last) {
            break;
        }
    }
    const jerk_interval *there = grid->seg[k].interval;
    out->count = k + 1;
    out->s[k + 1] =
        out->s[k] + way_to_rest(planner, there, out->v[k], out->a[k]);
    out->v[k + 1] = out->a[k + 1] = 0.0;
}

/* The end of the brake, a little further each time until there is a stop. */
static bool stop_near(jerk_planner *planner, brake_path *brake) {
    double end = brake->s[brake->count];
    double more = STOP_MORE;
    for (int i = 0; i < STOPS_NEAR; i++) {
        brake->s[brake->count] = (1.0 + more) * end;
        if (take_brake(planner, brake)) {
            return true;
        }
        more *= STOP_MORE_GROWS;
    }
    return false;
}

bool fall_to_rest(jerk_planner *planner, double tail) {
    double asked = DEEPEST_FALL * DEEPEST_FALL * planner->x;
    brake_path brake;
    if (!slow_to(planner, SLOWER_FOR_NOW)) {
        return false;
    }
    end_fall(planner, 0.0, &brake);
    double reach = lesser(ALMOST * tail, brake.s[brake.count]);
    if (!fall_over(planner, reach)
        || !plan_accept(planner, &planner->grid, true)) {
        return stop_near(planner, &brake);
    }
    bool deeper = deeper_fall(planner, asked);
    end_fall(planner, asked, &brake);
    give_back(planner, &planner->grid);
    return deeper && stop_near(planner, &brake);
}
