/* Profiles near to a guess for processors with AVX2: same results. */
#include "jerk/solver/projection.h"
#ifdef JERK_AVX2
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC target("avx2")
#endif
#define PROJECTION(name) name##_avx2
#include "jerk/solver/faster_guess_core.h"
#endif
