/* Where the solver starts: a speed profile over the grid, then the nearest one
 * that meets the dynamics. */
#include <math.h>
#include "jerk/state.h"

#define EASY_ACC 0.45 /* share of the limits that the guess uses */
#define EASY_JERK 0.5
#define EASY_SPEED 0.9
#define EASY_BEND 0.6
#define TINY 1e-14
#define LEAST_COST 1e-12
#define LEAST_KEPT 0.05 /* of x, from one knot to the next while it brakes */
#define STIFFNESS                                                              \
    0.05 /* weight of jerk against the distance from the profile */

/* What curvature alone allows on a segment. */
static double curve_cap(const jerk_planner *planner,
                        const struct segment *segment) {
    double f = planner->scale, bend = 0.0, twist = 0.0;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        bend = fmax(
            bend,
            fmax(fabs(segment->q->d2[0][axis]), fabs(segment->q->d2[1][axis]))
                / acc_max(planner, segment->q, axis));
        twist = fmax(
            twist,
            fmax(fabs(segment->q->d3[0][axis]), fabs(segment->q->d3[1][axis]))
                / jerk_max(planner, segment->q, axis));
    }
    double v =
        cbrt(EASY_BEND * segment->share / fmax(1e-30, twist * f * f * f));
    return fmin(EASY_BEND / fmax(1e-30, bend * f * f), v * v);
}

static void path_limits(const jerk_planner *planner,
                        const struct segment *segment,
                        double *acc,
                        double *jerk) {
    double f = planner->scale;
    *acc = *jerk = 1e30;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        double d1 = fmax(fabs(segment->q->d1[0][axis]), 1e-9);
        *acc = fmin(*acc,
                    segment->acc[axis] * acc_max(planner, segment->q, axis)
                        / (d1 * f * f));
        *jerk = fmin(*jerk,
                     segment->share * jerk_max(planner, segment->q, axis)
                         / (d1 * f * f * f));
    }
}

/* x at distance d from a standstill under constant path jerk. */
static double from_rest(double d, double jerk) {
    return 0.25 * jerk * jerk * pow(6.0 * d / jerk, 4.0 / 3.0);
}

/* One pass over the caps, leaving every minimum with limited jerk and
 * acceleration: upwards with `step` 1, else back. */
static void ramp(const jerk_planner *planner,
                 const struct grid *grid,
                 double *x,
                 int from,
                 int to,
                 int step,
                 double u) {
    for (int k = from; k != to; k += step) {
        const struct segment *segment = &grid->seg[step > 0 ? k : k - 1];
        double acc, jerk;
        path_limits(planner, segment, &acc, &jerk);
        double h = segment->h,
               rise = EASY_JERK * jerk / sqrt(fmax(x[k], 1e-12));
        double next = fmin(EASY_ACC * acc, u + h * rise),
               reach = x[k] + h * (u + next);
        if (reach < x[k + step]) {
            x[k + step] = fmax(reach, 0.25 * x[k]);
            u = next;
        } else {
            u = fmax(
                0.0,
                fmin(next,
                     0.5 * (x[k + step] - x[k])
                         / h)); /* falling caps are the other pass's matter */
        }
    }
}

/* Caps of feed, machine and curvature, less a margin. */
static void easy_caps(const jerk_planner *planner,
                      const struct grid *grid,
                      double *x) {
    double curve = curve_cap(planner, &grid->seg[0]);
    for (int k = 1; k < grid->n; k++) {
        double before = curve,
               soft = fmin(grid->seg[k - 1].soft, grid->seg[k].soft);
        curve = curve_cap(planner, &grid->seg[k]);
        x[k] = fmin(EASY_SPEED * fmin(soft, grid->knot_cap[k]),
                    fmin(before, curve));
    }
}

/* End of a rest interval under half of the jerk: x and u there. */
static double rest_end(const jerk_planner *planner,
                       const struct segment *segment,
                       double *u) {
    double acc, jerk, h = segment->h;
    path_limits(planner, segment, &acc, &jerk);
    double x = from_rest(h, EASY_JERK * jerk);
    *u = x / (1.5 * h);
    return x;
}

/* A slow profile that needs about half of every limit. */
static void slow_profile(jerk_planner *planner,
                         const struct grid *grid,
                         double *x) {
    int count = grid->n;
    double u = planner->u;
    x[0] = grid->rest_start ? 0.0 : planner->x;
    x[count] = 0.0;
    easy_caps(planner, grid, x);
    if (grid->rest_start) {
        x[1] = fmin(x[1], rest_end(planner, &grid->seg[0], &u));
    }
    ramp(planner,
         grid,
         x,
         grid->rest_start ? 1 : 0,
         count - 1,
         1,
         fmax(0.0, u));
    x[count - 1] =
        fmin(x[count - 1], rest_end(planner, &grid->seg[count - 1], &u));
    ramp(planner, grid, x, count - 1, 1, -1, u);
    for (int k = 1; k < count && !grid->rest_start;
         k++) { /* from above the caps: down with the full acceleration */
        double acc, jerk;
        path_limits(planner, &grid->seg[k - 1], &acc, &jerk);
        x[k] = fmax(x[k], x[k - 1] - 2.0 * acc * grid->seg[k - 1].h);
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
                      double h,
                      double t) {
    double a = 2.0 * h * u0, b = 2.0 * h * u1, d = x1 - x0;
    return x0 + t * (a + t * (3.0 * d - 2.0 * a - b + t * (a + b - 2.0 * d)));
}

/* x of the plan at a distance ahead of what was handed out, or so many times
 * it; negative behind its end. */
static void plan_x(const plan *pl,
                   const struct grid *grid,
                   double times,
                   double *x) {
    double start = 0.0;
    int i = pl->next;
    for (int k = 0; k < grid->n; k++) {
        double at = times * grid->from_start[k];
        while (i < pl->n && at >= start + pl->h[i] - 1e-12) {
            start += pl->h[i++];
        }
        if (i >= pl->n) {
            x[k] = -1.0;
            continue;
        }
        double d = at - start, h = pl->h[i];
        if (i == pl->n - 1) {
            x[k] = pl->x[i] * pow(fmax(0.0, 1.0 - d / h), 4.0 / 3.0);
        } else if (i == 0 && pl->rest_start) {
            x[k] = pl->x[1] * pow(d / h, 4.0 / 3.0);
        } else {
            x[k] = between(pl->x[i],
                           pl->u[i],
                           pl->x[i + 1],
                           pl->u[i + 1],
                           h,
                           d / h);
        }
    }
}

/* The nearest profile that meets the dynamics: least squares of x against the
 * guess and of the axis jerks. */
static bool project(jerk_planner *planner,
                    const struct grid *grid,
                    double stiffness) {
    struct problem *problem = &planner->prob;
    for (int k = 0; k < problem->blocks * LANES; k++) {
        problem->cost.xx[k] = problem->cost.xu[k] = problem->cost.uu[k] =
            problem->cost.xc[0][k] = problem->cost.xc[1][k] =
                problem->cost.uc[0][k] = problem->cost.uc[1][k] = 0.0;
    }
    for (int k = 0; k < problem->blocks * LANES; k++) {
        problem->cost.cc[1][k] = problem->grad.x[k] = problem->grad.u[k] =
            problem->grad.c[0][k] = problem->grad.c[1][k] = 0.0;
    }
    for (int k = problem->first; k < problem->n; k++) {
        double acc, jerk, xk = fmax(problem->guess[k], TINY);
        path_limits(planner, &grid->seg[k], &acc, &jerk);
        problem->cost.xx[k] = 1.0 / (xk * xk);
        problem->cost.uu[k] = stiffness / (acc * acc);
        problem->cost.cc[0][k] = problem->cost.cc[2][k] =
            0.5 * stiffness * xk / (jerk * jerk) + LEAST_COST * problem->convex;
    }
    if (!riccati_factor(problem)) {
        return false;
    }
    /* the problem is homogeneous in the deviation from a start trajectory: a
     * first rollout with no input */
    double x = problem->x0, u = problem->u0;
    if (problem->rest_start) {
        x = u = 0.0;
    }
    int last = problem->n - 1;
    for (int k = problem->first; k <= last; k++) {
        problem->x[k] = x;
        problem->u[k] = u;
        double h = problem->h[k], c = 0.0;
        if (k == last - 1) {
            c = problem->gain[k].kx[0] * x + problem->gain[k].ku[0] * u;
        }
        problem->c[0][k] = problem->c[1][k] = c;
        if (k == last) {
            break;
        }
        x += 2.0 * h * u + h * h * c;
        u += h * c;
    }
    for (int k = problem->first; k < problem->n; k++) {
        problem->grad.x[k] =
            problem->cost.xx[k] * (problem->x[k] - problem->guess[k]);
        problem->grad.u[k] = problem->cost.uu[k] * problem->u[k];
        for (int i = 0; i < 2; i++) {
            problem->grad.c[i][k] =
                problem->cost.cc[2 * i][k] * problem->c[i][k];
        }
    }
    riccati_solve(problem, &problem->grad);
    for (int k = problem->first; k < problem->n; k++) {
        problem->x[k] += problem->dx[k];
        problem->u[k] += problem->du[k];
        for (int i = 0; i < 2; i++) {
            problem->c[i][k] += problem->dc[i][k];
        }
    }
    if (problem->rest_start) {
        problem->x[0] = problem->u[0] = problem->c[0][0] = problem->c[1][0] =
            0.0;
    }
    return true;
}

/* A window that starts while it brakes: from there the speed cannot be above
 * what all of the jerk makes of it. */
static void keep_reachable(const jerk_planner *planner,
                           const struct grid *grid,
                           double *x) {
    double at = planner->x, u = planner->u;
    if (grid->rest_start || u >= 0.0) {
        return;
    }
    for (int k = 0; k < grid->n - 1; k++) {
        double acc, jerk, h = grid->seg[k].h;
        path_limits(planner, &grid->seg[k], &acc, &jerk);
        double next = fmin(acc, u + h * jerk / sqrt(fmax(at, TINY)));
        at = fmax(LEAST_KEPT * at, at + h * (u + next));
        u = next;
        if (at >= x[k + 1]) {
            return;
        }
        x[k + 1] = at;
    }
}

/* Present plan where it reaches, slow profile behind it. */
bool guess_window(jerk_planner *p,
                  const struct grid *g,
                  bool warm,
                  double shrink) {
    struct problem *b = &p->prob;
    slow_profile(p, g, b->guess);
    if (warm && p->plan.next < p->plan.n) {
        plan_x(&p->plan, g, 1.0, p->scratch);
        for (int k = 1; k < g->n; k++) {
            if (p->scratch[k] > b->guess[k]) {
                b->guess[k] =
                    fmin(p->scratch[k],
                         fmax(b->guess[k],
                              fmin(g->seg[k - 1].soft, g->seg[k].soft)));
            }
        }
    }
    for (int k = 1; k < g->n && g->from_start[k] < g->land_from;
         k++) { /* down to the feed, softly at both ends */
        double t = g->from_start[k] / g->land_from, feed = g->land_cap;
        b->guess[k] =
            feed + fmax(0.0, p->x - feed) * (1.0 - t * t * (3.0 - 2.0 * t));
    }
    keep_reachable(p, g, b->guess);
    for (int k = 1; k < g->n; k++) {
        b->guess[k] *= shrink;
    }
    bound_rows(p, g);
    return project(p, g, STIFFNESS);
}

/* A smooth bump from rest to rest, below all caps, for the fallback. */
bool guess_bump(jerk_planner *p, const struct grid *g) {
    struct problem *b = &p->prob;
    double cap = 1e30, jerk = 1e30;
    easy_caps(p, g, b->guess);
    for (int k = 0; k < g->n; k++) {
        double acc, j;
        path_limits(p, &g->seg[k], &acc, &j);
        jerk = fmin(jerk, j);
        if (k > 0) {
            cap = fmin(cap, b->guess[k]);
        }
    }
    for (int k = 1; k < g->n; k++) {
        double up = from_rest(g->from_start[k], EASY_JERK * jerk),
               down = from_rest(g->from_start[g->n] - g->from_start[k],
                                EASY_JERK * jerk);
        b->guess[k] = 1.0 / (1.0 / up + 1.0 / down + 1.0 / cap);
    }
    b->guess[0] = b->guess[g->n] = 0.0;
    bound_rows(p, g);
    return project(p, g, STIFFNESS);
}

/* From a profile over the same grid. */
bool guess_from(jerk_planner *p, const struct grid *g, const double *x) {
    struct problem *b = &p->prob;
    for (int k = 0; k <= g->n; k++) {
        b->guess[k] = fmax(TINY, x[k]);
    }
    b->guess[g->n] = 0.0;
    bound_rows(p, g);
    return project(p, g, 0.2 * STIFFNESS);
}

/* A stop from the present state over the whole grid. */
bool guess_stop(jerk_planner *p, const struct grid *g) {
    struct problem *b = &p->prob;
    double d = g->from_start[g->n],
           beta =
               fmin(4.0,
                    fmax(0.0, 2.0 * p->u * d / fmax(p->x, 1e-12) + 4.0 / 3.0));
    b->guess[0] = p->x;
    for (int k = 1; k < g->n; k++) {
        double t = g->from_start[k] / d;
        double cap =
            fmin(g->knot_cap[k], fmin(g->seg[k - 1].soft, g->seg[k].soft));
        b->guess[k] =
            fmax(TINY,
                 fmin(cap, p->x * pow(1.0 - t, 4.0 / 3.0) * (1.0 + beta * t)));
    }
    b->guess[g->n] = 0.0;
    bound_rows(p, g);
    return project(p, g, STIFFNESS);
}

/* A stop as the plan's over another length: its speeds at the same share of the
 * way. */
bool guess_stop_like(jerk_planner *p, const struct grid *g, double length) {
    struct problem *b = &p->prob;
    plan_x(&p->plan, g, length / g->from_start[g->n], p->scratch);
    b->guess[0] = p->x;
    for (int k = 1; k < g->n; k++) {
        b->guess[k] =
            fmax(TINY,
                 fmin(p->scratch[k],
                      fmin(g->knot_cap[k],
                           fmin(g->seg[k - 1].soft, g->seg[k].soft))));
    }
    b->guess[g->n] = 0.0;
    bound_rows(p, g);
    return project(p, g, STIFFNESS);
}
