/* A plan for other speeds, over as much of the path as they need. */
#ifndef JERK_NEAR_H
#define JERK_NEAR_H
#include "jerk/state/state.h"

/* Whether the present plan is faster over the grid than is asked for, `from` mm
 * behind the head or further. */
bool plan_is_faster(const jerk_planner *planner,
                    const struct grid *grid,
                    double from);

/* mm: a window behind a change need not be longer, since another change may
 * come soon. INFINITY: the known path ends before. */
double reach_behind_change(const jerk_planner *planner);

/* A new plan over the path just ahead; where the present one is faster than
 * what is asked for, it comes down.  False: none was found. */
bool plan_near(jerk_planner *planner);
#endif
