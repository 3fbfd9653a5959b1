/* The quickest change of speed on a straight line. */
#include <math.h>
#include "jerk/path/motion_law.h"
#include "jerk/path/speed_change.h"

path_limits limits_at(const jerk_planner *planner,
                      const jerk_interval *interval) {
    path_limits least = {1e30, 1e30};
    for (int i = 0; i < planner->axes; i++) {
        double along = fmax(fabs(interval->d1[0][i]), 1e-9);
        least.acc = fmin(least.acc, acc_max(planner, interval, i) / along);
        least.jerk = fmin(least.jerk, jerk_max(planner, interval, i) / along);
    }
    return least;
}

double level_speed(double v, double a, path_limits most) {
    return v + 0.5 * a * fabs(a) / most.jerk;
}

bool change_speed(double v,
                  double a,
                  double v1,
                  path_limits most,
                  speed_change *out) {
    double levels = level_speed(v, a, most);
    if (levels < 0.0) {
        return false;
    }
    double sign = v1 >= levels ? 1.0 : -1.0;
    double asked = sign * (v1 - v); /* what the speed gains */
    double room = 0.5 * a * a + most.jerk * asked;
    double steepest = fmin(most.acc, sqrt(fmax(0.0, room)));
    double way = steepest - sign * a; /* of the acceleration, to there */
    double gained = way > 0.0 ? (steepest * steepest - 0.5 * a * a) / most.jerk
                              : 0.5 * a * a / most.jerk;
    out->peak = sign * steepest;
    out->time[0] = fabs(way) / most.jerk;
    out->time[1] =
        steepest > 0.0 ? fmax(0.0, (asked - gained) / steepest) : 0.0;
    out->time[2] = steepest / most.jerk;
    out->jerk[0] = way > 0.0 ? sign * most.jerk : -sign * most.jerk;
    out->jerk[1] = 0.0;
    out->jerk[2] = -sign * most.jerk;
    jerk_state at = {.v = v, .a = a};
    out->lasts = 0.0;
    for (int i = 0; i < 3; i++) {
        jerk_law law = {.s0 = at.s, .v0 = at.v, .a0 = at.a};
        law.jerk = out->jerk[i];
        jerk_at(&law, out->time[i], &at);
        out->lasts += out->time[i];
    }
    out->way = at.s;
    return true;
}
