/* Feed hold: the shortest legal stop on the path. */
#include <math.h>
#include "jerk/stop/fall.h"
#include "jerk/path/grid.h"
#include "jerk/solver/brake.h"
#include "jerk/state/state.h"
#include "jerk/stop/stop.h"
#include "jerk/stop/tries.h"
#include "jerk/path/way.h"
#include "jerk/window/straight_line.h"

/* The fastest brake is integrated and made the plan, where it is shorter than
 * the stored tail of `tail` mm. */
static bool brake_now(jerk_planner *planner, double tail, double likely) {
    struct grid *grid = &planner->grid;
    double first = fmin(ALMOST * tail, BRAKE_WAYS * likely);
    brake_path brake;
    if (!grid_to(planner, grid, first)) {
        return false;
    }
    enum brake_end end =
        brake_to_rest(planner, grid, longest_brake(planner), &brake);
    if (end == BRAKE_NONE) {
        return false;
    }
    return end == BRAKE_RESTS && take_brake(planner, &brake);
}

/* From the stop that is the plan to shorter ones, each with the last one as
 * guess: false if none was found.  How far a slow axis goes depends much on the
 * last percent of its jerk where it is about to turn. */
static bool shorten(jerk_planner *planner) {
    double less = STOP_SHORTER;
    bool any = false;
    for (int i = 0; i < STOPS_SHORTER && less >= STOP_NEARLY_SHORTEST; i++) {
        if (try_shorter(planner, 1.0 - less)) {
            any = true;
        } else {
            less *= 0.5;
        }
    }
    return any;
}

/* Replace the plan by the shortest stop.  The deepest brake, or the deepest
 * fall of the speed, need not be it; where there is neither, the stored tail,
 * slowed down, is the first stop. */
bool plan_stop(jerk_planner *planner) {
    double tail = planner->plan.remaining;
    double likely = likely_stop(planner);
    planner->stats.holds++;
    if (stop_on_line(planner)) {
        return true;
    }
    bool found =
        tail > NEAR_ENOUGH * likely
        && (brake_now(planner, tail, likely) || fall_to_rest(planner, tail));
    bool shorter = shorten(planner);
    return found || shorter || tail <= NEAR_ENOUGH * way_down_to(planner, 0.0);
}
