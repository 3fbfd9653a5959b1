/* The run ring: pieces in the order in which they are driven; copied in, cut
 * off, shortened. */
#ifndef ENGINE_RUN_RUN_RING_H
#define ENGINE_RUN_RUN_RING_H
#include "engine/state/state.h"

bool run_has_room(struct engine *engine);
struct piece *feed_copy(struct engine *engine, const struct piece *from);
void feed_publish(struct engine *engine);
void feed_function(struct engine *engine,
                   const struct piece *from,
                   uint32_t synch);
uint64_t feed_first_free(struct engine *engine);
void feed_cut(struct engine *engine, uint64_t head);
void feed_shorten(struct engine *engine, struct piece *piece, double s);
#endif
