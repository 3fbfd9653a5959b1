/* The Newton step as a linear-quadratic problem. */
#ifndef JERK_RICCATI_H
#define JERK_RICCATI_H
#include "jerk/state/problem.h"

/* Inputs of the last stage but one by its state: c = kx x + ku u. */
void tie_to_rest(const struct problem *problem, double kx[2], double ku[2]);

/* Gains of all stages; false if the cost is not convex (or not a number). */
bool riccati_factor(struct problem *problem);

/* dx, du and dc for a gradient, with the gains of riccati_factor. */
void riccati_solve(struct problem *problem, const struct stage_grad *gradient);
#endif
