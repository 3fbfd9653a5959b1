/* Rows of the window's problem: limits of axes over (x, accel, input). */
#ifndef JERK_CONSTRAINTS_H
#define JERK_CONSTRAINTS_H
#include "jerk/state/state.h"

/* Dimensions and rows of the problem over a grid, from the state x0, u0. */
void problem_from_grid(jerk_planner *planner,
                       const struct grid *grid,
                       double x0,
                       double u0);

/* Caps, floors and the objective, from the guess at the knots. */
void bound_rows(jerk_planner *planner, const struct grid *grid);

/* Stage k has less of the jerk limit from now on, by the factor `by`. */
void tighten_rows(struct problem *problem, int k, double by);
#endif
