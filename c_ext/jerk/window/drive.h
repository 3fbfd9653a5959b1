/* What intervals do under their laws, LANES of them at a time: the largest
 * ratios at their ends and inside, and the lowest and highest speeds.  Part of
 * the checker's code (verify_core.h). */
#ifndef JERK_DRIVE_H
#define JERK_DRIVE_H
#include "jerk/window/ratios.h"
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

static inline vec acceleration_at(const laws *law, const vec *t) {
    vec s;
    return motion_at(law, t, &s).a;
}

/* Laws whose acceleration changes its sign from one part to the next. */
static ivec that_turn(const laws *law) {
    vec from = law->a0;
    ivec turn = {0, 0, 0, 0};
    for (int i = 1; i <= TURN_PARTS; i++) {
        vec t = law->time * ((double)i / TURN_PARTS);
        vec to = acceleration_at(law, &t);
        turn |= from * to < 0.0;
        from = to;
    }
    return turn;
}

/* Acceleration of one law, which stands in all lanes. */
static double acceleration_then(const laws *law, double seconds) {
    vec t = set1(seconds);
    return acceleration_at(law, &t)[0];
}

/* Times in it at which the acceleration changes its sign: how many. */
static int turning_points(const laws *law, double t[TURN_PARTS]) {
    double from = law->a0[0];
    int count = 0;
    for (int i = 1; i <= TURN_PARTS; i++) {
        double low = law->time[0] * (i - 1) / TURN_PARTS;
        double high = law->time[0] * i / TURN_PARTS;
        double a0 = from;
        double a1 = acceleration_then(law, high);
        from = a1;
        if (!(a0 * a1 < 0.0)) {
            continue;
        }
        t[count] = low;
        for (int k = 0; k < TURN_STEPS; k++) { /* secants, inside the bracket */
            t[count] = (low * a1 - high * a0) / (a1 - a0);
            double a = acceleration_then(law, t[count]);
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
    for (int i = turning_points(&law, turns) - 1; i >= 0; i--) {
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

#endif
