/* The shortest stop. */
#ifndef JERK_STOP_H
#define JERK_STOP_H
#include "jerk/state/state.h"

/* The plan becomes the shortest stop that is found; false: none is. */
bool plan_stop(jerk_planner *planner);
#endif
