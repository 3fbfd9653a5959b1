/* Feed hold: the shortest legal stop on the path, found by halving the distance
 * to the standstill. */
#include <math.h>
#include "jerk/solver/brake.h"
#include "jerk/path/grid.h"
#include "jerk/solver/constraints.h"
#include "jerk/solver/initial_guess.h"
#include "jerk/state/state.h"
#include "jerk/stop.h"
#include "jerk/window.h"

typedef struct brake {
    double top, distance; /* highest speed on the way, mm/s; mm */
} brake;

typedef struct path_limits {
    double acc, jerk; /* mm/s2, mm/s3 along the path */
} path_limits;

/* What all axes can follow at the head. */
static path_limits limits_at_head(const jerk_planner *planner) {
    path_limits least = {1e30, 1e30};
    const jerk_interval *interval = ring_at(planner, planner->head);
    for (int i = 0; i < planner->cfg.axes; i++) {
        double along = fmax(fabs(interval->d1[0][i]), 1e-9);
        least.acc = fmin(least.acc, acc_max(planner, interval, i) / along);
        least.jerk = fmin(least.jerk, jerk_max(planner, interval, i) / along);
    }
    return least;
}

static double path_acceleration(const jerk_planner *planner) {
    return planner->scale * planner->scale * planner->accel;
}

/* From (v, a) down to the speed v1 with the smallest limits along the path: to
 * a = 0, then two jerk ramps. */
static struct brake brake_estimate(const jerk_planner *planner, double v1) {
    double v = planner->scale * sqrt(planner->x);
    double a = fmax(0.0, path_acceleration(planner));
    path_limits most = limits_at_head(planner);
    double t1 = a / most.jerk;
    double top = v + 0.5 * a * t1;
    double drop = fmax(0.0, top - v1);
    double ramp = fmin(most.acc, sqrt(drop * most.jerk));
    double rise = v * t1 + 0.5 * a * t1 * t1 - most.jerk * t1 * t1 * t1 / 6.0;
    return (struct brake){
        top,
        rise
            + (ramp > 0.0 ? 0.5 * (top + v1) * (drop / ramp + ramp / most.jerk)
                          : 0.0)};
}

/* Way to rest where the path brakes already: more acceleration, as much for a
 * while, less; or less at once. */
static double brakes_on(double v, double a, path_limits most) {
    double room = 0.5 * a * a + most.jerk * v;
    double steepest = fmax(a, fmin(most.acc, sqrt(room)));
    double drop = v - 0.5 * a * a / most.jerk;
    if (drop <= 0.0) {
        return v * v / (1.5 * a);
    }
    double t1 = (steepest - a) / most.jerk;
    double v1 = v - 0.5 * (steepest * steepest - a * a) / most.jerk;
    double v2 = 0.5 * steepest * steepest / most.jerk;
    double way1 = t1 * (v - t1 * (0.5 * a + most.jerk * t1 / 6.0));
    double way2 = 0.5 * (v1 + v2) * fmax(0.0, v1 - v2) / steepest;
    return way1 + way2 + v2 * steepest / most.jerk / 3.0;
}

/* The first distance that is tried for a stop. */
static double likely_stop(const jerk_planner *planner) {
    double a = path_acceleration(planner);
    double v = planner->scale * sqrt(planner->x);
    return a < 0.0 ? brakes_on(v, -a, limits_at_head(planner))
                   : brake_estimate(planner, 0.0).distance;
}

bool must_rest(const jerk_planner *planner) {
    double a = path_acceleration(planner);
    double v = planner->scale * sqrt(planner->x);
    double falls = 0.5 * a * a / limits_at_head(planner).jerk;
    return a < 0.0 && v <= MUST_REST * falls
           && planner->plan.remaining <= NEAR_ENOUGH * likely_stop(planner);
}

double way_down_to(const jerk_planner *planner, double v1) {
    return brake_estimate(planner, v1).distance;
}

double jerk_stop_distance(const jerk_planner *planner) {
    return planner->at_standstill ? 0.0 : brake_estimate(planner, 0.0).distance;
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

/* The brake becomes the plan, on a grid that ends where it does. */
static bool take_brake(jerk_planner *planner, const brake_path *brake) {
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

/* No brake takes longer, s. */
static double longest_brake(const jerk_planner *planner) {
    path_limits most = limits_at_head(planner);
    double v = planner->scale * sqrt(planner->x);
    double ramp = fmin(most.acc, sqrt(most.jerk * v));
    double before = fabs(path_acceleration(planner)) / most.jerk;
    return BRAKE_LONGEST * (v / ramp + ramp / most.jerk + before);
}

/* The fastest brake is integrated and made the plan, or the stored tail of
 * `tail` mm is no longer by much. False: neither; `*likely`: how far it goes
 * then. */
static bool brake_now(jerk_planner *planner, double tail, double *likely) {
    struct grid *grid = &planner->grid;
    double first = fmin(0.999 * tail, BRAKE_WAYS * *likely);
    double longest = longest_brake(planner);
    double share = BRAKE_SHARE;
    brake_path brake;
    for (int i = 0; i < BRAKE_SHARES; i++) {
        if (!grid_to(planner, grid, first) || grid->count < 2
            || uneven(planner, grid)) {
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
    if (brake_now(planner, high, &likely)) {
        return true;
    }
    double distance = fmin(0.999 * high, 1.02 * likely);
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
    return found || high <= NEAR_ENOUGH * brake_estimate(planner, 0.0).distance;
}

bool plan_stop(jerk_planner *planner) {
    return shortest_stop(planner, MAX_HALVINGS);
}
