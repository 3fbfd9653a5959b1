/* The checker, which uses nothing of the solver's rows. */
#ifndef JERK_VERIFY_H
#define JERK_VERIFY_H
#include "jerk/state/state.h"

typedef double plan_checker(const jerk_planner *planner,
                            struct grid *grid,
                            struct problem *problem);
typedef double bend_checker(const jerk_planner *planner,
                            const struct segment *segment,
                            double x,
                            double accel,
                            const double input[2],
                            double *bow,
                            double *more);

/* Largest ratio of anything to its limit over the problem as a plan; infinite:
 * it is none.  x and accel are replaced by what the inputs integrate to. */
plan_checker plan_check, plan_check_base, plan_check_avx2;

/* Largest ratio inside one segment; `more`: by what it exceeds that at the
 * ends. */
bend_checker bend_inside, bend_inside_base, bend_inside_avx2;
#endif
