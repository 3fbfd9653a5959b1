/* The checker: what the planner hands out is recomputed here, from the path as
 * it was pushed and in plain units.  The code is included once per instruction
 * set (CHECKER names its functions); the results do not depend on it.
 *
 * It integrates the accelerations again, evaluates the true limits of every
 * axis at both ends and at places inside each interval, LANES of them at a
 * time, and looks for minima of speed.  Nothing of the planner's rows is used.
 * The one thing that it changes of a plan is the bow of an interval that would
 * not be legal without.
 */
#include "jerk/window/bow.h"
#include "jerk/window/ratios.h"
#include "jerk/window/verify.h"
#include "maths/order.h"

/* Between the points that have rows the path may bend otherwise than the rows
 * know: it is looked at in more places where the third derivative changes much
 * over the interval. */
static bool bends_unevenly(const view *view) {
    double change = 0.0;
    double most = 0.0;
    for (int n = 0; n < view->count; n++) {
        double first = view->interval->d3[0][view->axis[n]];
        double last = view->interval->d3[1][view->axis[n]];
        change = greater(change, fabs(last - first));
        most = greater(most, larger(first, last));
    }
    return change > 0.2 * most;
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
    int parts = bends_unevenly(&view) ? 12 : 6;
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

/* How much larger than at the ends it is inside an interval; ends far below the
 * rest say nothing. */
static double bulge(double most, double ends) {
    return most > 0.0 ? most / greater(ends, 0.8 * most) : 1.0;
}

/* The bow that the look at an interval asks for; false: it is as good as it is.
 */
static bool other_bow(const view *view,
                      const struct segment *segment,
                      const look *seen,
                      double *bow) {
    double bent = bow_for(view, seen, *segment->tight, *bow);
    if (bent == *bow || !isfinite(bent)) {
        return false;
    }
    *bow = bent;
    return true;
}

/* For the planner, ahead of a check: largest ratio of the interval; `*more`: by
 * what it is more than at the ends. With another bow the jerk is that of the
 * law all but exactly. */
double CHECKER(bend_inside)(const jerk_planner *planner,
                            const struct segment *segment,
                            double x,
                            double accel,
                            const double input[2],
                            double *bow,
                            double *more) {
    const view view = view_of(planner, segment);
    const double before = *bow;
    const jerk_law law = law_of(segment->length, &x, &accel, input, *bow);
    look seen;
    look_at(&view, &law, &seen);
    if (other_bow(&view, segment, &seen, bow)) {
        bend_look(&seen, *bow - before);
    }
    double ends = ends_ratio(&view, &seen);
    double most = greater(inside_ratio(&view, &seen), ends);
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
        lesser(grid->seg[k].soft / grid->seg[k].slower, grid->seg[k].cap) * f2;
    double most = k == 0 ? greater(x1, lesser(top_x, x1))
                         : greater(top_x, greater(x0, x1));
    return isfinite(most) ? sqrt(most / cap) * CHECK_SLACK / FEED_SLACK
                          : INFINITY;
}

static double acceleration(const jerk_law *law, double t) {
    double snap = law->snap / 2.0;
    double rest = law->crackle * PER_6 + t * (law->pop * PER_24);
    return law->a0 + t * (law->jerk + t * (snap + t * rest));
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

/* What an interval does under a law. */
typedef struct driven {
    double ends, limits; /* largest ratios: at its ends, anywhere */
    double low, top_x;   /* squared speeds */
} driven;

/* Largest acceleration over its limit, of the places that were looked at. */
static double most_acceleration(const view *view, const look *seen) {
    vec most = set1(0.0);
    for (int n = 0; n < view->count; n++) {
        vec ends = seen->ends.d1[n] * seen->at_ends.a
                   + seen->ends.d2[n] * seen->at_ends.v * seen->at_ends.v;
        vec inside = seen->inside.d1[n] * seen->within.a
                     + seen->inside.d2[n] * seen->within.v * seen->within.v;
        most = vmax(most, vmax(size_of(ends), size_of(inside)) * view->acc[n]);
    }
    return largest(most);
}

/* Whether the path jerk changes its sign: an acceleration near its limit may be
 * above it between the places that were looked at. */
static bool swings(const view *view, const look *seen) {
    vec most = vmax(seen->at_ends.j, seen->within.j);
    vec least = vmax(-seen->at_ends.j, -seen->within.j);
    return largest(most) > 0.0 && largest(least) > 0.0
           && most_acceleration(view, seen) > SWING_NEAR;
}

/* Whether the jerk of an axis goes from one limit to the other, or nearly: near
 * an end it may be above it. */
static bool jerk_swings(const view *view, const look *seen) {
    for (int n = 0; n < view->count; n++) {
        vec j = axis_jerk(&seen->ends, n, &seen->at_ends) * view->jerk[n];
        if (j[0] * j[1] < -SWING_JERK * SWING_JERK) {
            return true;
        }
    }
    return false;
}

static bool uneven(const view *view, const look *seen, const driven *at) {
    return bends_unevenly(view) || at->low < UNEVEN_SPEEDS * at->top_x
           || swings(view, seen) || jerk_swings(view, seen);
}

/* `x0`, `x1`: squared speeds at its ends. */
static driven drive(const view *view,
                    const jerk_law *law,
                    const look *seen,
                    double x0,
                    double x1) {
    double turns[TURN_PARTS];
    driven out = {.low = lesser(x0, x1), .top_x = greater(x0, x1)};
    out.ends = ends_ratio(view, seen);
    out.limits = greater(inside_ratio(view, seen), out.ends);
    if (uneven(view, seen, &out)) {
        out.limits =
            greater(out.limits, ratio_at_parts(view, law, UNEVEN_PARTS));
    }
    for (int i = turning_points(law, turns) - 1; i >= 0; i--) {
        vec s, t = set1(turns[i]);
        double v = motion_at(law, &t, &s).v[0];
        if (v * v > out.top_x) {
            out.limits = greater(out.limits, ratio_at_times(view, law, &t));
        }
        out.top_x = greater(out.top_x, v * v);
        out.low = v > 0.0 ? lesser(out.low, v * v) : 0.0;
    }
    return out;
}

static bool is_law(const jerk_law *law) {
    return isfinite(law->time + law->snap + law->crackle + law->pop);
}

/* An interval that is not legal may be so with another bow: nothing else of the
 * plan changes by it. `at`, `x1`: x and u at its start, x at its end. */
static void bend_to_fit(const view *view,
                        const struct segment *segment,
                        const double at[2],
                        double x1,
                        const double input[2],
                        look *seen,
                        driven *driven,
                        double *bow) {
    double x = at[0];
    double accel = at[1];
    double bent = *bow;
    if (!other_bow(view, segment, seen, &bent)) {
        return;
    }
    const jerk_law law = law_of(segment->length, &x, &accel, input, bent);
    if (!is_law(&law)) {
        return;
    }
    look_at(view, &law, seen);
    const struct driven then = drive(view, &law, seen, at[0], x1);
    if (then.limits <= CHECK_SLACK) {
        *driven = then;
        *bow = bent;
    }
}

/* Largest ratio of an acceleration to its limit; 0 where it is small enough. */
static double heavy_ratio(const view *view, const jerk_law *law) {
    vec most = set1(0.0);
    for (int k = 0; k <= UNEVEN_PARTS; k += LANES) {
        vec t = law->time * parts_from(k, UNEVEN_PARTS, UNEVEN_PARTS);
        vec s;
        bends at;
        const motion motion = motion_at(law, &t, &s);
        s = s * view->per_length;
        bends_inside(view, &s, &at);
        for (int n = 0; n < view->count; n++) {
            vec v2 = motion.v * motion.v;
            vec acc = at.d1[n] * motion.a + at.d2[n] * v2;
            most = vmax(most, size_of(acc) * view->acc[n]);
        }
    }
    double ratio = largest(most);
    return ratio > CHECK_SLACK ? ratio : 0.0;
}

/* One interval with free inputs; x, u advance. */
static double free_ratio(const jerk_planner *planner,
                         struct grid *grid,
                         int k,
                         double *x,
                         double *accel,
                         const double input[2],
                         double *bow) {
    struct segment *segment = &grid->seg[k];
    const double at[2] = {*x, *accel};
    const jerk_law law = law_of(segment->length, x, accel, input, *bow);
    double x1 = *x;
    if (!(lesser(at[0], x1) > LEAST_DIP * greater(at[0], x1))
        || !is_law(&law)) {
        return INFINITY;
    }
    const view view = view_of(planner, segment);
    look seen;
    look_at(&view, &law, &seen);
    driven driven = drive(&view, &law, &seen, at[0], x1);
    if (driven.limits > CHECK_SLACK) {
        bend_to_fit(&view, segment, at, x1, input, &seen, &driven, bow);
    }
    segment->bulge = bulge(driven.limits, driven.ends);
    if (!(driven.low > LEAST_DIP * driven.top_x)) {
        return INFINITY;
    }
    double limits = driven.limits;
    double feed = feed_ratio(planner, grid, k, at[0], x1, driven.top_x);
    segment->excess = limits > CHECK_SLACK ? limits : 0.0;
    segment->heavy = limits > CHECK_SLACK ? heavy_ratio(&view, &law) : 0.0;
    segment->fast = feed > CHECK_SLACK ? feed : 0.0;
    return greater(limits, feed);
}

/* What jumps at knot k shows in samples up to one and a half cycles away: the
 * intervals so near, from `first` on; returns the last one. */
static int shown_until(const jerk_planner *planner,
                       const struct grid *grid,
                       int k,
                       double v,
                       int *first) {
    const double *from = grid->from_start;
    double reach = 1.5 * planner->cfg.cycle_s * v;
    int i = k - 1;
    int end = k;
    while (i > 0 && from[k] - from[i] < reach) {
        i--;
    }
    while (end < grid->count - 1 && from[end + 1] - from[k] < reach) {
        end++;
    }
    *first = i;
    return end;
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
    double share = 0.0;
    int first;
    if (!grid->seg[k - 1].last) {
        return 0.0;
    }
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        double turn = fabs(turn_of(left, right, axis));
        double bend = 0.75 * fabs(bend_of(left, right, axis)) * x / dt;
        double kink = 0.75 * turn * fabs(accel) / dt;
        if (kink > 0.0) {
            most = greater(most,
                           (bend + turn * sqrt(x) / (dt * dt) + kink)
                               / least_jerk(planner, left, right, axis));
        }
    }
    int end = shown_until(planner, grid, k, sqrt(x), &first);
    for (int i = first; i <= end; i++) {
        share = greater(share, grid->seg[i].share);
    }
    if (most + share <= CHECK_SLACK) {
        return most + share;
    }
    for (int i = first; i <= end; i++) {
        grid->seg[i].leave = greater(grid->seg[i].leave, most);
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
    double room = 1.0 - lesser(segment[-1].jump, segment->jump);
    double used = 0.0;
    if (!grid->seg[k - 1].last) {
        return true;
    }
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        double bend = 0.75 * fabs(bend_of(left, right, axis)) * x / dt;
        double turn = fabs(turn_of(left, right, axis));
        double corner = turn * sqrt(x) / (dt * dt);
        used =
            greater(used,
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
        worst = greater(standstill_ratio(planner, &grid->seg[0], sqrt(x), 1.0),
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
            worst = greater(worst, kink_ratio(planner, grid, k, x, accel));
        }
        if (k == last - 1) {
            problem->input[0][k] = problem->input[1][k] =
                last_input(grid, x, accel) / f2;
        }
        const double input[2] = {problem->input[0][k] * f2,
                                 problem->input[1][k] * f2};
        double bow = problem->bow[k] * f2;
        double ratio = free_ratio(planner, grid, k, &x, &accel, input, &bow);
        problem->bow[k] = grid->seg[k].bow = bow / f2;
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
    worst = greater(worst, kink_ratio(planner, grid, last, x, accel));
    problem->x[last] = x / f2;
    problem->accel[last] = accel / f2;
    problem->x[grid->count] = 0.0;
    problem->accel[grid->count] = 0.0;
    problem->input[0][last] = 0.0;
    problem->input[1][last] = 0.0;
    worst = greater(worst, feed_ratio(planner, grid, last, x, 0.0, x));
    double standing =
        standstill_ratio(planner, &grid->seg[last], sqrt(x), -1.0);
    return greater(worst, standing);
}
