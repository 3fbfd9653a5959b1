/* Rows of the axes for any processor, and the choice between the builds. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored                                                 \
    "-Wpsabi" /* vectors are passed between static functions only */
#endif
#define AXIS_ROWS axis_rows_base
#include "jerk/rows/axis_rows_core.h"

void axis_rows(const jerk_planner *planner,
               const struct grid *grid,
               struct problem *problem) {
#ifdef JERK_AVX2
    if (__builtin_cpu_supports("avx2")) {
        axis_rows_avx2(planner, grid, problem);
        return;
    }
#endif
    axis_rows_base(planner, grid, problem);
}
