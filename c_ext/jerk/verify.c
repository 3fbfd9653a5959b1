/* The checker: what the planner hands out is recomputed here, from the path as
 * it was pushed and in plain units.
 *
 * It integrates the accelerations again, evaluates the true limits of every
 * axis at both ends and in the middle of each interval, and looks for minima of
 * speed inside.  Nothing of the planner's rows is used.
 */
#include <math.h>
#include <stddef.h>
#include "jerk/state.h"

#define JUMP_SLACK 1.01
#define SMALL_JUMPS 5e-3 /* share of the jerk limit */
#define TURN_PARTS                                                             \
    4 /* parts of an interval in each of which the acceleration is taken to    \
         change its sign once at most */
#define TURN_STEPS 4
#define LEAST_DIP 1e-4 /* smallest x inside an interval, over the largest */

typedef struct motion {
    double v, a, j; /* along the path */
} motion;

/* Largest ratio of an axis value to its limit at derivatives d1, d2, d3;
 * `miss`: what d3 may be more (NULL: it is exact). */
static double ratio_at(const jerk_planner *planner,
                       const struct segment *segment,
                       const double *d1,
                       const double *d2,
                       const double *d3,
                       const float *miss,
                       struct motion motion) {
    const jerk_interval *interval = segment->q;
    double worst = 0.0, v2 = motion.v * motion.v;
    if (!isfinite(motion.v + motion.a + motion.j)) {
        return INFINITY;
    }
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        if (d1[axis] == 0.0 && d2[axis] == 0.0 && d3[axis] == 0.0) {
            continue; /* it rests */
        }
        double v = fabs(d1[axis]) * motion.v / planner->cfg.v_max[axis];
        double acc = fabs(d1[axis] * motion.a + d2[axis] * v2)
                     / (acc_max(planner, interval, axis) * segment->acc[axis]);
        double jerk =
            (fabs(motion.v * (d3[axis] * v2 + 3.0 * d2[axis] * motion.a)
                  + d1[axis] * motion.j)
             + (miss ? (double)miss[axis] * v2 * motion.v : 0.0))
            / (jerk_max(planner, interval, axis) * segment->jump);
        if (!isfinite(v + acc + jerk)) {
            return INFINITY;
        }
        if (v > worst) {
            worst = v;
        }
        if (acc > worst) {
            worst = acc;
        }
        if (jerk > worst) {
            worst = jerk;
        }
    }
    return worst;
}

/* The derivatives at the share t of the interval: the polynomial of degree 5
 * for the tangent that meets the tangent and its two derivatives at both ends,
 * in Hermite's basis. */
static void derivatives_at(const jerk_interval *interval,
                           double t,
                           int axes,
                           double *d1,
                           double *d2,
                           double *d3) {
    double h = interval->length, r = 1.0 - t, t2 = t * t, r2 = r * r;
    double s1 = r2 * r * (1.0 + 3.0 * t + 6.0 * t2),
           s2 = h * r2 * r * t * (1.0 + 3.0 * t),
           s3 = 0.5 * h * h * r2 * r * t2;
    double e2 = -h * t2 * t * r * (1.0 + 3.0 * r),
           e3 = 0.5 * h * h * t2 * t * r2;
    double first = -30.0 * t2 * r2 / h, b2 = r2 * (1.0 + 2.0 * t - 15.0 * t2),
           b3 = 0.5 * h * t * r2 * (2.0 - 5.0 * t);
    double f2 = t2 * (1.0 + 2.0 * r - 15.0 * r2),
           f3 = -0.5 * h * r * t2 * (2.0 - 5.0 * r);
    double second = -60.0 * t * r * (1.0 - 2.0 * t) / (h * h),
           g2 = -12.0 * t * r * (3.0 - 5.0 * t) / h,
           g3 = r * (1.0 - 8.0 * t + 10.0 * t2);
    double k2 = 12.0 * t * r * (3.0 - 5.0 * r) / h,
           k3 = t * (1.0 - 8.0 * r + 10.0 * r2);
    for (int i = 0; i < axes; i++) {
        double p0 = interval->d1[0][i], p1 = interval->d1[1][i],
               v0 = interval->d2[0][i], v1 = interval->d2[1][i],
               w0 = interval->d3[0][i], w1 = interval->d3[1][i];
        d1[i] =
            s1 * p0 + s2 * v0 + s3 * w0 + (1.0 - s1) * p1 + e2 * v1 + e3 * w1;
        d2[i] = first * (p0 - p1) + b2 * v0 + b3 * w0 + f2 * v1 + f3 * w1;
        d3[i] = second * (p0 - p1) + g2 * v0 + g3 * w0 + k2 * v1 + k3 * w1;
    }
}

static double ratio_inside(const jerk_planner *planner,
                           const struct segment *segment,
                           double t,
                           struct motion motion) {
    double d1[JERK_AXES], d2[JERK_AXES], d3[JERK_AXES];
    derivatives_at(segment->q, t, planner->cfg.axes, d1, d2, d3);
    return ratio_at(planner, segment, d1, d2, d3, segment->q->miss, motion);
}

static double ratio_at_end(const jerk_planner *planner,
                           const struct segment *segment,
                           int end,
                           struct motion motion) {
    return ratio_at(planner,
                    segment,
                    segment->q->d1[end],
                    segment->q->d2[end],
                    segment->q->d3[end],
                    NULL,
                    motion);
}

/* Constant path jerk over the interval h with the speed v at the moving end;
 * `sign` -1: it ends at rest. */
static double rest_ratio(const jerk_planner *planner,
                         const struct segment *segment,
                         double v,
                         double sign) {
    double t = 3.0 * segment->h / v, j = 2.0 * v / (t * t);
    double tm = t * cbrt(0.5), vm = 0.5 * j * tm * tm;
    struct motion at = {v, sign * j * t, j}, mid = {vm, sign * j * tm, j};
    double worst = fmax(ratio_at_end(planner, segment, sign > 0, at),
                        ratio_inside(planner, segment, 0.5, mid));
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        worst =
            fmax(worst,
                 fabs(segment->q->d1[sign > 0 ? 0 : 1][axis]) * j
                     / (jerk_max(planner, segment->q, axis) * segment->jump));
    }
    return worst;
}

/* The motion of a law that begins at 0 at the time t; `s` gets the place. */
static struct motion motion_at(const jerk_law *law, double t, double *s) {
    jerk_state at;
    jerk_at(law, t, &at);
    *s = at.s;
    return (struct motion){at.v, at.a, law_jerk(law, t)};
}

static double ratio_at_time(const jerk_planner *planner,
                            const struct segment *segment,
                            const jerk_law *law,
                            double t) {
    double at;
    const struct motion motion = motion_at(law, t, &at);
    return ratio_inside(planner, segment, at / segment->h, motion);
}

static double ends_ratio(const jerk_planner *planner,
                         const struct segment *segment,
                         const jerk_law *law) {
    double at;
    return fmax(
        ratio_at_end(planner, segment, 0, motion_at(law, 0.0, &at)),
        ratio_at_end(planner, segment, 1, motion_at(law, law->time, &at)));
}

/* Parts of the time at which it is looked at: more of them where the third
 * derivative changes much over the interval. */
static int points_inside(const jerk_planner *planner,
                         const jerk_interval *interval) {
    double change = 0.0, most = 0.0;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        change =
            fmax(change, fabs(interval->d3[1][axis] - interval->d3[0][axis]));
        most = fmax(
            most,
            fmax(fabs(interval->d3[0][axis]), fabs(interval->d3[1][axis])));
    }
    return change > 0.2 * most ? 12 : 6;
}

/* Between the points that have rows the path may bend otherwise than the rows
 * know. */
static double inside_ratio(const jerk_planner *planner,
                           const struct segment *segment,
                           const jerk_law *law) {
    double worst = 0.0;
    int count = points_inside(planner, segment->q);
    for (int k = 1; k < count; k++) {
        if (2 * k != count) {
            worst = fmax(
                worst,
                ratio_at_time(planner,
                              segment,
                              law,
                              law->time * k
                                  / count)); /* the middle has been looked at */
        }
    }
    return worst;
}

/* The law over an interval h with the inputs c; x, u: at its end. */
static jerk_law law_of(double h, double *x, double *u, const double c[2]) {
    double x0 = *x, u0 = *u;
    jerk_law law = {0};
    *x = x_behind(h, x0, u0, c[0], c[1]);
    *u = u_behind(h, u0, c[0], c[1]);
    double v0 = sqrt(x0), v1 = sqrt(*x);
    law_between(&law, h, v0, u0, c[0] * v0, v1, *u, c[1] * v1);
    return law;
}

/* How much larger than at the ends it is inside an interval; ends far below the
 * rest say nothing. */
static double bulge(double most, double ends) {
    return most > 0.0 ? most / fmax(ends, 0.8 * most) : 1.0;
}

/* For the planner, ahead of a check: largest ratio of the interval; `*more`: by
 * what it is more than at the ends. */
double bend_inside(const jerk_planner *planner,
                   const struct segment *segment,
                   double x,
                   double u,
                   const double c[2],
                   double *more) {
    const jerk_law law = law_of(segment->h, &x, &u, c);
    double ends = ends_ratio(planner, segment, &law),
           most =
               fmax(ends,
                    fmax(ratio_at_time(planner, segment, &law, 0.5 * law.time),
                         inside_ratio(planner, segment, &law)));
    *more = bulge(most, ends);
    return most;
}

/* Largest speed over its cap: the feed or what was allowed on the way down to
 * it. */
static double feed_ratio(const jerk_planner *planner,
                         const struct grid *grid,
                         int k,
                         double x0,
                         double x1,
                         double top_x) {
    double f2 = planner->scale * planner->scale,
           cap = fmin(grid->seg[k].soft / grid->seg[k].slower, grid->seg[k].cap)
                 * f2;
    double most =
        k == 0 ? fmax(x1, fmin(top_x, x1)) : fmax(top_x, fmax(x0, x1));
    return isfinite(most) ? sqrt(most / cap) * CHECK_SLACK / FEED_SLACK
                          : INFINITY;
}

static double acceleration(const jerk_law *law, double t) {
    return law->a0
           + t
                 * (law->jerk
                    + t
                          * (law->snap / 2.0
                             + t * (law->crackle / 6.0 + t * law->pop / 24.0)));
}

/* Times in the law at which the acceleration changes its sign: how many. */
static int turning_points(const jerk_law *law, double t[TURN_PARTS]) {
    double from = law->a0;
    int count = 0;
    for (int i = 1; i <= TURN_PARTS; i++) {
        double low = law->time * (i - 1) / TURN_PARTS,
               high = law->time * i / TURN_PARTS, a0 = from,
               a1 = acceleration(law, high);
        from = a1;
        if (!(a0 * a1 < 0.0)) {
            continue;
        }
        t[count] = low;
        for (int k = 0; k < TURN_STEPS; k++) { /* secants, inside the bracket */
            t[count] = (low * a1 - high * a0) / (a1 - a0);
            double a = acceleration(law, t[count]);
            if (a * a0 > 0.0) {
                low = t[count], a0 = a;
            } else {
                high = t[count], a1 = a;
            }
            if (a == 0.0) {
                break;
            }
        }
        count++;
    }
    return count;
}

/* One interval with free inputs; x, u advance. */
static double free_ratio(const jerk_planner *planner,
                         struct grid *grid,
                         int k,
                         double *x,
                         double *u,
                         const double c[2]) {
    struct segment *segment = &grid->seg[k];
    double x0 = *x, at, turns[TURN_PARTS];
    const jerk_law law = law_of(segment->h, x, u, c);
    double x1 = *x, top_x = fmax(x0, x1), low = fmin(x0, x1);
    if (!(low > LEAST_DIP * top_x)
        || !isfinite(law.time + law.snap + law.crackle + law.pop)) {
        return INFINITY;
    }
    double ends = ends_ratio(planner, segment, &law),
           limits = fmax(ends,
                         ratio_at_time(planner, segment, &law, 0.5 * law.time));
    limits = fmax(limits, inside_ratio(planner, segment, &law));
    segment->bulge = bulge(limits, ends);
    for (int i = turning_points(&law, turns) - 1; i >= 0; i--) {
        double v = motion_at(&law, turns[i], &at).v;
        if (v * v > top_x) {
            limits =
                fmax(limits, ratio_at_time(planner, segment, &law, turns[i]));
        }
        top_x = fmax(top_x, v * v);
        low = v > 0.0 ? fmin(low, v * v) : 0.0;
    }
    if (!(low > LEAST_DIP * top_x)) {
        return INFINITY;
    }
    double feed = feed_ratio(planner, grid, k, x0, x1, top_x);
    segment->excess = limits > CHECK_SLACK ? limits : 0.0;
    segment->fast = feed > CHECK_SLACK ? feed : 0.0;
    return fmax(limits, feed);
}

/* Where the direction jumps, an acceleration u along the path jumps with it:
 * that shows beside what the intervals around knot k are planned with. Larger
 * than the bound: they must leave more. */
static double kink_ratio(const jerk_planner *planner,
                         struct grid *grid,
                         int k,
                         double x,
                         double u) {
    const jerk_interval *interval = grid->seg[k - 1].q,
                        *interval_r = grid->seg[k].q;
    double dt = planner->cfg.cycle_s, most = 0.0,
           share = fmax(grid->seg[k - 1].share, grid->seg[k].share);
    if (!grid->seg[k - 1].last) {
        return 0.0;
    }
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        double turn = fabs(interval_r->d1[0][axis] - interval->d1[1][axis]),
               bend = 0.75
                      * fabs(interval_r->d2[0][axis] - interval->d2[1][axis])
                      * x / dt;
        double kink = 0.75 * turn * fabs(u) / dt;
        if (kink > 0.0) {
            most = fmax(most,
                        (bend + turn * sqrt(x) / (dt * dt) + kink)
                            / fmin(jerk_max(planner, interval, axis),
                                   jerk_max(planner, interval_r, axis)));
        }
    }
    if (most + share <= CHECK_SLACK) {
        return most + share;
    }
    for (int i = k - 1; i <= k; i++) {
        grid->seg[i].leave = fmax(grid->seg[i].leave, most);
    }
    return most + share;
}

/* Jumps of q' and q'' at knot k, as samples show them, against the share that
 * the intervals around it leave. */
static bool jump_fits(const jerk_planner *planner,
                      const struct grid *grid,
                      int k,
                      double x) {
    const jerk_interval *interval = grid->seg[k - 1].q,
                        *interval_r = grid->seg[k].q;
    double dt = planner->cfg.cycle_s,
           room = 1.0 - fmin(grid->seg[k - 1].jump, grid->seg[k].jump),
           used = 0.0;
    if (!grid->seg[k - 1].last) {
        return true;
    }
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        double bend = 0.75
                      * fabs(interval_r->d2[0][axis] - interval->d2[1][axis])
                      * x / dt,
               corner = fabs(interval_r->d1[0][axis] - interval->d1[1][axis])
                        * sqrt(x) / (dt * dt);
        used = fmax(used,
                    (bend + corner)
                        / fmin(jerk_max(planner, interval, axis),
                               jerk_max(planner, interval_r, axis)));
    }
    return used <= room * JUMP_SLACK + SMALL_JUMPS;
}

/* The input that meets the rest interval exactly: what the way there has
 * gathered in rounding ends here. */
static double last_input(const struct grid *grid, double x, double u) {
    double h = grid->seg[grid->n - 2].h, t = 1.5 * grid->seg[grid->n - 1].h;
    return -(x + (2.0 * h + t) * u) / (h * (h + t));
}

/* Largest ratio of anything to its limit over the plan (infinite: no plan at
 * all).  On the way x and u of the problem are replaced by what the inputs
 * integrate to. */
double plan_check(const jerk_planner *planner,
                  struct grid *grid,
                  struct problem *problem) {
    double f2 = planner->scale * planner->scale, worst = 0.0,
           x = problem->x0 * f2, u = problem->u0 * f2;
    int last = grid->n - 1, k = 0;
    if (grid->n < (grid->rest_start ? 3 : 2)) {
        return INFINITY;
    }
    if (grid->rest_start) {
        u = problem->u[1] * f2;
        x = 1.5 * grid->seg[0].h * u;
        if (!(x > 0.0)) {
            return INFINITY;
        }
        worst = fmax(rest_ratio(planner, &grid->seg[0], sqrt(x), 1.0),
                     feed_ratio(planner, grid, 0, 0.0, x, x));
        problem->x[0] = problem->u[0] = problem->c[0][0] = problem->c[1][0] =
            0.0;
        k = 1;
    }
    for (; k < last; k++) {
        problem->x[k] = x / f2;
        problem->u[k] = u / f2;
        if (k > 0 && !jump_fits(planner, grid, k, x)) {
            return INFINITY;
        }
        if (k > 0) {
            worst = fmax(worst, kink_ratio(planner, grid, k, x, u));
        }
        if (k == last - 1) {
            problem->c[0][k] = problem->c[1][k] = last_input(grid, x, u) / f2;
        }
        const double c[2] = {problem->c[0][k] * f2, problem->c[1][k] * f2};
        double ratio = free_ratio(planner, grid, k, &x, &u, c);
        if (!(ratio <= worst)) {
            worst = ratio;
        }
        if (!isfinite(worst)) {
            return INFINITY;
        }
    }
    double meet = 1.5 * grid->seg[last].h * -u;
    if (!(x > 0.0) || !(fabs(x - meet) <= 1e-6 * x)) {
        return INFINITY;
    }
    if (!jump_fits(planner, grid, last, x)) {
        return INFINITY;
    }
    worst = fmax(worst, kink_ratio(planner, grid, last, x, u));
    problem->x[last] = x / f2;
    problem->u[last] = u / f2;
    problem->x[grid->n] = problem->u[grid->n] = problem->c[0][last] =
        problem->c[1][last] = 0.0;
    worst = fmax(worst, feed_ratio(planner, grid, last, x, 0.0, x));
    return fmax(worst, rest_ratio(planner, &grid->seg[last], sqrt(x), -1.0));
}
