/* Rings of what is recorded: GEO, the technology functions and the look-ahead
 * write, the recorder empties them. GEO never waits for it. */
#ifndef RECORD_RING_H
#define RECORD_RING_H
#include "engine/state/state.h"

/* Room for `size` rows of `bytes`; 0, or -1: no memory. */
int record_ring_new(struct record_ring *ring, size_t bytes, int64_t size);
/* The next row of a ring to be written, NULL: nothing is recorded, or there is
 * no room and the row counts as lost. record_put() hands it out. */
void *record_next(struct record_ring *ring);
/* The row that was put last; there is one. */
const void *record_last(const struct record_ring *ring);
/* The same row, and nothing is lost where there is none. */
void *record_room(struct record_ring *ring);
void record_put(struct record_ring *ring);
bool record_full(const struct recording *recording);
void record_free(struct recording *recording);

#endif
