/* Where the solver starts: a speed profile over the grid, then the nearest one
 * that meets the dynamics. */
#include <math.h>
#include "jerk/solver/constraints.h"
#include "jerk/solver/initial_guess.h"
#include "jerk/solver/riccati.h"
#include "jerk/state/state.h"

/* What curvature alone allows on a segment. */
static double curve_cap(const jerk_planner *planner,
                        const struct segment *segment) {
    double scale = planner->scale;
    double bend = 0.0;
    double twist = 0.0;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        bend = fmax(bend,
                    larger(segment->interval->d2[0][axis],
                           segment->interval->d2[1][axis])
                        / acc_max(planner, segment->interval, axis));
        twist = fmax(twist,
                     larger(segment->interval->d3[0][axis],
                            segment->interval->d3[1][axis])
                         / jerk_max(planner, segment->interval, axis));
    }
    double v = cbrt(EASY_BEND * segment->share
                    / fmax(1e-30, twist * scale * scale * scale));
    return fmin(EASY_BEND / fmax(1e-30, bend * scale * scale), v * v);
}

static void path_limits(const jerk_planner *planner,
                        const struct segment *segment,
                        double *acc,
                        double *jerk) {
    double scale = planner->scale;
    *acc = *jerk = 1e30;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        double d1 = fmax(fabs(segment->interval->d1[0][axis]), 1e-9);
        *acc =
            fmin(*acc,
                 segment->acc[axis] * acc_max(planner, segment->interval, axis)
                     / (d1 * scale * scale));
        *jerk = fmin(*jerk,
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
        double rise = EASY_JERK * jerk / sqrt(fmax(x[k], 1e-12));
        double next = fmin(EASY_ACC * acc, accel + length * rise);
        double reach = x[k] + length * (accel + next);
        if (reach < x[k + step]) {
            x[k + step] = fmax(reach, 0.25 * x[k]);
            accel = next;
        } else {
            accel = fmax(0.0,
                         fmin(next,
                              0.5 * (x[k + step] - x[k])
                                  / length)); /* falling caps are the other
                                                 pass's matter */
        }
    }
}

/* Cap of the speed between two segments by feed and override. */
static double feed_at(const struct grid *grid, int k) {
    const struct segment *segment = &grid->seg[k];
    return grid->sinks ? fmin(segment[-1].asked, segment->asked)
                       : fmin(segment[-1].soft, segment->soft);
}

/* Caps of feed, machine and curvature, less a margin. */
static void easy_caps(const jerk_planner *planner,
                      const struct grid *grid,
                      double *x) {
    double curve = curve_cap(planner, &grid->seg[0]);
    for (int k = 1; k < grid->count; k++) {
        double before = curve;
        double soft = feed_at(grid, k);
        curve = curve_cap(planner, &grid->seg[k]);
        x[k] = fmin(EASY_SPEED * fmin(soft, grid->knot_cap[k]),
                    fmin(before, curve));
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
        x[1] = fmin(x[1], most);
    }
    ramp(planner,
         grid,
         x,
         grid->from_standstill ? 1 : 0,
         count - 1,
         1,
         fmax(0.0, accel));
    x[count - 1] = fmin(x[count - 1],
                        standstill_end(planner, &grid->seg[count - 1], &accel));
    ramp(planner, grid, x, count - 1, 1, -1, accel);
    for (int k = 1; k < count && !grid->from_standstill;
         k++) { /* from above the caps: down with the full acceleration */
        double acc, jerk;
        path_limits(planner, &grid->seg[k - 1], &acc, &jerk);
        double drop = 2.0 * acc * grid->seg[k - 1].length;
        x[k] = fmax(x[k], x[k - 1] - drop);
    }
    for (int k = 1; k < count; k++) {
        x[k] = fmax(x[k], TINY);
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
            double left = fmax(0.0, 1.0 - into / length);
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

/* What the state at the start of a stage and its inputs make of an axis' jerk,
 * over its limit and sqrt(x). */
typedef struct form {
    double x, accel, input[2];
} form;

/* The n-th jerk row of stage k, at its start or its end. */
static struct form jerk_form(const struct problem *problem,
                             int k,
                             int end,
                             int n) {
    int first = (2 * (k / LANES) + end) * problem->axes;
    const two_sided *row = &problem->jerk[first + n];
    double q3 = row->coef[0][k % LANES];
    double q2 = row->coef[1][k % LANES];
    double q1 = row->coef[2][k % LANES];
    struct form form = {q3, q2, {0.0, 0.0}};
    if (end > 0) {
        double length = problem->lengths[k];
        double third = THIRD * length * length;
        double half = 0.5 * length;
        form.accel += 2.0 * length * q3;
        form.input[0] = 2.0 * third * q3 + half * q2;
        form.input[1] = third * q3 + half * q2;
    }
    form.input[end] += q1;
    return form;
}

/* Adds a row's square to the cost of stage k. */
static void add_jerk_cost(struct stage_cost *cost,
                          int k,
                          const struct form *form,
                          double weight) {
    double wx = weight * form->x;
    double wu = weight * form->accel;
    cost->xx[k] += wx * form->x;
    cost->xu[k] += wx * form->accel;
    cost->uu[k] += wu * form->accel;
    for (int i = 0; i < 2; i++) {
        double input = form->input[i];
        cost->xc[i][k] += wx * input;
        cost->uc[i][k] += wu * input;
        double wc = weight * input;
        cost->cc[2 * i][k] += wc * input;
    }
    double both = form->input[0] * form->input[1];
    cost->cc[1][k] += weight * both;
}

/* Cost of x off the guess, of acceleration and of the axes' jerks. */
static void guess_cost(const jerk_planner *planner,
                       struct problem *problem,
                       const struct grid *grid,
                       double stiffness) {
    struct stage_cost *cost = &problem->cost;
    for (int k = 0; k < problem->blocks * LANES; k++) {
        cost->xx[k] = 0.0;
        cost->xu[k] = 0.0;
        cost->uu[k] = 0.0;
        cost->cc[1][k] = 0.0;
        for (int i = 0; i < 2; i++) {
            cost->xc[i][k] = 0.0;
            cost->uc[i][k] = 0.0;
            problem->grad.input[i][k] = 0.0;
        }
        problem->grad.x[k] = 0.0;
        problem->grad.accel[k] = 0.0;
    }
    for (int k = problem->first; k < problem->count; k++) {
        double acc, jerk;
        double xk = fmax(problem->guess[k], TINY);
        path_limits(planner, &grid->seg[k], &acc, &jerk);
        cost->xx[k] = 1.0 / (xk * xk);
        cost->uu[k] = stiffness / (acc * acc);
        cost->cc[0][k] = cost->cc[2][k] = GUESS_LEAST_COST * problem->convex;
        bool has_rows = k < problem->count - 1;
        int rows = has_rows ? problem->used[k / LANES].jerk : 0;
        for (int n = 0; n < 2 * rows; n++) {
            struct form form = jerk_form(problem, k, n % 2, n / 2);
            add_jerk_cost(cost, k, &form, 0.5 * stiffness * xk);
        }
    }
}

/* Slope of that cost at the present x, u and inputs. */
static void guess_slope(struct problem *problem) {
    const struct stage_cost *cost = &problem->cost;
    for (int k = problem->first; k < problem->count; k++) {
        double x = problem->x[k];
        double accel = problem->accel[k];
        double c0 = problem->input[0][k];
        double c1 = problem->input[1][k];
        double xk = fmax(problem->guess[k], TINY);
        double by_x = cost->xx[k] * x + cost->xu[k] * accel;
        by_x += cost->xc[0][k] * c0;
        by_x += cost->xc[1][k] * c1;
        problem->grad.x[k] = by_x - problem->guess[k] / (xk * xk);
        double by_accel = cost->xu[k] * x + cost->uu[k] * accel;
        by_accel += cost->uc[0][k] * c0;
        by_accel += cost->uc[1][k] * c1;
        problem->grad.accel[k] = by_accel;
        for (int i = 0; i < 2; i++) {
            double by_input = cost->xc[i][k] * x;
            by_input += cost->uc[i][k] * accel;
            by_input += cost->cc[i][k] * c0;
            by_input += cost->cc[i + 1][k] * c1;
            problem->grad.input[i][k] = by_input;
        }
    }
}

/* The nearest profile that meets the dynamics: least squares of x against the
 * guess and of the axis jerks. */
static bool project(jerk_planner *planner,
                    const struct grid *grid,
                    double stiffness) {
    struct problem *problem = &planner->prob;
    guess_cost(planner, problem, grid, stiffness);
    if (!riccati_factor(problem)) {
        return false;
    }
    /* the problem is homogeneous in the deviation from a start trajectory: a
     * first rollout with no input */
    double x = problem->x0;
    double accel = problem->u0;
    if (problem->from_standstill) {
        x = 0.0;
        accel = 0.0;
    }
    int last = problem->count - 1;
    for (int k = problem->first; k <= last; k++) {
        problem->x[k] = x;
        problem->accel[k] = accel;
        double length = problem->lengths[k];
        double input = 0.0;
        if (k == last - 1) {
            const struct gain *gain = &problem->gain[k];
            input = gain->kx[0] * x + gain->ku[0] * accel;
        }
        problem->input[0][k] = problem->input[1][k] = input;
        if (k == last) {
            break;
        }
        x += 2.0 * length * accel + length * length * input;
        accel += length * input;
    }
    guess_slope(problem);
    riccati_solve(problem, &problem->grad);
    for (int k = problem->first; k < problem->count; k++) {
        problem->x[k] += problem->dx[k];
        problem->accel[k] += problem->du[k];
        for (int i = 0; i < 2; i++) {
            problem->input[i][k] += problem->dc[i][k];
        }
    }
    if (problem->from_standstill) {
        problem->x[0] = 0.0;
        problem->accel[0] = 0.0;
        problem->input[0][0] = 0.0;
        problem->input[1][0] = 0.0;
    }
    return true;
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
        double next = fmin(acc, accel + length * jerk / sqrt(fmax(at, TINY)));
        at = fmax(LEAST_KEPT * at, at + length * (accel + next));
        accel = next;
        if (at >= x[k + 1]) {
            return;
        }
        x[k + 1] = at;
    }
}

/* The present plan goes on behind the window: here it comes to rest. */
static void come_to_rest(const jerk_planner *planner,
                         const struct grid *grid,
                         double *x) {
    int last = grid->count - 1;
    double accel;
    if (planner->plan.remaining <= grid->from_start[grid->count]) {
        return;
    }
    x[last] = fmin(x[last], standstill_end(planner, &grid->seg[last], &accel));
    ramp(planner, grid, x, last, 1, -1, accel);
}

/* Present plan where it reaches, slow profile behind it. */
bool guess_window(jerk_planner *planner,
                  const struct grid *grid,
                  bool warm,
                  double shrink) {
    struct problem *problem = &planner->prob;
    slow_profile(planner, grid, problem->guess);
    if (warm && planner->plan.next < planner->plan.count) {
        plan_x(&planner->plan, grid, 1.0, planner->scratch);
        for (int k = 1; k < grid->count; k++) {
            if (planner->scratch[k] > problem->guess[k]) {
                problem->guess[k] =
                    fmin(planner->scratch[k],
                         fmax(problem->guess[k], feed_at(grid, k)));
            }
            if (grid->sinks) {
                double t = fmin(1.0, grid->from_start[k] / grid->ramp);
                double more = planner->scratch[k] - feed_at(grid, k);
                if (more > 0.0) {
                    problem->guess[k] =
                        feed_at(grid, k)
                        + more * (1.0 - t * t * (3.0 - 2.0 * t));
                }
            }
        }
        come_to_rest(planner, grid, problem->guess);
    }
    keep_reachable(planner, grid, problem->guess);
    for (int k = 1; k < grid->count; k++) {
        problem->guess[k] *= shrink;
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
        jerk = fmin(jerk, j);
        if (k > 0) {
            cap = fmin(cap, problem->guess[k]);
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
        problem->guess[k] = fmax(TINY, x[k]);
    }
    problem->guess[grid->count] = 0.0;
    bound_rows(planner, grid);
    return project(planner, grid, CLOSE_STIFFNESS);
}

/* A stop from the present state over the whole grid. */
bool guess_stop(jerk_planner *planner, const struct grid *grid) {
    struct problem *problem = &planner->prob;
    double way = grid->from_start[grid->count];
    double beta = fmin(
        4.0,
        fmax(0.0,
             2.0 * planner->accel * way / fmax(planner->x, 1e-12) + 4.0 / 3.0));
    problem->guess[0] = planner->x;
    for (int k = 1; k < grid->count; k++) {
        double t = grid->from_start[k] / way;
        double cap = fmin(grid->knot_cap[k],
                          fmin(grid->seg[k - 1].soft, grid->seg[k].soft));
        problem->guess[k] = fmax(
            TINY,
            fmin(cap,
                 planner->x * standstill_power(1.0 - t) * (1.0 + beta * t)));
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
        problem->guess[k] =
            fmax(TINY,
                 fmin(planner->scratch[k],
                      fmin(grid->knot_cap[k],
                           fmin(grid->seg[k - 1].soft, grid->seg[k].soft))));
    }
    problem->guess[grid->count] = 0.0;
    bound_rows(planner, grid);
    return project(planner, grid, CLOSE_STIFFNESS);
}
