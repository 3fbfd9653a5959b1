/* Operation modes, watchdogs and error records (hli_reference 3, 5.4, 7.2).
 *
 * GEO takes a mode command in the cycle in which it sees the semaphore.
 * Stopping and resuming the path is done at once; what needs preparation
 * (select, start, abort, reset, another mode) goes to the cell, which answers
 * with the new state.
 */
#include <string.h>
#include "engine/geo/modes.h"
#include "engine/state/state.h"
#include "hli/sync.h"

#define STANDBY 1u
#define MODE_MAX 5u
#define READY 3u
#define ACTIVE 4u
#define SELECTING 7u
#define DESELECTING 8u
#define PREPARING 9u
#define STARTING 11u
#define STOPPING 13u
#define RESET 15u
#define WATCHDOG_DEFAULT_US 1000000u
#define ERROR_TO_STATE 270061u
#define ERROR_WATCHDOG 270053u

static void show_state(struct engine *engine, uint32_t mode, uint32_t state) {
    HLI_IMCM_MODE_STATE *imcm_mode_state =
        &engine->hli.channel->channel_mc_control.mode_and_state.state_r;
    show_u32(&imcm_mode_state->mode, mode);
    show_u32(&imcm_mode_state->state, state);
}

void mode_publish_state(struct engine *engine) {
    show_state(engine,
               ATOMIC_GET(engine->modes.mode),
               ATOMIC_GET(engine->modes.state));
}

/* GEO may take a command at this very moment: its transient state stays until
 * the outcome. */
static void set_state(struct mode_unit *modes, uint32_t state) {
    uint32_t before = ATOMIC_GET(modes->state);
    while (ATOMIC_GET(modes->pending) == NO_COMMAND
           && !__atomic_compare_exchange_n(&modes->state,
                                           &before,
                                           state,
                                           false,
                                           __ATOMIC_ACQ_REL,
                                           __ATOMIC_ACQUIRE)) {
    }
}

void engine_set_mode(struct engine *engine, uint32_t mode, uint32_t state) {
    ATOMIC_SET(engine->modes.mode, mode);
    set_state(&engine->modes, state);
    if (state != HOLD && state != STOPPING) {
        ATOMIC_SET(engine->modes.stopped, 0);
    }
    if (engine->hli.channel && engine->geo.cycle == 0) {
        mode_publish_state(engine); /* later on the cycle does: a lockstep PLC
                                       may be scanning now */
    }
}

uint32_t engine_mode_state(struct engine *engine) {
    return ATOMIC_GET(engine->modes.state);
}

int engine_see_mode_command(struct engine *engine,
                            struct engine_mode_command *out) {
    if (ATOMIC_GET(engine->modes.pending) != COMMAND_TAKEN) {
        return 0;
    }
    *out = engine->modes.command;
    return 1;
}

int engine_take_mode_command(struct engine *engine,
                             struct engine_mode_command *out) {
    int found = engine_see_mode_command(engine, out);
    if (found) {
        ATOMIC_SET(engine->modes.pending, NO_COMMAND);
    }
    return found;
}

/* Queue of ERRORS_MAX records; what finds no room is counted. One producer: GEO
 * and the cell on GEO's behalf. */
static void queue_error(struct error_queue *errors, const engine_error *error) {
    uint64_t head = ATOMIC_GET(errors->head);
    if (head - ATOMIC_GET(errors->done) >= ERRORS_MAX) {
        errors->lost++;
        return;
    }
    errors->entries[head % ERRORS_MAX] = *error;
    ATOMIC_SET(errors->head, head + 1);
}

void engine_post_error(struct engine *engine, const engine_error *error) {
    while (__atomic_exchange_n(&engine->errors.lock, 1, __ATOMIC_ACQUIRE)) {
        cpu_pause();
    }
    queue_error(&engine->errors, error);
    __atomic_store_n(&engine->errors.lock, 0, __ATOMIC_RELEASE);
}

/* False while the cell is posting: the next cycle will do. */
static bool own_error(struct error_queue *errors,
                      uint32_t id,
                      uint32_t reaction) {
    engine_error error;
    memset(&error, 0, sizeof error);
    error.id = id;
    error.reaction_class = reaction;
    error.recovery_class = reaction;
    if (__atomic_exchange_n(&errors->lock, 1, __ATOMIC_ACQUIRE)) {
        return false;
    }
    queue_error(errors, &error);
    __atomic_store_n(&errors->lock, 0, __ATOMIC_RELEASE);
    return true;
}

static void fill_record(struct engine *engine,
                        HLI_ERROR_SATZ *error_satz,
                        const engine_error *error) {
    memset(error_satz, 0, sizeof *error_satz);
    error_satz->kopf.error_id = error->id;
    error_satz->kopf.line = (int32_t)error->line;
    memcpy(error_satz->kopf.modul_name.zeichen, "HLICOSIM", 8);
    error_satz->kopf.channel = (uint16_t)(engine->cfg.channel + 1);
    error_satz->kopf.cycle = (uint32_t)engine->geo.cycle;
    error_satz->kopf.recovery_class = (uint16_t)error->recovery_class;
    error_satz->kopf.reaction_class = (uint16_t)error->reaction_class;
    if (!error->line) {
        return;
    }
    HLI_RUMPF_NC_PROG body;
    memset(&body, 0, sizeof body);
    memcpy(body.prog_name, error->program, sizeof error->program);
    memcpy(body.file_name, error->program, sizeof error->program);
    body.fileoffset = -1;
    body.tokenoffset = (uint16_t)error->column;
    body.satz_nr = error->n;
    error_satz->kopf.body_type = 1;
    memcpy(&error_satz->rumpf.maske, &body, sizeof body);
}

static void show_next_error(struct engine *engine) {
    MC_ERROR *error = &engine->hli.channel->mc_error;
    if (engine->errors.done == ATOMIC_GET(engine->errors.head)) {
        return;
    }
    if (load_u8_acquire(&error->enable_w)
        && load_u8_acquire(&error->semaphor_rw)) {
        return;
    }
    fill_record(engine,
                &error->satz_r,
                &engine->errors.entries[engine->errors.done % ERRORS_MAX]);
    store_u8_release(&error->semaphor_rw, 1);
    ATOMIC_SET(engine->errors.done, engine->errors.done + 1);
}

void mode_publish(struct engine *engine) {
    uint32_t mode = ATOMIC_GET(engine->modes.mode);
    uint32_t state = ATOMIC_GET(engine->modes.state);
    show_next_error(engine);
    show_state(engine, mode, state);
}

/* PLC to CNC. */
static void take_plc_error(struct engine *engine) {
    MC_ERROR *error = &engine->hli.channel->lc_error;
    if (!load_u8_acquire(&error->semaphor_rw)
        || ATOMIC_GET(engine->errors.plc_id)) {
        return;
    }
    engine->errors.plc_class =
        load_u16_relaxed(&error->satz_r.kopf.reaction_class);
    uint32_t id = load_u32_relaxed(&error->satz_r.kopf.error_id);
    ATOMIC_SET(engine->errors.plc_id, id ? id : UINT32_MAX);
    store_u8_release(&error->semaphor_rw, 0);
}

int engine_take_plc_error(struct engine *engine,
                          uint32_t *id,
                          uint32_t *reaction_class) {
    *id = ATOMIC_GET(engine->errors.plc_id);
    if (!*id) {
        return 0;
    }
    *reaction_class = engine->errors.plc_class;
    ATOMIC_SET(engine->errors.plc_id, 0);
    return 1;
}

/* The CNC monitors the PLC: alive_rw has to be set once in every period of the
 * cell's time. */
static void watch_plc(struct engine *engine, bool present) {
    MC_WATCHDOG_UNIT *watchdog = &engine->hli.channel->head.mc_watchdog;
    if (!present || !load_u8_acquire(&watchdog->enable_w)) {
        engine->watchdog.alive = false;
        show_u8(&watchdog->alive_state_r, 0);
        return;
    }
    uint32_t us = load_u32_relaxed(&watchdog->cycle_time_w);
    double period = 1e-6 * (us ? us : WATCHDOG_DEFAULT_US),
           now = (double)engine->geo.cycle * engine->cfg.cycle_s;
    if (load_u8_acquire(&watchdog->alive_rw)) {
        store_u8_release(&watchdog->alive_rw, 0);
        engine->watchdog.alive = true;
        engine->watchdog.since = now;
    } else if (engine->watchdog.alive && now - engine->watchdog.since > period
               && own_error(&engine->errors, ERROR_WATCHDOG, 7)) {
        engine->watchdog.alive = false;
        engine->watchdog.missed = true;
        ATOMIC_SET(engine->watchdog.event, 1);
    }
    show_u8(&watchdog->alive_state_r,
            engine->watchdog.alive && !engine->watchdog.missed);
}

/* The other direction: the CNC shows that it lives; the PLC clears alive_rw
 * when it has seen it. */
static void show_life(struct shared_areas *hli, bool present) {
    MC_WATCHDOG_UNIT *watchdog = &hli->channel->head.lc_watchdog;
    bool enabled = present && load_u8_acquire(&watchdog->enable_w);
    if (enabled) {
        store_u8_release(&watchdog->alive_rw, 1);
    }
    show_u8(&watchdog->alive_state_r, enabled);
}

static bool legal_target(uint32_t mode, uint32_t state) {
    if (mode < 1 || mode > MODE_MAX) {
        return false;
    }
    return mode == STANDBY ? state >= 1 && state <= READY
                           : (state >= 1 && state <= HOLD) || state == RESET;
}

static void read_command(
    struct engine_mode_command *out,
    const HLI_PROC_TRANS_TO_MODE_STATE *proc_trans_to_mode_state) {
    out->from_mode = load_u32_relaxed(&proc_trans_to_mode_state->from_mode);
    out->from_state = load_u32_relaxed(&proc_trans_to_mode_state->from_state);
    out->to_mode = load_u32_relaxed(&proc_trans_to_mode_state->to_mode);
    out->to_state = load_u32_relaxed(&proc_trans_to_mode_state->to_state);
    memcpy(out->parameter,
           proc_trans_to_mode_state->parameter,
           sizeof out->parameter);
    out->parameter[sizeof out->parameter - 1] = 0;
}

/* Stop and resume are for the path alone; true if the command was one of these.
 * One that names a program goes to the cell: it may be another one. */
static bool stop_or_resume(
    struct mode_unit *modes,
    const struct engine_mode_command *engine_mode_command) {
    uint32_t state = ATOMIC_GET(modes->state);
    if (engine_mode_command->to_mode != ATOMIC_GET(modes->mode)
        || ATOMIC_GET(modes->hold_to_cell)) {
        return false;
    }
    bool stops = state == ACTIVE || state == HOLD || state == STOPPING;
    if (engine_mode_command->to_state == HOLD && stops) {
        ATOMIC_SET(modes->stopped, 1);
        if (state == ACTIVE) {
            ATOMIC_SET(modes->state, STOPPING);
        }
        return true;
    }
    if (engine_mode_command->to_state == ACTIVE
        && !engine_mode_command->parameter[0]
        && (state == HOLD || state == STOPPING)) {
        ATOMIC_SET(modes->stopped, 0);
        ATOMIC_SET(modes->state, ACTIVE);
        return true;
    }
    return false;
}

/* HOLD and back, by the cell. */
void engine_hold(struct engine *engine, int hold) {
    ATOMIC_SET(engine->modes.stopped, hold);
    set_state(&engine->modes, hold ? STOPPING : ACTIVE);
}

void engine_hold_by_cell(struct engine *engine, int by_cell) {
    ATOMIC_SET(engine->modes.hold_to_cell, by_cell);
}

void engine_macro_runs(struct engine *engine, int runs) {
    ATOMIC_SET(engine->modes.macro_runs, runs);
}

/* Transient state while the cell carries the command out. */
static uint32_t on_the_way(uint32_t target) {
    static const uint32_t transient[] =
        {RESET, DESELECTING, SELECTING, PREPARING, STARTING, STOPPING};
    return transient[target > HOLD ? 0 : target];
}

/* The cell still carries out a command. */
static bool is_busy(const struct mode_unit *modes) {
    uint32_t state = ATOMIC_GET(modes->state);
    return ATOMIC_GET(modes->pending)
           || (state >= SELECTING && state != STOPPING);
}

/* False: the refusal finds no way to the PLC in this cycle. */
static bool take_command(struct engine *engine,
                         const MC_CONTROL_MCM_MODE_STATE_UNIT *unit) {
    struct engine_mode_command engine_mode_command;
    read_command(&engine_mode_command, &unit->command_w);
    if (!legal_target(engine_mode_command.to_mode,
                      engine_mode_command.to_state)) {
        return own_error(&engine->errors, ERROR_TO_STATE, 1);
    }
    if ((engine_mode_command.from_mode
         && engine_mode_command.from_mode != ATOMIC_GET(engine->modes.mode))
        || (engine_mode_command.from_state
            && engine_mode_command.from_state
                   != ATOMIC_GET(engine->modes.state))) {
        engine->modes.warnings++;
    }
    if (stop_or_resume(&engine->modes, &engine_mode_command)) {
        return true;
    }
    ATOMIC_SET(engine->modes.pending, COMMAND_COMES);
    engine_mode_command.state = ATOMIC_GET(engine->modes.state);
    ATOMIC_SET(engine->modes.state,
               on_the_way(engine_mode_command
                              .to_state)); /* so that nobody takes the old state
                                              for the command's outcome */
    engine->modes.command = engine_mode_command;
    ATOMIC_SET(engine->modes.pending, COMMAND_TAKEN);
    return true;
}

void mode_cycle(struct engine *engine, bool present) {
    MC_CONTROL_MCM_MODE_STATE_UNIT *unit =
        &engine->hli.channel->channel_mc_control.mode_and_state;
    if (present && load_u8_acquire(&unit->enable_w)
        && load_u8_acquire(&unit->command_semaphor_rw)
        && !is_busy(&engine->modes) && take_command(engine, unit)) {
        mode_publish_state(engine); /* a PLC that sees the semaphore fall does
                                       not see the old state any more */
        store_u8_release(&unit->command_semaphor_rw, 0);
    }
    if (ATOMIC_GET(engine->modes.state) == STOPPING
        && ATOMIC_GET(engine->modes.stopped) && engine->geo.v <= 0.0
        && !ATOMIC_GET(engine->modes.macro_runs)) {
        ATOMIC_SET(engine->modes.state, HOLD);
    }
    watch_plc(engine, present);
    show_life(&engine->hli, present);
    take_plc_error(engine);
}
