/* When the plan is made anew: over the window, over less of it where that
 * fails, and otherwise the fastest way down. */
#include <math.h>
#include <string.h>
#include "jerk/near.h"
#include "jerk/path/grid.h"
#include "jerk/replan.h"
#include "jerk/rows/constraints.h"
#include "jerk/solver/initial_guess.h"
#include "jerk/state/state.h"
#include "jerk/stop/stop.h"
#include "jerk/path/way.h"
#include "jerk/window/slower.h"
#include "jerk/window/straight_line.h"
#include "jerk/window/window.h"

/* Time over an interval, to compare plans: exact from or to a standstill,
 * otherwise by the mean speed. Scaled as the squared speeds are. */
static double time_over(double length, double x0, double x1) {
    double factor = x0 > 0.0 && x1 > 0.0 ? 2.0 : 3.0;
    return factor * length / (sqrt(x0) + sqrt(x1));
}

/* The new plan as it is walked: the interval reached, and when it begins. */
typedef struct walked {
    int k;
    double t;
} walked;

/* Time of the new plan over the first `length` mm, unless it ends ahead of
 * them. */
static double new_time_to(const struct grid *grid,
                          const double *x,
                          struct walked *walk,
                          double length) {
    for (; walk->k < grid->count; walk->k++) {
        double whole = grid->seg[walk->k].length;
        double left = length - grid->from_start[walk->k];
        double t = time_over(whole, x[walk->k], x[walk->k + 1]);
        if (left < whole) {
            return walk->t + t * left / whole;
        }
        walk->t += t;
    }
    return walk->t;
}

/* The new plan takes more time than the stored tail over the tail's way, or
 * much more to a knot ahead of where the tail brakes for its end: it has a hole
 * there. */
static bool slower_than_tail(const jerk_planner *planner,
                             const struct grid *grid) {
    const plan *pl = &planner->plan;
    const double *x = planner->prob.x;
    double length = 0.0;
    for (int k = pl->next; k < pl->count; k++) {
        length += pl->lengths[k];
    }
    if (length <= 0.0 || grid->from_start[grid->count] < length - 1e-9) {
        return false;
    }
    struct walked walk = {0, 0.0};
    double brakes = length - pl->lasts / LASTS;
    double at = 0.0;
    double t = 0.0;
    double t_new = 0.0;
    for (int k = pl->next; k < pl->count; k++) {
        at += pl->lengths[k];
        t += time_over(pl->lengths[k], pl->x[k], pl->x[k + 1]);
        t_new = new_time_to(grid, x, &walk, at);
        if (at < brakes && t_new > SLOWER_THAN_REST * t) {
            return true;
        }
    }
    return t_new > (pl->stands ? SLOWER : SLOWER_THAN_REST) * t;
}

/* Jerk grows with the power 3/2 of the squared speed. */
static double slowed_by(double worst) {
    double all = cbrt(1.0 / (worst * worst));
    return isfinite(worst) ? fmin(FALLBACK_SCALE, all) : FALLBACK_SCALE;
}

/* From rest to rest any profile, slowed down, becomes legal: accelerations fall
 * with the square of the speed. */
static bool slow_bump(jerk_planner *planner, struct grid *grid) {
    struct problem *problem = &planner->prob;
    problem_from_grid(planner, grid, 0.0, 0.0);
    if (!guess_bump(planner, grid)) {
        return false;
    }
    for (int i = 0; i < FALLBACK_TRIES; i++) {
        double worst = check_plan(planner, grid);
        planner->stats.spent += work_of(planner, BESIDE_ITERATIONS / 2);
        if (worst <= CHECK_SLACK) {
            return true;
        }
        double by = slowed_by(worst);
        for (int k = 0; k <= grid->count; k++) {
            problem->x[k] *= by;
            problem->accel[k] *= by;
            problem->input[0][k] *= by;
            problem->input[1][k] *= by;
        }
    }
    return false;
}

static double time_of(const struct grid *grid, const double *x) {
    double t = 0.0;
    for (int k = 0; k < grid->count; k++) {
        t += time_over(grid->seg[k].length, x[k], x[k + 1]);
    }
    return t;
}

static bool bump_over(jerk_planner *planner, struct grid *grid, double length) {
    return grid_to(planner, grid, length) && grid->count >= 3
           && slow_bump(planner, grid);
}

/* The solver has failed at a standstill: a slow move, over the part of the
 * window that it takes fastest. One place where axes can do next to nothing
 * would slow down all of the way to it and behind it. */
static bool slow_fallback(jerk_planner *planner, struct grid *grid) {
    double whole = grid->from_start[grid->count];
    bool stands = grid->stands;
    double best = 0.0;
    double length = 0.0;
    double tried = whole;
    for (int i = 0; i < FALLBACK_LENGTHS; i++, tried *= 0.25) {
        if (!bump_over(planner, grid, tried)) {
            continue;
        }
        double speed = tried / time_of(grid, planner->prob.x);
        if (speed < FALLBACK_SLOWER * best) {
            break; /* nothing slow is left out: shorter is slower */
        }
        if (speed > best) {
            best = speed;
            length = tried;
        }
    }
    if (!(length > 0.0) || !bump_over(planner, grid, length)) {
        return false;
    }
    grid->stands = stands && length == whole;
    return true;
}

/* The present plan was made for other speeds. */
static bool other_speeds(const jerk_planner *planner) {
    const struct speeds *was = &planner->was;
    return was->command != planner->command_speed
           || was->feed != planner->feed_factor
           || was->rapid != planner->rapid_factor;
}

/* Whether motion has earned another try. From rest there is no other way on:
 * shorter and shorter windows are. */
static bool can_afford(const jerk_planner *planner) {
    return planner->at_standstill
           || (double)planner->stats.spent < planner->most;
}

/* The window up to a reach, in which the present plan stays allowed if it is
 * faster than what is asked for: whether it is. */
static bool over_window(jerk_planner *planner,
                        struct grid *grid,
                        double reach) {
    grid_window(planner, grid, reach, 0.0);
    bool faster = !grid->from_standstill && plan_is_faster(planner, grid, 0.0);
    if (faster) {
        allow_tail(planner, grid, INFINITY);
    }
    return faster;
}

/* mm of the plan that are driven in so many seconds, or nearly. */
static double way_within(const jerk_planner *planner, double seconds) {
    const plan *pl = &planner->plan;
    double way = 0.0;
    double left = seconds * planner->scale;
    for (int k = pl->next; k < pl->count && left > 0.0; k++) {
        way += pl->lengths[k];
        left -= time_over(pl->lengths[k], pl->x[k], pl->x[k + 1]);
    }
    return way;
}

/* The plan is too fast still where, or when, a quick fall of the speed has
 * ended: slow places are short and last long. */
static bool falls_on(const jerk_planner *planner, const struct grid *grid) {
    double v = planner->scale * sqrt(grid->seg[0].asked);
    double there = FALL_WAYS * way_down_to(planner, v);
    double then = way_within(planner, FALL_TIMES * time_down_to(planner, v));
    return plan_is_faster(planner, grid, fmin(there, then));
}

/* The window, in which a speed that is too high falls faster than in the
 * present plan, if that is soon found. */
static bool solve_fall(jerk_planner *planner, struct grid *grid) {
    grid->sinks = true;
    grid->ramp = INFINITY;
    planner->finer = false;
    problem_from_grid(planner, grid, planner->x, planner->accel);
    bool legal = guess_window(planner, grid, true, 1.0)
                 && solve_guess(planner, grid, SINK_TRIES, SINK_ITERATIONS);
    if (!legal) {
        give_back(planner, grid);
    }
    grid->sinks = false;
    return legal;
}

/* The same in parts, over windows that need not reach further than to rest. If
 * there is none either, the window is laid out again. */
static bool fall_in_parts(jerk_planner *planner,
                          struct grid *grid,
                          double reach) {
    if (plan_near(planner)) {
        return true;
    }
    over_window(planner, grid, reach);
    return false;
}

/* What the solver has come to is the guess over finer steps. */
static void keep_found(jerk_planner *planner, const struct grid *grid) {
    plan *found = &planner->found;
    size_t bytes = sizeof(double) * (size_t)(grid->count + 1);
    memcpy(found->x, planner->prob.x, bytes);
    memcpy(found->accel, planner->prob.accel, bytes);
    for (int k = 0; k < grid->count; k++) {
        found->lengths[k] = grid->seg[k].length;
    }
    found->count = grid->count;
    found->from_standstill = grid->from_standstill;
    found->remaining = grid->from_start[grid->count];
}

/* The window up to a reach, with finer steps where they turn out to be too
 * long. */
static bool solve_finer(jerk_planner *planner,
                        struct grid *grid,
                        double reach,
                        int tries) {
    bool legal = false;
    for (planner->finer_tries = tries; planner->finer_tries > 0;
         planner->finer_tries--) {
        legal = solve_window(planner, grid, true, 1.0);
        if (legal || !planner->finer || !can_afford(planner)) {
            break;
        }
        if (planner->scarce) {
            keep_found(planner, grid);
        }
        over_window(planner, grid, reach);
    }
    planner->found.count = 0;
    planner->finer_tries = 0;
    return legal;
}

/* Windows over many slow knots may fail as a whole: shorter ones do not. */
static bool solve_shorter(jerk_planner *planner,
                          struct grid *grid,
                          double least) {
    double reach = grid->from_start[grid->count];
    for (int i = 0; i < SHORTER_TRIES && can_afford(planner); i++) {
        reach *= SHORTER;
        if (reach <= least) {
            return false;
        }
        over_window(planner, grid, reach);
        if (grid->count < (grid->from_standstill ? 3 : 2)) {
            return false;
        }
        planner->reach = reach;
        if (solve_finer(planner, grid, reach, FINER_SHORTER)) {
            return true;
        }
    }
    return false;
}

/* Give back what a failure has taken from the windows. */
static void reach_further(jerk_planner *planner, const struct grid *grid) {
    if (planner->reach < 1e30) {
        planner->reach =
            fmax(planner->reach, grid->from_start[grid->count]) * LONGER;
    }
    if (planner->reach > REACH_FORGOTTEN) {
        planner->reach = 1e30;
    }
}

/* Laws of the plan that are driven in so many seconds, or nearly. */
static int laws_within(const jerk_planner *planner, double seconds) {
    const plan *pl = &planner->plan;
    double way = seconds * speed_at_head(planner);
    int k = pl->next;
    for (double at = 0.0; k < pl->count && (at < way || k == pl->next); k++) {
        at += pl->lengths[k];
    }
    return k - pl->next;
}

/* A first answer to other speeds stands, or not: what reaches further has to
 * follow, or it is tried again. The answer may be the plan of before, of this
 * edition: then nothing is waited for. */
static bool follow_soon(jerk_planner *planner, bool planned, uint64_t before) {
    planner->changed = false;
    planner->wait = planner->plan.edition == before
                        ? 0
                        : laws_within(planner, NEXT_COMMIT_S);
    if (planned) {
        planner->near = true;
        planner->was = speeds_now(planner);
    }
    return planned;
}

/* Other speeds while it moves, soon behind the last ones. */
static bool is_hurried(const jerk_planner *planner) {
    return planner->changed && planner->hurried && !planner->at_standstill
           && planner->plan.next < planner->plan.count && other_speeds(planner);
}

/* The stop is driven to its end: what has changed is planned from there. */
static bool rests_first(jerk_planner *planner) {
    if (!planner->changed || planner->at_standstill || !must_rest(planner)) {
        return false;
    }
    planner->changed = false;
    planner->near = true;
    planner->wait = planner->plan.count;
    return true;
}

/* A plan that moves on next to not at all.  From such a speed one much higher
 * is reached within the shortest step, and no window is legal; from rest one
 * is. */
static bool creeps_on(const jerk_planner *planner, double asked) {
    const plan *pl = &planner->plan;
    double most = planner->x;
    for (int k = pl->next; k < pl->count; k++) {
        most = fmax(most, pl->x[k]);
    }
    return !planner->at_standstill && !pl->from_standstill
           && most < NEXT_TO_REST * asked;
}

/* A new plan over the window by the solver, if it is legal and not slower than
 * the stored tail; else the tail stays. False: it is not what is wanted. */
static bool solve_ahead(jerk_planner *planner) {
    struct grid *grid = &planner->grid;
    uint64_t before = planner->plan.edition;
    double left = planner->plan.next < planner->plan.count
                      ? fmax(0.0, planner->plan.remaining)
                      : 0.0;
    double ahead = fmax(planner->reach, TAIL_MORE * left);
    if (planner->changed && !planner->is_read) {
        ahead = fmin(ahead, reach_behind_change(planner));
    }
    grid_window(planner, grid, ahead, 0.0);
    if (grid->count < (grid->from_standstill ? 3 : 2)) {
        return true;
    }
    bool falls = false;
    bool slowed = false;
    if (!grid->from_standstill && plan_is_faster(planner, grid, 0.0)) {
        bool known = !planner->changed && !planner->near;
        if (!known && !slow_down(planner)) {
            return follow_soon(planner, plan_near(planner), before);
        }
        slowed = !known;
        planner->was = speeds_now(planner);
        falls = over_window(planner, grid, ahead);
    }
    bool changed = planner->changed;
    planner->changed = false;
    planner->wait = 1 + grid->count / 10;
    bool fallen = falls && solve_fall(planner, grid);
    if (slowed && falls && !fallen && fall_in_parts(planner, grid, ahead)) {
        return follow_soon(planner, true, before);
    }
    if (fallen || solve_finer(planner, grid, ahead, FINER_TRIES)
        || solve_shorter(planner, grid, TAIL_MORE * left)) {
        if (!changed && !falls && !grid->from_standstill
            && slower_than_tail(planner, grid)) {
            planner->stats.slower++;
            planner->plan.final =
                planner->plan.final
                || planner->prob.solved; /* the solver does no better */
        } else if (plan_accept(planner, grid, planner->prob.solved)) {
            planner->was = speeds_now(planner);
        }
        planner->near = falls && falls_on(planner, grid);
        if (planner->near) {
            int soon = laws_within(planner, FALL_SEEN_S);
            planner->wait = soon < planner->wait ? soon : planner->wait;
        }
        reach_further(planner, grid);
        return true;
    }
    if (grid->from_standstill) {
        grid_window(planner, grid, 1e30, 0.0);
        if ((solve_window(planner, grid, false, SHRINK)
             || slow_fallback(planner, grid))
            && plan_accept(planner, grid, false)) {
            planner->was = speeds_now(planner);
        }
        return true;
    }
    if (slowed) {
        return follow_soon(planner, true, before);
    }
    if (!changed && !creeps_on(planner, grid->seg[0].asked)) {
        return true;
    }
    bool met = plan_stop(planner); /* the fastest way down */
    if (!changed) {
        return true;
    }
    grid_window(planner, grid, 1e30, 0.0);
    allow_tail(planner, grid, INFINITY);
    return (solve_window(planner, grid, true, 1.0)
            && plan_accept(planner, grid, planner->prob.solved))
           || met;
}

/* A straight line is ahead, and its plan is what is wanted. */
static bool planned_on_line(jerk_planner *planner) {
    planner->changed = false;
    planner->near = false;
    planner->was = speeds_now(planner);
    return true;
}

bool plan_window(jerk_planner *planner) {
    uint64_t before = planner->plan.edition;
    if (rests_first(planner)) {
        return true;
    }
    switch (plan_on_line(planner)) {
    case LINE_TO_END:
        return planned_on_line(planner);
    case LINE_FALL:
        return follow_soon(planner, true, before);
    case LINE_NONE:
        break;
    }
    bool asked = planner->changed || planner->near;
    bool met;
    if (is_hurried(planner)) {
        bool planned = plan_near(planner) || slow_down(planner);
        met = follow_soon(planner, planned, before);
    } else {
        met = solve_ahead(planner);
    }
    bool found = planner->plan.edition != before;
    return asked && !found && rise_on_line(planner)
               ? follow_soon(planner, true, before)
               : met;
}
