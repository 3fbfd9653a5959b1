/* Joints where the direction jumps, several of them in a cycle. */
#ifndef JERK_JOINTS_H
#define JERK_JOINTS_H
#include "jerk/state/state.h"

/* The joint between two intervals is passed at the head. */
void turn_passed(jerk_planner *planner,
                 const jerk_interval *left,
                 const jerk_interval *right);

/* Laws were taken back to where so many mm were driven. */
void turns_back(jerk_planner *planner, double driven);

/* Caps and shares around joints that show in the samples of one cycle. */
void turn_caps(const jerk_planner *planner, struct grid *grid);
#endif
