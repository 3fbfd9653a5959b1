/* GEO's side of the HLI: take the PLC's level commands, publish status. The CNC never reads its own state back. */
#include <math.h>
#include "engine/state/state.h"

#define OVERRIDE_FULL 1000u
#define OVERRIDE_MAX 2000u

static bool flag(const volatile uint8_t *p) { return load_u8_acquire(p) != 0; }

static int32_t dint(double v) { return v >= 2147483647.0 ? INT32_MAX : v <= -2147483648.0 ? INT32_MIN : (int32_t)lrint(v); }

/* Level control unit (hli_reference 2.2): the PLC's command counts while plc_present_w and enable_w. */
static bool level_bool(MC_CONTROL_BOOL_UNIT *u, bool present, bool fallback) {
    bool value = present && flag(&u->enable_w) ? flag(&u->command_w) : fallback;
    show_u8(&u->state_r, value);
    return value;
}

static uint32_t level_override(engine *e, MC_CONTROL_UNS16_UNIT *u, bool present, bool valid) {
    uint32_t value = OVERRIDE_FULL;
    if (present && valid && flag(&u->enable_w)) {
        value = load_u16_relaxed(&u->command_w);
        if (value > OVERRIDE_MAX) {
            value = OVERRIDE_MAX;
            e->bad_commands++;
        }
    }
    show_u16(&u->state_r, (uint16_t)value);
    return value;
}

/* All axes of the channel released (lr_mc_control.release_feedhold; not enabled counts as released). */
static bool axes_released(engine *e) {
    bool released = true;
    for (int i = 0; i < e->cfg.axis_count; i++) {
        HLI_AXIS *ax = &e->segment->axis[i];
        bool present = flag(&ax->head.plc_present_w);
        released &= level_bool(&ax->lr_mc_control.release_feedhold, present, true);
        released &= level_bool(&ax->lr_mc_control.drive_on, present, true);
        released &= level_bool(&ax->lr_mc_control.torque_permission, present, true);
    }
    e->released = released;
    return released;
}

/* Override of an axis: acts on independent axes and spindles, of which there are none that move; shown all the same. */
static void show_axis_override(engine *e, HLI_AXIS *ax, bool present) {
    bool valid = level_bool(&ax->ipo_mc_control.override_valid, present, false);
    (void)level_override(e, &ax->ipo_mc_control.override, present, valid);
}

/* An axis that moves now is held: the path stands. The others that are held stop the path ahead of their next motion. */
static bool axes_held(engine *e) {
    uint32_t held = 0;
    for (int i = 0; i < e->cfg.axis_count; i++) {
        HLI_AXIS *ax = &e->segment->axis[i];
        bool present = flag(&ax->head.plc_present_w);
        show_axis_override(e, ax, present);
        if (level_bool(&ax->ipo_mc_control.feedhold, present, false)) held |= 1u << i;
    }
    ATOMIC_SET(e->held_axes, held);
    return held && e->geo.piece != UINT64_MAX && e->piece_done <= e->geo.piece && (piece_at(e, e->geo.piece)->moving & held);
}

/* External path speed, valid while both units are enabled; true if it is negative: backward. */
static bool take_external_speed(engine *e, HLI_BAHN_MC_CONTROL *c, bool present) {
    bool valid = level_bool(&c->ext_command_speed_valid, present, false) && flag(&c->ext_command_speed.enable_w);
    int32_t speed = valid ? (int32_t)load_u32_relaxed((uint32_t *)&c->ext_command_speed.command_w) : 0;
    double value = valid ? fabs(speed / 1000.0) : NEVER;
    show_u32((uint32_t *)&c->ext_command_speed.state_r, (uint32_t)speed);
    __atomic_store(&e->ext_speed, &value, __ATOMIC_RELEASE);
    return speed < 0;
}

/* P-CHAN-00181: what rapid motion follows. */
static double rapid_factor(const engine *e, double feed, double rapid) {
    switch (e->cfg.rapid_override_mode) {
    case 1: return fmin(feed, rapid);
    case 2: case 3: return rapid;
    default: return feed;
    }
}

/* Delete distance to go: the rising edge counts; state_r says that it was seen. */
static void take_shortcut(engine *e, HLI_BAHN_MC_CONTROL *c, bool present) {
    uint32_t mask = present && flag(&c->del_dist_to_go_end.enable_w) ? load_u32_relaxed(&c->del_dist_to_go_end.command_w) : 0;
    show_u32(&c->del_dist_to_go_end.state_r, mask);
    ATOMIC_SET(e->shortcut_mask, mask);
    bool wanted = level_bool(&c->delete_distance_to_go, present, false);
    if (wanted && !e->shortcut_seen && e->store_kept && !e->program_end) ATOMIC_SET(e->shortcut_requests, e->shortcut_requests + 1);
    e->shortcut_seen = wanted;
}

/* Channel axis of a logical axis number, -1 if it is none. */
static int channel_axis(engine *e, uint32_t number) {
    for (int i = 0; i < e->cfg.axis_count; i++)
        if (e->cfg.axis_id[i] == number) return i;
    return -1;
}

/* insert_cmd (hli_reference 5.3): taken once the command before has reached the planner. */
static void take_insert_command(engine *e, HLI_BAHN_MC_CONTROL *c, bool present) {
    MC_CONTROL_INSERT_CMD_UNIT *u = &c->insert_cmd;
    if (!present || !flag(&u->enable_w) || !flag(&u->command_semaphor_rw)) return;
    if (ATOMIC_GET(e->feed.inserts) != e->insert_requests) return;
    insert_cmd cmd = {.value = load_f64_relaxed(&u->command_w.dist_or_pos) / TENTH_UM,
                      .mode = load_u16_relaxed(&u->command_w.rel_abs_mode),
                      .m_function = load_u16_relaxed(&u->command_w.m_function_nr),
                      .add = (int32_t)load_u32_relaxed((uint32_t *)&u->command_w.add_nr)};
    uint32_t number = load_u16_relaxed(&u->command_w.axis_nr);
    int axis = number ? channel_axis(e, number) : -1;
    cmd.axis = axis + 1;
    cmd.base = axis >= 0 ? e->geo.position[axis] : e->geo.dist_shift + e->geo.dist;
    bool good = isfinite(cmd.value) && fabs(cmd.value) < 1e12 && cmd.mode <= INSERT_RELATIVE_ONCE && (!number || axis >= 0);
    if (good && cmd.mode != INSERT_ABSOLUTE && !number && cmd.value < 0.0) good = false;
    if (good) {
        e->insert_request = cmd;
        ATOMIC_SET(e->insert_requests, e->insert_requests + 1);
    } else {
        e->bad_commands++;
    }
    store_u8_release(&u->command_semaphor_rw, 0);
}

void take_commands(engine *e) {
    HLI_BAHN_MC_CONTROL *c = &e->channel->bahn_mc_control;
    bool present = flag(&e->channel->head.plc_present_w);
    mode_cycle(e, present);
    e->feedhold_now = level_bool(&c->feedhold, present, false);
    bool hold = e->feedhold_now | !axes_released(e) | axes_held(e) | ATOMIC_GET(e->stopped);
    bool valid = level_bool(&c->override_valid, present, false);
    double factor = level_override(e, &c->override, present, valid) / (double)OVERRIDE_FULL;
    bool rapid_valid = level_bool(&c->rapid_override_valid, present, false);
    double rapid = rapid_factor(e, factor, level_override(e, &c->rapid_override, present, rapid_valid) / (double)OVERRIDE_FULL);
    bool go_on = level_bool(&c->continue_machining, present, false);
    if (go_on && !e->geo.continue_seen) e->geo.waiting_continue = e->geo.stands_single = false;
    e->geo.continue_seen = go_on;
    if (ATOMIC_GET(e->override_ignored)) factor = rapid = 1.0;
    __atomic_store(&e->override_now, &factor, __ATOMIC_RELEASE);
    __atomic_store(&e->rapid_now, &rapid, __ATOMIC_RELEASE);
    bool external = take_external_speed(e, c, present);
    ATOMIC_SET(e->backward_now, (level_bool(&c->backward_motion, present, false) || external) && !e->program_end);
    ATOMIC_SET(e->simulate_now, level_bool(&c->simulate_motion, present, false));
    if (level_bool(&c->backward_storage_off, present, false) && e->program_end) ATOMIC_SET(e->store_first, ATOMIC_GET(e->store_head));
    take_shortcut(e, c, present);
    take_insert_command(e, c, present);
    ATOMIC_SET(e->rt_loop_now, level_bool(&c->rt_loop_enable, present, false));
    ATOMIC_SET(e->single_now, level_bool(&c->single_block, present, false));
    ATOMIC_SET(e->m01_now, level_bool(&c->m01_stop_enable, present, false));
    ATOMIC_SET(e->hold_now, hold);
}

static void publish_axis(engine *e, int i) {
    const geo *g = &e->geo;
    HLI_COORD *k = &e->channel->bahn_state.coord_r[i];
    const piece *p = piece_at(e, g->piece);
    double target = g->piece != UINT64_MAX ? load_f64_relaxed(&p->end[i]) : g->position[i];
    int32_t now = dint(g->position[i] * TENTH_UM);
    uint16_t state = g->v > 0 ? 3 : 1;
    HLI_LR_STATE *lr = &e->segment->axis[i].lr_state;
    show_u32(&k->cmd_position_r, (uint32_t)dint(target * TENTH_UM));
    show_u32(&k->act_position_r, (uint32_t)now);
    show_u32(&k->current_position_r, (uint32_t)now);
    show_u32(&k->acs_position_r, (uint32_t)now);
    show_u16(&k->state_r, state);
    show_u32(&lr->end_position_acs_r, (uint32_t)dint(target * TENTH_UM));
    show_u32(&lr->active_position_acs_r, (uint32_t)now);
    show_u32(&lr->current_position_acs_r, (uint32_t)now);
    show_u16(&lr->axis_state_r, state);
}

static double display_distance(engine *e) {
    const geo *g = &e->geo;
    return (g->dist_shift + g->dist) * TENTH_UM;
}

static uint32_t stop_conditions(engine *e) {
    uint32_t bits = 0;
    if (e->geo.v > 0) return 0;
    if (e->feedhold_now) bits |= 1u;
    if (ATOMIC_GET(e->held_axes)) bits |= 2u;
    if (ATOMIC_GET(e->stopped)) bits |= 1024u;
    if (!e->released) bits |= 4096u;
    if (e->program_active && !e->finished && e->store_done >= ATOMIC_GET(e->store_head)) bits |= 8192u;
    if (ATOMIC_GET(e->mode_state) == 6u) bits |= 512u;
    if (e->override_now <= 0) bits |= 4u;
    if (e->geo.waiting_continue) bits |= e->geo.stands_single ? 8u : piece_at(e, e->geo.piece)->inserted ? 2048u : piece_at(e, e->geo.piece)->code == 1 ? 32u : 16u;
    if (e->geo.waiting_techno) bits |= 64u;
    if (e->geo.dwelling) bits |= 256u;
    return bits;
}

static void publish_next_stop(engine *e) {
    HLI_INSERT_CMD_STATE *s = &e->channel->bahn_mc_control.insert_cmd.state_r;
    bool found = e->stops_done < ATOMIC_GET(e->stops_fed);
    const inserted_stop *stop = &e->stops[e->stops_done % STOPS_MAX];
    show_f64(&s->distance_of_next_stop, found ? load_f64_relaxed(&stop->dist) * TENTH_UM : -1.0);
    for (int i = 0; i < e->cfg.axis_count; i++)
        show_u32((uint32_t *)&s->position_at_next_stop[i], (uint32_t)(found ? dint(load_f64_relaxed(&stop->position[i]) * TENTH_UM) : 0));
}

static void publish_bahn(engine *e) {
    const geo *g = &e->geo;
    HLI_BAHN_STATE *b = &e->channel->bahn_state;
    const piece *p = g->piece == UINT64_MAX ? NULL : piece_at(e, g->piece);
    bool motion = p && is_motion(p);
    show_f64(&b->dist_prog_start, display_distance(e));
    /* the planner may shorten the piece in which GEO stands: read once */
    double length = !motion ? 0.0 : p->mapped ? element_at(e, g->active)->facts.length / TENTH_UM : load_f64_relaxed(&p->length);
    double driven = !motion ? 0.0 : p->mapped ? fmin(g->element_distance, length) : g->s;
    show_f64(&b->dist_to_go_r, (length - driven) * TENTH_UM);
    show_u32(&b->covered_distance_r, length > 0.0 ? (uint32_t)lrint(1000.0 * driven / length) : 0);
    show_u32(&b->block_count_r, g->count);
    show_u32(&b->block_number_r, g->n);
    show_u32(&b->command_feed_r, (uint32_t)dint(g->feed * 1000.0));
    bool external = e->ext_speed < NEVER && motion && p->dir < 0;
    show_u32(&b->active_feed_r, (uint32_t)dint((external ? -geo_path_speed(e) : geo_path_speed(e)) * 1000.0));
    show_u32(&b->stop_condition_r, stop_conditions(e));
    show_u32(&b->tool_nr_r, (uint32_t)g->tool);
    show_u16(&b->override_r, (uint16_t)lrint(e->override_now * OVERRIDE_FULL));
    show_u8(&b->interpolation_active_r, motion && g->has_phase);
    show_u8(&b->axes_in_position_r, g->v <= 0);
    show_u8(&b->wait_continue_r, g->waiting_continue);
    show_u8(&b->wait_techno_acknowledge_r, g->waiting_techno);
    show_u8(&b->dwell_time_active_r, g->dwelling && g->has_phase);
    show_u8(&b->feedhold_active_r, e->hold_now != 0);
    show_u8(&b->rapid_active_r, motion && g->rapid);
    show_u8(&e->channel->decoder_state.program_end_r, ATOMIC_GET(e->finished) != 0);
    show_u8(&b->program_end_r, e->program_end != 0);
    show_u8(&b->wait_error_removal_r, ATOMIC_GET(e->mode_state) == 6u);
    show_u8(&e->channel->decoder_state.wait_after_error_r, ATOMIC_GET(e->mode_state) == 6u);
    show_u32(&b->error_id_r, ATOMIC_GET(e->error_id));
    show_u8(&b->error_r, ATOMIC_GET(e->error_id) != 0);
    if (ATOMIC_GET(e->name_changed)) {
        ATOMIC_SET(e->name_changed, 0);
        memcpy(b->prog_name_r, e->program_name, sizeof e->program_name);
    }
    show_u8(&b->backward_active_r, motion && p->dir < 0);
    if (motion && e->was_backward && p->dir >= 0) ATOMIC_SET(e->retraced_event, 1);
    if (motion) e->was_backward = p->dir < 0;
    show_u8(&b->delete_distance_to_go_active_r, ATOMIC_GET(e->feed.shortcuts) != e->shortcut_requests || (motion && p->shortcut));
    publish_next_stop(e);
    foresight_publish(e);
}

/* Entries were written first; now their count, and f_log_is_active last. */
static void publish_lookahead(engine *e) {
    HLI_CONTOUR_LOOKAHEAD_STATE *s = &e->channel->contour_lookahead.state;
    uint32_t active = ATOMIC_GET(e->log.active);
    show_f64(&s->max_dist_prog_start, max_dist_prog_start(e));
    show_u32(&s->count_logged_blocks, ATOMIC_GET(e->log.count));
    show_u8(&s->f_log_is_active, active != 0);
}

static void publish_stats(engine *e) {
    HLI_SIDE_STATS *s = &e->side->stats;
    store_u64_relaxed(&s->requests_mode1, ATOMIC_GET(e->requests_mode1));
    store_u64_relaxed(&s->requests_mode2, ATOMIC_GET(e->requests_mode2));
    store_u64_relaxed(&s->requests_bad, ATOMIC_GET(e->requests_bad));
    store_u64_relaxed(&s->overruns, e->overruns);
    store_u64_relaxed(&s->bad_commands, e->bad_commands);
}

/* Showing it twice is showing it once. */
static void show_channel(engine *e) {
    publish_bahn(e);
    for (int i = 0; i < e->cfg.axis_count; i++) publish_axis(e, i);
    publish_lookahead(e);
    mode_publish_state(e);
}

void publish(engine *e) {
    seq_begin(&e->side->channel_seq.word);
    show_channel(e);
    mode_publish_errors(e);
    seq_end(&e->side->channel_seq.word);
    publish_stats(e);
    store_u64_release(&e->side->cnc.cell_time_ns, (uint64_t)llrint((double)e->geo.cycle * e->cfg.cycle_s * 1e9));
    store_u64_release(&e->side->cnc.cycle, e->geo.cycle);
}

/* Between two cycles: the channel's state once more. */
void publish_again(engine *e) {
    seq_begin(&e->side->channel_seq.word);
    show_channel(e);
    seq_end(&e->side->channel_seq.word);
}

/* Power-up state, before the first cycle. */
void publish_initial(engine *e) {
    publish(e);
    store_u8_release(&e->channel->head.init_done_r, 1);
}
