/* GEO's side of the HLI: take the PLC's level commands, publish status. The CNC never reads its own state back. */
#include <math.h>
#include "engine_internal.h"

#define OVERRIDE_FULL 1000u
#define OVERRIDE_MAX 2000u

static bool flag(const volatile uint8_t *p) { return load_u8_acquire(p) != 0; }

static int32_t dint(double v) { return v >= 2147483647.0 ? INT32_MAX : v <= -2147483648.0 ? INT32_MIN : (int32_t)lrint(v); }

/* Level control unit (hli_reference 2.2): the PLC's command counts while plc_present_w and enable_w. */
static bool level_bool(MC_CONTROL_BOOL_UNIT *u, bool present, bool fallback) {
    bool value = present && flag(&u->enable_w) ? flag(&u->command_w) : fallback;
    store_u8_release(&u->state_r, value);
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
    store_u16_relaxed(&u->state_r, (uint16_t)value);
    return value;
}

/* All axes of the channel released (lr_mc_control.release_feedhold; not enabled counts as released). */
static bool axes_released(engine *e) {
    bool released = true;
    for (int i = 0; i < e->cfg.axis_count; i++) {
        HLI_AXIS *ax = &e->segment->axis[i];
        bool present = flag(&ax->head.plc_present_w);
        released &= level_bool(&ax->lr_mc_control.release_feedhold, present, true);
    }
    return released;
}

/* P-CHAN-00181: what rapid motion follows. */
static double rapid_factor(const engine *e, double feed, double rapid) {
    switch (e->cfg.rapid_override_mode) {
    case 1: return fmin(feed, rapid);
    case 2: case 3: return rapid;
    default: return feed;
    }
}

void take_commands(engine *e) {
    HLI_BAHN_MC_CONTROL *c = &e->channel->bahn_mc_control;
    bool present = flag(&e->channel->head.plc_present_w);
    bool hold = level_bool(&c->feedhold, present, false) | !axes_released(e);
    bool valid = level_bool(&c->override_valid, present, false);
    double factor = level_override(e, &c->override, present, valid) / (double)OVERRIDE_FULL;
    bool rapid_valid = level_bool(&c->rapid_override_valid, present, false);
    double rapid = rapid_factor(e, factor, level_override(e, &c->rapid_override, present, rapid_valid) / (double)OVERRIDE_FULL);
    bool go_on = level_bool(&c->continue_machining, present, false);
    if (go_on && !e->geo.continue_seen) e->geo.waiting_continue = e->geo.stands_single = false;
    e->geo.continue_seen = go_on;
    __atomic_store(&e->override_now, &factor, __ATOMIC_RELEASE);
    __atomic_store(&e->rapid_now, &rapid, __ATOMIC_RELEASE);
    ATOMIC_SET(e->single_now, level_bool(&c->single_block, present, false));
    ATOMIC_SET(e->m01_now, level_bool(&c->m01_stop_enable, present, false));
    ATOMIC_SET(e->hold_now, hold);
}

static void publish_axis(engine *e, int i) {
    const geo *g = &e->geo;
    HLI_COORD *k = &e->channel->bahn_state.coord_r[i];
    const piece *p = piece_at(e, g->piece);
    double target = g->piece != UINT64_MAX ? p->end[i] : g->position[i];
    int32_t now = dint(g->position[i] * TENTH_UM);
    uint16_t state = g->v > 0 ? 3 : 1;
    HLI_LR_STATE *lr = &e->segment->axis[i].lr_state;
    store_u32_relaxed(&k->cmd_position_r, (uint32_t)dint(target * TENTH_UM));
    store_u32_relaxed(&k->act_position_r, (uint32_t)now);
    store_u32_relaxed(&k->current_position_r, (uint32_t)now);
    store_u32_relaxed(&k->acs_position_r, (uint32_t)now);
    store_u16_relaxed(&k->state_r, state);
    store_u32_relaxed(&lr->end_position_acs_r, (uint32_t)dint(target * TENTH_UM));
    store_u32_relaxed(&lr->active_position_acs_r, (uint32_t)now);
    store_u32_relaxed(&lr->current_position_acs_r, (uint32_t)now);
    store_u16_relaxed(&lr->axis_state_r, state);
}

static double display_distance(engine *e) {
    const geo *g = &e->geo;
    if (g->piece == UINT64_MAX || e->element_head == 0) return 0.0;
    const element *el = element_at(e, g->active);
    if (el->epoch != g->epoch) return 0.0;
    const piece *p = piece_at(e, g->piece);
    if (is_motion(p) && p->mapped) return el->facts.start_position + fmin(g->element_distance * TENTH_UM, el->facts.length);
    if (!is_motion(p) || p->element != g->active) return el->facts.start_position + el->facts.length;
    if (g->s >= p->length) return el->facts.start_position + el->facts.length;
    return el->facts.start_position + g->s * TENTH_UM;
}

static uint32_t stop_conditions(engine *e) {
    uint32_t bits = 0;
    if (e->geo.v > 0) return 0;
    if (load_u8_acquire(&e->channel->bahn_mc_control.feedhold.state_r)) bits |= 1u;
    if (e->hold_now && !bits) bits |= 2u;
    if (e->override_now <= 0) bits |= 4u;
    if (e->geo.waiting_continue) bits |= e->geo.stands_single ? 8u : piece_at(e, e->geo.piece)->code == 1 ? 32u : 16u;
    if (e->geo.waiting_techno) bits |= 64u;
    if (e->geo.dwelling) bits |= 256u;
    return bits;
}

static void publish_bahn(engine *e) {
    const geo *g = &e->geo;
    HLI_BAHN_STATE *b = &e->channel->bahn_state;
    const piece *p = g->piece == UINT64_MAX ? NULL : piece_at(e, g->piece);
    bool motion = p && is_motion(p);
    store_f64_relaxed(&b->dist_prog_start, display_distance(e));
    double length = motion && p->mapped ? element_at(e, g->active)->facts.length / TENTH_UM : motion ? p->length : 0.0;
    double driven = motion && p->mapped ? fmin(g->element_distance, length) : motion ? g->s : 0.0;
    store_f64_relaxed(&b->dist_to_go_r, (length - driven) * TENTH_UM);
    store_u32_relaxed(&b->covered_distance_r, length > 0.0 ? (uint32_t)lrint(1000.0 * driven / length) : 0);
    store_u32_relaxed(&b->block_count_r, g->count);
    store_u32_relaxed(&b->block_number_r, g->n);
    store_u32_relaxed(&b->command_feed_r, (uint32_t)dint(g->feed * 1000.0));
    store_u32_relaxed(&b->active_feed_r, (uint32_t)dint(g->v * 1000.0));
    store_u32_relaxed(&b->stop_condition_r, stop_conditions(e));
    store_u32_relaxed(&b->tool_nr_r, (uint32_t)g->tool);
    store_u16_relaxed(&b->override_r, (uint16_t)lrint(e->override_now * OVERRIDE_FULL));
    store_u8_release(&b->interpolation_active_r, motion && g->has_phase);
    store_u8_release(&b->axes_in_position_r, g->v <= 0);
    store_u8_release(&b->wait_continue_r, g->waiting_continue);
    store_u8_release(&b->wait_techno_acknowledge_r, g->waiting_techno);
    store_u8_release(&b->dwell_time_active_r, g->dwelling && g->has_phase);
    store_u8_release(&b->feedhold_active_r, e->hold_now != 0);
    store_u8_release(&b->rapid_active_r, motion && g->rapid);
    store_u8_release(&e->channel->decoder_state.program_end_r, ATOMIC_GET(e->finished) != 0);
    store_u8_release(&b->program_end_r, e->program_end != 0);
}

/* Entries were written first; now their count, and f_log_is_active last. */
static void publish_lookahead(engine *e) {
    HLI_CONTOUR_LOOKAHEAD_STATE *s = &e->channel->contour_lookahead.state;
    uint32_t active = ATOMIC_GET(e->log.active);
    store_f64_relaxed(&s->max_dist_prog_start, max_dist_prog_start(e));
    store_u32_release(&s->count_logged_blocks, ATOMIC_GET(e->log.count));
    store_u8_release(&s->f_log_is_active, active != 0);
}

static void publish_stats(engine *e) {
    HLI_SIDE_STATS *s = &e->side->stats;
    store_u64_relaxed(&s->requests_mode1, ATOMIC_GET(e->requests_mode1));
    store_u64_relaxed(&s->requests_mode2, ATOMIC_GET(e->requests_mode2));
    store_u64_relaxed(&s->requests_bad, ATOMIC_GET(e->requests_bad));
    store_u64_relaxed(&s->overruns, e->overruns);
    store_u64_relaxed(&s->bad_commands, e->bad_commands);
}

void publish(engine *e) {
    seq_begin(&e->side->channel_seq.word);
    publish_bahn(e);
    for (int i = 0; i < e->cfg.axis_count; i++) publish_axis(e, i);
    publish_lookahead(e);
    seq_end(&e->side->channel_seq.word);
    publish_stats(e);
    store_u64_release(&e->side->cnc.cell_time_ns, (uint64_t)llrint((double)e->geo.cycle * e->cfg.cycle_s * 1e9));
    store_u64_release(&e->side->cnc.cycle, e->geo.cycle);
}

/* Power-up state, before the first cycle. */
void publish_initial(engine *e) {
    publish(e);
    store_u8_release(&e->channel->head.init_done_r, 1);
}
