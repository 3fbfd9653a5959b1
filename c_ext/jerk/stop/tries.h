/* Stops over one distance. */
#ifndef JERK_STOP_TRIES_H
#define JERK_STOP_TRIES_H
#include "jerk/solver/brake.h"
#include "jerk/state/state.h"

/* The stop over `share` of the way of the plan becomes the plan, with nearly
 * all of the jerk that the checker allows.  False: there is no such stop. */
bool try_shorter(jerk_planner *planner, double share);

/* The brake becomes the plan, on a grid that ends where it does. */
bool take_brake(jerk_planner *planner, const brake_path *brake);
#endif
