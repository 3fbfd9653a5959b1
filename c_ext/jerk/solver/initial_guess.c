/* Where the solver starts: a speed profile over the grid, then the nearest one
 * that meets the dynamics (projection.c). */
#include <math.h>
#include "jerk/rows/constraints.h"
#include "jerk/solver/faster_guess.h"
#include "jerk/solver/initial_guess.h"
#include "jerk/solver/projection.h"
#include "jerk/state/state.h"
#include "maths/order.h"

/* What curvature alone allows on a segment, by accelerations and by jerks. */
struct curve {
    double bend, twist;
};

static struct curve curve_caps(const jerk_planner *planner,
                               const struct segment *segment) {
    double scale = planner->scale;
    double bend = 0.0;
    double twist = 0.0;
    for (int axis = 0; axis < planner->axes; axis++) {
        bend = greater(bend,
                       larger(segment->interval->d2[0][axis],
                              segment->interval->d2[1][axis])
                           / acc_max(planner, segment->interval, axis));
        twist = greater(twist,
                        larger(segment->interval->d3[0][axis],
                               segment->interval->d3[1][axis])
                            / jerk_max(planner, segment->interval, axis));
    }
    double v = cbrt(EASY_BEND * segment->share
                    / greater(1e-30, twist * scale * scale * scale));
    return (struct curve){1.0 / greater(1e-30, bend * scale * scale), v * v};
}

static double easy_curve(struct curve curve) {
    return lesser(EASY_BEND * curve.bend, curve.twist);
}

static void path_limits(const jerk_planner *planner,
                        const struct segment *segment,
                        double *acc,
                        double *jerk) {
    double scale = planner->scale;
    *acc = *jerk = 1e30;
    for (int axis = 0; axis < planner->axes; axis++) {
        double d1 = greater(fabs(segment->interval->d1[0][axis]), 1e-9);
        *acc = lesser(*acc,
                      segment->acc[axis]
                          * acc_max(planner, segment->interval, axis)
                          / (d1 * scale * scale));
        *jerk =
            lesser(*jerk,
                   segment->share * jerk_max(planner, segment->interval, axis)
                       / (d1 * scale * scale * scale));
    }
}

/* Under constant path jerk x grows so with the distance from a standstill. */
static double standstill_power(double way) {
    return way * cbrt(way);
}

/* x at distance d from a standstill under constant path jerk. */
static double x_from_standstill(double distance, double jerk) {
    return 0.25 * jerk * jerk * standstill_power(6.0 * distance / jerk);
}

/* One pass over the caps, leaving every minimum with limited jerk and
 * acceleration: upwards with `step` 1, else back. */
static void ramp(const jerk_planner *planner,
                 const struct grid *grid,
                 double *x,
                 int from,
                 int to,
                 int step,
                 double accel) {
    for (int k = from; k != to; k += step) {
        const struct segment *segment = &grid->seg[step > 0 ? k : k - 1];
        double acc, jerk;
        path_limits(planner, segment, &acc, &jerk);
        double length = segment->length;
        double rise = EASY_JERK * jerk / sqrt(greater(x[k], 1e-12));
        double next = lesser(EASY_ACC * acc, accel + length * rise);
        double reach = x[k] + length * (accel + next);
        if (reach < x[k + step]) {
            x[k + step] = greater(reach, 0.25 * x[k]);
            accel = next;
        } else {
            accel = greater(0.0,
                            lesser(next,
                                   0.5 * (x[k + step] - x[k])
                                       / length)); /* falling caps are the other
                                                      pass's matter */
        }
    }
}

/* Cap of the speed between two segments by feed and override. */
static double feed_at(const struct grid *grid, int k) {
    const struct segment *segment = &grid->seg[k];
    return grid->sinks ? lesser(segment[-1].asked, segment->asked)
                       : lesser(segment[-1].soft, segment->soft);
}

/* Caps of feed, machine and curvature, less a margin. */
static void easy_caps(jerk_planner *planner,
                      const struct grid *grid,
                      double *x) {
    struct problem *problem = &planner->prob;
    struct curve curve = curve_caps(planner, &grid->seg[0]);
    for (int k = 1; k < grid->count; k++) {
        struct curve before = curve;
        double soft = feed_at(grid, k);
        curve = curve_caps(planner, &grid->seg[k]);
        double cap = lesser(soft, grid->knot_cap[k]);
        double bend = lesser(before.bend, curve.bend);
        problem->cap[k] = EASY_SPEED * cap;
        problem->most[k] = lesser(cap, HARD_BEND * bend);
        x[k] = lesser(problem->cap[k],
                      lesser(easy_curve(before), easy_curve(curve)));
    }
}

/* End of a rest interval under half of the jerk: x and u there. */
static double standstill_end(const jerk_planner *planner,
                             const struct segment *segment,
                             double *accel) {
    double acc, jerk;
    double length = segment->length;
    path_limits(planner, segment, &acc, &jerk);
    double x = x_from_standstill(length, EASY_JERK * jerk);
    *accel = x / (1.5 * length);
    return x;
}

/* A slow profile that needs about half of every limit. */
static void slow_profile(jerk_planner *planner,
                         const struct grid *grid,
                         double *x) {
    int count = grid->count;
    double accel = planner->accel;
    x[0] = grid->from_standstill ? 0.0 : planner->x;
    x[count] = 0.0;
    easy_caps(planner, grid, x);
    if (grid->from_standstill) {
        double most = standstill_end(planner, &grid->seg[0], &accel);
        x[1] = lesser(x[1], most);
    }
    ramp(planner,
         grid,
         x,
         grid->from_standstill ? 1 : 0,
         count - 1,
         1,
         greater(0.0, accel));
    x[count - 1] =
        lesser(x[count - 1],
               standstill_end(planner, &grid->seg[count - 1], &accel));
    ramp(planner, grid, x, count - 1, 1, -1, accel);
    for (int k = 1; k < count && !grid->from_standstill;
         k++) { /* from above the caps: down with the full acceleration */
        double acc, jerk;
        path_limits(planner, &grid->seg[k - 1], &acc, &jerk);
        double drop = 2.0 * acc * grid->seg[k - 1].length;
        x[k] = greater(x[k], x[k - 1] - drop);
    }
    for (int k = 1; k < count; k++) {
        x[k] = greater(x[k], TINY);
    }
}

/* x at the share t of an interval: x' = 2 u. */
static double between(double x0,
                      double u0,
                      double x1,
                      double u1,
                      double length,
                      double t) {
    double start_slope = 2.0 * length * u0;
    double end_slope = 2.0 * length * u1;
    double difference = x1 - x0;
    return x0
           + t
                 * (start_slope
                    + t
                          * (3.0 * difference - 2.0 * start_slope - end_slope
                             + t
                                   * (start_slope + end_slope
                                      - 2.0 * difference)));
}

/* x of the plan at a distance ahead of what was handed out, or so many times
 * it; negative behind its end. */
static void plan_x(const plan *pl,
                   const struct grid *grid,
                   double times,
                   double *x) {
    double start = 0.0;
    int i = pl->next;
    for (int k = 0; k < grid->count; k++) {
        double at = times * grid->from_start[k];
        while (i < pl->count && at >= start + pl->lengths[i] - 1e-12) {
            start += pl->lengths[i++];
        }
        if (i >= pl->count) {
            x[k] = -1.0;
            continue;
        }
        double into = at - start;
        double length = pl->lengths[i];
        if (i == pl->count - 1) {
            double left = greater(0.0, 1.0 - into / length);
            x[k] = pl->x[i] * standstill_power(left);
        } else if (i == 0 && pl->from_standstill) {
            x[k] = pl->x[1] * standstill_power(into / length);
        } else {
            x[k] = between(pl->x[i],
                           pl->accel[i],
                           pl->x[i + 1],
                           pl->accel[i + 1],
                           length,
                           into / length);
        }
    }
}

/* The nearest profile to the guess that meets the dynamics. */
static bool project(jerk_planner *planner,
                    const struct grid *grid,
                    double stiffness) {
    struct problem *problem = &planner->prob;
    for (int k = problem->first; k < problem->count; k++) {
        double acc, jerk;
        path_limits(planner, &grid->seg[k], &acc, &jerk);
        problem->brake[k] = 1.0 / (acc * acc);
    }
    return nearest_profile(problem, stiffness, false);
}

/* A window that starts while it brakes: from there the speed cannot be above
 * what all of the jerk makes of it. */
static void keep_reachable(const jerk_planner *planner,
                           const struct grid *grid,
                           double *x) {
    double at = planner->x;
    double accel = planner->accel;
    if (grid->from_standstill || accel >= 0.0) {
        return;
    }
    for (int k = 0; k < grid->count - 1; k++) {
        double acc, jerk;
        double length = grid->seg[k].length;
        path_limits(planner, &grid->seg[k], &acc, &jerk);
        double next =
            lesser(acc, accel + length * jerk / sqrt(greater(at, TINY)));
        at = greater(LEAST_KEPT * at, at + length * (accel + next));
        accel = next;
        if (at >= x[k + 1]) {
            return;
        }
        x[k + 1] = at;
    }
}

/* What is guessed from goes on behind the window: here it comes to rest. */
static void come_to_rest(const jerk_planner *planner,
                         const struct grid *grid,
                         const plan *from,
                         double *x) {
    int last = grid->count - 1;
    double accel;
    if (from->remaining <= grid->from_start[grid->count]) {
        return;
    }
    x[last] =
        lesser(x[last], standstill_end(planner, &grid->seg[last], &accel));
    ramp(planner, grid, x, last, 1, -1, accel);
}

/* What was found over longer steps, where it reaches. */
static bool guess_found(jerk_planner *planner, const struct grid *grid) {
    struct problem *problem = &planner->prob;
    plan_x(&planner->found, grid, 1.0, planner->scratch);
    for (int k = 1; k < grid->count; k++) {
        if (planner->scratch[k] > 0.0) {
            problem->guess[k] = greater(planner->scratch[k], TINY);
        }
    }
    come_to_rest(planner, grid, &planner->found, problem->guess);
    bound_rows(planner, grid);
    return project(planner, grid, CLOSE_STIFFNESS);
}

/* Present plan where it reaches, slow profile behind it. */
bool guess_window(jerk_planner *planner,
                  const struct grid *grid,
                  bool warm,
                  double shrink) {
    struct problem *problem = &planner->prob;
    slow_profile(planner, grid, problem->guess);
    if (planner->found.count > 0) {
        return guess_found(planner, grid);
    }
    if (warm && planner->plan.next < planner->plan.count) {
        plan_x(&planner->plan, grid, 1.0, planner->scratch);
        for (int k = 1; k < grid->count; k++) {
            if (planner->scratch[k] > problem->guess[k]) {
                problem->guess[k] =
                    lesser(planner->scratch[k],
                           greater(problem->guess[k], feed_at(grid, k)));
            }
            if (grid->sinks) {
                double t = lesser(1.0, grid->from_start[k] / grid->ramp);
                double more = planner->scratch[k] - feed_at(grid, k);
                if (more > 0.0) {
                    problem->guess[k] =
                        feed_at(grid, k)
                        + more * (1.0 - t * t * (3.0 - 2.0 * t));
                }
            }
        }
        come_to_rest(planner, grid, &planner->plan, problem->guess);
    }
    keep_reachable(planner, grid, problem->guess);
    for (int k = 1; k < grid->count; k++) {
        problem->guess[k] *= shrink;
    }
    bool grows = !grid->sinks && shrink == 1.0;
    if (grows
        && !(project(planner, grid, STIFFNESS)
             && faster_guess(problem, planner->scratch))) {
        return false;
    }
    bound_rows(planner, grid);
    return project(planner, grid, STIFFNESS);
}

/* A smooth bump from rest to rest, below all caps, for the fallback. */
bool guess_bump(jerk_planner *planner, const struct grid *grid) {
    struct problem *problem = &planner->prob;
    double cap = 1e30;
    double jerk = 1e30;
    easy_caps(planner, grid, problem->guess);
    for (int k = 0; k < grid->count; k++) {
        double acc, j;
        path_limits(planner, &grid->seg[k], &acc, &j);
        jerk = lesser(jerk, j);
        if (k > 0) {
            cap = lesser(cap, problem->guess[k]);
        }
    }
    for (int k = 1; k < grid->count; k++) {
        double up = x_from_standstill(grid->from_start[k], EASY_JERK * jerk);
        double down = x_from_standstill(grid->from_start[grid->count]
                                            - grid->from_start[k],
                                        EASY_JERK * jerk);
        problem->guess[k] = 1.0 / (1.0 / up + 1.0 / down + 1.0 / cap);
    }
    problem->guess[0] = 0.0;
    problem->guess[grid->count] = 0.0;
    bound_rows(planner, grid);
    return project(planner, grid, STIFFNESS);
}

/* From a profile over the same grid. */
bool guess_from(jerk_planner *planner,
                const struct grid *grid,
                const double *x) {
    struct problem *problem = &planner->prob;
    for (int k = 0; k <= grid->count; k++) {
        problem->guess[k] = greater(x[k], TINY);
    }
    problem->guess[grid->count] = 0.0;
    bound_rows(planner, grid);
    return project(planner, grid, CLOSE_STIFFNESS);
}

/* A stop as the plan's over another length: its speeds at the same share of the
 * way. */
bool guess_stop_like(jerk_planner *planner,
                     const struct grid *grid,
                     double length) {
    struct problem *problem = &planner->prob;
    plan_x(&planner->plan,
           grid,
           length / grid->from_start[grid->count],
           planner->scratch);
    problem->guess[0] = planner->x;
    for (int k = 1; k < grid->count; k++) {
        problem->guess[k] = greater(
            TINY,
            lesser(planner->scratch[k],
                   lesser(grid->knot_cap[k],
                          lesser(grid->seg[k - 1].soft, grid->seg[k].soft))));
    }
    problem->guess[grid->count] = 0.0;
    bound_rows(planner, grid);
    return project(planner, grid, CLOSE_STIFFNESS);
}
