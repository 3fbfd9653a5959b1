/* The checker: what the planner hands out is recomputed here, from the path as
 * it was pushed and in plain units.  The code is included once per instruction
 * set (CHECKER names its functions); the results do not depend on it.
 *
 * It integrates the accelerations again, evaluates the true limits of every
 * axis at both ends and at places inside each interval, LANES of them at a
 * time, and looks for minima of speed.  Nothing of the planner's rows is used.
 */
#include <math.h>
#include <stddef.h>
#include "jerk/path/motion_law.h"
#include "jerk/solver/vectors.h"
#include "jerk/state/state.h"
#include "jerk/window/verify.h"

/* Speed, acceleration and jerk along the path. */
typedef struct motion {
    vec v, a, j;
} motion;

/* What is looked at over an interval: its axes that move, and 1 over their
 * limits. */
typedef struct view {
    const jerk_interval *interval;
    double length;
    int count;
    int axis[JERK_AXES];
    double v[JERK_AXES], acc[JERK_AXES], jerk[JERK_AXES];
} view;

/* Derivatives of the axes of a view. */
typedef struct bends {
    vec d1[JERK_AXES], d2[JERK_AXES], d3[JERK_AXES];
} bends;

static bool rests(const jerk_interval *interval, int axis) {
    double sum = 0.0;
    for (int end = 0; end < 2; end++) {
        sum += fabs(interval->d1[end][axis]);
        sum += fabs(interval->d2[end][axis]);
        sum += fabs(interval->d3[end][axis]);
    }
    return sum == 0.0;
}

static view view_of(const jerk_planner *planner,
                    const struct segment *segment) {
    const jerk_interval *interval = segment->interval;
    view out = {.interval = interval, .length = segment->length};
    for (int i = 0; i < planner->cfg.axes; i++) {
        if (rests(interval, i)) {
            continue;
        }
        int n = out.count++;
        out.axis[n] = i;
        out.v[n] = 1.0 / planner->cfg.v_max[i];
        double acc = acc_max(planner, interval, i) * segment->acc[i];
        double jerk = jerk_max(planner, interval, i) * segment->jump;
        out.acc[n] = 1.0 / acc;
        out.jerk[n] = 1.0 / jerk;
    }
    return out;
}

/* Largest ratio of an axis value to its limit; `inside`: d3 may be more by what
 * the interval says. */
static double ratio_at(const view *view,
                       const bends *at,
                       bool inside,
                       const motion *motion) {
    vec worst = set1(0.0);
    vec all = motion->v + motion->a + motion->j;
    vec v2 = motion->v * motion->v;
    vec v3 = inside ? v2 * motion->v : set1(0.0);
    for (int n = 0; n < view->count; n++) {
        double miss = (double)view->interval->miss[view->axis[n]];
        vec bend = at->d3[n] * v2 + 3.0 * at->d2[n] * motion->a;
        vec v = size_of(at->d1[n]) * motion->v * view->v[n];
        vec a = at->d1[n] * motion->a + at->d2[n] * v2;
        vec j = motion->v * bend + at->d1[n] * motion->j;
        vec acc = size_of(a) * view->acc[n];
        vec jerk = (size_of(j) + miss * v3) * view->jerk[n];
        all += v + acc + jerk;
        worst = vmax(v, worst);
        worst = vmax(acc, worst);
        worst = vmax(jerk, worst);
    }
    return isfinite(sum(all)) ? largest(worst) : INFINITY;
}

/* The derivatives at the shares t of the interval: the polynomial of degree 5
 * for the tangent that meets the tangent and its two derivatives at both ends,
 * in Hermite's basis. */
static void bends_inside(const view *view, const vec *at, bends *out) {
    const jerk_interval *interval = view->interval;
    vec t = *at;
    double length = interval->length;
    vec left = 1.0 - t;
    vec t2 = t * t;
    vec r2 = left * left;
    vec s1 = r2 * left * (1.0 + 3.0 * t + 6.0 * t2);
    vec s2 = length * r2 * left * t * (1.0 + 3.0 * t);
    vec s3 = 0.5 * length * length * r2 * left * t2;
    vec e2 = -length * t2 * t * left * (1.0 + 3.0 * left);
    vec e3 = 0.5 * length * length * t2 * t * r2;
    vec first = -30.0 * t2 * r2 / length;
    vec b2 = r2 * (1.0 + 2.0 * t - 15.0 * t2);
    vec b3 = 0.5 * length * t * r2 * (2.0 - 5.0 * t);
    vec f2 = t2 * (1.0 + 2.0 * left - 15.0 * r2);
    vec f3 = -0.5 * length * left * t2 * (2.0 - 5.0 * left);
    vec second = -60.0 * t * left * (1.0 - 2.0 * t) / (length * length);
    vec g2 = -12.0 * t * left * (3.0 - 5.0 * t) / length;
    vec g3 = left * (1.0 - 8.0 * t + 10.0 * t2);
    vec k2 = 12.0 * t * left * (3.0 - 5.0 * left) / length;
    vec k3 = t * (1.0 - 8.0 * left + 10.0 * r2);
    for (int n = 0; n < view->count; n++) {
        int i = view->axis[n];
        double p0 = interval->d1[0][i];
        double p1 = interval->d1[1][i];
        double v0 = interval->d2[0][i];
        double v1 = interval->d2[1][i];
        double w0 = interval->d3[0][i];
        double w1 = interval->d3[1][i];
        double turn = p0 - p1;
        out->d1[n] = p1 + s1 * turn + s2 * v0 + s3 * w0 + e2 * v1 + e3 * w1;
        out->d2[n] = first * turn + b2 * v0 + b3 * w0 + f2 * v1 + f3 * w1;
        out->d3[n] = second * turn + g2 * v0 + g3 * w0 + k2 * v1 + k3 * w1;
    }
}

static void bends_at_ends(const view *view, int one, int other, bends *out) {
    const jerk_interval *interval = view->interval;
    for (int n = 0; n < view->count; n++) {
        int i = view->axis[n];
        out->d1[n] = in_turn(interval->d1[one][i], interval->d1[other][i]);
        out->d2[n] = in_turn(interval->d2[one][i], interval->d2[other][i]);
        out->d3[n] = in_turn(interval->d3[one][i], interval->d3[other][i]);
    }
}

static double ratio_inside(const view *view,
                           const vec *t,
                           const motion *motion) {
    bends at;
    bends_inside(view, t, &at);
    return ratio_at(view, &at, true, motion);
}

/* At two ends of the interval (it may be one), in turn. */
static double ratio_at_ends(const view *view,
                            int one,
                            int other,
                            const motion *motion) {
    bends at;
    bends_at_ends(view, one, other, &at);
    return ratio_at(view, &at, false, motion);
}

/* The motion of a law that begins at 0; `s` gets the places.  It is jerk_at()
 * of LANES times: a call for each time would be 7 % of all planning. */
static motion motion_at(const jerk_law *law, const vec *times, vec *s) {
    vec t = *times;
    double j = law->jerk;
    double snap = law->snap;
    double crackle = law->crackle;
    double pop = law->pop;
    vec s5 = snap / 24 + t * (crackle / 120 + t * pop / 720);
    vec s3 = law->a0 / 2 + t * (j / 6 + t * s5);
    vec v3 = snap / 6 + t * (crackle / 24 + t * pop / 120);
    vec a2 = snap / 2 + t * (crackle / 6 + t * pop / 24);
    *s = t * (law->v0 + t * s3);
    return (motion){.v = law->v0 + t * (law->a0 + t * (j / 2 + t * v3)),
                    .a = law->a0 + t * (j + t * a2),
                    .j = j + t * (snap + t * (crackle / 2 + t * pop / 6))};
}

static double ratio_at_times(const view *view,
                             const jerk_law *law,
                             const vec *t) {
    vec s;
    const motion at = motion_at(law, t, &s);
    s = s / view->length;
    return ratio_inside(view, &s, &at);
}

/* The ends of parts k, k + 1 .. `last`, as shares of the whole. */
static inline vec parts_from(int k, int last, int parts) {
    vec out;
    for (int lane = 0; lane < LANES; lane++) {
        out[lane] = k + lane < last ? k + lane : last;
    }
    return out / parts;
}

/* Largest ratio at the ends of so many parts of its time. */
static double ratio_at_parts(const view *view, const jerk_law *law, int parts) {
    double worst = 0.0;
    for (int k = 1; k < parts; k += LANES) {
        vec part = law->time * parts_from(k, parts - 1, parts);
        double ratio = ratio_at_times(view, law, &part);
        worst = ratio > worst ? ratio : worst;
    }
    return worst;
}

static double ends_ratio(const view *view, const jerk_law *law) {
    vec s;
    const vec t = in_turn(0.0, law->time);
    const motion at = motion_at(law, &t, &s);
    return ratio_at_ends(view, 0, 1, &at);
}

/* Between the points that have rows the path may bend otherwise than the rows
 * know: parts of the time at whose ends it is looked at, more of them where the
 * third derivative changes much over the interval. */
static int parts_of_time(const view *view) {
    double change = 0.0;
    double most = 0.0;
    for (int n = 0; n < view->count; n++) {
        double first = view->interval->d3[0][view->axis[n]];
        double last = view->interval->d3[1][view->axis[n]];
        change = fmax(change, fabs(last - first));
        most = fmax(most, larger(first, last));
    }
    return change > 0.2 * most ? 12 : 6;
}

/* Constant path jerk over the interval h with the speed v at the moving end;
 * `sign` -1: it ends at rest. */
static double standstill_ratio(const jerk_planner *planner,
                               const struct segment *segment,
                               double v,
                               double sign) {
    double time = 3.0 * segment->length / v;
    double j = 2.0 * v / (time * time);
    const view view = view_of(planner, segment);
    int parts = parts_of_time(&view);
    double worst = 0.0;
    for (int k = 0; k <= parts; k += LANES) {
        vec share = parts_from(k, parts, parts);
        vec t = time * share;
        vec way = share * share * share;
        vec place = sign > 0.0 ? way : 1.0 - way;
        const motion at = {0.5 * j * t * t, sign * j * t, set1(j)};
        double ratio = ratio_inside(&view, &place, &at);
        worst = ratio > worst ? ratio : worst;
    }
    return worst;
}

/* The law over an interval h with the inputs c; x, u: at its end. */
static jerk_law law_of(double length,
                       double *x,
                       double *accel,
                       const double input[2]) {
    double x0 = *x;
    double u0 = *accel;
    jerk_law law = {0};
    *x = x_after(length, x0, u0, input[0], input[1]);
    *accel = accel_after(length, u0, input[0], input[1]);
    double v0 = sqrt(x0);
    double v1 = sqrt(*x);
    motion_law_between(&law,
                       length,
                       v0,
                       u0,
                       input[0] * v0,
                       v1,
                       *accel,
                       input[1] * v1);
    return law;
}

/* How much larger than at the ends it is inside an interval; ends far below the
 * rest say nothing. */
static double bulge(double most, double ends) {
    return most > 0.0 ? most / fmax(ends, 0.8 * most) : 1.0;
}

/* For the planner, ahead of a check: largest ratio of the interval; `*more`: by
 * what it is more than at the ends. */
double CHECKER(bend_inside)(const jerk_planner *planner,
                            const struct segment *segment,
                            double x,
                            double accel,
                            const double input[2],
                            double *more) {
    const jerk_law law = law_of(segment->length, &x, &accel, input);
    const view view = view_of(planner, segment);
    double ends = ends_ratio(&view, &law);
    double most = fmax(ends, ratio_at_parts(&view, &law, FORESEEN_PARTS));
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
    double f2 = planner->scale * planner->scale;
    double cap =
        fmin(grid->seg[k].soft / grid->seg[k].slower, grid->seg[k].cap) * f2;
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
        double low = law->time * (i - 1) / TURN_PARTS;
        double high = law->time * i / TURN_PARTS;
        double a0 = from;
        double a1 = acceleration(law, high);
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
                         double *accel,
                         const double input[2]) {
    struct segment *segment = &grid->seg[k];
    double x0 = *x;
    double turns[TURN_PARTS];
    const jerk_law law = law_of(segment->length, x, accel, input);
    double x1 = *x;
    double top_x = fmax(x0, x1);
    double low = fmin(x0, x1);
    if (!(low > LEAST_DIP * top_x)
        || !isfinite(law.time + law.snap + law.crackle + law.pop)) {
        return INFINITY;
    }
    const view view = view_of(planner, segment);
    double ends = ends_ratio(&view, &law);
    int parts = parts_of_time(&view);
    double limits = fmax(ends, ratio_at_parts(&view, &law, parts));
    segment->bulge = bulge(limits, ends);
    for (int i = turning_points(&law, turns) - 1; i >= 0; i--) {
        vec s, t = set1(turns[i]);
        double v = motion_at(&law, &t, &s).v[0];
        if (v * v > top_x) {
            limits = fmax(limits, ratio_at_times(&view, &law, &t));
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
                         double accel) {
    const jerk_interval *left = grid->seg[k - 1].interval;
    const jerk_interval *right = grid->seg[k].interval;
    double dt = planner->cfg.cycle_s;
    double most = 0.0;
    const struct segment *segment = &grid->seg[k];
    double share = fmax(segment[-1].share, segment->share);
    if (!grid->seg[k - 1].last) {
        return 0.0;
    }
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        double turn = fabs(turn_of(left, right, axis));
        double bend = 0.75 * fabs(bend_of(left, right, axis)) * x / dt;
        double kink = 0.75 * turn * fabs(accel) / dt;
        if (kink > 0.0) {
            most = fmax(most,
                        (bend + turn * sqrt(x) / (dt * dt) + kink)
                            / least_jerk(planner, left, right, axis));
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
    const jerk_interval *left = grid->seg[k - 1].interval;
    const jerk_interval *right = grid->seg[k].interval;
    double dt = planner->cfg.cycle_s;
    const struct segment *segment = &grid->seg[k];
    double room = 1.0 - fmin(segment[-1].jump, segment->jump);
    double used = 0.0;
    if (!grid->seg[k - 1].last) {
        return true;
    }
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        double bend = 0.75 * fabs(bend_of(left, right, axis)) * x / dt;
        double turn = fabs(turn_of(left, right, axis));
        double corner = turn * sqrt(x) / (dt * dt);
        used = fmax(used,
                    (bend + corner) / least_jerk(planner, left, right, axis));
    }
    return used <= room * JUMP_SLACK + SMALL_JUMPS;
}

/* The input that meets the rest interval exactly: what the way there has
 * gathered in rounding ends here. */
static double last_input(const struct grid *grid, double x, double accel) {
    double length = grid->seg[grid->count - 2].length;
    double t = 1.5 * grid->seg[grid->count - 1].length;
    double way = 2.0 * length + t;
    return -(x + way * accel) / (length * (length + t));
}

/* Largest ratio of anything to its limit over the plan (infinite: no plan at
 * all).  On the way x and u of the problem are replaced by what the inputs
 * integrate to. */
double CHECKER(plan_check)(const jerk_planner *planner,
                           struct grid *grid,
                           struct problem *problem) {
    double f2 = planner->scale * planner->scale;
    double worst = 0.0;
    double x = problem->x0 * f2;
    double accel = problem->u0 * f2;
    int last = grid->count - 1;
    int k = 0;
    if (grid->count < (grid->from_standstill ? 3 : 2)) {
        return INFINITY;
    }
    if (grid->from_standstill) {
        accel = problem->accel[1] * f2;
        x = 1.5 * grid->seg[0].length * accel;
        if (!(x > 0.0)) {
            return INFINITY;
        }
        worst = fmax(standstill_ratio(planner, &grid->seg[0], sqrt(x), 1.0),
                     feed_ratio(planner, grid, 0, 0.0, x, x));
        problem->x[0] = 0.0;
        problem->accel[0] = 0.0;
        problem->input[0][0] = 0.0;
        problem->input[1][0] = 0.0;
        k = 1;
    }
    for (; k < last; k++) {
        problem->x[k] = x / f2;
        problem->accel[k] = accel / f2;
        if (k > 0 && !jump_fits(planner, grid, k, x)) {
            return INFINITY;
        }
        if (k > 0) {
            worst = fmax(worst, kink_ratio(planner, grid, k, x, accel));
        }
        if (k == last - 1) {
            problem->input[0][k] = problem->input[1][k] =
                last_input(grid, x, accel) / f2;
        }
        const double input[2] = {problem->input[0][k] * f2,
                                 problem->input[1][k] * f2};
        double ratio = free_ratio(planner, grid, k, &x, &accel, input);
        if (!(ratio <= worst)) {
            worst = ratio;
        }
        if (!isfinite(worst)) {
            return INFINITY;
        }
    }
    double meet = 1.5 * grid->seg[last].length * -accel;
    bool meets = fabs(x - meet) <= 1e-6 * x;
    if (!(x > 0.0) || !meets) {
        return INFINITY;
    }
    if (!jump_fits(planner, grid, last, x)) {
        return INFINITY;
    }
    worst = fmax(worst, kink_ratio(planner, grid, last, x, accel));
    problem->x[last] = x / f2;
    problem->accel[last] = accel / f2;
    problem->x[grid->count] = 0.0;
    problem->accel[grid->count] = 0.0;
    problem->input[0][last] = 0.0;
    problem->input[1][last] = 0.0;
    worst = fmax(worst, feed_ratio(planner, grid, last, x, 0.0, x));
    double standing =
        standstill_ratio(planner, &grid->seg[last], sqrt(x), -1.0);
    return fmax(worst, standing);
}
