/* The engine's programs: one begins, one is aborted. Called while nothing moves
 * but for engine_abort. */
#include <string.h>
#include "engine/geo/interpolate.h"
#include "engine/geo/rt_cycle.h"
#include "engine/geo/technology.h"
#include "engine/geo/standstill.h"
#include "engine/jerk_adapter/adapter.h"
#include "engine/path/limits.h"
#include "engine/plan/prediction.h"
#include "engine/run/standstill_jobs.h"
#include "engine/state/state.h"
#include "engine/store/element_map.h"
#include "engine/store/marked_log.h"
#include "engine/store/push.h"
#include "engine/store/technology_rows.h"

/* Brake, leave out what is left and report the program's end. No row may be
 * pushed any more. */
void engine_abort(struct engine *engine) {
    log_program_end(engine);
    ATOMIC_SET(engine->program.expect_drain, 0);
    ATOMIC_SET(engine->retracing.event, 0);
    engine->retracing.backward = false;
    ATOMIC_SET(engine->program.finished, 1);
    ATOMIC_SET(engine->program.abort, ABORT_ASKED);
}

void engine_halt(struct engine *engine) {
    ATOMIC_SET(engine->program.finished, 0);
    ATOMIC_SET(engine->retracing.event, 0);
    engine->retracing.backward = false;
    engine_expect_drain(engine);
    ATOMIC_SET(engine->program.abort, ABORT_ASKED);
}

/* Early functions have been put out although their rows are left out. */
static bool is_done(const struct engine *engine, uint64_t i) {
    const struct piece *piece = store_at(&engine->store, i);
    return i < engine->program.halt_piece ? !log_marker_is_ahead(engine, piece)
                                          : piece->put_out;
}

/* The lowest rows that are left out: of all, and of motions. */
static void find_left(const struct engine *engine, engine_left *out) {
    uint64_t head = engine->store.head;
    out->row = out->path = engine->push.rows_taken;
    for (uint64_t i = first_of_block(engine); i < head; i++) {
        const struct piece *piece = store_at(&engine->store, i);
        if (is_gate(piece) || is_done(engine, i)) {
            continue;
        }
        if (piece->row < out->row) {
            out->row = piece->row;
        }
        if (is_motion(piece) && piece->row < out->path) {
            out->path = piece->row;
        }
    }
}

int32_t engine_left_out(struct engine *engine,
                        engine_left *out,
                        uint64_t *done,
                        int32_t most) {
    const struct program_state *program = &engine->program;
    uint64_t head = engine->store.head;
    int32_t count = 0;
    memset(out, 0, sizeof *out);
    find_left(engine, out);
    out->driven = program->halt_s;
    out->whole = program->halt_whole;
    for (uint64_t i = first_of_block(engine); i < head && count < most; i++) {
        const struct piece *piece = store_at(&engine->store, i);
        if (!is_gate(piece) && is_done(engine, i) && piece->row >= out->row) {
            done[count++] = piece->row;
        }
    }
    return count;
}

void engine_resync(struct engine *engine, int in_block) {
    bool left_out = ATOMIC_GET(engine->program.abort) == ABORT_DONE;
    if (left_out) {
        techno_left_out(engine);
    }
    ATOMIC_SET(engine->program.abort, 0);
    memcpy(engine->push.last_end,
           engine->geo.position,
           sizeof engine->push.last_end);
    engine->push.short_motions.rows = 0;
    memcpy(engine->push.element_end,
           engine->geo.position,
           sizeof engine->push.element_end);
    element_map_behind(engine);
    engine->push.has_tangent = engine->push.has_motion_piece =
        engine->push.stop_pending = false;
    engine->push.begun = engine->push.begun && !in_block;
    engine->push.path = engine->geo.path - engine->geo.path_shift;
    engine->push.distance =
        (engine->geo.dist - engine->geo.dist_shift) * TENTH_UM;
    engine->push.end_speed = 0.0f;
    engine->push.epoch++;
    engine->push.epoch_element = engine->push.loop_behind =
        engine->store.element_head;
    geo_go_on(engine); /* what was left out is told no more */
    if (left_out) {
        log_left_out(engine);
    }
}

int engine_set_axis(struct engine *engine,
                    int32_t place,
                    const engine_axis *axis) {
    if (place < 0 || place >= engine->cfg.axis_count) {
        return -1;
    }
    engine->cfg.v_max[place] = axis->v_max;
    engine->cfg.a_max[place] = axis->a_max;
    engine->cfg.j_max[place] = axis->j_max;
    engine->cfg.axis_id[place] = axis->number;
    engine->program.axes[place] = *axis;
    engine->geo.position[place] = engine->dispatch.stand[place] =
        axis->position;
    if (engine->geo.piece != UINT64_MAX) { /* it is shown as the target */
        piece_at(&engine->run, engine->geo.piece)->end[place] = axis->position;
    }
    if (engine->hli.segment) {
        engine->hli.axis[place] =
            axis->area < 0 ? NULL : &engine->hli.segment->axis[axis->area];
    }
    ATOMIC_SET(engine->program.axes_changed, 1);
    return jerk_adapter_renew(engine) && prediction_renew(engine) ? 0 : -1;
}

void engine_suppress_functions(struct engine *engine, int suppressed) {
    ATOMIC_SET(engine->technology.suppressed, suppressed);
}

void engine_set_program_name(struct engine *engine, const char *name) {
    memset(engine->program.name, 0, sizeof engine->program.name);
    memcpy(engine->program.name,
           name,
           strnlen(name, sizeof engine->program.name - 1));
    ATOMIC_SET(engine->program.name_changed, 1);
}

void engine_set_error(struct engine *engine, uint32_t id) {
    ATOMIC_SET(engine->errors.channel_id, id);
}

/* Pending technology units and edges go; level units, enable_w and what the PLC
 * has written stay (hli_reference 1.4). */
void engine_reset_channel(struct engine *engine) {
    technology_clear(&engine->technology);
}

static void begin_preparation(struct engine *engine) {
    memcpy(engine->push.last_end,
           engine->geo.position,
           sizeof engine->push.last_end);
    engine->push.short_motions.rows = 0;
    memcpy(engine->push.element_end,
           engine->geo.position,
           sizeof engine->push.element_end);
    element_map_behind(engine);
    engine->push.has_tangent = engine->push.has_motion_piece =
        engine->push.stop_pending = engine->push.m01_pending =
            engine->push.begun = engine->push.in_loop =
                engine->push.behind_loop = false;
    engine->push.distance = engine->push.path = 0.0;
    limits_reset(&engine->push);
    engine->push.end_speed = 0.0f;
    engine->push.epoch++;
    engine->push.epoch_element = engine->push.loop_behind =
        engine->store.element_head;
    memset(&engine->technology_rows.pushed,
           0,
           sizeof engine->technology_rows.pushed);
    memset(&engine->technology_rows.gated,
           0,
           sizeof engine->technology_rows.gated);
    engine->technology_rows.has_pending_gate = false;
    engine->technology_rows.std_block = engine->technology_rows.std_index =
        engine->technology_rows.behind_count = 0;
    engine->technology_rows.std_base = 0;
    engine->technology_rows.spindle_rev = 0.0;
    engine->technology_rows.spindle_move = 0;
    engine->technology_rows.spindle_pending = false;
    ATOMIC_SET(engine->early.done, engine->early.head);
    ATOMIC_SET(engine->program.finished, 0);
    log_reset(&engine->log); /* behind it: without entries more will come */
    ATOMIC_SET(engine->program.expect_drain, 0);
    ATOMIC_SET(engine->program.drain_at, engine->store.head);
}

static void begin_motion(struct engine *engine) {
    struct geo *geo = &engine->geo;
    memset(&engine->technology.done, 0, sizeof engine->technology.done);
    memset(&engine->technology.done_again,
           0,
           sizeof engine->technology.done_again);
    technology_clear(&engine->technology);
    geo->dist = geo->path = geo->path_shift = geo->v = geo->feed = 0.0;
    geo->count = geo->n = 0;
    geo->waiting_continue = geo->waiting_techno = geo->stands_single =
        geo->dwelling = geo->has_phase = false;
    geo->in_loop = false;
    geo->loop_count = geo->loop_written = 0;
    geo->loops_repeated = geo->loops_left_out = 0;
    engine->orders.rt_loop_program = false;
    rt_cycles_begin_program(engine);
    geo->active = engine->store.element_head;
    geo_begin_distance(engine);
    ATOMIC_SET(engine->program.abort, 0);
    ATOMIC_SET(engine->orders.override_ignored, 0);
    ATOMIC_SET(engine->modes.hold_to_cell, 0);
    ATOMIC_SET(engine->modes.macro_runs, 0);
    ATOMIC_SET(engine->program.end, 0);
    engine->program.end_reported = 0;
    time_causes_begin(&engine->time_causes);
}

void engine_stand_by(struct engine *engine) {
    ATOMIC_SET(engine->program.active, 0);
}

/* A program starts where the axes stand: distance, block count and log begin
 * anew. */
void engine_begin_program(struct engine *engine) {
    begin_preparation(engine);
    begin_motion(engine);
    dispatch_begin_program(engine);
    prediction_begin_program(engine);
    ATOMIC_SET(engine->program.active, 1);
}
