/* The feeder: copies pieces of the store into the run ring, in the order in
 * which they are to be driven. */
#ifndef ENGINE_RUN_DISPATCH_H
#define ENGINE_RUN_DISPATCH_H
#include "engine/state/state.h"

#define FED_NEAR                                                               \
    64u /* pieces fed beyond the window: what corner limits mostly have to     \
           look at ... */
#define FED_AHEAD 1064u /* ... and at the most */

void feed_motion(struct engine *engine, const struct piece *from);
void feed_event(struct engine *engine, const struct piece *from);
uint64_t feed_oldest(struct engine *engine);
void feed(struct engine *engine);
bool feed_further(struct engine *e);
#endif
