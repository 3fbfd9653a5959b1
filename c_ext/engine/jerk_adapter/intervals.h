/* Intervals of the jerk-limited planner's path from the geometry and the limits
 * of pieces. */
#ifndef ENGINE_JERK_ADAPTER_INTERVALS_H
#define ENGINE_JERK_ADAPTER_INTERVALS_H
#include "engine/state/state.h"
#include "jerk/state/api.h"

/* The next interval of the path of a piece. */
jerk_interval next_interval(const struct engine *engine,
                            const struct piece *piece,
                            uint64_t i,
                            double from);
#endif
