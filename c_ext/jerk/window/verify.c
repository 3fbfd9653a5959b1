/* The checker for any processor, and the choice between its builds. */
#define CHECKER(name) name##_base
#include "jerk/window/verify_core.h"

double plan_check(const jerk_planner *planner,
                  struct grid *grid,
                  struct problem *problem) {
#ifdef JERK_AVX2
    if (__builtin_cpu_supports("avx2")) {
        return plan_check_avx2(planner, grid, problem);
    }
#endif
    return plan_check_base(planner, grid, problem);
}

int bend_inside(const jerk_planner *planner,
                const struct grid *grid,
                const struct problem *problem,
                int k,
                struct bent out[LANES]) {
#ifdef JERK_AVX2
    if (__builtin_cpu_supports("avx2")) {
        return bend_inside_avx2(planner, grid, problem, k, out);
    }
#endif
    return bend_inside_base(planner, grid, problem, k, out);
}
