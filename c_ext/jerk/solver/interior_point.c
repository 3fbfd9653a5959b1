/* The solver for any processor, and the choice between its builds. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3")
#pragma GCC diagnostic ignored                                                 \
    "-Wpsabi" /* vectors are passed between static functions only */
#endif
#define IPM_SOLVE ipm_solve_base
#include "jerk/solver/interior_point.h"
#include "jerk/solver/interior_point_core.h"

bool ipm_solve(struct problem *problem, int max_iterations) {
#ifdef JERK_AVX2
    if (__builtin_cpu_supports("avx2")) {
        return ipm_solve_avx2(problem, max_iterations);
    }
#endif
    return ipm_solve_base(problem, max_iterations);
}
