/* How fine the grid has to be, by what the axes that move can do. */
#ifndef JERK_STEP_SIZE_H
#define JERK_STEP_SIZE_H
#include "jerk/state/state.h"

/* The speed that counts of a limit: what LONGEST_WAY is enough to reach, mm/s.
 */
double reached_speed(double v, double a, double j);

/* What the limits along an interval ask of the grid. */
struct steps interval_steps(const jerk_planner *planner,
                            const jerk_interval *interval);
#endif
