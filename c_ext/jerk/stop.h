/* The shortest stop. */
#ifndef JERK_STOP_H
#define JERK_STOP_H
#include "jerk/state/state.h"

/* The plan becomes the shortest stop that is found; false: none is. */
bool plan_stop(jerk_planner *planner);

/* Whether the path comes to rest, or nearly, whatever is planned, and the
 * present plan does so. */
bool must_rest(const jerk_planner *planner);

/* mm to the speed v1, estimated. */
double way_down_to(const jerk_planner *planner, double v1);

/* As plan_stop, given up after so many distances without a legal stop. */
bool shortest_stop(jerk_planner *planner, int hopeless);
#endif
