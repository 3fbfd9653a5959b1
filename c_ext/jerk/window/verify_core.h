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

/* Intervals that are looked at together: those from `first` on, so many. The
 * last one stands in the lanes that are left. */
typedef struct batch {
    int first, count;
    const struct segment *segment[LANES];
    view view;
    drives of;
    laws law;
    look seen;
} batch;

static void begin_batch(const struct grid *grid, int first, batch *out) {
    int free = grid->count - 1 - first; /* the last interval ends at rest */
    out->first = first;
    out->count = free < LANES ? free : LANES;
    for (int lane = 0; lane < LANES; lane++) {
        int at = lane < out->count ? lane : out->count - 1;
        out->segment[lane] = &grid->seg[first + at];
        out->of.length[lane] = out->segment[lane]->length;
    }
}

static vec tight_of(const batch *batch) {
    vec out;
    for (int lane = 0; lane < LANES; lane++) {
        out[lane] = *batch->segment[lane]->tight;
    }
    return out;
}

/* Between the points that have rows the path may bend otherwise than the rows
 * know: it is looked at in more places where the third derivative changes much
 * over the interval. */
static ivec bend_unevenly(const view *view) {
    vec change = set1(0.0);
    vec most = set1(0.0);
    for (int n = 0; n < view->count; n++) {
        vec first = view->ends[0].d3[n];
        vec last = view->ends[1].d3[n];
        change = vmax(size_of(last - first), change);
        most = vmax(vmax(size_of(first), size_of(last)), most);
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

/* Acceleration of one of the laws. */
static double acceleration(const laws *law, int lane, double t) {
    double snap = law->snap[lane] / 2.0;
    double rest = law->crackle[lane] * PER_6 + t * (law->pop[lane] * PER_24);
    return law->a0[lane] + t * (law->jerk[lane] + t * (snap + t * rest));
}

/* Laws whose acceleration changes its sign from one part to the next. */
static ivec that_turn(const laws *law) {
    vec from = law->a0;
    ivec turn = {0, 0, 0, 0};
    for (int i = 1; i <= TURN_PARTS; i++) {
        vec t = law->time * ((double)i / TURN_PARTS);
        vec rest = law->crackle * PER_6 + t * (law->pop * PER_24);
        vec to = law->a0 + t * (law->jerk + t * (law->snap / 2.0 + t * rest));
        turn |= from * to < 0.0;
        from = to;
    }
    return turn;
}

/* Times in the law at which the acceleration changes its sign: how many. */
static int turning_points(const laws *law, int lane, double t[TURN_PARTS]) {
    double from = law->a0[lane];
    int count = 0;
    for (int i = 1; i <= TURN_PARTS; i++) {
        double low = law->time[lane] * (i - 1) / TURN_PARTS;
        double high = law->time[lane] * i / TURN_PARTS;
        double a0 = from;
        double a1 = acceleration(law, lane, high);
        from = a1;
        if (!(a0 * a1 < 0.0)) {
            continue;
        }
        t[count] = low;
        for (int k = 0; k < TURN_STEPS; k++) { /* secants, inside the bracket */
            t[count] = (low * a1 - high * a0) / (a1 - a0);
            double a = acceleration(law, lane, t[count]);
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

/* What intervals do under their laws. */
typedef struct driven {
    vec ends, limits; /* largest ratios: at their ends, anywhere */
    vec low, top_x;   /* squared speeds */
} driven;

/* Largest acceleration over its limit, of the places that were looked at. */
static vec most_acceleration(const view *view, const look *seen) {
    vec most = set1(0.0);
    for (int n = 0; n < view->count; n++) {
        for (int end = 0; end < 2; end++) {
            const motion *at = &seen->at_ends[end];
            vec acc = view->ends[end].d1[n] * at->a
                      + view->ends[end].d2[n] * at->v * at->v;
            most = vmax(size_of(acc) * view->acc[n], most);
        }
        for (int i = 0; i < INNER_PLACES; i++) {
            const motion *at = &seen->within[i];
            vec acc = seen->inside[i].d1[n] * at->a
                      + seen->inside[i].d2[n] * at->v * at->v;
            most = vmax(size_of(acc) * view->acc[n], most);
        }
    }
    return most;
}

/* Where the path jerk changes its sign: an acceleration near its limit may be
 * above it between the places that were looked at. */
static ivec swings(const view *view, const look *seen) {
    vec most = vmax(largest_jerk(seen->at_ends, 2),
                    largest_jerk(seen->within, INNER_PLACES));
    vec least = vmin(least_jerk_of(seen->at_ends, 2),
                     least_jerk_of(seen->within, INNER_PLACES));
    ivec turns = (most > 0.0) & (least < 0.0);
    return any_of(turns) ? turns & (most_acceleration(view, seen) > SWING_NEAR)
                         : turns;
}

/* Where the jerk of an axis goes from one limit to the other, or nearly: near
 * an end it may be above it. */
static ivec jerk_swings(const view *view, const look *seen) {
    ivec out = {0, 0, 0, 0};
    for (int n = 0; n < view->count; n++) {
        vec first = axis_jerk(&view->ends[0], n, &seen->at_ends[0]);
        vec last = axis_jerk(&view->ends[1], n, &seen->at_ends[1]);
        vec product = first * view->jerk[n] * (last * view->jerk[n]);
        out |= product < -SWING_JERK * SWING_JERK;
    }
    return out;
}

/* One of the intervals at more places, `uneven`, and where the speed has a
 * maximum or a minimum. */
static void look_closer(const view *all,
                        const laws *laws_of_all,
                        int lane,
                        bool uneven,
                        driven *out) {
    double turns[TURN_PARTS];
    view view;
    spread_view(all, lane, &view);
    const laws law = spread_laws(laws_of_all, lane);
    double limits = out->limits[lane];
    if (uneven) {
        limits = greater(limits, ratio_at_parts(&view, &law, UNEVEN_PARTS));
    }
    for (int i = turning_points(&law, lane, turns) - 1; i >= 0; i--) {
        vec s, t = set1(turns[i]);
        double v = motion_at(&law, &t, &s).v[0];
        if (v * v > out->top_x[lane]) {
            limits = greater(limits, ratio_at_times(&view, &law, &t)[0]);
        }
        out->top_x[lane] = greater(out->top_x[lane], v * v);
        out->low[lane] = v > 0.0 ? lesser(out->low[lane], v * v) : 0.0;
    }
    out->limits[lane] = limits;
}

/* `x1`: squared speeds at their ends. */
static driven drive(const batch *batch, const vec *x1) {
    const view *view = &batch->view;
    vec x0 = batch->of.x;
    driven out = {.low = vmin(x0, *x1), .top_x = vmax(x0, *x1)};
    out.ends = ends_ratio(view, &batch->seen);
    out.limits = vmax(inside_ratio(view, &batch->seen), out.ends);
    ivec uneven = bend_unevenly(view) | (out.low < UNEVEN_SPEEDS * out.top_x)
                  | swings(view, &batch->seen)
                  | jerk_swings(view, &batch->seen);
    ivec turn = that_turn(&batch->law);
    for (int lane = 0; lane < batch->count; lane++) {
        if (uneven[lane] | turn[lane]) {
            look_closer(view, &batch->law, lane, uneven[lane] != 0, &out);
        }
    }
    return out;
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
