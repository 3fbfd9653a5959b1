/* A stop where the path bends too much for an integrated brake. */
#ifndef JERK_FALL_H
#define JERK_FALL_H
#include "jerk/state/state.h"

/* The plan becomes a stop on the way of the deepest fall of the speed. The
 * stored tail is `tail` mm long; a stop on a line would be `likely` mm. False:
 * none was found; the plan becomes the fall, if that is legal. */
bool fall_to_rest(jerk_planner *planner, double tail, double likely);
#endif
