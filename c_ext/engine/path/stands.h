/* Whether the axes stand at the start of a piece, under the conditions planned
 * with. */
#ifndef ENGINE_PATH_STANDS_H
#define ENGINE_PATH_STANDS_H
#include "engine/path/technology_counts.h"
#include "engine/state/state.h"

static inline bool stands_before(const struct plan_conditions *plan,
                                 const struct piece *piece) {
    if (piece->m01 && plan->m01) {
        return true;
    }
    if ((piece->new_block && plan->single)
        || (piece->moving & plan->held_axes)) {
        return true;
    }
    return piece->stop_before
           || (piece->gated
               && !gate_open(piece->replay ? &plan->done_again : &plan->done,
                             &piece->need));
}

#endif
