/* The engine's programs: one begins, one is aborted. Called while nothing moves
 * but for engine_abort. */
#include <string.h>
#include "engine/geo/interpolate.h"
#include "engine/geo/technology.h"
#include "engine/path/limits.h"
#include "engine/plan/prediction.h"
#include "engine/run/standstill_jobs.h"
#include "engine/state/state.h"
#include "engine/store/element_map.h"
#include "engine/store/marked_log.h"
#include "engine/store/push.h"

/* Brake, leave out what is left and report the program's end. No row may be
 * pushed any more. */
void engine_abort(struct engine *engine) {
    log_program_end(engine);
    ATOMIC_SET(engine->expect_drain, 0);
    ATOMIC_SET(engine->retraced_event, 0);
    engine->was_backward = false;
    ATOMIC_SET(engine->finished, 1);
    ATOMIC_SET(engine->abort_now, 1);
}

void engine_halt(struct engine *engine) {
    ATOMIC_SET(engine->finished, 0);
    engine_expect_drain(engine);
    ATOMIC_SET(engine->abort_now, 1);
}

void engine_resync(struct engine *engine) {
    ATOMIC_SET(engine->abort_now, 0);
    memcpy(engine->last_end, engine->geo.position, sizeof engine->last_end);
    engine->carried.rows = 0;
    memcpy(engine->element_end,
           engine->geo.position,
           sizeof engine->element_end);
    map_behind_element(engine);
    engine->has_tangent = engine->has_motion_piece = engine->stop_pending =
        false;
    engine->pushed_path = engine->geo.path - engine->geo.path_shift;
    engine->distance = (engine->geo.dist - engine->geo.dist_shift) * TENTH_UM;
    engine->end_speed = 0.0f;
}

void engine_suppress_functions(struct engine *engine, int suppressed) {
    ATOMIC_SET(engine->suppressed, suppressed);
}

void engine_set_program_name(struct engine *engine, const char *name) {
    memset(engine->program_name, 0, sizeof engine->program_name);
    memcpy(engine->program_name,
           name,
           strnlen(name, sizeof engine->program_name - 1));
    ATOMIC_SET(engine->name_changed, 1);
}

void engine_set_error(struct engine *engine, uint32_t id) {
    ATOMIC_SET(engine->error_id, id);
}

/* Pending technology units and edges go; level units, enable_w and what the PLC
 * has written stay (hli_reference 1.4). */
void engine_reset_channel(struct engine *engine) {
    technology_clear(engine);
}

static void begin_preparation(struct engine *engine) {
    memcpy(engine->last_end, engine->geo.position, sizeof engine->last_end);
    engine->carried.rows = 0;
    memcpy(engine->element_end,
           engine->geo.position,
           sizeof engine->element_end);
    map_behind_element(engine);
    engine->has_tangent = engine->has_motion_piece = engine->stop_pending =
        engine->m01_pending = engine->in_loop = false;
    engine->distance = engine->pushed_path = 0.0;
    limits_reset(engine);
    engine->end_speed = 0.0f;
    engine->push_epoch++;
    engine->epoch_element = engine->element_head;
    memset(&engine->pushed, 0, sizeof engine->pushed);
    memset(&engine->gated, 0, sizeof engine->gated);
    engine->has_pending_gate = false;
    engine->std_block = engine->std_index = engine->behind_count = 0;
    engine->std_base = 0;
    engine->spindle_rev = 0.0;
    engine->spindle_move = 0;
    engine->spindle_pending = false;
    ATOMIC_SET(engine->early_done, engine->early_head);
    log_reset(engine);
    ATOMIC_SET(engine->finished, 0);
    ATOMIC_SET(engine->expect_drain, 0);
    engine->drain_at = engine->store_head;
}

static void begin_motion(struct engine *engine) {
    struct geo *geo = &engine->geo;
    memset(&engine->done, 0, sizeof engine->done);
    memset(&engine->done_again, 0, sizeof engine->done_again);
    technology_clear(engine);
    geo->dist = geo->path = geo->path_shift = geo->v = geo->feed = 0.0;
    geo->count = geo->n = 0;
    geo->waiting_continue = geo->waiting_techno = geo->stands_single =
        geo->dwelling = geo->has_phase = false;
    geo->active = engine->element_head;
    geo_begin_distance(engine);
    ATOMIC_SET(engine->abort_now, 0);
    ATOMIC_SET(engine->override_ignored, 0);
    ATOMIC_SET(engine->hold_to_cell, 0);
    ATOMIC_SET(engine->macro_runs, 0);
    ATOMIC_SET(engine->program_end, 0);
    engine->end_reported = 0;
}

void engine_stand_by(struct engine *engine) {
    ATOMIC_SET(engine->program_active, 0);
}

/* A program starts where the axes stand: distance, block count and log begin
 * anew. */
void engine_begin_program(struct engine *engine) {
    begin_preparation(engine);
    begin_motion(engine);
    feed_begin_program(engine);
    foresight_begin_program(engine);
    ATOMIC_SET(engine->program_active, 1);
}
