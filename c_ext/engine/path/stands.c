/* What decides where the axes must stand. */
#include "engine/path/stands.h"
#include "engine/path/technology_counts.h"
#include "engine/state/state.h"

struct stand_orders stand_orders_now(const struct engine *engine) {
    return (struct stand_orders){
        .done = techno_done(&engine->technology.done),
        .done_again = techno_done(&engine->technology.done_again),
        .held_axes = ATOMIC_GET(engine->orders.held_axes),
        .single = ATOMIC_GET(engine->orders.single),
        .m01 = ATOMIC_GET(engine->orders.m01),
    };
}

bool same_stand_orders(const struct engine *engine,
                       const struct stand_orders *then) {
    return ATOMIC_GET(engine->orders.single) == then->single
           && ATOMIC_GET(engine->orders.m01) == then->m01
           && ATOMIC_GET(engine->orders.held_axes) == then->held_axes
           && same_techno(&engine->technology.done, &then->done)
           && same_techno(&engine->technology.done_again, &then->done_again);
}
