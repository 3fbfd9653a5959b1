/* The engine's programs: one begins, one is aborted. Called while nothing moves but for engine_abort. */
#include <string.h>
#include "engine/state/state.h"

/* Brake, leave out what is left and report the program's end. No row may be pushed any more. */
void engine_abort(engine *e) {
    log_program_end(e);
    ATOMIC_SET(e->expect_drain, 0);
    ATOMIC_SET(e->retraced_event, 0);
    e->was_backward = false;
    ATOMIC_SET(e->finished, 1);
    ATOMIC_SET(e->abort_now, 1);
}

void engine_halt(engine *e) {
    ATOMIC_SET(e->finished, 0);
    engine_expect_drain(e);
    ATOMIC_SET(e->abort_now, 1);
}

void engine_resync(engine *e) {
    ATOMIC_SET(e->abort_now, 0);
    memcpy(e->last_end, e->geo.position, sizeof e->last_end);
    e->carried.rows = 0;
    memcpy(e->element_end, e->geo.position, sizeof e->element_end);
    map_behind_element(e);
    e->has_tangent = e->has_motion_piece = e->stop_pending = false;
    e->pushed_path = e->geo.path - e->geo.path_shift;
    e->distance = (e->geo.dist - e->geo.dist_shift) * TENTH_UM;
    e->end_speed = 0.0f;
}

static void clear_units(engine *e) {
    memset(e->std_slots, 0, sizeof e->std_slots);
    memset(e->late_slots, 0, sizeof e->late_slots);
    memset(e->spindle_slots, 0, sizeof e->spindle_slots);
    e->std_open = e->late_open = e->std_used = 0;
    memset(e->spindle_open, 0, sizeof e->spindle_open);
    e->spindle_used = 0;
    ATOMIC_SET(e->units_cleared, 0);
}

/* The PLC's side of it, in the cycle. */
void techno_clear_units(engine *e) {
    if (ATOMIC_GET(e->units_cleared)) return;
    ATOMIC_SET(e->units_cleared, 1);
    for (uint32_t i = 0; i <= HLI_TU_CH_STD_SYNC_MAXIDX; i++) store_u8_release(&e->channel->techno_unit_std_sync[i].please_rw, 0);
    for (uint32_t i = 0; i <= HLI_TU_CH_LATE_SYNC_MAXIDX; i++) store_u8_release(&e->channel->techno_unit_late_sync[i].please_rw, 0);
    store_u16_relaxed(&e->channel->used_units_std_sync_r, 0);
    store_u16_relaxed(&e->channel->used_units_late_sync_r, 0);
    for (uint32_t k = 0; k < e->cfg.spindle_count; k++) {
        HLI_AXIS *axis = &e->segment->axis[e->cfg.axis_count + (int)k];
        for (uint32_t i = 0; i <= HLI_TU_AX_STD_SYNC_MAXIDX; i++) store_u8_release(&axis->techno_unit_std_sync[i].please_rw, 0);
        store_u16_relaxed(&axis->used_units_std_sync_r, 0);
    }
}

void engine_suppress_functions(engine *e, int suppressed) { ATOMIC_SET(e->suppressed, suppressed); }

void engine_set_program_name(engine *e, const char *name) {
    memset(e->program_name, 0, sizeof e->program_name);
    memcpy(e->program_name, name, strnlen(name, sizeof e->program_name - 1));
    ATOMIC_SET(e->name_changed, 1);
}

void engine_set_error(engine *e, uint32_t id) { ATOMIC_SET(e->error_id, id); }

/* Pending technology units and edges go; level units, enable_w and what the PLC has written stay (hli_reference 1.4). */
void engine_reset_channel(engine *e) { clear_units(e); }

static void begin_preparation(engine *e) {
    memcpy(e->last_end, e->geo.position, sizeof e->last_end);
    e->carried.rows = 0;
    memcpy(e->element_end, e->geo.position, sizeof e->element_end);
    map_behind_element(e);
    e->has_tangent = e->has_motion_piece = e->stop_pending = e->m01_pending = e->in_loop = false;
    e->distance = e->pushed_path = 0.0;
    limits_reset(e);
    e->end_speed = 0.0f;
    e->push_epoch++;
    e->epoch_element = e->element_head;
    memset(&e->pushed, 0, sizeof e->pushed);
    memset(&e->gated, 0, sizeof e->gated);
    e->has_pending_gate = false;
    e->std_block = e->std_index = e->behind_count = 0;
    e->std_base = 0;
    e->spindle_rev = 0.0;
    e->spindle_move = 0;
    e->spindle_pending = false;
    ATOMIC_SET(e->early_done, e->early_head);
    log_reset(e);
    ATOMIC_SET(e->finished, 0);
    ATOMIC_SET(e->expect_drain, 0);
    e->drain_at = e->store_head;
}

static void begin_motion(engine *e) {
    geo *g = &e->geo;
    memset(&e->done, 0, sizeof e->done);
    memset(&e->done_again, 0, sizeof e->done_again);
    clear_units(e);
    g->dist = g->path = g->path_shift = g->v = g->feed = 0.0;
    g->count = g->n = 0;
    g->waiting_continue = g->waiting_techno = g->stands_single = g->dwelling = g->has_phase = false;
    g->active = e->element_head;
    geo_begin_distance(e);
    ATOMIC_SET(e->abort_now, 0);
    ATOMIC_SET(e->override_ignored, 0);
    ATOMIC_SET(e->hold_to_cell, 0);
    ATOMIC_SET(e->macro_runs, 0);
    ATOMIC_SET(e->program_end, 0);
    e->end_reported = 0;
}

void engine_stand_by(engine *e) { ATOMIC_SET(e->program_active, 0); }

/* A program starts where the axes stand: distance, block count and log begin anew. */
void engine_begin_program(engine *e) {
    begin_preparation(e);
    begin_motion(e);
    feed_begin_program(e);
    foresight_begin_program(e);
    ATOMIC_SET(e->program_active, 1);
}
