/* One cycle of GEO as it is recorded. */
#ifndef RECORD_H
#define RECORD_H
#include "engine/state/state.h"

void record_cycle(struct engine *engine);
/* Write the next row without handing it out, so that its cache lines are there
 * when the cycle comes. */
void record_rehearse(struct engine *engine);

#endif
