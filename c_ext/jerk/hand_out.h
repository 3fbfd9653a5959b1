/* What the caller gets: the plan's laws, one after the other. */
#ifndef JERK_HAND_OUT_H
#define JERK_HAND_OUT_H
#include "jerk/state/state.h"

/* The beginning of what was taken back is handed out all the same; its time, s.
 */
double hand_out_again(jerk_planner *planner, double seconds);
#endif
