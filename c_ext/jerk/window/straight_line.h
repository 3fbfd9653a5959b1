/* Straight lines, planned without the solver. */
#ifndef JERK_STRAIGHT_LINE_H
#define JERK_STRAIGHT_LINE_H
#include "jerk/state/state.h"

enum on_line {
    LINE_NONE,   /* there is no line, or no plan for it alone */
    LINE_TO_END, /* the plan leads to the next stand, or as far as is known */
    LINE_FALL    /* it comes down to a lower speed, and more path follows */
};

/* Where nothing but a line is in the window its fastest motion becomes the
 * plan. Where more follows a plan that is too fast comes down on it. */
enum on_line plan_on_line(jerk_planner *planner);

/* No window was found for a higher speed: up to it on the line and to rest at
 * its end, where the present plan crawls. False: it does not. */
bool rise_on_line(jerk_planner *planner);

/* The plan is the shortest stop now. False: the line ends before. */
bool stop_on_line(jerk_planner *planner);
#endif
