/* When the plan is made anew. */
#ifndef JERK_REPLAN_H
#define JERK_REPLAN_H
#include "jerk/state/state.h"

/* A new plan over the window, or the stored tail stays; false: it is not what
 * is wanted. */
bool plan_window(jerk_planner *planner);
#endif
