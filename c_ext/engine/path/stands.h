/* Whether the axes stand at the start of a piece, under the conditions planned
 * with. */
#ifndef ENGINE_PATH_STANDS_H
#define ENGINE_PATH_STANDS_H
#include "engine/path/technology_counts.h"
#include "engine/state/state.h"

static inline bool stands_before(const struct engine *engine,
                                 const struct piece *piece) {
    if ((piece->m01 && engine->plan.m01)
        || (piece->new_block && engine->plan.single)
        || (piece->moving & engine->plan.held_axes)) {
        return true;
    }
    return piece->stop_before
           || (piece->gated
               && !gate_open(piece->replay ? &engine->plan.done_again
                                           : &engine->plan.done,
                             &piece->need));
}

#endif
