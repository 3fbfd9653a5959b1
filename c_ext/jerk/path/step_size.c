/* How fine the planner's grid has to be along an interval: by what the axes
 * that move there can do, not by the quickest axis of the machine. */
#include <math.h>
#include "jerk/path/step_size.h"
#include "jerk/state/state.h"
#include "maths/order.h"

typedef struct along {
    double v, a, j; /* limits of the path */
} along;

/* Of a limit of speed, what there is a way to reach: numbers are scaled by it,
 * and so are steps. */
double reached_speed(double v, double a, double j) {
    double by_a2 = 2.0 * a * LONGEST_WAY;
    double by_j3 = 4.5 * j * LONGEST_WAY * LONGEST_WAY;
    return v * v <= by_a2 && v * v * v <= by_j3
               ? v
               : lesser(v, lesser(sqrt(by_a2), cbrt(by_j3)));
}

/* The longest interval resolves the ramp to full acceleration, or the way to
 * rest where that ramp is very short. */
static struct steps steps_for(struct along along) {
    along.v = reached_speed(along.v, along.a, along.j);
    double a = lesser(along.a, sqrt(along.v * along.j));
    double ramp = a * a * a / (6.0 * along.j * along.j);
    double stop = 0.5 * along.v * (along.v / a + a / along.j);
    struct steps out = {.longest =
                            greater(ramp / RAMP_PARTS, stop / STOP_PARTS)};
    out.line_standstill = ramp / JOINED_PARTS;
    out.finest = greater(ramp / STANDSTILL_PARTS,
                         lesser(0.5 * ramp, out.longest / FINEST_PARTS));
    return out;
}

/* How fast an axis comes to bind the path, or ceases to, at q: change per mm of
 * its rate over its jerk limit, over the largest of all axes. A slow axis that
 * turns round beside quick ones does so within a small part of the turn. */
static double lean_rate(const jerk_planner *planner,
                        const jerk_interval *interval) {
    double worst = 0.0;
    for (int end = 0; end < 2; end++) {
        double most = 0.0;
        double change = 0.0;
        for (int axis = 0; axis < planner->axes; axis++) {
            double jerk = jerk_max(planner, interval, axis);
            most = greater(most, fabs(interval->d1[end][axis]) / jerk);
            change = greater(change, fabs(interval->d2[end][axis]) / jerk);
        }
        if (most > 0.0) {
            worst = greater(worst, change / most);
        }
    }
    return worst;
}

/* What is driven in a cycle at the least: the third derivatives, `bend` over
 * their jerk limits, say how slowly the place may have to be passed. What lasts
 * a small part of a cycle is not resolved. */
static double cycle_length(const jerk_planner *planner, double bend) {
    return planner->cfg.cycle_s * cbrt(1.0 / greater(1e-15, bend));
}

/* Longest interval for how fast axes come to bind. */
static double lean_length(const jerk_planner *planner,
                          const jerk_interval *interval,
                          double bend) {
    return greater(LEAN_CYCLES * cycle_length(planner, bend),
                   LEAN / greater(1e-15, lean_rate(planner, interval)));
}

/* Longest interval at q: beyond a few degrees of turn the rows at both ends no
 * longer hold the middle. Axes that outrun the path count by the relative
 * change of their rate. */
static double turn_length(const jerk_planner *planner,
                          const jerk_interval *interval) {
    double start = 0.0;
    double end = 0.0;
    for (int axis = 0; axis < planner->axes; axis++) {
        double rate =
            greater(1.0, larger(interval->d1[0][axis], interval->d1[1][axis]));
        double d0 = interval->d2[0][axis] / rate;
        double d1 = interval->d2[1][axis] / rate;
        start += d0 * d0;
        end += d1 * d1;
    }
    return MAX_TURN / sqrt(greater(1e-30, greater(start, end)));
}

/* Third derivative of an axis in the middle of the interval: its polynomial has
 * degree 5 in q' and meets all derivatives at both ends. */
static double third_inside(const jerk_interval *interval, int axis) {
    double change = interval->d2[1][axis] - interval->d2[0][axis];
    return 1.5 * change / interval->length
           - 0.25 * (interval->d3[0][axis] + interval->d3[1][axis]);
}

/* Of the third derivatives by the jerk limits: the largest, and the length over
 * which they change by as much. */
static void set_bend(const jerk_planner *planner,
                     const jerk_interval *interval,
                     struct steps *out) {
    double change = 0.0;
    out->bend = 0.0;
    for (int axis = 0; axis < planner->axes; axis++) {
        double jerk = jerk_max(planner, interval, axis);
        double first = interval->d3[0][axis];
        double last = interval->d3[1][axis];
        double inside = third_inside(interval, axis);
        double most = larger(first, last);
        double by = fabs(last - first);
        if (fabs(inside) > PEAKS * most) {
            most = fabs(inside);
            by = 2.0 * larger(inside - first, inside - last);
            out->peaks = true;
        }
        out->bend = greater(out->bend, most / jerk);
        change = greater(change, by / jerk);
    }
    out->even = interval->length * out->bend / greater(1e-30, change);
    out->turn = lesser(out->turn, lean_length(planner, interval, out->bend));
    out->little = out->turn > LITTLE_TURN * interval->length;
}

/* Squared speed that the axes' accelerations allow across the path. */
static double bend_top(const jerk_planner *planner,
                       const jerk_interval *interval,
                       int end) {
    double bend = 0.0;
    double across = 0.0;
    for (int axis = 0; axis < planner->axes; axis++) {
        double d2 = fabs(interval->d2[end][axis]);
        bend += d2 * d2;
        across += d2 * acc_max(planner, interval, axis);
    }
    return bend > 0.0 ? across / bend : INFINITY;
}

/* What all axes together can accelerate along the path. */
static double most_along(const jerk_planner *planner,
                         const jerk_interval *interval) {
    double sum = 0.0;
    for (int axis = 0; axis < planner->axes; axis++) {
        sum += larger(interval->d1[0][axis], interval->d1[1][axis])
               * acc_max(planner, interval, axis);
    }
    return sum;
}

/* Of an axis, the largest rate over the interval counts; no interval is longer
 * than along the slowest of the axes that move. */
struct steps interval_steps(const jerk_planner *planner,
                            const jerk_interval *interval) {
    struct along along = {1e30, 1e30, 1e30};
    struct steps most = {0};
    double least = 1e30;
    for (int axis = 0; axis < planner->axes; axis++) {
        double first = interval->d1[0][axis];
        double rate = larger(first, interval->d1[1][axis]);
        if (rate < 1e-9) {
            continue;
        }
        struct along own = {planner->cfg.v_max[axis],
                            acc_max(planner, interval, axis),
                            jerk_max(planner, interval, axis)};
        struct steps alone = steps_for(own);
        least = lesser(least, lesser(SLOW_STEP, SLOW_TIME * own.v) / rate);
        most = (struct steps){greater(most.longest, alone.longest),
                              greater(most.finest, alone.finest),
                              .knots = 0.0};
        along = (struct along){lesser(along.v, own.v / rate),
                               lesser(along.a, own.a / rate),
                               lesser(along.j, own.j / rate)};
    }
    struct steps out = steps_for(along);
    if (!(most.longest > 0.0)) {
        most = out; /* no axis moves here: a parameter runs on (profiles) */
    }
    out.least = lesser(least, interval->length);
    out.longest = greater(lesser(out.longest, most.longest), out.least);
    out.finest = lesser(out.finest, most.finest);
    if (planner->cfg.spacing_mm > 0.0) {
        out.longest = planner->cfg.spacing_mm;
    }
    out.turn = turn_length(planner, interval);
    set_bend(planner, interval, &out);
    out.top[0] = bend_top(planner, interval, 0);
    out.top[1] = bend_top(planner, interval, 1);
    out.along = most_along(planner, interval);
    out.curve_standstill = STANDSTILL_TURN * out.turn;
    out.kept = out.turn;
    out.shortest =
        lesser(out.turn,
               greater(LEAST_CYCLES * cycle_length(planner, out.bend),
                       lesser(out.turn, interval->length) / LEAST_PARTS));
    out.knots = ceil(interval->length / out.longest);
    return out;
}

/* Intervals of the planner's grid from full speed to rest. */
double jerk_stop_knots(const jerk_config *config) {
    double most = 0.0;
    for (int i = 0; i < config->axes; i++) {
        double v =
            reached_speed(config->v_max[i], config->a_max[i], config->j_max[i]);
        double a = lesser(config->a_max[i], sqrt(v * config->j_max[i]));
        most = greater(
            most,
            0.5 * v * (v / a + a / config->j_max[i])
                / steps_for(
                      (struct along){v, config->a_max[i], config->j_max[i]})
                      .longest);
    }
    return most;
}
