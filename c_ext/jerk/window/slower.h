/* The present plan, driven more slowly. */
#ifndef JERK_SLOWER_H
#define JERK_SLOWER_H
#include <stdbool.h>
#include "jerk/state/api.h"

/* The plan becomes the same motion, slowed down to the speeds asked for.
 * False: there is no legal way to it; the plan is as it was. */
bool slow_down(jerk_planner *planner);

/* The plan becomes itself with this share of its squared speed.  The grid is
 * that of the plan then; the squared speeds that it had stand in the problem's
 * guess. */
bool slow_to(jerk_planner *planner, double share);
#endif
