/* A stop where the path bends too much for an integrated brake. */
#ifndef JERK_FALL_H
#define JERK_FALL_H
#include "jerk/state/state.h"

/* There is none; there is no stop at its end; the plan is such a stop. */
enum fall_end {
    FALL_NONE,
    FALL_ALONE,
    FALL_RESTS
};

/* The plan becomes a stop at the end of the deepest fall of the speed. The
 * stored tail is `tail` mm long; a stop on a line would be `likely` mm. */
enum fall_end fall_to_rest(jerk_planner *planner, double tail, double likely);

/* The plan becomes that fall: it is legal, and slower. */
bool fall_on(jerk_planner *planner, double tail, double likely);
#endif
