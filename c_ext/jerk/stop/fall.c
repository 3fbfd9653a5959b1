/* A stop where the path bends.
 *
 * How soon the speed may fall at one place depends on the bends behind it.  So
 * the solver looks for the lowest speeds: once down to half of the speed, with
 * all checks, and from there once more, roughly.  Where that fall has nearly
 * ended, the rest of the way is short and can be estimated.  A stop over this
 * length is solved for, with the fall as its guess.
 */
#include <math.h>
#include <string.h>
#include "jerk/stop/fall.h"
#include "jerk/path/grid.h"
#include "jerk/solver/constraints.h"
#include "jerk/solver/initial_guess.h"
#include "jerk/stop/tries.h"
#include "jerk/stop/way.h"
#include "jerk/window/window.h"

/* Down to the squared speed `asked`, or to the feed where that is less. */
static void ask_for(struct grid *grid, double asked) {
    for (int k = 0; k < grid->count; k++) {
        grid->seg[k].asked = fmin(grid->seg[k].soft, asked);
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
    double v = planner->scale * sqrt(asked);
    grid->ramp = FALL_WAYS * way_down_to(planner, v);
    if (!solve_window(planner, grid, true, 1.0)) {
        give_back(grid);
        return false;
    }
    return true;
}

/* The same over some of the tail, or over all of it. */
static bool first_fall(jerk_planner *planner, double tail, double likely) {
    double most = ALMOST * tail;
    double reach = FALL_REACH * likely;
    return (reach < most && fall_over(planner, reach))
           || fall_over(planner, most);
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

/* The fall as a brake, up to where it has nearly come down to `asked`, then to
 * rest. */
static void end_fall(const jerk_planner *planner,
                     double asked,
                     brake_path *out) {
    const struct grid *grid = &planner->grid;
    const struct problem *problem = &planner->prob;
    int last = grid->count < BRAKE_STEPS ? grid->count : BRAKE_STEPS;
    int k = 0;
    for (;; k++) {
        out->s[k] = grid->from_start[k];
        out->v[k] = planner->scale * sqrt(fmax(0.0, problem->x[k]));
        out->a[k] = planner->scale * planner->scale * problem->accel[k];
        if (k + 2 >= last || (k > 0 && problem->x[k] <= FALL_ENDS * asked)) {
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

enum fall_end fall_to_rest(jerk_planner *planner, double tail, double likely) {
    double asked = DEEPEST_FALL * DEEPEST_FALL * planner->x;
    brake_path brake;
    if (!first_fall(planner, tail, likely)) {
        return FALL_NONE;
    }
    bool deeper = deeper_fall(planner, asked);
    end_fall(planner, asked, &brake);
    give_back(&planner->grid);
    return deeper && stop_near(planner, &brake) ? FALL_RESTS : FALL_ALONE;
}

bool fall_on(jerk_planner *planner, double tail, double likely) {
    return first_fall(planner, tail, likely)
           && plan_accept(planner, &planner->grid, true);
}
