/* The quickest change of speed on a straight line: jerk up to an acceleration,
 * this acceleration for a while, and jerk down to none. */
#ifndef JERK_SPEED_CHANGE_H
#define JERK_SPEED_CHANGE_H
#include "jerk/state/state.h"

typedef struct path_limits {
    double acc, jerk; /* mm/s2, mm/s3 along the path */
} path_limits;

/* What all axes can follow at the start of an interval. */
path_limits limits_at(const jerk_planner *planner,
                      const jerk_interval *interval);

typedef struct speed_change {
    double jerk[3], time[3]; /* mm/s3, s: of the three phases */
    double peak;             /* mm/s2: of the second phase */
    double way, lasts;       /* mm, s */
} speed_change;

/* The speed that (v, a) comes to when the acceleration ends at once. */
double level_speed(double v, double a, path_limits most);

/* From (v, a) to the speed v1 without acceleration. False: the acceleration at
 * the start leads to a speed below zero. */
bool change_speed(double v,
                  double a,
                  double v1,
                  path_limits most,
                  speed_change *out);
#endif
