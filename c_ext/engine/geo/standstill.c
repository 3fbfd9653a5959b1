/* Why the path stands, since when, and at which block. The cell asks for it
 * when the path has stood for long (ENGINE_STANDS). */
#include "engine/geo/standstill.h"
#include "engine/geo/modes.h"
#include "engine/state/state.h"
#include "hli/sync.h"

uint32_t stop_conditions(struct engine *engine) {
    uint32_t bits = 0;
    if (engine->geo.v > 0) {
        return 0;
    }
    if (engine->orders.feedhold) {
        bits |= ENGINE_STOP_FEEDHOLD;
    }
    if (ATOMIC_GET(engine->orders.held_axes)) {
        bits |= ENGINE_STOP_AXIS_HOLD;
    }
    bool paused = ATOMIC_GET(engine->modes.state) == HOLD;
    if (ATOMIC_GET(engine->modes.stopped) || paused) {
        bits |= ENGINE_STOP_MODE;
    }
    if (!engine->orders.released) {
        bits |= ENGINE_STOP_RELEASE;
    }
    if (engine->program.active && !engine->program.finished && !paused
        && engine->store.done >= ATOMIC_GET(engine->store.head)) {
        bits |= ENGINE_STOP_NO_BLOCKS;
    }
    if (ATOMIC_GET(engine->modes.state) == 6u) {
        bits |= ENGINE_STOP_ERROR;
    }
    if (engine->orders.override <= 0) {
        bits |= ENGINE_STOP_OVERRIDE;
    }
    if (engine->geo.waiting_continue) {
        const struct piece *piece = piece_at(&engine->run, engine->geo.piece);
        bits |= engine->geo.stands_single ? ENGINE_STOP_SINGLE_BLOCK
                : piece->inserted         ? ENGINE_STOP_INSERTED
                : piece->code == 1        ? ENGINE_STOP_M01
                                          : ENGINE_STOP_M00;
    }
    if (engine->geo.waiting_techno) {
        bits |= ENGINE_STOP_FUNCTION;
    }
    if (engine->geo.dwelling) {
        bits |= ENGINE_STOP_DWELL;
    }
    return bits;
}

/* What stop_condition_r has no bit for. */
static uint32_t further_conditions(const struct engine *engine) {
    uint32_t bits = 0;
    if (engine->orders.rapid <= 0) {
        bits |= ENGINE_STOP_RAPID_OVERRIDE;
    }
    if (engine->orders.ext_speed <= 0) {
        bits |= ENGINE_STOP_EXTERNAL_SPEED;
    }
    if (ATOMIC_GET(engine->orders.backward)) {
        bits |= ENGINE_STOP_BACKWARD;
    }
    return bits;
}

/* The piece at which the path stands: the one under the tool, or the next one
 * where that one has been driven. */
static uint64_t standing_piece(const struct engine *engine) {
    uint64_t at = engine->geo.piece, done = engine->run.done;
    bool stop = engine->geo.waiting_continue && !engine->geo.stands_single;
    if (!stop && (at == UINT64_MAX || done > at)
        && done < ATOMIC_GET(engine->run.head)) {
        return done;
    }
    return at;
}

static void begin_standstill(struct engine *engine, uint64_t at) {
    struct standstill *stands = &engine->standstill;
    uint64_t line_n = 0;
    uint32_t file = 0;
    if (at != UINT64_MAX) {
        const struct piece *piece = piece_at(&engine->run, at);
        line_n = __atomic_load_n(&piece->told_line_n, __ATOMIC_RELAXED);
        file = __atomic_load_n(&piece->told_file, __ATOMIC_RELAXED);
    }
    stands->piece = at;
    ATOMIC_SET(stands->since, engine->geo.cycle);
    ATOMIC_SET(stands->line, (uint32_t)(line_n >> 32));
    ATOMIC_SET(stands->n, (uint32_t)line_n);
    ATOMIC_SET(stands->file, file);
}

void note_standstill(struct engine *engine) {
    struct standstill *stands = &engine->standstill;
    bool moves = engine->geo.v > 0 || !ATOMIC_GET(engine->program.active)
                 || engine->program.end;
    if (moves) {
        if (stands->conditions) {
            ATOMIC_SET(stands->conditions, 0);
        }
        return;
    }
    uint32_t bits = stop_conditions(engine) | further_conditions(engine);
    uint64_t at = standing_piece(engine);
    if (!stands->conditions || at != stands->piece) {
        begin_standstill(engine, at);
    }
    ATOMIC_SET(stands->conditions, bits ? bits : ENGINE_STOP_UNKNOWN);
    if (stands->tell_after && !(bits & ENGINE_STOP_DWELL)
        && engine->geo.cycle - stands->since == stands->tell_after) {
        ATOMIC_SET(stands->event, 1);
    }
}

void engine_tell_standstill(struct engine *engine, uint64_t cycles) {
    engine->standstill.tell_after = cycles;
}

void engine_get_standstill(struct engine *engine, engine_standstill *out) {
    struct standstill *stands = &engine->standstill;
    out->conditions = ATOMIC_GET(stands->conditions);
    out->since = ATOMIC_GET(stands->since);
    out->cycle = ATOMIC_GET(engine->geo.cycle);
    out->line = ATOMIC_GET(stands->line);
    out->n = ATOMIC_GET(stands->n);
    out->file = ATOMIC_GET(stands->file);
    out->held_axes = ATOMIC_GET(engine->orders.held_axes);
}
