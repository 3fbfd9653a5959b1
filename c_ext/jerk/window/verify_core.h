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
#include "jerk/window/drive.h"
#include "jerk/window/ratios.h"
#include "jerk/window/verify.h"
#include "maths/order.h"

static vec tight_of(const batch *batch) {
    vec out;
    for (int lane = 0; lane < LANES; lane++) {
        out[lane] = *batch->segment[lane]->tight;
    }
    return out;
}

/* Constant path jerk over the interval h with the speed v at the moving end;
 * `sign` -1: it ends at rest. */
static double standstill_ratio(const jerk_planner *planner,
                               const struct segment *segment,
                               double v,
                               double sign) {
    double time = 3.0 * segment->length / v;
    double j = 2.0 * v / (time * time);
    view view;
    view_of_one(planner, segment, &view);
    int parts = any_of(bend_unevenly(&view)) ? 12 : 6;
    vec worst = set1(0.0);
    for (int k = 0; k <= parts; k += LANES) {
        vec share = parts_from(k, parts, parts);
        vec t = time * share;
        vec way = share * share * share;
        vec place = sign > 0.0 ? way : 1.0 - way;
        const motion at = {0.5 * j * t * t, sign * j * t, set1(j)};
        worst = vmax(ratio_inside(&view, &place, &at), worst);
    }
    return largest(worst);
}

/* How much larger than at the ends it is inside an interval; ends far below the
 * rest say nothing. */
static double bulge(double most, double ends) {
    return most > 0.0 ? most / greater(ends, 0.8 * most) : 1.0;
}

/* The bows that the look at the intervals asks for; the mask: where they are
 * others. */
static ivec other_bows(const batch *batch, vec *bows) {
    *bows =
        bows_for(&batch->view, &batch->seen, tight_of(batch), batch->of.bow);
    return (*bows != batch->of.bow) & are_finite(*bows);
}

/* With another bow the jerk is that of the law all but exactly. */
int CHECKER(bend_inside)(const jerk_planner *planner,
                         const struct grid *grid,
                         const struct problem *problem,
                         int k,
                         struct bent out[LANES]) {
    double f2 = planner->scale * planner->scale;
    batch batch;
    vec bows;
    begin_batch(grid, k, &batch);
    view_of(planner, batch.segment, &batch.view);
    for (int lane = 0; lane < LANES; lane++) {
        int at = k + (lane < batch.count ? lane : batch.count - 1);
        batch.of.x[lane] = problem->x[at] * f2;
        batch.of.accel[lane] = problem->accel[at] * f2;
        batch.of.input[0][lane] = problem->input[0][at] * f2;
        batch.of.input[1][lane] = problem->input[1][at] * f2;
        batch.of.bow[lane] = problem->bow[at] * f2;
    }
    batch.law = laws_of(&batch.of);
    look_at(&batch.view, &batch.law, &batch.seen);
    ivec others = other_bows(&batch, &bows);
    bows = chosen(others, bows, batch.of.bow);
    bend_look(&batch.seen, bows - batch.of.bow);
    vec ends = ends_ratio(&batch.view, &batch.seen);
    vec most = vmax(inside_ratio(&batch.view, &batch.seen), ends);
    for (int lane = 0; lane < batch.count; lane++) {
        out[lane].most = most[lane];
        out[lane].more = bulge(most[lane], ends[lane]);
        out[lane].bow = others[lane] ? bows[lane] / f2 : problem->bow[k + lane];
    }
    return batch.count;
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

static ivec are_laws(const laws *law) {
    return are_finite(law->time + law->snap + law->crackle + law->pop);
}

/* Intervals that are not legal may be so with other bows: nothing else of the
 * plan changes by them. */
static void bend_to_fit(const batch *present,
                        const vec *x1,
                        driven *driven,
                        vec *bows) {
    batch other = *present;
    ivec others =
        other_bows(present, &other.of.bow) & (driven->limits > CHECK_SLACK);
    if (!any_of(others)) {
        return;
    }
    other.law = laws_of(&other.of);
    look_at(&other.view, &other.law, &other.seen);
    const struct driven then = drive(&other, x1);
    ivec fit = others & are_laws(&other.law) & (then.limits <= CHECK_SLACK);
    driven->ends = chosen(fit, then.ends, driven->ends);
    driven->limits = chosen(fit, then.limits, driven->limits);
    driven->low = chosen(fit, then.low, driven->low);
    driven->top_x = chosen(fit, then.top_x, driven->top_x);
    *bows = chosen(fit, other.of.bow, *bows);
}

/* Largest ratio of an acceleration of one interval to its limit; 0 where it is
 * small enough. */
static double heavy_ratio(const batch *batch, int lane) {
    vec most = set1(0.0);
    view view;
    spread_view(&batch->view, lane, &view);
    const laws law = spread_laws(&batch->law, lane);
    for (int k = 0; k <= UNEVEN_PARTS; k += LANES) {
        vec t = law.time * parts_from(k, UNEVEN_PARTS, UNEVEN_PARTS);
        vec s;
        bends at;
        const motion motion = motion_at(&law, &t, &s);
        s = s * view.per_length;
        bends_inside(&view, &s, &at);
        for (int n = 0; n < view.count; n++) {
            vec v2 = motion.v * motion.v;
            vec acc = at.d1[n] * motion.a + at.d2[n] * v2;
            most = vmax(most, size_of(acc) * view.acc[n]);
        }
    }
    double ratio = largest(most);
    return ratio > CHECK_SLACK ? ratio : 0.0;
}

/* The input that meets the rest interval exactly: what the way there has
 * gathered in rounding ends here. */
static double last_input(const struct grid *grid, double x, double accel) {
    double length = grid->seg[grid->count - 2].length;
    double t = 1.5 * grid->seg[grid->count - 1].length;
    double way = 2.0 * length + t;
    return -(x + way * accel) / (length * (length + t));
}

/* What a batch of intervals with free inputs does. */
typedef struct checked {
    batch batch;
    driven driven;
    vec x1, accel1, bows;
    ivec none; /* they have no law at all */
} checked;

/* x and u go on from (x, accel). */
static void check_batch(const jerk_planner *planner,
                        const struct grid *grid,
                        struct problem *problem,
                        int k,
                        double x,
                        double accel,
                        checked *out) {
    double f2 = planner->scale * planner->scale;
    batch *batch = &out->batch;
    drives *of = &batch->of;
    begin_batch(grid, k, batch);
    for (int lane = 0; lane < LANES; lane++) {
        int at = k + (lane < batch->count ? lane : batch->count - 1);
        if (lane < batch->count) {
            if (at == grid->count - 2) {
                problem->input[0][at] = problem->input[1][at] =
                    last_input(grid, x, accel) / f2;
            }
            of->x[lane] = x;
            of->accel[lane] = accel;
            double length = batch->segment[lane]->length;
            double c0 = problem->input[0][at] * f2;
            double c1 = problem->input[1][at] * f2;
            x = x_after(length, x, accel, c0, c1);
            accel = accel_after(length, accel, c0, c1);
        } else {
            of->x[lane] = of->x[lane - 1];
            of->accel[lane] = of->accel[lane - 1];
        }
        out->x1[lane] = x;
        out->accel1[lane] = accel;
        of->input[0][lane] = problem->input[0][at] * f2;
        of->input[1][lane] = problem->input[1][at] * f2;
        of->bow[lane] = problem->bow[at] * f2;
    }
    batch->law = laws_of(of);
    vec least = vmin(of->x, out->x1);
    vec most = vmax(of->x, out->x1);
    out->none = ~((least > LEAST_DIP * most) & are_laws(&batch->law));
    view_of(planner, batch->segment, &batch->view);
    look_at(&batch->view, &batch->law, &batch->seen);
    out->bows = of->bow;
    out->driven = drive(batch, &out->x1);
    if (any_of(out->driven.limits > CHECK_SLACK)) {
        bend_to_fit(batch, &out->x1, &out->driven, &out->bows);
    }
}

/* One interval of a batch. */
static double free_ratio(const jerk_planner *planner,
                         struct grid *grid,
                         const checked *of,
                         int lane) {
    int k = of->batch.first + lane;
    struct segment *segment = &grid->seg[k];
    if (of->none[lane]) {
        return INFINITY;
    }
    double limits = of->driven.limits[lane];
    double top_x = of->driven.top_x[lane];
    segment->bulge = bulge(limits, of->driven.ends[lane]);
    if (!(of->driven.low[lane] > LEAST_DIP * top_x)) {
        return INFINITY;
    }
    double feed =
        feed_ratio(planner, grid, k, of->batch.of.x[lane], of->x1[lane], top_x);
    segment->excess = limits > CHECK_SLACK ? limits : 0.0;
    segment->heavy = limits > CHECK_SLACK ? heavy_ratio(&of->batch, lane) : 0.0;
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
    checked checked;
    int lane = LANES;
    for (; k < last; k++, lane++) {
        if (lane == LANES) {
            lane = 0;
            check_batch(planner, grid, problem, k, x, accel, &checked);
        }
        problem->x[k] = x / f2;
        problem->accel[k] = accel / f2;
        if (k > 0 && !jump_fits(planner, grid, k, x)) {
            return INFINITY;
        }
        if (k > 0) {
            worst = greater(worst, kink_ratio(planner, grid, k, x, accel));
        }
        double ratio = free_ratio(planner, grid, &checked, lane);
        problem->bow[k] = grid->seg[k].bow = checked.bows[lane] / f2;
        x = checked.x1[lane];
        accel = checked.accel1[lane];
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
