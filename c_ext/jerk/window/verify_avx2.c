/* The checker for processors with AVX2: same results. */
#include "jerk/window/verify.h"
#ifdef JERK_AVX2
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC target("avx2")
#endif
#define CHECKER(name) name##_avx2
#include "jerk/window/verify_core.h"
#endif
