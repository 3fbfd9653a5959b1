/* Profiles near to a guess for any processor, and the choice between the
 * builds. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic ignored                                                 \
    "-Wpsabi" /* vectors are passed between static functions only */
#endif
#define PROJECTION(name) name##_base
#include "jerk/solver/faster_guess_core.h"

bool nearest_profile(struct problem *problem, double stiffness, bool goes_on) {
#ifdef JERK_AVX2
    if (__builtin_cpu_supports("avx2")) {
        return nearest_profile_avx2(problem, stiffness, goes_on);
    }
#endif
    return nearest_profile_base(problem, stiffness, goes_on);
}

bool faster_guess(struct problem *problem, double *growth) {
#ifdef JERK_AVX2
    if (__builtin_cpu_supports("avx2")) {
        return faster_guess_avx2(problem, growth);
    }
#endif
    return faster_guess_base(problem, growth);
}
