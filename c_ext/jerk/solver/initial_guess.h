/* Where the solver starts; false: the guess meets no dynamics. */
#ifndef JERK_INITIAL_GUESS_H
#define JERK_INITIAL_GUESS_H
#include "jerk/state/state.h"

/* From the present plan where it reaches (`warm`), and a slow profile behind
 * it. */
bool guess_window(jerk_planner *planner,
                  const struct grid *grid,
                  bool warm,
                  double shrink);

/* A smooth bump from rest to rest, below all caps. */
bool guess_bump(jerk_planner *planner, const struct grid *grid);

/* From the squared speeds x at the knots of the same grid. */
bool guess_from(jerk_planner *planner,
                const struct grid *grid,
                const double *x);

/* A stop as that of the plan, which was over another length. */
bool guess_stop_like(jerk_planner *planner,
                     const struct grid *grid,
                     double length);
#endif
