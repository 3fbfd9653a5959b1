/* A plan for other speeds over the path just ahead.
 *
 * An override that changes in every cycle asks for a plan with every commit.
 * Such a plan need not reach further than to rest: the next one comes soon.  So
 * its window is short.  Where the present plan is faster than what is asked
 * for, it stays allowed, and the solver looks for the slowest motion down to
 * what is asked for.  The present plan is legal, so there is such a motion.
 */
#include <math.h>
#include "jerk/near.h"
#include "jerk/path/grid.h"
#include "jerk/state/state.h"
#include "jerk/path/way.h"
#include "jerk/window/window.h"

/* The speed asked for on an interval, and possible there, mm/s. */
static double possible_speed(const jerk_planner *planner,
                             const jerk_interval *interval) {
    double most = fmin(asked_speed(planner, interval), 10.0 * planner->scale);
    for (int i = 0; i < planner->axes; i++) {
        double along = larger(interval->d1[0][i], interval->d1[1][i]);
        if (along > 0.0) {
            most = fmin(most, planner->cfg.v_max[i] / along);
        }
    }
    return most;
}

/* Speed that the path may come to before the next plan, mm/s. */
static double highest_speed(const jerk_planner *planner,
                            const jerk_interval *interval) {
    double now = speed_at_head(planner);
    double most = possible_speed(planner, interval);
    for (int i = 0; i < planner->axes; i++) {
        double along = larger(interval->d1[0][i], interval->d1[1][i]);
        if (along > 0.0) {
            double gain = NEAR_S * acc_max(planner, interval, i) / along;
            most = fmin(most, now + gain);
        }
    }
    return fmax(most, now);
}

/* mm: to rest from there, and some more. */
static double near_reach(const jerk_planner *planner) {
    const jerk_interval *interval = ring_at(planner, planner->head);
    double most = highest_speed(planner, interval);
    double way = NEAR_WAYS * way_from(planner, interval, most) + NEAR_S * most;
    return fmax(way, NEAR_WAYS * jerk_stop_distance(planner));
}

double reach_behind_change(const jerk_planner *planner) {
    double most = speed_at_head(planner);
    double reach = 0.0;
    double enough = INFINITY;
    for (uint64_t i = planner->head; i != planner->tail && reach < enough;
         i++) {
        const jerk_interval *interval = ring_at(planner, i);
        most = fmax(most, possible_speed(planner, interval));
        reach += interval->length;
        enough =
            CHANGE_WAYS * way_from(planner, interval, most) + CHANGE_S * most;
    }
    return reach < enough ? INFINITY : enough;
}

bool plan_is_faster(const jerk_planner *planner,
                    const struct grid *grid,
                    double from) {
    const plan *pl = &planner->plan;
    double at = 0.0;
    int k = 0;
    for (int i = pl->next; i < pl->count; i++) {
        while (k < grid->count && grid->from_start[k + 1] <= at + 1e-9) {
            k++;
        }
        if (k >= grid->count) {
            return false;
        }
        if (at >= from && pl->x[i] > FASTER * grid->seg[k].asked) {
            return true;
        }
        at += pl->lengths[i];
    }
    return false;
}

/* A deep fall is planned in parts: the solver starts near the present plan. */
static void limit_fall(const jerk_planner *planner, struct grid *grid) {
    for (int k = 0; k < grid->count; k++) {
        struct segment *segment = &grid->seg[k];
        double least = fmin(segment->soft, DEEPEST_FALL * planner->x);
        segment->asked = fmax(segment->asked, least);
    }
}

/* A plan over such a reach, in which the present one stays allowed; one that
 * reaches further has to follow. `again`: the solver starts with the present
 * plan itself, which is legal. */
static bool plan_over(jerk_planner *planner, double reach, bool again) {
    struct grid *grid = &planner->grid;
    grid_window(planner, grid, reach, DEEPEST_FALL * planner->x);
    if (grid->count < 2) {
        return false;
    }
    allow_tail(planner, grid, INFINITY);
    limit_fall(planner, grid);
    grid->sinks = true;
    double asked = planner->scale * sqrt(grid->seg[0].asked);
    grid->ramp = again ? INFINITY : FALL_WAYS * way_down_to(planner, asked);
    if (!solve_window(planner, grid, true, 1.0)) {
        give_back(planner, grid);
        return false;
    }
    if (!plan_accept(planner, grid, false)) {
        return false;
    }
    planner->reach = REFILL_WAYS * reach;
    return true;
}

/* Where a bend decides, the way to rest may be much longer than on a line. */
bool plan_near(jerk_planner *planner) {
    double reach = near_reach(planner);
    for (int i = 0; i < NEAR_TRIES; i++) {
        if (plan_over(planner, reach, i > 0)) {
            return true;
        }
        if (reach > TAIL_MORE * planner->plan.remaining) {
            return false;
        }
        reach *= NEAR_LONGER;
    }
    return false;
}
