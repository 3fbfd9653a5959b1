/* The checker, which uses nothing of the solver's rows. */
#ifndef JERK_VERIFY_H
#define JERK_VERIFY_H
#include "jerk/state/state.h"

/* Largest ratio of anything to its limit over the problem as a plan; infinite:
 * it is none.  x and accel are replaced by what the inputs integrate to. */
double plan_check(const jerk_planner *planner,
                  struct grid *grid,
                  struct problem *problem);

/* Largest ratio inside one segment; `more`: by what it exceeds that at the
 * ends. */
double bend_inside(const jerk_planner *planner,
                   const struct segment *segment,
                   double x,
                   double accel,
                   const double input[2],
                   double *more);
#endif
