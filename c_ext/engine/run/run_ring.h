/* The run ring: pieces in the order in which they are driven; copied in, cut
 * off, shortened. */
#ifndef ENGINE_RUN_RUN_RING_H
#define ENGINE_RUN_RUN_RING_H
#include "engine/state/state.h"

bool run_has_room(struct run_ring *run);
struct piece *run_copy(struct run_ring *run, const struct piece *from);
void run_publish(struct run_ring *run);

/* A function outside the program's count: again on a stretch driven before, or
 * inserted by the PLC. One at a time. */
void run_function(struct engine *engine,
                  const struct piece *from,
                  uint32_t synch);

/* First piece of the run ring that may still be changed: none that is
 * committed, none that the tail runs over. */
uint64_t run_first_free(struct engine *engine);

/* Drop what has been fed from `head` on. */
void run_cut(struct engine *engine, uint64_t head);

/* Shorten a motion that is driven forward to its first s mm. */
void run_shorten(struct engine *engine, struct piece *piece, double s);
#endif
