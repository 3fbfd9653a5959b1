/* Life of the engine, pumping in lockstep and free run. Threads: threads.c. */
#include <stdlib.h>
#include <string.h>
#include "curve/curve.h"
#include "engine/accel/accel_planner.h"
#include "engine/accel/corner_zones.h"
#include "engine/accel/span_store.h"
#include "engine/commit/pace.h"
#include "engine/events.h"
#include "engine/geo/commands.h"
#include "engine/geo/cycle.h"
#include "engine/geo/external.h"
#include "engine/geo/rt_cycle.h"
#include "engine/geo/interpolate.h"
#include "engine/lookahead/service.h"
#include "engine/geo/publish.h"
#include "engine/geo/standstill.h"
#include "engine/jerk_adapter/adapter.h"
#include "engine/path/limits.h"
#include "engine/plan/prediction.h"
#include "engine/plan/pump.h"
#include "engine/state/memory.h"
#include "engine/state/record_ring.h"
#include "engine/state/state.h"
#include "engine/state/tuning.h"
#include "hli/sync.h"

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
    engine->store.kept = kept < STORE_KEPT_MAX ? kept : STORE_KEPT_MAX;
    uint64_t stored =
        power_of_two(engine->store.kept + KEPT_BEHIND + STORE_AHEAD);
    uint64_t elements =
        power_of_two(2
                     * (behind + engine->store.kept > RUN_RING_MAX
                            ? behind + engine->store.kept
                            : RUN_RING_MAX));
    engine->store.element_mask = elements - 1;
    engine->store.mask = stored - 1;
    engine->store.pieces = calloc(stored, sizeof(struct piece));
    engine->commit.tail_max =
        (spans_max(&engine->cfg) + 1u) * (engine->cfg.window + 64);
    if (!jerk_adapter_new(engine) || !prediction_new(engine)
        || !spans_new(engine)) {
        return false;
    }
    engine->store.elements = calloc(elements, sizeof(struct element));
    engine->store.more = calloc(elements, sizeof(struct element_more));
    engine->store.events = calloc(elements, sizeof(struct ahead_event));
    uint64_t run = power_of_two(engine->cfg.window + RUN_MORE);
    engine->run.mask = (run < RUN_RING_MAX ? run : RUN_RING_MAX) - 1;
    engine->run.pieces = calloc(engine->run.mask + 1, sizeof(struct piece));
    if (!corner_zones_new(engine)) {
        return false;
    }
    engine->store.curves = calloc(stored, sizeof(struct curve));
    engine->commit.ring = calloc(PHASE_RING, sizeof(phase));
    for (int i = 0; i < 2; i++) {
        engine->commit.tails[i].phases =
            calloc(engine->commit.tail_max, sizeof(phase));
    }
    bool has_store = engine->store.elements && engine->store.more
                     && engine->store.events && engine->store.pieces
                     && engine->store.curves,
         has_tails =
             engine->commit.tails[0].phases && engine->commit.tails[1].phases;
    if (!has_store || !has_tails) {
        return false;
    }
    if (!engine->run.pieces || !engine->commit.ring) {
        return false;
    }
    memory_large(engine->store.pieces, stored * sizeof(struct piece));
    memory_large(engine->store.curves, stored * sizeof(struct curve));
    memory_touch(engine->run.pieces,
                 (engine->run.mask + 1) * sizeof(struct piece));
    memory_touch(engine->accel.corners,
                 (engine->run.mask + 1) * sizeof(struct used_corner));
    memory_touch(engine->commit.ring, PHASE_RING * sizeof(phase));
    return true;
}

static void attach_segment(struct engine *engine, void *segment) {
    engine->hli.segment = segment;
    engine->hli.channel = &engine->hli.segment->channel[engine->cfg.channel];
    const engine_config *cfg = &engine->cfg;
    HLI_AXIS *first = &engine->hli.segment->axis[cfg->axis_base];
    int own = cfg->axis_count - cfg->guest_count;
    for (int i = 0; i < own; i++) {
        engine->hli.axis[i] = &first[i];
    }
    engine->hli.spindle = &first[own];
    engine->hli.side = &engine->hli.segment->sidecar;
    if (engine->cfg.channel == 0) { /* in every channel it costs too much */
        engine->hli.ahead = &engine->hli.segment->ahead[0];
        engine->hli.ahead->version_r = HLI_AHEAD_VERSION;
        engine->hli.ahead->sizeof_r = sizeof *engine->hli.ahead;
    }
    publish_initial(engine);
}

struct engine *engine_new(const engine_config *config, void *segment) {
    struct engine *engine = calloc(1, sizeof *engine);
    if (!engine) {
        return NULL;
    }
    engine->cfg = *config;
    engine->group = (struct engine_group){{engine}, 1};
    engine->planner =
        jerk_adapter_wanted(config) ? &jerk_limited_planner : &accel_planner;
    engine->traits = engine->planner->traits;
    if (!allocate(engine)) {
        engine_free(engine);
        return NULL;
    }
    memcpy(engine->push.last_end, config->start, sizeof engine->push.last_end);
    limits_reset(&engine->push);
    memcpy(engine->push.element_end,
           config->start,
           sizeof engine->push.element_end);
    memcpy(engine->geo.position, config->start, sizeof engine->geo.position);
    engine->plan.reserve_override = 1.0;
    engine->plan.override = engine->orders.override = 1.0;
    engine->plan.rapid = engine->orders.rapid = 1.0;
    engine->geo.piece = UINT64_MAX;
    engine->orders.released = true;
    time_causes_begin(&engine->time_causes);
    engine->dispatch.dir = 1;
    engine->dispatch.at = -1.0;
    engine->orders.ext_speed = engine->plan.ext_speed = NEVER;
    engine->program.active = engine->technology.units_cleared = 1;
    engine->modes.mode = 2;
    engine->modes.state = 4;
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
        free(engine->commit.tails[i].phases);
    }
    free(engine->store.elements);
    free(engine->store.more);
    free(engine->store.events);
    external_free(engine);
    rt_cycles_free(engine);
    jerk_adapter_free(engine);
    prediction_free(engine);
    spans_free(&engine->accel);
    free(engine->store.pieces);
    free(engine->run.pieces);
    free(engine->accel.corners);
    free(engine->store.curves);
    free(engine->commit.ring);
    free(engine->log.items);
    record_free(&engine->recording);
    free(engine->technology_rows.m_synch.synch);
    free(engine->technology_rows.m_synch.pre);
    free(engine->technology_rows.h_synch.synch);
    free(engine->technology_rows.h_synch.pre);
    free(engine);
}

void engine_stay(struct engine *engine, int stay) {
    ATOMIC_SET(engine->program.stay, stay);
}

void engine_hold_start(struct engine *engine, int hold) {
    ATOMIC_SET(engine->program.hold_start, hold);
}

void engine_set_override(struct engine *engine, double factor, int hold) {
    __atomic_store(&engine->orders.override, &factor, __ATOMIC_RELEASE);
    __atomic_store(&engine->orders.rapid, &factor, __ATOMIC_RELEASE);
    ATOMIC_SET(engine->orders.hold, hold);
}

void engine_time(struct engine *engine,
                 int64_t *cycle_ns,
                 int64_t *late_ns,
                 int64_t *rehearsal_ns,
                 int64_t rows) {
    engine->timing.cycle_ns = cycle_ns;
    engine->timing.late_ns = late_ns;
    engine->timing.rehearsal_ns = rehearsal_ns;
    engine->timing.rows = rows;
}

int64_t engine_timed(const struct engine *engine) {
    return ATOMIC_GET(engine->timing.done);
}

void engine_stall_planner(struct engine *engine, int stalled) {
    ATOMIC_SET(engine->commit.stalled, stalled);
}

void engine_set_phase(struct engine *engine, uint32_t phase) {
    if (engine->hli.side) {
        store_u32_release(&engine->hli.side->cnc.phase, phase);
    }
}

void engine_expect_cycle(struct engine *engine) {
    ATOMIC_SET(engine->program.blocks_from, ATOMIC_GET(engine->geo.cycle) + 1);
}

int engine_take_command(struct engine *engine, struct engine_command *out) {
    if (engine->path_commands.tail >= ATOMIC_GET(engine->path_commands.head)) {
        return 0;
    }
    *out = engine->path_commands
               .entries[engine->path_commands.tail % COMMANDS_MAX];
    ATOMIC_SET(engine->path_commands.tail, engine->path_commands.tail + 1);
    return 1;
}

static bool plc_attached(const struct shared_areas *hli) {
    return hli->side && load_u32_acquire(&hli->side->plc.attached);
}

/* Lockstep: may the next cycle run? Waits for the PLC's scan until then. */
static bool plc_allows(struct engine *engine, int64_t until_ns) {
    if (engine->cfg.clock != HLI_CLOCK_LOCKSTEP || !engine->hli.side) {
        return true;
    }
    int64_t wait_ns = until_ns - hs_monotonic_ns();
    if (!plc_attached(&engine->hli) || wait_ns <= 0) {
        return false;
    }
    return hs_word_wait(&engine->hli.side->plc_turn,
                        (uint32_t)engine->geo.cycle + 1,
                        TURN_SPIN_NS,
                        wait_ns)
           == HS_OK;
}

/* The PLC waits for the cycle it has allowed; in lockstep only that one is
 * worth a wake. */
static void tell_plc(struct engine *engine) {
    if (!engine->hli.side) {
        return;
    }
    HLI_SIDE_WORD *side_word = &engine->hli.side->cnc_turn;
    bool due = engine->cfg.clock != HLI_CLOCK_LOCKSTEP
               || load_u32_acquire(&engine->hli.side->plc_turn.word)
                      == (uint32_t)engine->geo.cycle;
    if (due) {
        hs_word_post(side_word, (uint32_t)engine->geo.cycle);
    } else {
        store_u32_release(&side_word->word, (uint32_t)engine->geo.cycle);
    }
}

/* Immediate service without a thread: the request of the scan that has ended is
 * answered with what that scan has seen, before anything moves. */
static void serve_between_scans(struct engine *engine) {
    if (engine->cfg.service == HLI_SERVICE_IMMEDIATE
        && !first_channel(engine)->service.started && engine->hli.segment) {
        serve_request(engine);
    }
}

int engine_join(struct engine *const *engines, uint32_t count) {
    if (!count || count > HLI_SYS_CH_MAXIDX + 1) {
        return -1;
    }
    for (uint32_t i = 0; i < count; i++) {
        memcpy(engines[i]->group.all, engines, count * sizeof *engines);
        engines[i]->group.count = count;
    }
    return 0;
}

/* The first channel's event in the order of the channels; -1: none. */
static int event_of(const struct engine_group *group, uint32_t *who) {
    for (*who = 0; *who < group->count; (*who)++) {
        int event = pending_event(group->all[*who]);
        if (event >= 0) {
            return event;
        }
        if (record_full(&group->all[*who]->recording)) {
            return ENGINE_RECORD_FULL;
        }
    }
    *who = 0;
    return -1;
}

static void channel_cycle(struct engine *engine) {
    prediction_plan(engine, planner_pump(engine) != 0);
    geo_cycle(engine);
}

int engine_run_all(struct engine *first,
                   int64_t count,
                   int64_t wait_ns,
                   uint32_t *who) {
    const struct engine_group *group = &first->group;
    int64_t until_ns = hs_monotonic_ns() + wait_ns;
    for (int64_t i = 0; i < count; i++) {
        int event = event_of(group, who);
        if (event >= 0) {
            return event;
        }
        if (!plc_allows(first, until_ns)) {
            return ENGINE_PLC_WAIT;
        }
        if (plc_finished(first)) {
            return ENGINE_PLC_FINISHED; /* looked at where the PLC's scan has
                                           ended: same in every run */
        }
        for (uint32_t k = 0; k < group->count; k++) {
            serve_between_scans(group->all[k]);
        }
        for (uint32_t k = 0; k < group->count; k++) {
            channel_cycle(group->all[k]);
        }
        tell_plc(first);
    }
    return ENGINE_DONE;
}

int engine_run(struct engine *engine, int64_t count, int64_t wait_ns) {
    uint32_t who;
    return engine_run_all(engine, count, wait_ns, &who);
}

/* Whether the path is driven backward, or where it has been driven before: of
 * the store `done` pieces have. */
static bool is_retraced(struct engine *engine, uint64_t done) {
    uint64_t i = engine->geo.piece;
    if (ATOMIC_GET(engine->dispatch.dir) < 0) {
        return true;
    }
    if (i == UINT64_MAX) {
        return false;
    }
    bool is_over = ATOMIC_GET(engine->run.done) > i;
    return piece_at(&engine->run, i)->origin + (is_over ? 1 : 0) < done;
}

static bool at_inserted_stop(struct engine *engine) {
    return engine->geo.waiting_continue && !engine->geo.stands_single
           && piece_at(&engine->run, engine->geo.piece)->inserted;
}

void engine_get_state(struct engine *engine, engine_state *out) {
    memset(out, 0, sizeof *out);
    memcpy(out->position, engine->geo.position, sizeof out->position);
    out->path = engine->geo.path;
    out->speed = geo_path_speed(engine);
    out->cycle = engine->geo.cycle;
    out->element = engine->geo.active;
    out->elements = engine->store.element_head;
    out->overruns = engine->timing.overruns;
    out->requests_mode1 = ATOMIC_GET(engine->service.requests_mode1);
    out->requests_mode2 = ATOMIC_GET(engine->service.requests_mode2);
    out->requests_bad = ATOMIC_GET(engine->service.requests_bad);
    out->bad_commands = engine->orders.bad;
    out->plan_cpu_s = engine->commit.cpu_s;
    out->motion_time_s = engine->commit.committed_s;
    __atomic_load(&engine->geo.consumed_s, &out->consumed_s, __ATOMIC_RELAXED);
    out->phases = engine->commit.phases;
    out->fault = engine->fault;
    out->log_dropped = engine->log.dropped;
    out->log_ignored_areas = engine->log.ignored_areas;
    out->log_stray_params = engine->log.stray_params;
    out->log_on_closed = engine->log.on_closed;
    out->log_disabled = engine->log.disabled;
    out->program_end = engine->program.end;
    out->plc_attached = plc_attached(&engine->hli);
    out->rt_loop = ATOMIC_GET(engine->orders.rt_loop);
    out->rt_loop_count = loop_count_told(&engine->geo);
    out->record_lost = engine->recording.samples.lost;
    out->techno_functions = engine->technology.functions;
    out->techno_unseen = engine->technology.unseen;
    out->techno_wait_cycles = engine->technology.wait_cycles;
    out->waiting_techno = engine->geo.waiting_techno;
    time_by_cause(engine, out->time_by_cause);
    out->infeasible = engine->commit.infeasible;
    uint64_t done = ATOMIC_GET(engine->store.done);
    out->rows_taken = engine->push.rows_taken;
    out->row_done = done > 0 ? store_at(&engine->store, done - 1)->row : 0;
    out->retraced = is_retraced(engine, done);
    out->off_program =
        out->retraced || deletes_distance(engine) || at_inserted_stop(engine);
    out->mode_warnings = engine->modes.warnings;
    out->errors_lost = engine->errors.lost;
    out->planner_late = engine->lateness.times;
    out->planner_late_cycles = engine->lateness.cycles;
    out->planner_away_s = (double)ATOMIC_GET(engine->lateness.away_ns) * 1e-9;
    pace_quantiles(engine, out->planner_us_per_ms);
}
