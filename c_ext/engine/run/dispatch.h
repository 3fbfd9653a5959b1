/* The feeder: copies pieces of the store into the run ring, in the order in
 * which they are to be driven. */
#ifndef ENGINE_RUN_DISPATCH_H
#define ENGINE_RUN_DISPATCH_H
#include "engine/state/state.h"

#define FED_NEAR                                                               \
    64u /* pieces fed beyond the window: what corner limits mostly have to     \
           look at ... */
#define FED_AHEAD 1064u /* ... and at the most */

void dispatch_motion(struct engine *engine, const struct piece *from);
void dispatch_event(struct engine *engine, const struct piece *from);
uint64_t dispatch_oldest(struct engine *engine);
void dispatch_path(struct engine *engine);
bool dispatch_further(struct engine *engine);
#endif
