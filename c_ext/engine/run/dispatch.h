/* The dispatch: copies pieces of the store into the run ring, in the order in
 * which they are to be driven. */
#ifndef ENGINE_RUN_DISPATCH_H
#define ENGINE_RUN_DISPATCH_H
#include "engine/state/state.h"

void dispatch_motion(struct engine *engine, const struct piece *from);
void dispatch_event(struct engine *engine, const struct piece *from);

/* Backward motion ends here. */
uint64_t dispatch_oldest(struct engine *engine);

/* Feed as far as the planner has to see. */
void dispatch_path(struct engine *engine);

/* Corner limits look further than what is fed: feed more from now on. */
bool dispatch_further(struct engine *engine);
#endif
