/* Straight lines, planned without the solver. */
#ifndef JERK_STRAIGHT_LINE_H
#define JERK_STRAIGHT_LINE_H
#include "jerk/state/state.h"

enum on_line {
    LINE_NONE,     /* there is no line, or no plan for it alone */
    LINE_TO_STAND, /* the plan leads to where the axes must stand */
    LINE_FALL      /* it comes down to a lower speed, and more path follows */
};

/* From rest, the line to the next stand becomes the plan; while it moves, what
 * has changed. */
enum on_line plan_on_line(jerk_planner *planner);

/* The plan is the shortest stop now. False: the line ends before. */
bool stop_on_line(jerk_planner *planner);
#endif
