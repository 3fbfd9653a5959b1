/* Ways to rest on a straight line with the limits of one place. */
#include <math.h>
#include "jerk/path/ring.h"
#include "jerk/path/speed_change.h"
#include "jerk/path/way.h"

static path_limits limits_at_head(const jerk_planner *planner) {
    return limits_at(planner, ring_at(planner, planner->head));
}

/* mm from (v, a) down to the speed v1; less than zero: there is no such way. */
static double brakes(double v, double a, double v1, path_limits most) {
    speed_change change;
    if (!change_speed(v, a, v1, most, &change)) {
        return -1.0;
    }
    return change.way;
}

double way_to_rest(const jerk_planner *planner,
                   const jerk_interval *interval,
                   double v,
                   double a) {
    double way = brakes(v, a, 0.0, limits_at(planner, interval));
    return way < 0.0 ? v * v / (1.5 * -a) : way;
}

double likely_stop(const jerk_planner *planner) {
    return way_to_rest(planner,
                       ring_at(planner, planner->head),
                       speed_at_head(planner),
                       acceleration_at_head(planner));
}

double way_down_to(const jerk_planner *planner, double v1) {
    double a = fmax(0.0, acceleration_at_head(planner));
    double v = speed_at_head(planner);
    return brakes(v, a, fmin(v1, v), limits_at_head(planner));
}

double time_down_to(const jerk_planner *planner, double v1) {
    double a = fmax(0.0, acceleration_at_head(planner));
    double v = speed_at_head(planner);
    speed_change change = {.lasts = 0.0};
    change_speed(v, a, fmin(v1, v), limits_at_head(planner), &change);
    return change.lasts;
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
