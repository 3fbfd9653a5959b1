/* How far it is to rest, or to a lower speed: estimates with the limits of one
 * place, as if the path were straight. */
#ifndef JERK_PATH_WAY_H
#define JERK_PATH_WAY_H
#include "jerk/state/state.h"

/* mm to rest from a speed and an acceleration along the path, mm/s and mm/s2.
 */
double way_to_rest(const jerk_planner *planner,
                   const jerk_interval *interval,
                   double v,
                   double a);

/* mm from the head to rest. */
double likely_stop(const jerk_planner *planner);

/* mm from the head to the speed v1, and s. */
double way_down_to(const jerk_planner *planner, double v1);
double time_down_to(const jerk_planner *planner, double v1);

/* s that no brake from the head takes. */
double longest_brake(const jerk_planner *planner);

/* Whether the path comes to rest, or nearly, whatever is planned, and the
 * present plan does so. */
bool must_rest(const jerk_planner *planner);
#endif
