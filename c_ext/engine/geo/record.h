/* One cycle of GEO as it is recorded. */
#ifndef RECORD_H
#define RECORD_H
#include "engine/state/state.h"

void record_cycle(struct engine *engine);

#endif
