/* The table of a replay, filled by who loads this library. */
#include "calls.h"

struct fuzz_calls fuzz_calls;
