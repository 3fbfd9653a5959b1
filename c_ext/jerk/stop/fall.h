/* A stop where the path bends too much for an integrated brake. */
#ifndef JERK_FALL_H
#define JERK_FALL_H
#include "jerk/state/state.h"

/* The plan becomes a stop at the end of the deepest fall of the speed, which is
 * shorter than the stored tail of `tail` mm.  False: only the speed falls. */
bool fall_to_rest(jerk_planner *planner, double tail);
#endif
