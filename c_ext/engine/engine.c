/* Life of the engine, pumping in lockstep and free run. Threads: threads.c. */
#include <stdlib.h>
#include <string.h>
#include "curve/curve.h"
#include "engine/accel/accel_planner.h"
#include "engine/accel/corner_zones.h"
#include "engine/accel/span_store.h"
#include "engine/events.h"
#include "engine/geo/cycle.h"
#include "engine/geo/external.h"
#include "engine/geo/interpolate.h"
#include "engine/geo/publish.h"
#include "engine/jerk_adapter/adapter.h"
#include "engine/path/limits.h"
#include "engine/plan/prediction.h"
#include "engine/plan/pump.h"
#include "engine/state/memory.h"
#include "engine/state/state.h"
#include "engine/threads.h"
#include "hli/sync.h"

#define TURN_SPIN_NS                                                           \
    500000 /* a PLC scan in Python takes some 10 us, a futex wake across cores \
              about 20 */

static uint64_t power_of_two(uint64_t count) {
    uint64_t p = 1;
    while (p < count) {
        p <<= 1;
    }
    return p;
}

static bool allocate(struct engine *engine) {
    uint64_t behind =
        engine->cfg.log_max < 65536u ? engine->cfg.log_max : 65536u;
    uint64_t kept = engine->cfg.fb_storage_size / STORE_BYTES;
    engine->store_kept = kept < STORE_KEPT_MAX ? kept : STORE_KEPT_MAX;
    uint64_t stored =
        power_of_two(engine->store_kept + KEPT_BEHIND + STORE_AHEAD);
    uint64_t elements = power_of_two(2
                                     * (behind + engine->store_kept > PIECE_RING
                                            ? behind + engine->store_kept
                                            : PIECE_RING));
    engine->element_mask = elements - 1;
    engine->store_mask = stored - 1;
    engine->store = calloc(stored, sizeof(struct piece));
    engine->plan.tail_max =
        (spans_max(engine) + 1u) * (engine->cfg.window + 64);
    if (!drive_new(engine) || !foresight_new(engine) || !spans_new(engine)) {
        return false;
    }
    engine->elements = calloc(elements, sizeof(struct element));
    uint64_t run = power_of_two(engine->cfg.window + RUN_MORE);
    engine->piece_mask = (run < PIECE_RING ? run : PIECE_RING) - 1;
    engine->pieces = calloc(engine->piece_mask + 1, sizeof(struct piece));
    if (!zones_new(engine)) {
        return false;
    }
    engine->curves = calloc(stored, sizeof(struct curve));
    engine->phase_ring = calloc(PHASE_RING, sizeof(phase));
    for (int i = 0; i < 2; i++) {
        engine->plan.tails[i].phases =
            calloc(engine->plan.tail_max, sizeof(phase));
    }
    if (!engine->elements || !engine->store || !engine->pieces
        || !engine->curves || !engine->phase_ring
        || !engine->plan.tails[0].phases || !engine->plan.tails[1].phases) {
        return false;
    }
    memory_large(engine->store, stored * sizeof(struct piece));
    memory_large(engine->curves, stored * sizeof(struct curve));
    memory_touch(engine->pieces,
                 (engine->piece_mask + 1) * sizeof(struct piece));
    memory_touch(engine->plan.corners,
                 (engine->piece_mask + 1) * sizeof(struct used_corner));
    memory_touch(engine->phase_ring, PHASE_RING * sizeof(phase));
    return true;
}

static void attach_segment(struct engine *engine, void *segment) {
    engine->segment = segment;
    engine->channel = &engine->segment->channel[engine->cfg.channel];
    engine->side = &engine->segment->sidecar;
    publish_initial(engine);
}

struct engine *engine_new(const engine_config *config, void *segment) {
    struct engine *engine = calloc(1, sizeof *engine);
    if (!engine) {
        return NULL;
    }
    engine->cfg = *config;
    engine->planner =
        drive_wanted(config) ? &jerk_limited_planner : &accel_planner;
    engine->traits = engine->planner->traits;
    if (!allocate(engine)) {
        engine_free(engine);
        return NULL;
    }
    memcpy(engine->last_end, config->start, sizeof engine->last_end);
    limits_reset(engine);
    memcpy(engine->element_end, config->start, sizeof engine->element_end);
    memcpy(engine->geo.position, config->start, sizeof engine->geo.position);
    engine->plan.reserve_override = 1.0;
    engine->plan.override = engine->override_now = 1.0;
    engine->plan.rapid = engine->rapid_now = 1.0;
    engine->geo.piece = UINT64_MAX;
    engine->feed.dir = 1;
    engine->feed.at = -1.0;
    engine->ext_speed = engine->plan.ext_speed = NEVER;
    engine->program_active = engine->units_cleared = 1;
    engine->mode = 2;
    engine->mode_state = 4;
    if (segment) {
        attach_segment(engine, segment);
    }
    return engine;
}

void engine_free(struct engine *engine) {
    if (!engine) {
        return;
    }
    engine_serve_stop(engine);
    engine_stop(engine);
    for (uint32_t i = 0; i < LOG_CHUNKS; i++) {
        free(engine->log.chunk[i]);
    }
    for (int i = 0; i < 2; i++) {
        free(engine->plan.tails[i].phases);
    }
    free(engine->elements);
    external_free(engine);
    drive_free(engine);
    foresight_free(engine);
    spans_free(engine);
    free(engine->store);
    free(engine->pieces);
    free(engine->plan.corners);
    free(engine->curves);
    free(engine->phase_ring);
    free(engine->log.items);
    free(engine->record);
    free(engine->m_synch.synch);
    free(engine->m_synch.pre);
    free(engine->h_synch.synch);
    free(engine->h_synch.pre);
    free(engine);
}

void engine_stay(struct engine *engine, int stay) {
    ATOMIC_SET(engine->stay, stay);
}

void engine_hold_start(struct engine *engine, int hold) {
    ATOMIC_SET(engine->hold_start, hold);
}

int engine_record(struct engine *engine, int64_t rows) {
    engine->record =
        calloc((size_t)rows,
               sizeof(double) * (size_t)(engine->cfg.axis_count + 4));
    engine->record_rows = engine->record ? rows : 0;
    return engine->record ? 0 : -1;
}

int64_t engine_record_take(struct engine *engine,
                           double *out,
                           int64_t max_rows) {
    size_t width = (size_t)engine->cfg.axis_count + 4;
    int64_t head = ATOMIC_GET(engine->record_head), tail = engine->record_tail,
            count = 0;
    for (; tail < head && count < max_rows; tail++, count++) {
        memcpy(out + (size_t)count * width,
               engine->record + (size_t)(tail % engine->record_rows) * width,
               width * sizeof(double));
    }
    ATOMIC_SET(engine->record_tail, tail);
    return count;
}

static bool record_full(const struct engine *engine) {
    return engine->record
           && engine->record_head - engine->record_tail >= engine->record_rows;
}

void engine_set_override(struct engine *engine, double factor, int hold) {
    __atomic_store(&engine->override_now, &factor, __ATOMIC_RELEASE);
    __atomic_store(&engine->rapid_now, &factor, __ATOMIC_RELEASE);
    ATOMIC_SET(engine->hold_now, hold);
}

void engine_time(struct engine *engine,
                 int64_t *cycle_ns,
                 int64_t *late_ns,
                 int64_t *rehearsal_ns,
                 int64_t rows) {
    engine->cycle_ns = cycle_ns;
    engine->late_ns = late_ns;
    engine->rehearsal_ns = rehearsal_ns;
    engine->timed_rows = rows;
}

int64_t engine_timed(const struct engine *engine) {
    return ATOMIC_GET(engine->timed);
}

void engine_stall_planner(struct engine *engine, int stalled) {
    ATOMIC_SET(engine->plan.stalled, stalled);
}

void engine_set_phase(struct engine *engine, uint32_t phase) {
    if (engine->side) {
        store_u32_release(&engine->side->cnc.phase, phase);
    }
}

void engine_expect_cycle(struct engine *engine) {
    ATOMIC_SET(engine->blocks_from, ATOMIC_GET(engine->geo.cycle) + 1);
}

int engine_take_command(struct engine *engine, struct engine_command *out) {
    if (engine->command_tail >= ATOMIC_GET(engine->command_head)) {
        return 0;
    }
    *out = engine->commands[engine->command_tail % COMMANDS_MAX];
    ATOMIC_SET(engine->command_tail, engine->command_tail + 1);
    return 1;
}

static bool plc_attached(const struct engine *engine) {
    return engine->side && load_u32_acquire(&engine->side->plc.attached);
}

/* Lockstep: may the next cycle run? Waits for the PLC's scan, at most wait_ns.
 */
static bool plc_allows(struct engine *engine, int64_t wait_ns) {
    if (engine->cfg.clock != HLI_CLOCK_LOCKSTEP || !engine->side) {
        return true;
    }
    if (!plc_attached(engine)) {
        return false;
    }
    return hs_word_wait(&engine->side->plc_turn,
                        (uint32_t)engine->geo.cycle + 1,
                        TURN_SPIN_NS,
                        wait_ns)
           == HS_OK;
}

/* The PLC waits for the cycle it has allowed; in lockstep only that one is
 * worth a wake. */
static void tell_plc(struct engine *engine) {
    if (!engine->side) {
        return;
    }
    HLI_SIDE_WORD *side_word = &engine->side->cnc_turn;
    bool due = engine->cfg.clock != HLI_CLOCK_LOCKSTEP
               || load_u32_acquire(&engine->side->plc_turn.word)
                      == (uint32_t)engine->geo.cycle;
    if (due) {
        hs_word_post(side_word, (uint32_t)engine->geo.cycle);
    } else {
        store_u32_release(&side_word->word, (uint32_t)engine->geo.cycle);
    }
}

int engine_run(struct engine *engine, int64_t count, int64_t wait_ns) {
    for (int64_t i = 0; i < count; i++) {
        int event = pending_event(engine);
        if (event >= 0) {
            return event;
        }
        if (record_full(engine)) {
            return ENGINE_RECORD_FULL;
        }
        if (!plc_allows(engine, wait_ns)) {
            return ENGINE_PLC_WAIT;
        }
        if (plc_finished(engine)) {
            return ENGINE_PLC_FINISHED; /* looked at where the PLC's scan has
                                           ended: same in every run */
        }
        foresight_plan(engine, planner_pump(engine) != 0);
        geo_cycle(engine);
        tell_plc(engine);
    }
    return ENGINE_DONE;
}

void engine_get_state(struct engine *engine, engine_state *out) {
    memset(out, 0, sizeof *out);
    memcpy(out->position, engine->geo.position, sizeof out->position);
    out->path = engine->geo.path;
    out->speed = geo_path_speed(engine);
    out->cycle = engine->geo.cycle;
    out->element = engine->geo.active;
    out->elements = engine->element_head;
    out->overruns = engine->overruns;
    out->requests_mode1 = ATOMIC_GET(engine->requests_mode1);
    out->requests_mode2 = ATOMIC_GET(engine->requests_mode2);
    out->requests_bad = ATOMIC_GET(engine->requests_bad);
    out->bad_commands = engine->bad_commands;
    out->plan_cpu_s = engine->plan.cpu_s;
    out->motion_time_s = engine->plan.committed_s;
    out->phases = engine->plan.phases;
    out->fault = engine->fault;
    out->log_dropped = engine->log_dropped;
    out->log_ignored_areas = engine->log_ignored_areas;
    out->log_stray_params = engine->log_stray_params;
    out->log_on_closed = engine->log_on_closed;
    out->log_disabled = engine->log_disabled;
    out->program_end = engine->program_end;
    out->plc_attached = plc_attached(engine);
    out->record_lost = engine->record_lost;
    out->techno_functions = engine->techno_functions;
    out->techno_unseen = engine->techno_unseen;
    out->techno_wait_cycles = engine->techno_wait_cycles;
    out->waiting_techno = engine->geo.waiting_techno;
    out->infeasible = engine->plan.infeasible;
    uint64_t done = ATOMIC_GET(engine->store_done);
    out->rows_taken = engine->rows_taken;
    out->row_done = done > 0 ? store_at(engine, done - 1)->row : 0;
    out->halt_row = engine->halt_row;
    out->halt_s = engine->halt_s;
    out->halt_whole = engine->halt_whole;
    out->mode_warnings = engine->mode_warnings;
    out->errors_lost = engine->errors_lost;
}
