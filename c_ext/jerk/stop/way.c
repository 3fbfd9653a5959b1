/* Ways to rest on a straight line with the limits of one place. */
#include <math.h>
#include "jerk/path/ring.h"
#include "jerk/stop/way.h"

typedef struct path_limits {
    double acc, jerk; /* mm/s2, mm/s3 along the path */
} path_limits;

/* What all axes can follow at the start of an interval. */
static path_limits limits_at(const jerk_planner *planner,
                             const jerk_interval *interval) {
    path_limits least = {1e30, 1e30};
    for (int i = 0; i < planner->cfg.axes; i++) {
        double along = fmax(fabs(interval->d1[0][i]), 1e-9);
        least.acc = fmin(least.acc, acc_max(planner, interval, i) / along);
        least.jerk = fmin(least.jerk, jerk_max(planner, interval, i) / along);
    }
    return least;
}

static path_limits limits_at_head(const jerk_planner *planner) {
    return limits_at(planner, ring_at(planner, planner->head));
}

static double speed_at_head(const jerk_planner *planner) {
    return planner->scale * sqrt(planner->x);
}

static double acceleration_at_head(const jerk_planner *planner) {
    return planner->scale * planner->scale * planner->accel;
}

/* From (v, a >= 0) down to the speed v1: to a = 0, then two jerk ramps. */
static double brakes(double v, double a, double v1, path_limits most) {
    double t1 = a / most.jerk;
    double top = v + 0.5 * a * t1;
    double drop = fmax(0.0, top - v1);
    double ramp = fmin(most.acc, sqrt(drop * most.jerk));
    double rise = v * t1 + 0.5 * a * t1 * t1 - most.jerk * t1 * t1 * t1 / 6.0;
    return rise
           + (ramp > 0.0 ? 0.5 * (top + v1) * (drop / ramp + ramp / most.jerk)
                         : 0.0);
}

/* From (v, -a) to rest, where the path brakes already: more deceleration, as
 * much for a while, less; or less at once. */
static double brakes_on(double v, double a, path_limits most) {
    double room = 0.5 * a * a + most.jerk * v;
    double steepest = fmax(a, fmin(most.acc, sqrt(room)));
    double drop = v - 0.5 * a * a / most.jerk;
    if (drop <= 0.0) {
        return v * v / (1.5 * a);
    }
    double t1 = (steepest - a) / most.jerk;
    double v1 = v - 0.5 * (steepest * steepest - a * a) / most.jerk;
    double v2 = 0.5 * steepest * steepest / most.jerk;
    double way1 = t1 * (v - t1 * (0.5 * a + most.jerk * t1 / 6.0));
    double way2 = 0.5 * (v1 + v2) * fmax(0.0, v1 - v2) / steepest;
    return way1 + way2 + v2 * steepest / most.jerk / 3.0;
}

double way_to_rest(const jerk_planner *planner,
                   const jerk_interval *interval,
                   double v,
                   double a) {
    path_limits most = limits_at(planner, interval);
    return a < 0.0 ? brakes_on(v, -a, most) : brakes(v, a, 0.0, most);
}

double likely_stop(const jerk_planner *planner) {
    return way_to_rest(planner,
                       ring_at(planner, planner->head),
                       speed_at_head(planner),
                       acceleration_at_head(planner));
}

double way_down_to(const jerk_planner *planner, double v1) {
    double a = fmax(0.0, acceleration_at_head(planner));
    return brakes(speed_at_head(planner), a, v1, limits_at_head(planner));
}

double jerk_stop_distance(const jerk_planner *planner) {
    return planner->at_standstill ? 0.0 : way_down_to(planner, 0.0);
}

double longest_brake(const jerk_planner *planner) {
    path_limits most = limits_at_head(planner);
    double v = speed_at_head(planner);
    double ramp = fmin(most.acc, sqrt(most.jerk * v));
    double before = fabs(acceleration_at_head(planner)) / most.jerk;
    return BRAKE_LONGEST * (v / ramp + ramp / most.jerk + before);
}

bool must_rest(const jerk_planner *planner) {
    double a = acceleration_at_head(planner);
    double v = speed_at_head(planner);
    double falls = 0.5 * a * a / limits_at_head(planner).jerk;
    return a < 0.0 && v <= MUST_REST * falls
           && planner->plan.remaining <= NEAR_ENOUGH * likely_stop(planner);
}
