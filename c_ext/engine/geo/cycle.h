/* One cycle of GEO: commands, motion, answers to the planner, samples,
 * publication. */
#ifndef ENGINE_GEO_CYCLE_H
#define ENGINE_GEO_CYCLE_H
#include "engine/state/state.h"

void geo_cycle(struct engine *engine);

/* Just ahead of a real-time cycle, no time passes: the position and what the
 * PLC is shown of it once more. */
void geo_rehearse(struct engine *engine);
#endif
