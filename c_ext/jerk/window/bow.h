/* The bows of intervals' inputs (problem.h), chosen from an iterate.
 *
 * Where the path bends, an axis that keeps its jerk limit at both ends exceeds
 * it between them.  A bow moves the input there, and the ends the other way.
 * So no limit need be lowered.  Part of the checker's code (verify_core.h). */
#ifndef JERK_BOW_H
#define JERK_BOW_H
#include "jerk/window/ratios.h"

/* What the axes' jerks inside an interval leave a change of its bow: from low
 * to high. `slope`: of the jerk that decides it, by the bow. */
typedef struct bow_range {
    vec low, high, low_slope, high_slope;
} bow_range;

/* The jerk inside an interval grows by `slope` with the bow, over what it does
 * at the ends, and may grow by `room`; only in the lanes `there`. */
static inline void bound_bow(bow_range *range,
                             ivec there,
                             vec room,
                             vec slope) {
    vec most = room / slope;
    ivec lower = there & (slope > 0.0) & (most < range->high);
    range->high = chosen(lower, most, range->high);
    range->high_slope = chosen(lower, slope, range->high_slope);
    ivec higher = there & (slope < 0.0) & (most > range->low);
    range->low = chosen(higher, most, range->low);
    range->low_slope = chosen(higher, -slope, range->low_slope);
}

/* The least change of the bow; where axes ask for opposite ones, that with the
 * least jerk. */
static vec least_change(const bow_range *range) {
    vec slopes = range->low_slope + range->high_slope;
    vec between =
        (range->low * range->low_slope + range->high * range->high_slope)
        / slopes;
    vec change = vmin(vmax(set1(0.0), range->low), range->high);
    return chosen(range->low > range->high, between, change);
}

/* What the jerk of axis n inside leaves: to be as at the ends. */
static inline void bound_by_axis(const view *view,
                                 const look *seen,
                                 int n,
                                 vec limit,
                                 bow_range *range) {
    const vec per_limit = view->jerk[n];
    vec floor = (1.0 - BOW_NEAR) * limit;
    vec first = axis_jerk(&view->ends[0], n, &seen->at_ends[0]);
    vec last = axis_jerk(&view->ends[1], n, &seen->at_ends[1]);
    first *= per_limit;
    last *= per_limit;
    vec above = vmax(vmax(first, last), floor);
    vec below = vmax(vmax(-first, -last), floor);
    for (int i = 0; i < INNER_PLACES; i++) {
        const motion *within = &seen->within[i];
        vec jerk = axis_jerk(&seen->inside[i], n, within) * per_limit;
        ivec there = size_of(jerk) > FORESEEN * limit;
        if (!any_of(there)) {
            continue;
        }
        vec z = seen->places[i];
        vec shape = 6.0 * z * (1.0 - z) * within->v;
        vec slope = seen->inside[i].d1[n] * shape * per_limit;
        ivec negative = jerk < 0.0;
        vec most = chosen(negative, below, above);
        bound_bow(range,
                  there,
                  FORESEEN_FROM * most - size_of(jerk),
                  chosen(negative, -slope, slope));
    }
}

/* The bows with which no axis has much more jerk inside an interval than at its
 * ends. */
static inline vec bows_for(const view *view,
                           const look *seen,
                           vec limit,
                           vec bow) {
    bow_range range = {.low = set1(-INFINITY), .high = set1(INFINITY)};
    vec steepest = set1(0.0);
    for (int n = 0; n < view->count; n++) {
        for (int end = 0; end < 2; end++) {
            vec v = seen->at_ends[end].v;
            vec steep = size_of(view->ends[end].d1[n]) * v;
            steepest = vmax(steepest, steep * view->jerk[n]);
        }
        bound_by_axis(view, seen, n, limit, &range);
    }
    vec most = BOW_MOST / steepest;
    return vmin(vmax(bow + least_change(&range), -most), most);
}

/* What the look at intervals shows with so much more of their bows. */
static inline void bend_look(look *seen, vec more) {
    for (int end = 0; end < 2; end++) {
        seen->at_ends[end].j -= more * seen->at_ends[end].v;
    }
    for (int i = 0; i < INNER_PLACES; i++) {
        vec z = seen->places[i];
        vec shape = 6.0 * z * (1.0 - z) - 1.0;
        seen->within[i].j += more * shape * seen->within[i].v;
    }
}
#endif
