/* The path brakes on the stored tail, or stands although there is path to drive
 * and nothing is committed: the planner is late. Planner, preparation and GEO
 * poll each other and sleep on nothing, so no wake can be lost. On a crowded
 * core it was the processor: others had it in the middle of a plan, as long as
 * the path stood. `away_ns` tells that from work that takes long.
 *
 * A release, a new program and a resumed path need a commit first. So standing
 * counts only once it has lasted as long as a commit lasts at most.
 */
#include "engine/commit/lateness.h"
#include "engine/commit/commit.h"
#include "engine/state/state.h"

static bool stands_by_order(struct engine *engine) {
    const struct orders *orders = &engine->orders;
    const struct geo *geo = &engine->geo;
    return ATOMIC_GET(orders->hold) || orders->override <= 0.0
           || orders->rapid <= 0.0 || orders->ext_speed <= 0.0
           || orders->held_axes || geo->waiting_continue || geo->waiting_techno
           || geo->dwelling || geo->stands_single
           || ATOMIC_GET(engine->program.hold_start);
}

static bool has_path(struct engine *engine) {
    return ATOMIC_GET(engine->run.head) > ATOMIC_GET(engine->run.done)
           || (ATOMIC_GET(engine->dispatch.dir) > 0
               && ATOMIC_GET(engine->store.head)
                      > ATOMIC_GET(engine->store.done));
}

void note_lateness(struct engine *engine) {
    struct lateness *late = &engine->lateness;
    const struct geo *geo = &engine->geo;
    uint64_t word = ATOMIC_GET(engine->commit.word);
    bool braking = geo->in_tail && !geo->leaves;
    bool stands = !geo->has_phase && ((word & 1) || geo->consumed >= word >> 2);
    if (!(braking || stands) || stands_by_order(engine) || !has_path(engine)) {
        late->cycles_now = 0;
        return;
    }
    late->cycles_now++;
    uint64_t patience =
        (uint64_t)(commit_high(&engine->cfg) / engine->cfg.cycle_s) + 1;
    if (late->cycles_now < patience) {
        return;
    }
    if (late->cycles_now == patience) {
        late->times++;
        late->cycles += patience - 1;
    }
    late->cycles++;
}
