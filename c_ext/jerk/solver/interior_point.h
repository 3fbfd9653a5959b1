/* The solver of the window: false if it has not converged (or has paused). */
#ifndef JERK_INTERIOR_POINT_H
#define JERK_INTERIOR_POINT_H
#include "jerk/state/problem.h"

typedef bool ipm_solver(struct problem *problem, int max_iterations);

ipm_solver ipm_solve, ipm_solve_base, ipm_solve_avx2;
#endif
