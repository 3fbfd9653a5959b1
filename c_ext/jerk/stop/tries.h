/* Stops over one distance. */
#ifndef JERK_STOP_TRIES_H
#define JERK_STOP_TRIES_H
#include "jerk/solver/brake.h"
#include "jerk/state/state.h"

/* The stop after `distance` mm becomes the plan. `found` mm: the plan is a
 * longer stop of that length; 0: it is none. False: there is no such stop. */
bool try_stop(jerk_planner *planner, double distance, double found);

/* The same with nearly all of the jerk that the checker allows, over `share` of
 * the way of the stop that is the plan. */
bool try_shorter(jerk_planner *planner, double share);

/* The brake becomes the plan, on a grid that ends where it does. */
bool take_brake(jerk_planner *planner, const brake_path *brake);
#endif
