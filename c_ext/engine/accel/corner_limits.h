/* Look-ahead: how fast each corner may be passed. */
#ifndef ENGINE_ACCEL_CORNER_LIMITS_H
#define ENGINE_ACCEL_CORNER_LIMITS_H
#include "engine/state/state.h"

/* Finish the corner limits of all pieces up to the end of what is known. */
void corner_caps(struct engine *engine);

static inline bool next_motion(struct run_ring *run,
                               uint64_t *i,
                               uint64_t head) {
    do {
        (*i)++;
        if (*i >= head) {
            return false;
        }
    } while (!is_motion(piece_at(run, *i)));
    return true;
}

#endif
