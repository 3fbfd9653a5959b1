/* One cycle of GEO: commands, motion, answers to the planner, samples,
 * publication. */
#ifndef ENGINE_GEO_CYCLE_H
#define ENGINE_GEO_CYCLE_H
#include "engine/state/state.h"

void geo_cycle(struct engine *engine);
void geo_rehearse(struct engine *engine);
#endif
