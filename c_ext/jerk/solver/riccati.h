/* The Newton step as a linear-quadratic problem. */
#ifndef JERK_RICCATI_H
#define JERK_RICCATI_H
#include "jerk/state/problem.h"

/* Gains of all stages; false if the cost is not convex (or not a number). */
bool riccati_factor(struct problem *problem);

/* dx, du and dc for a gradient, with the gains of riccati_factor. */
void riccati_solve(struct problem *problem, const struct stage_grad *gradient);
#endif
