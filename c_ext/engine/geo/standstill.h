/* Why the path stands, since when, and at which block. */
#ifndef ENGINE_GEO_STANDSTILL_H
#define ENGINE_GEO_STANDSTILL_H
#include "engine/state/state.h"

/* Bits of stop_condition_r; 0 while the path moves. */
uint32_t stop_conditions(struct engine *engine);

/* Once a cycle, behind the motion. */
void note_standstill(struct engine *engine);
#endif
