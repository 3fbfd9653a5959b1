/* One cycle of GEO as it is recorded. */
#ifndef RECORD_H
#define RECORD_H
#include "engine/state/state.h"

void record_cycle(struct engine *engine);
/* A channel that takes no part in this cycle stands: its last row again.  Its
 * engine is not touched, its thread may be at work. */
void record_standing(struct engine *engine, uint64_t cycle);
/* Write the next row without handing it out, so that its cache lines are there
 * when the cycle comes. */
void record_rehearse(struct engine *engine);

#endif
