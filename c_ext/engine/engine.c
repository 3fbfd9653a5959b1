/* Life of the engine, pumping in lockstep and free run. Threads: threads.c. */
#include <stdlib.h>
#include "engine/state/state.h"

#define TURN_SPIN_NS 500000 /* a PLC scan in Python takes some 10 us, a futex wake across cores about 20 */

static uint64_t power_of_two(uint64_t n) {
    uint64_t p = 1;
    while (p < n) p <<= 1;
    return p;
}

static bool allocate(engine *e) {
    uint64_t behind = e->cfg.log_max < 65536u ? e->cfg.log_max : 65536u;
    uint64_t kept = e->cfg.fb_storage_size / STORE_BYTES;
    e->store_kept = kept < STORE_KEPT_MAX ? kept : STORE_KEPT_MAX;
    uint64_t stored = power_of_two(e->store_kept + KEPT_BEHIND + STORE_AHEAD);
    uint64_t elements = power_of_two(2 * (behind + e->store_kept > PIECE_RING ? behind + e->store_kept : PIECE_RING));
    e->element_mask = elements - 1;
    e->store_mask = stored - 1;
    e->store = calloc(stored, sizeof(piece));
    e->plan.tail_max = (spans_max(e) + 1u) * (e->cfg.window + 64);
    if (!drive_new(e) || !foresight_new(e) || !spans_new(e)) return false;
    e->elements = calloc(elements, sizeof(element));
    uint64_t run = power_of_two(e->cfg.window + RUN_MORE);
    e->piece_mask = (run < PIECE_RING ? run : PIECE_RING) - 1;
    e->pieces = calloc(e->piece_mask + 1, sizeof(piece));
    if (!zones_new(e)) return false;
    e->curves = calloc(stored, sizeof(curve));
    e->phase_ring = calloc(PHASE_RING, sizeof(phase));
    for (int i = 0; i < 2; i++) e->plan.tails[i].phases = calloc(e->plan.tail_max, sizeof(phase));
    if (!e->elements || !e->store || !e->pieces || !e->curves || !e->phase_ring || !e->plan.tails[0].phases || !e->plan.tails[1].phases) return false;
    memory_large(e->store, stored * sizeof(piece));
    memory_large(e->curves, stored * sizeof(curve));
    memory_touch(e->pieces, (e->piece_mask + 1) * sizeof(piece));
    memory_touch(e->plan.corners, (e->piece_mask + 1) * sizeof(used_corner));
    memory_touch(e->phase_ring, PHASE_RING * sizeof(phase));
    return true;
}

static void attach_segment(engine *e, void *segment) {
    e->segment = segment;
    e->channel = &e->segment->channel[e->cfg.channel];
    e->side = &e->segment->sidecar;
    publish_initial(e);
}

engine *engine_new(const engine_config *config, void *segment) {
    engine *e = calloc(1, sizeof *e);
    if (!e) return NULL;
    e->cfg = *config;
    if (!allocate(e)) {
        engine_free(e);
        return NULL;
    }
    memcpy(e->last_end, config->start, sizeof e->last_end);
    limits_reset(e);
    memcpy(e->element_end, config->start, sizeof e->element_end);
    memcpy(e->geo.position, config->start, sizeof e->geo.position);
    e->plan.reserve_override = 1.0;
    e->plan.override = e->override_now = 1.0;
    e->plan.rapid = e->rapid_now = 1.0;
    e->geo.piece = UINT64_MAX;
    e->feed.dir = 1;
    e->feed.at = -1.0;
    e->ext_speed = e->plan.ext_speed = NEVER;
    e->program_active = e->units_cleared = 1;
    e->mode = 2;
    e->mode_state = 4;
    if (segment) attach_segment(e, segment);
    return e;
}

void engine_free(engine *e) {
    if (!e) return;
    engine_serve_stop(e);
    engine_stop(e);
    for (uint32_t i = 0; i < LOG_CHUNKS; i++) free(e->log.chunk[i]);
    for (int i = 0; i < 2; i++) free(e->plan.tails[i].phases);
    free(e->elements);
    external_free(e);
    drive_free(e);
    foresight_free(e);
    spans_free(e);
    free(e->store);
    free(e->pieces);
    free(e->plan.corners);
    free(e->curves);
    free(e->phase_ring);
    free(e->log.items);
    free(e->record);
    free(e->m_synch.synch);
    free(e->m_synch.pre);
    free(e->h_synch.synch);
    free(e->h_synch.pre);
    free(e);
}

void engine_stay(engine *e, int stay) { ATOMIC_SET(e->stay, stay); }

void engine_hold_start(engine *e, int hold) { ATOMIC_SET(e->hold_start, hold); }

int engine_record(engine *e, int64_t rows) {
    e->record = calloc((size_t)rows, sizeof(double) * (size_t)(e->cfg.axis_count + 4));
    e->record_rows = e->record ? rows : 0;
    return e->record ? 0 : -1;
}

int64_t engine_record_take(engine *e, double *out, int64_t max_rows) {
    size_t width = (size_t)e->cfg.axis_count + 4;
    int64_t head = ATOMIC_GET(e->record_head), tail = e->record_tail, n = 0;
    for (; tail < head && n < max_rows; tail++, n++)
        memcpy(out + (size_t)n * width, e->record + (size_t)(tail % e->record_rows) * width, width * sizeof(double));
    ATOMIC_SET(e->record_tail, tail);
    return n;
}

static bool record_full(const engine *e) { return e->record && e->record_head - e->record_tail >= e->record_rows; }

void engine_set_override(engine *e, double factor, int hold) {
    __atomic_store(&e->override_now, &factor, __ATOMIC_RELEASE);
    __atomic_store(&e->rapid_now, &factor, __ATOMIC_RELEASE);
    ATOMIC_SET(e->hold_now, hold);
}

void engine_time(engine *e, int64_t *cycle_ns, int64_t *late_ns, int64_t *rehearsal_ns, int64_t rows) {
    e->cycle_ns = cycle_ns;
    e->late_ns = late_ns;
    e->rehearsal_ns = rehearsal_ns;
    e->timed_rows = rows;
}

int64_t engine_timed(const engine *e) { return ATOMIC_GET(e->timed); }

void engine_stall_planner(engine *e, int stalled) { ATOMIC_SET(e->plan.stalled, stalled); }

void engine_set_phase(engine *e, uint32_t phase) {
    if (e->side) store_u32_release(&e->side->cnc.phase, phase);
}

/* Preparation is wanted when less than a good window is ahead of the planner. */
static bool needs_blocks(engine *e) {
    if (!ATOMIC_GET(e->program_active) || ATOMIC_GET(e->finished) || ATOMIC_GET(e->expect_drain)) return false;
    if (ATOMIC_GET(e->geo.cycle) < ATOMIC_GET(e->blocks_from)) return false;
    uint64_t ahead = e->element_head - ATOMIC_GET(e->geo.active);
    return ring_has_room(e) && (ahead < 2u * e->cfg.window + 256u || e->store_head - ATOMIC_GET(e->store_done) < 1024u);
}

void engine_expect_cycle(engine *e) { ATOMIC_SET(e->blocks_from, ATOMIC_GET(e->geo.cycle) + 1); }

int engine_take_command(engine *e, engine_command *out) {
    if (e->command_tail >= ATOMIC_GET(e->command_head)) return 0;
    *out = e->commands[e->command_tail % COMMANDS_MAX];
    ATOMIC_SET(e->command_tail, e->command_tail + 1);
    return 1;
}

static bool plc_finished(const engine *e) {
    return ATOMIC_GET(e->program_end) && !ATOMIC_GET(e->stay) && e->side && load_u32_acquire(&e->side->plc.finished);
}

/* What preparation or the cell has to know, in order of urgency; -1 if nothing. */
int pending_event(engine *e) {
    if (e->fault) return ENGINE_FAULT;
    if (ATOMIC_GET(e->mode_pending)) return ENGINE_MODE_COMMAND;
    if (ATOMIC_GET(e->plc_error_id)) return ENGINE_PLC_ERROR;
    if (ATOMIC_GET(e->watchdog_event)) {
        ATOMIC_SET(e->watchdog_event, 0);
        return ENGINE_WATCHDOG;
    }
    if (ATOMIC_GET(e->retraced_event)) {
        ATOMIC_SET(e->retraced_event, 0);
        return ENGINE_RETRACED;
    }
    if (ATOMIC_GET(e->expect_drain) && ATOMIC_GET(e->geo.cycle) >= e->drain_from &&
        ATOMIC_GET(e->store_done) >= e->drain_at && geo_drained(e)) {
        ATOMIC_SET(e->expect_drain, 0);
        return ENGINE_DRAINED;
    }
    if (ATOMIC_GET(e->program_end) && !e->end_reported) {
        e->end_reported = 1;
        return ENGINE_PROGRAM_END;
    }
    if (e->threads_started && plc_finished(e)) return ENGINE_PLC_FINISHED;
    if (needs_blocks(e)) return ENGINE_NEED_BLOCKS;
    return -1;
}

static bool plc_attached(const engine *e) { return e->side && load_u32_acquire(&e->side->plc.attached); }

/* Lockstep: may the next cycle run? Waits for the PLC's scan, at most wait_ns. */
static bool plc_allows(engine *e, int64_t wait_ns) {
    if (e->cfg.clock != HLI_CLOCK_LOCKSTEP || !e->side) return true;
    if (!plc_attached(e)) return false;
    return hs_word_wait(&e->side->plc_turn, (uint32_t)e->geo.cycle + 1, TURN_SPIN_NS, wait_ns) == HS_OK;
}

/* The PLC waits for the cycle it has allowed; in lockstep only that one is worth a wake. */
static void tell_plc(engine *e) {
    if (!e->side) return;
    HLI_SIDE_WORD *w = &e->side->cnc_turn;
    bool due = e->cfg.clock != HLI_CLOCK_LOCKSTEP || load_u32_acquire(&e->side->plc_turn.word) == (uint32_t)e->geo.cycle;
    if (due) hs_word_post(w, (uint32_t)e->geo.cycle);
    else store_u32_release(&w->word, (uint32_t)e->geo.cycle);
}

int engine_run(engine *e, int64_t n, int64_t wait_ns) {
    for (int64_t i = 0; i < n; i++) {
        int event = pending_event(e);
        if (event >= 0) return event;
        if (record_full(e)) return ENGINE_RECORD_FULL;
        if (!plc_allows(e, wait_ns)) return ENGINE_PLC_WAIT;
        if (plc_finished(e)) return ENGINE_PLC_FINISHED; /* looked at where the PLC's scan has ended: same in every run */
        foresight_plan(e, planner_pump(e) != 0);
        geo_cycle(e);
        tell_plc(e);
    }
    return ENGINE_DONE;
}

void engine_get_state(engine *e, engine_state *out) {
    memset(out, 0, sizeof *out);
    memcpy(out->position, e->geo.position, sizeof out->position);
    out->path = e->geo.path;
    out->speed = geo_path_speed(e);
    out->cycle = e->geo.cycle;
    out->element = e->geo.active;
    out->elements = e->element_head;
    out->overruns = e->overruns;
    out->requests_mode1 = ATOMIC_GET(e->requests_mode1);
    out->requests_mode2 = ATOMIC_GET(e->requests_mode2);
    out->requests_bad = ATOMIC_GET(e->requests_bad);
    out->bad_commands = e->bad_commands;
    out->plan_cpu_s = e->plan.cpu_s;
    out->motion_time_s = e->plan.committed_s;
    out->phases = e->plan.phases;
    out->fault = e->fault;
    out->log_dropped = e->log_dropped;
    out->log_ignored_areas = e->log_ignored_areas;
    out->log_stray_params = e->log_stray_params;
    out->log_on_closed = e->log_on_closed;
    out->log_disabled = e->log_disabled;
    out->program_end = e->program_end;
    out->plc_attached = plc_attached(e);
    out->record_lost = e->record_lost;
    out->techno_functions = e->techno_functions;
    out->techno_unseen = e->techno_unseen;
    out->techno_wait_cycles = e->techno_wait_cycles;
    out->waiting_techno = e->geo.waiting_techno;
    out->infeasible = e->plan.infeasible;
    uint64_t done = ATOMIC_GET(e->store_done);
    out->rows_taken = e->rows_taken;
    out->row_done = done > 0 ? store_at(e, done - 1)->row : 0;
    out->halt_row = e->halt_row;
    out->halt_s = e->halt_s;
    out->halt_whole = e->halt_whole;
    out->mode_warnings = e->mode_warnings;
    out->errors_lost = e->errors_lost;
}
