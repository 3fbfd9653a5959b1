/* What preparation or the cell has to know, in order of urgency. */
#include "engine/events.h"
#include "engine/geo/interpolate.h"
#include "engine/state/state.h"
#include "engine/store/push.h"
#include "hli/sync.h"

/* Preparation is wanted when less than a good window is ahead of the planner.
 */
static bool needs_blocks(struct engine *engine) {
    if (!ATOMIC_GET(engine->program.active)
        || ATOMIC_GET(engine->program.finished)
        || ATOMIC_GET(engine->program.expect_drain)) {
        return false;
    }
    if (ATOMIC_GET(engine->geo.cycle)
        < ATOMIC_GET(engine->program.blocks_from)) {
        return false;
    }
    uint64_t ahead =
        engine->store.element_head - ATOMIC_GET(engine->geo.active);
    return store_has_room(engine)
           && (ahead < 2u * engine->cfg.window + 256u
               || engine->store.head - ATOMIC_GET(engine->store.done) < 1024u);
}

bool plc_finished(const struct engine *engine) {
    return all_ended(&engine->group)
           && !ATOMIC_GET(first_channel(engine)->program.stay)
           && engine->hli.side
           && load_u32_acquire(&engine->hli.side->plc.finished);
}

/* A path that halts stands only once the rest has been left out, although it
 * may have come to its end by itself. */
static bool drained(struct engine *engine) {
    return ATOMIC_GET(engine->program.expect_drain)
           && ATOMIC_GET(engine->program.abort) != ABORT_ASKED
           && ATOMIC_GET(engine->geo.cycle) >= engine->program.drain_from
           && ATOMIC_GET(engine->store.done) >= engine->program.drain_at
           && geo_drained(engine);
}

int pending_event(struct engine *engine) {
    if (engine->fault) {
        return ENGINE_FAULT;
    }
    if (ATOMIC_GET(engine->modes.pending) == COMMAND_TAKEN) {
        return ENGINE_MODE_COMMAND;
    }
    if (ATOMIC_GET(engine->errors.plc_id)) {
        return ENGINE_PLC_ERROR;
    }
    if (ATOMIC_GET(engine->watchdog.event)) {
        ATOMIC_SET(engine->watchdog.event, 0);
        return ENGINE_WATCHDOG;
    }
    if (ATOMIC_GET(engine->retracing.event)) {
        ATOMIC_SET(engine->retracing.event, 0);
        return ENGINE_RETRACED;
    }
    if (ATOMIC_GET(engine->standstill.event)) {
        ATOMIC_SET(engine->standstill.event, 0);
        return ENGINE_STANDS;
    }
    if (engine->group.count > 1
        && ATOMIC_GET(engine->path_commands.head)
               != engine->path_commands.tail) {
        return ENGINE_COMMANDS;
    }
    if (drained(engine)) {
        ATOMIC_SET(engine->program.expect_drain, 0);
        return ENGINE_DRAINED;
    }
    if (ATOMIC_GET(engine->program.end) && !engine->program.end_reported) {
        engine->program.end_reported = 1;
        return ENGINE_PROGRAM_END;
    }
    if (engine->threads.started && plc_finished(engine)) {
        return ENGINE_PLC_FINISHED;
    }
    if (needs_blocks(engine)) {
        return ENGINE_NEED_BLOCKS;
    }
    return -1;
}
