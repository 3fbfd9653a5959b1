/* Laws of the plan that are not handed out yet. */
#ifndef JERK_PLAN_LAW_H
#define JERK_PLAN_LAW_H
#include "jerk/state/state.h"

/* The law of segment k of the plan; it is kept there, for tails are asked for
 * again and again. */
void plan_law(const jerk_planner *planner, int k, jerk_law *law);
#endif
