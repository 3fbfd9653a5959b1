/* Operation modes, watchdogs and error records (hli_reference 3, 5.4, 7.2).
 *
 * GEO takes a mode command in the cycle in which it sees the semaphore. Stopping and resuming the path is done at once;
 * what needs preparation (select, start, abort, reset, another mode) goes to the cell, which answers with the new state.
 */
#include <string.h>
#include "engine/state/state.h"

#define STANDBY 1u
#define MODE_MAX 5u
#define SELECTED 2u
#define READY 3u
#define ACTIVE 4u
#define HOLD 5u
#define SELECTING 7u
#define DESELECTING 8u
#define PREPARING 9u
#define STARTING 11u
#define STOPPING 13u
#define RESET 15u
#define WATCHDOG_DEFAULT_US 1000000u
#define ERROR_TO_STATE 270061u
#define ERROR_WATCHDOG 270053u

void mode_publish_state(engine *e) {
    HLI_IMCM_MODE_STATE *s = &e->channel->channel_mc_control.mode_and_state.state_r;
    show_u32(&s->mode, ATOMIC_GET(e->mode));
    show_u32(&s->state, ATOMIC_GET(e->mode_state));
}

void engine_set_mode(engine *e, uint32_t mode, uint32_t state) {
    ATOMIC_SET(e->mode, mode);
    ATOMIC_SET(e->mode_state, state);
    if (state != HOLD && state != STOPPING) ATOMIC_SET(e->stopped, 0);
    if (e->channel && e->geo.cycle == 0) mode_publish_state(e); /* later on the cycle does: a lockstep PLC may be scanning now */
}

uint32_t engine_mode_state(engine *e) { return ATOMIC_GET(e->mode_state); }

int engine_take_mode_command(engine *e, engine_mode_command *out) {
    if (!ATOMIC_GET(e->mode_pending)) return 0;
    *out = e->mode_command;
    ATOMIC_SET(e->mode_pending, 0);
    return 1;
}

/* ------------------------------------------------------------------------------------------------ errors */
/* Queue of ERRORS_MAX records; what finds no room is counted. One producer: GEO and the cell on GEO's behalf. */
static void queue_error(engine *e, const engine_error *error) {
    uint64_t head = ATOMIC_GET(e->errors_head);
    if (head - ATOMIC_GET(e->errors_done) >= ERRORS_MAX) {
        e->errors_lost++;
        return;
    }
    e->errors[head % ERRORS_MAX] = *error;
    ATOMIC_SET(e->errors_head, head + 1);
}

void engine_post_error(engine *e, const engine_error *error) {
    while (__atomic_exchange_n(&e->errors_lock, 1, __ATOMIC_ACQUIRE)) cpu_pause();
    queue_error(e, error);
    __atomic_store_n(&e->errors_lock, 0, __ATOMIC_RELEASE);
}

static void own_error(engine *e, uint32_t id, uint32_t reaction) {
    engine_error error;
    memset(&error, 0, sizeof error);
    error.id = id;
    error.reaction_class = reaction;
    error.recovery_class = reaction;
    if (__atomic_exchange_n(&e->errors_lock, 1, __ATOMIC_ACQUIRE)) return; /* the cell is posting: next cycle will do */
    queue_error(e, &error);
    __atomic_store_n(&e->errors_lock, 0, __ATOMIC_RELEASE);
}

static void fill_record(engine *e, HLI_ERROR_SATZ *r, const engine_error *error) {
    memset(r, 0, sizeof *r);
    r->kopf.error_id = error->id;
    r->kopf.line = (int32_t)error->line;
    memcpy(r->kopf.modul_name.zeichen, "HLICOSIM", 8);
    r->kopf.channel = (uint16_t)(e->cfg.channel + 1);
    r->kopf.cycle = (uint32_t)e->geo.cycle;
    r->kopf.recovery_class = (uint16_t)error->recovery_class;
    r->kopf.reaction_class = (uint16_t)error->reaction_class;
    if (!error->line) return;
    HLI_RUMPF_NC_PROG body;
    memset(&body, 0, sizeof body);
    memcpy(body.prog_name, error->program, sizeof error->program);
    memcpy(body.file_name, error->program, sizeof error->program);
    body.fileoffset = -1;
    body.tokenoffset = (uint16_t)error->column;
    body.satz_nr = error->n;
    r->kopf.body_type = 1;
    memcpy(&r->rumpf.maske, &body, sizeof body);
}

/* CNC to PLC: the next record once the one before is taken; a PLC that does not enable the unit is not waited for. */
void mode_publish_errors(engine *e) {
    MC_ERROR *u = &e->channel->mc_error;
    if (e->errors_done == ATOMIC_GET(e->errors_head)) return;
    if (load_u8_acquire(&u->enable_w) && load_u8_acquire(&u->semaphor_rw)) return;
    fill_record(e, &u->satz_r, &e->errors[e->errors_done % ERRORS_MAX]);
    store_u8_release(&u->semaphor_rw, 1);
    ATOMIC_SET(e->errors_done, e->errors_done + 1);
}

/* PLC to CNC. */
static void take_plc_error(engine *e) {
    MC_ERROR *u = &e->channel->lc_error;
    if (!load_u8_acquire(&u->semaphor_rw) || ATOMIC_GET(e->plc_error_id)) return;
    e->plc_error_class = load_u16_relaxed(&u->satz_r.kopf.reaction_class);
    uint32_t id = load_u32_relaxed(&u->satz_r.kopf.error_id);
    ATOMIC_SET(e->plc_error_id, id ? id : UINT32_MAX);
    store_u8_release(&u->semaphor_rw, 0);
}

int engine_take_plc_error(engine *e, uint32_t *id, uint32_t *reaction_class) {
    *id = ATOMIC_GET(e->plc_error_id);
    if (!*id) return 0;
    *reaction_class = e->plc_error_class;
    ATOMIC_SET(e->plc_error_id, 0);
    return 1;
}

/* ------------------------------------------------------------------------------------------------ watchdogs */
/* The CNC monitors the PLC: alive_rw has to be set once in every period of the cell's time. */
static void watch_plc(engine *e, bool present) {
    MC_WATCHDOG_UNIT *u = &e->channel->head.mc_watchdog;
    if (!present || !load_u8_acquire(&u->enable_w)) {
        e->watch_alive = false;
        show_u8(&u->alive_state_r, 0);
        return;
    }
    uint32_t us = load_u32_relaxed(&u->cycle_time_w);
    double period = 1e-6 * (us ? us : WATCHDOG_DEFAULT_US), now = (double)e->geo.cycle * e->cfg.cycle_s;
    if (load_u8_acquire(&u->alive_rw)) {
        store_u8_release(&u->alive_rw, 0);
        e->watch_alive = true;
        e->watch_since = now;
    } else if (e->watch_alive && now - e->watch_since > period) {
        e->watch_alive = false;
        e->watch_missed = true;
        own_error(e, ERROR_WATCHDOG, 7);
        ATOMIC_SET(e->watchdog_event, 1);
    }
    show_u8(&u->alive_state_r, e->watch_alive && !e->watch_missed);
}

/* The other direction: the CNC shows that it lives; the PLC clears alive_rw when it has seen it. */
static void show_life(engine *e, bool present) {
    MC_WATCHDOG_UNIT *u = &e->channel->head.lc_watchdog;
    bool enabled = present && load_u8_acquire(&u->enable_w);
    if (enabled) store_u8_release(&u->alive_rw, 1);
    show_u8(&u->alive_state_r, enabled);
}

/* ------------------------------------------------------------------------------------------------ modes */
static bool legal_target(uint32_t mode, uint32_t state) {
    if (mode < 1 || mode > MODE_MAX) return false;
    return mode == STANDBY ? state >= 1 && state <= READY : (state >= 1 && state <= HOLD) || state == RESET;
}

static void read_command(engine_mode_command *out, const HLI_PROC_TRANS_TO_MODE_STATE *c) {
    out->from_mode = load_u32_relaxed(&c->from_mode);
    out->from_state = load_u32_relaxed(&c->from_state);
    out->to_mode = load_u32_relaxed(&c->to_mode);
    out->to_state = load_u32_relaxed(&c->to_state);
    memcpy(out->parameter, c->parameter, sizeof out->parameter);
    out->parameter[sizeof out->parameter - 1] = 0;
}

/* Stop and resume are for the path alone; true if the command was one of these. */
static bool stop_or_resume(engine *e, const engine_mode_command *c) {
    uint32_t state = ATOMIC_GET(e->mode_state);
    if (c->to_mode != ATOMIC_GET(e->mode) || ATOMIC_GET(e->hold_to_cell)) return false;
    if (c->to_state == HOLD && (state == ACTIVE || state == HOLD || state == STOPPING)) {
        ATOMIC_SET(e->stopped, 1);
        if (state == ACTIVE) ATOMIC_SET(e->mode_state, STOPPING);
        return true;
    }
    if (c->to_state == ACTIVE && (state == HOLD || state == STOPPING)) {
        ATOMIC_SET(e->stopped, 0);
        ATOMIC_SET(e->mode_state, ACTIVE);
        return true;
    }
    return false;
}

/* HOLD and back, by the cell. */
void engine_hold(engine *e, int hold) {
    ATOMIC_SET(e->stopped, hold);
    ATOMIC_SET(e->mode_state, hold ? STOPPING : ACTIVE);
}

void engine_hold_by_cell(engine *e, int by_cell) { ATOMIC_SET(e->hold_to_cell, by_cell); }

void engine_macro_runs(engine *e, int runs) { ATOMIC_SET(e->macro_runs, runs); }

/* Transient state while the cell carries the command out. */
static uint32_t on_the_way(uint32_t target) {
    static const uint32_t transient[] = {RESET, DESELECTING, SELECTING, PREPARING, STARTING, STOPPING};
    return transient[target > HOLD ? 0 : target];
}

static void take_command(engine *e, MC_CONTROL_MCM_MODE_STATE_UNIT *u) {
    engine_mode_command c;
    if (ATOMIC_GET(e->mode_pending)) return; /* one at a time */
    read_command(&c, &u->command_w);
    store_u8_release(&u->command_semaphor_rw, 0);
    if (!legal_target(c.to_mode, c.to_state)) {
        own_error(e, ERROR_TO_STATE, 1);
        return;
    }
    if ((c.from_mode && c.from_mode != ATOMIC_GET(e->mode)) || (c.from_state && c.from_state != ATOMIC_GET(e->mode_state))) e->mode_warnings++;
    if (stop_or_resume(e, &c)) return;
    c.state = ATOMIC_GET(e->mode_state);
    ATOMIC_SET(e->mode_state, on_the_way(c.to_state)); /* so that nobody takes the old state for the command's outcome */
    e->mode_command = c;
    ATOMIC_SET(e->mode_pending, 1);
}

/* Once a cycle, ahead of the motion. */
void mode_cycle(engine *e, bool present) {
    MC_CONTROL_MCM_MODE_STATE_UNIT *u = &e->channel->channel_mc_control.mode_and_state;
    if (present && load_u8_acquire(&u->enable_w) && load_u8_acquire(&u->command_semaphor_rw)) take_command(e, u);
    if (ATOMIC_GET(e->mode_state) == STOPPING && e->geo.v <= 0.0 && !ATOMIC_GET(e->macro_runs)) ATOMIC_SET(e->mode_state, HOLD);
    watch_plc(e, present);
    show_life(e, present);
    take_plc_error(e);
}
