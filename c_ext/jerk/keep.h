/* The plan that another one takes the place of. */
#ifndef JERK_KEEP_H
#define JERK_KEEP_H
#include "jerk/state/state.h"

/* Another plan is about to take the place of the present one. */
void keep_plan(jerk_planner *planner);

/* The plan that was kept is the present one again. */
void kept_plan_follows(jerk_planner *planner);
#endif
