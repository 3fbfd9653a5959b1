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

/* How many times the jerk along the path changes over the grid. A brake that
 * goes as deep as it can at each place need not be the shortest then. */
static double unevenness(const jerk_planner *planner, const struct grid *grid) {
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
    return most / least;
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

static double stored_tail(const jerk_planner *planner) {
    double way = 0.0;
    for (int k = planner->plan.next; k < planner->plan.count; k++) {
        way += planner->plan.lengths[k];
    }
    return way;
}

/* Halving between the distance `low` without a stop and that of the plan, which
 * is one: so often at the most. */
static void halve(jerk_planner *planner, double low, int tries) {
    double high = planner->plan.remaining;
    for (int i = 0; i < tries && high - low > CLOSE_ENOUGH * high; i++) {
        double middle = 0.5 * (low + high);
        *(try_stop(planner, middle, high) ? &high : &low) = middle;
    }
}

/* From the stop that is the plan to shorter ones, by `least` of it each time or
 * by more, each with the last one as guess.  How far a slow axis goes depends
 * much on the last percent of its jerk where it is about to turn. */
static void shorten(jerk_planner *planner, double least) {
    double less = STOP_SHORTER;
    for (int i = 0; i < STOPS_SHORTER && less >= least; i++) {
        if (!try_shorter(planner, 1.0 - less)) {
            less *= 0.5;
        }
    }
}

/* A first stop: from the likely distance on, a little longer each time.
 * Returns the longest one that is none, `tail` if all are. */
static double longest_failure(jerk_planner *planner,
                              double tail,
                              double likely,
                              int hopeless) {
    double low = 0.0;
    double distance = fmin(ALMOST * tail, 1.02 * likely);
    double grow = STOP_LONGER;
    for (int i = 0; i < hopeless && tail - low > CLOSE_ENOUGH * tail; i++) {
        if (try_stop(planner, distance, 0.0)) {
            return low;
        }
        low = distance;
        distance = fmin(0.5 * (low + tail), grow * low);
        grow = 1.0 + STOP_GROWS * (grow - 1.0);
    }
    return tail;
}

/* The deepest brake, or the deepest fall of the speed; shorter where the limits
 * of the path change. False: no stop, but the speed may fall now. */
static bool brake_deeply(jerk_planner *planner,
                         double tail,
                         double first,
                         double likely,
                         bool changes) {
    bool brakes = brake_now(planner, tail, first, &likely);
    if (!brakes && !fall_to_rest(planner, tail)) {
        return false;
    }
    if (changes || !brakes) {
        shorten(planner, STOP_NEARLY_SHORTEST);
    }
    return true;
}

/* A stop that is searched for by its length, so many times at the most without
 * one; then shorter ones. Where limits change little (`even`) fewer do. */
static bool search(jerk_planner *planner,
                   double tail,
                   double likely,
                   int hopeless,
                   bool even) {
    double low =
        longest_failure(planner, tail, likely, even ? hopeless / 2 : hopeless);
    if (low >= tail) {
        return false;
    }
    halve(planner, low, even ? 1 : MAX_HALVINGS);
    shorten(planner, even ? STOP_NEARLY_SHORTEST : CLOSE_ENOUGH);
    return true;
}

/* Replace the plan by the shortest stop; the stored tail is the longest that is
 * considered. False if none was found that is shorter by much; given up after
 * so many tries without one. */
bool shortest_stop(jerk_planner *planner, int hopeless) {
    struct grid *grid = &planner->grid;
    double tail = stored_tail(planner);
    double likely = likely_stop(planner);
    bool even = false;
    bool far = tail > NEAR_ENOUGH * likely;
    planner->stats.holds++;
    if (stop_on_line(planner)) {
        return true;
    }
    if (far) {
        double first = fmin(ALMOST * tail, BRAKE_WAYS * likely);
        double uneven = grid_to(planner, grid, first) && grid->count >= 2
                            ? unevenness(planner, grid)
                            : INFINITY;
        even = uneven <= BRAKE_UNEVEN;
        bool changes = uneven > BRAKE_CHANGES;
        if (even && brake_deeply(planner, tail, first, likely, changes)) {
            return true;
        }
    }
    if (search(planner, tail, likely, hopeless, even)) {
        return true;
    }
    if (far && !even && fall_to_rest(planner, tail)) {
        shorten(planner, CLOSE_ENOUGH);
        return true;
    }
    return tail <= NEAR_ENOUGH * way_down_to(planner, 0.0);
}

bool plan_stop(jerk_planner *planner) {
    return shortest_stop(planner, MAX_HALVINGS);
}
