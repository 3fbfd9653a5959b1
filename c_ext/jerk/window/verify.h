/* The checker, which uses nothing of the solver's rows. */
#ifndef JERK_VERIFY_H
#define JERK_VERIFY_H
#include "jerk/state/state.h"

typedef double plan_checker(const jerk_planner *planner,
                            struct grid *grid,
                            struct problem *problem);
/* What an interval does with the bow that it asks for: its largest ratio, by
 * what factor that is above the one at its ends, and the bow. */
typedef struct bent {
    double most, more, bow;
} bent;

typedef int bend_checker(const jerk_planner *planner,
                         const struct grid *grid,
                         const struct problem *problem,
                         int k,
                         struct bent out[LANES]);

/* Largest ratio of anything to its limit over the problem as a plan; infinite:
 * it is none.  x and accel are replaced by what the inputs integrate to. */
plan_checker plan_check, plan_check_base, plan_check_avx2;

/* For the planner, ahead of a check: intervals k, k + 1 .. as they are; returns
 * how many were looked at. */
bend_checker bend_inside, bend_inside_base, bend_inside_avx2;
#endif
