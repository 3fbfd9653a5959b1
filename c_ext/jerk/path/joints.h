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

/* The speed at which each knot may be passed, its neighbours being passed no
 * faster than they may: grid->top. */
void top_speeds(const jerk_planner *planner, struct grid *grid);

/* The first knot where the direction jumps; 0: none. */
int first_joint(const jerk_planner *planner, const struct grid *grid);

/* Caps and shares around joints that show in the samples of one cycle, from the
 * first joint on. */
void turn_caps(const jerk_planner *planner, struct grid *grid, int first);
#endif
