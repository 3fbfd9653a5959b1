/* Feed hold: the shortest legal stop on the path. */
#include <math.h>
#include "jerk/stop/fall.h"
#include "jerk/path/grid.h"
#include "jerk/solver/brake.h"
#include "jerk/state/state.h"
#include "jerk/stop/stop.h"
#include "jerk/stop/tries.h"
#include "jerk/stop/way.h"

/* Whether the jerk along the path changes much over the grid: there a brake
 * that goes as deep as it can at each place need not be the shortest. */
static bool uneven(const jerk_planner *planner, const struct grid *grid) {
    double least = 1e30;
    double most = 0.0;
    for (int k = 0; k < grid->count; k++) {
        double jerk = 1e30;
        for (int i = 0; i < planner->cfg.axes; i++) {
            const jerk_interval *part = grid->seg[k].interval;
            double along = fmax(fabs(part->d1[0][i]), 1e-9);
            jerk = fmin(jerk, jerk_max(planner, part, i) / along);
        }
        least = fmin(least, jerk);
        most = fmax(most, jerk);
    }
    return most > BRAKE_UNEVEN * least;
}

/* The fastest brake is integrated and made the plan, or the stored tail of
 * `tail` mm is no longer by much. False: neither; `*likely`: how far it goes
 * then. */
static bool brake_now(jerk_planner *planner,
                      double tail,
                      double first,
                      double *likely) {
    struct grid *grid = &planner->grid;
    double longest = longest_brake(planner);
    double share = BRAKE_SHARE;
    brake_path brake;
    for (int i = 0; i < BRAKE_SHARES; i++) {
        if (!grid_to(planner, grid, first)) {
            return false;
        }
        enum brake_end end =
            brake_to_rest(planner, grid, share, longest, &brake);
        bool rests = end == BRAKE_RESTS;
        double way = rests ? brake.s[brake.count] : first;
        if (end == BRAKE_NONE || way > BRAKE_AS_TAIL * tail) {
            return end != BRAKE_NONE && i == 0;
        }
        if (rests && take_brake(planner, &brake)) {
            return true;
        }
        *likely = rests ? fmax(*likely, way) : *likely;
        share *= BRAKE_SHARE;
    }
    return false;
}

/* Where the limits along the path stay much the same, the deepest brake is the
 * shortest stop. False: they do not. `*found`: the plan is such a stop. */
static bool brake_evenly(jerk_planner *planner,
                         double tail,
                         double likely,
                         bool *found) {
    struct grid *grid = &planner->grid;
    double first = fmin(ALMOST * tail, BRAKE_WAYS * likely);
    if (!grid_to(planner, grid, first) || grid->count < 2
        || uneven(planner, grid)) {
        return false;
    }
    double way = likely;
    *found = brake_now(planner, tail, first, &way)
             || fall_to_rest(planner, tail, way);
    return true;
}

/* Replace the plan by the shortest stop; the stored tail is the longest that is
 * considered. False if none was found that is shorter by much; given up after
 * so many tries without one. */
bool shortest_stop(jerk_planner *planner, int hopeless) {
    double low = 0.0;
    double high = 0.0;
    double grow = STOP_LONGER;
    bool found = false;
    for (int k = planner->plan.next; k < planner->plan.count; k++) {
        high += planner->plan.lengths[k];
    }
    planner->stats.holds++;
    double likely = likely_stop(planner);
    if (high > NEAR_ENOUGH * likely
        && brake_evenly(planner, high, likely, &found)) {
        return found;
    }
    double distance = fmin(ALMOST * high, 1.02 * likely);
    for (int i = 0; i < (found ? MAX_HALVINGS : hopeless)
                    && high - low > CLOSE_ENOUGH * high;
         i++) {
        if (try_stop(planner, distance, found ? high : 0.0)) {
            high = distance, found = true;
        } else {
            low = distance;
        }
        double middle = 0.5 * (low + high);
        double near = found ? middle : fmin(middle, grow * low);
        distance = low > 0.0 ? near : 0.92 * high;
        grow = 1.0 + STOP_GROWS * (grow - 1.0);
    }
    return found || high <= NEAR_ENOUGH * way_down_to(planner, 0.0);
}

bool plan_stop(jerk_planner *planner) {
    return shortest_stop(planner, MAX_HALVINGS);
}
