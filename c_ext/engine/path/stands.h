/* Whether the axes stand at the start of a piece, under the conditions planned
 * with. */
#ifndef ENGINE_PATH_STANDS_H
#define ENGINE_PATH_STANDS_H
#include "engine/path/technology_counts.h"
#include "engine/state/state.h"

/* As operator, PLC and acknowledged functions have it now. */
struct stand_orders stand_orders_now(const struct engine *engine);

/* Whether they are still the same. */
bool same_stand_orders(const struct engine *engine,
                       const struct stand_orders *then);

static inline bool stands_before(const struct plan_conditions *plan,
                                 const struct piece *piece) {
    const struct stand_orders *orders = &plan->stands;
    if (piece->m01 && orders->m01) {
        return true;
    }
    if ((piece->new_block && orders->single)
        || (piece->moving & orders->held_axes)) {
        return true;
    }
    return piece->stop_before
           || (piece->gated
               && !gate_open(piece->replay ? &orders->done_again
                                           : &orders->done,
                             &piece->need));
}

#endif
