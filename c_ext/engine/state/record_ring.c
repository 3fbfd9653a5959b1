/* Rings of what is recorded: one writer, one reader, nobody waits. */
#include <stdlib.h>
#include "engine/state/record_ring.h"

int record_ring_new(struct record_ring *ring, size_t bytes, int64_t size) {
    ring->rows = calloc((size_t)size, bytes);
    ring->bytes = bytes;
    ring->size = ring->rows ? size : 0;
    return ring->rows ? 0 : -1;
}

void record_free(struct recording *recording) {
    free(recording->samples.rows);
    free(recording->functions.rows);
    free(recording->requests.rows);
}

static bool ring_full(const struct record_ring *ring) {
    return ring->rows
           && ATOMIC_GET(ring->head) - ATOMIC_GET(ring->tail) >= ring->size;
}

bool record_full(const struct recording *recording) {
    return ring_full(&recording->samples) || ring_full(&recording->functions)
           || ring_full(&recording->requests);
}

void *record_room(struct record_ring *ring) {
    if (!ring->rows || ring_full(ring)) {
        return NULL;
    }
    return ring->rows + (size_t)ring->at * ring->bytes;
}

void *record_next(struct record_ring *ring) {
    void *row = record_room(ring);
    if (!row && ring->rows) {
        ATOMIC_SET(ring->lost, ring->lost + 1);
    }
    return row;
}

const void *record_last(const struct record_ring *ring) {
    int64_t at = ring->at > 0 ? ring->at : ring->size;
    return ring->rows + (size_t)(at - 1) * ring->bytes;
}

void record_put(struct record_ring *ring) {
    ring->at = ring->at + 1 < ring->size ? ring->at + 1 : 0;
    ATOMIC_SET(ring->head, ring->head + 1);
}
