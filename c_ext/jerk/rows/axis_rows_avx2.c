/* Rows of the axes for processors with AVX2: same results. */
#include "jerk/rows/axis_rows.h"
#ifdef JERK_AVX2
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC target("avx2")
#endif
#define AXIS_ROWS axis_rows_avx2
#include "jerk/rows/axis_rows_core.h"
#endif
