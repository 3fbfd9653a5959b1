/* Straight lines from rest to rest, planned without the solver. */
#ifndef JERK_STRAIGHT_LINE_H
#define JERK_STRAIGHT_LINE_H
#include "jerk/state/state.h"

/* A plan from rest to the next stand, if a straight line leads there. */
bool plan_straight(jerk_planner *planner);
#endif
