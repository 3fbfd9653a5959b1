/* The feeder: copies pieces of the store into the run ring, in the order in
 * which they are to be driven. */
#ifndef ENGINE_RUN_DISPATCH_H
#define ENGINE_RUN_DISPATCH_H
#include "engine/state/state.h"

void dispatch_motion(struct engine *engine, const struct piece *from);
void dispatch_event(struct engine *engine, const struct piece *from);
uint64_t dispatch_oldest(struct engine *engine);
void dispatch_path(struct engine *engine);
bool dispatch_further(struct engine *engine);
#endif
