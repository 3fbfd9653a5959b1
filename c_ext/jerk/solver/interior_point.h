/* The solver of the window: false if it has not converged (or has paused). */
#ifndef JERK_INTERIOR_POINT_H
#define JERK_INTERIOR_POINT_H
#include "jerk/state/problem.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define JERK_AVX2
bool ipm_solve_avx2(problem *problem, int max_iterations);
#endif
bool ipm_solve_base(struct problem *problem, int max_iterations);
bool ipm_solve(struct problem *problem, int max_iterations);
#endif
