/* The bow of an interval's input (problem.h), chosen from an iterate.
 *
 * Where the path bends, an axis that keeps its jerk limit at both ends exceeds
 * it between them.  A bow moves the input there, and the ends the other way.
 * So no limit need be lowered.  Part of the checker's code (verify_core.h). */
#ifndef JERK_BOW_H
#define JERK_BOW_H
#include "jerk/window/ratios.h"
#include "maths/order.h"

/* What the axes' jerks inside an interval leave a change of its bow: from low
 * to high. `slope`: of the jerk that decides it, by the bow. */
typedef struct bow_range {
    double low, high, low_slope, high_slope;
} bow_range;

/* `jerk` inside the interval grows by `slope` with the bow, over what it does
 * at the ends, and may grow by `room`. */
static void bound_bow(bow_range *range, double room, double slope) {
    double most = room / slope;
    if (slope > 0.0 && most < range->high) {
        range->high = most;
        range->high_slope = slope;
    }
    if (slope < 0.0 && most > range->low) {
        range->low = most;
        range->low_slope = -slope;
    }
}

/* The least change of the bow; where axes ask for opposite ones, that with the
 * least jerk. */
static double least_change(const bow_range *range) {
    if (range->low > range->high) {
        return (range->low * range->low_slope + range->high * range->high_slope)
               / (range->low_slope + range->high_slope);
    }
    return lesser(greater(0.0, range->low), range->high);
}

/* Axis jerks over their limits. */
static vec jerk_of(const view *view,
                   const bends *at,
                   int n,
                   const motion *motion) {
    vec v2 = motion->v * motion->v;
    vec bend = at->d3[n] * v2 + 3.0 * at->d2[n] * motion->a;
    return (motion->v * bend + at->d1[n] * motion->j) * view->jerk[n];
}

/* What the jerk of an axis inside leaves: to be as at the ends. */
static inline void bound_by_axis(vec ends,
                                 vec inside,
                                 vec slope,
                                 double limit,
                                 bow_range *range) {
    double floor = (1.0 - BOW_NEAR) * limit;
    double most[2];
    most[0] = greater(greater(ends[0], ends[1]), floor);
    most[1] = greater(greater(-ends[0], -ends[1]), floor);
    for (int lane = 0; lane < LANES; lane++) {
        bool below = inside[lane] < 0.0;
        double jerk = fabs(inside[lane]);
        if (jerk > FORESEEN * limit) {
            bound_bow(range,
                      FORESEEN_FROM * most[below] - jerk,
                      below ? -slope[lane] : slope[lane]);
        }
    }
}

/* The bow with which no axis has much more jerk inside the interval than at its
 * ends. */
static double bow_for(const view *view,
                      const look *seen,
                      double limit,
                      double bow) {
    bow_range range = {-INFINITY, INFINITY, 0.0, 0.0};
    vec shape = 6.0 * seen->places * (1.0 - seen->places) * seen->within.v;
    double steepest = 0.0;
    for (int n = 0; n < view->count; n++) {
        vec slope = seen->inside.d1[n] * shape * view->jerk[n];
        vec steep = size_of(seen->ends.d1[n]) * seen->at_ends.v * view->jerk[n];
        steepest = greater(steepest, largest(steep));
        bound_by_axis(jerk_of(view, &seen->ends, n, &seen->at_ends),
                      jerk_of(view, &seen->inside, n, &seen->within),
                      slope,
                      limit,
                      &range);
    }
    double most = BOW_MOST / steepest;
    return lesser(greater(bow + least_change(&range), -most), most);
}

/* What the look at an interval shows with so much more of a bow. */
static void bend_look(look *seen, double more) {
    vec z = seen->places;
    vec shape = 6.0 * z * (1.0 - z) - 1.0;
    seen->at_ends.j -= more * seen->at_ends.v;
    seen->within.j += more * shape * seen->within.v;
}
#endif
