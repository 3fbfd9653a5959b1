/* GEO's side of the HLI: take the PLC's level commands, publish status. The CNC
 * never reads its own state back. */
#include <math.h>
#include "engine/state/state.h"

#define OVERRIDE_FULL 1000u
#define OVERRIDE_MAX 2000u

static bool flag(const volatile uint8_t *p) {
    return load_u8_acquire(p) != 0;
}

static int32_t dint(double v) {
    return v >= 2147483647.0    ? INT32_MAX
           : v <= -2147483648.0 ? INT32_MIN
                                : (int32_t)lrint(v);
}

/* Level control unit (hli_reference 2.2): the PLC's command counts while
 * plc_present_w and enable_w. */
static bool level_bool(MC_CONTROL_BOOL_UNIT *unit,
                       bool present,
                       bool fallback) {
    bool value =
        present && flag(&unit->enable_w) ? flag(&unit->command_w) : fallback;
    show_u8(&unit->state_r, value);
    return value;
}

static uint32_t level_override(struct engine *engine,
                               MC_CONTROL_UNS16_UNIT *unit,
                               bool present,
                               bool valid) {
    uint32_t value = OVERRIDE_FULL;
    if (present && valid && flag(&unit->enable_w)) {
        value = load_u16_relaxed(&unit->command_w);
        if (value > OVERRIDE_MAX) {
            value = OVERRIDE_MAX;
            engine->bad_commands++;
        }
    }
    show_u16(&unit->state_r, (uint16_t)value);
    return value;
}

/* All axes of the channel released (lr_mc_control.release_feedhold; not enabled
 * counts as released). */
static bool axes_released(struct engine *engine) {
    bool released = true;
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        HLI_AXIS *ax = &engine->segment->axis[i];
        bool present = flag(&ax->head.plc_present_w);
        released &=
            level_bool(&ax->lr_mc_control.release_feedhold, present, true);
        released &= level_bool(&ax->lr_mc_control.drive_on, present, true);
        released &=
            level_bool(&ax->lr_mc_control.torque_permission, present, true);
    }
    engine->released = released;
    return released;
}

/* Override of an axis: acts on independent axes and spindles, of which there
 * are none that move; shown all the same. */
static void show_axis_override(struct engine *engine,
                               HLI_AXIS *ax,
                               bool present) {
    bool valid = level_bool(&ax->ipo_mc_control.override_valid, present, false);
    (void)level_override(engine, &ax->ipo_mc_control.override, present, valid);
}

/* An axis that moves now is held: the path stands. The others that are held
 * stop the path ahead of their next motion. */
static bool axes_held(struct engine *engine) {
    uint32_t held = 0;
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        HLI_AXIS *ax = &engine->segment->axis[i];
        bool present = flag(&ax->head.plc_present_w);
        show_axis_override(engine, ax, present);
        if (level_bool(&ax->ipo_mc_control.feedhold, present, false)) {
            held |= 1u << i;
        }
    }
    ATOMIC_SET(engine->held_axes, held);
    return held && engine->geo.piece != UINT64_MAX
           && engine->piece_done <= engine->geo.piece
           && (piece_at(engine, engine->geo.piece)->moving & held);
}

/* External path speed, valid while both units are enabled; true if it is
 * negative: backward. */
static bool take_external_speed(struct engine *engine,
                                HLI_BAHN_MC_CONTROL *bahn_mc_control,
                                bool present) {
    bool valid =
        level_bool(&bahn_mc_control->ext_command_speed_valid, present, false)
        && flag(&bahn_mc_control->ext_command_speed.enable_w);
    int32_t speed =
        valid ? (int32_t)load_u32_relaxed(
                    (uint32_t *)&bahn_mc_control->ext_command_speed.command_w)
              : 0;
    double value = valid ? fabs(speed / 1000.0) : NEVER;
    show_u32((uint32_t *)&bahn_mc_control->ext_command_speed.state_r,
             (uint32_t)speed);
    __atomic_store(&engine->ext_speed, &value, __ATOMIC_RELEASE);
    return speed < 0;
}

/* P-CHAN-00181: what rapid motion follows. */
static double rapid_factor(const struct engine *engine,
                           double feed,
                           double rapid) {
    switch (engine->cfg.rapid_override_mode) {
    case 1:
        return fmin(feed, rapid);
    case 2:
    case 3:
        return rapid;
    default:
        return feed;
    }
}

/* Delete distance to go: the rising edge counts; state_r says that it was seen.
 */
static void take_shortcut(struct engine *engine,
                          HLI_BAHN_MC_CONTROL *bahn_mc_control,
                          bool present) {
    uint32_t mask =
        present && flag(&bahn_mc_control->del_dist_to_go_end.enable_w)
            ? load_u32_relaxed(&bahn_mc_control->del_dist_to_go_end.command_w)
            : 0;
    show_u32(&bahn_mc_control->del_dist_to_go_end.state_r, mask);
    ATOMIC_SET(engine->shortcut_mask, mask);
    bool wanted =
        level_bool(&bahn_mc_control->delete_distance_to_go, present, false);
    if (wanted && !engine->shortcut_seen && engine->store_kept
        && !engine->program_end) {
        ATOMIC_SET(engine->shortcut_requests, engine->shortcut_requests + 1);
    }
    engine->shortcut_seen = wanted;
}

/* Channel axis of a logical axis number, -1 if it is none. */
static int channel_axis(struct engine *engine, uint32_t number) {
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        if (engine->cfg.axis_id[i] == number) {
            return i;
        }
    }
    return -1;
}

/* insert_cmd (hli_reference 5.3): taken once the command before has reached the
 * planner. */
static void take_insert_command(struct engine *engine,
                                HLI_BAHN_MC_CONTROL *bahn_mc_control,
                                bool present) {
    MC_CONTROL_INSERT_CMD_UNIT *unit = &bahn_mc_control->insert_cmd;
    if (!present || !flag(&unit->enable_w)
        || !flag(&unit->command_semaphor_rw)) {
        return;
    }
    if (ATOMIC_GET(engine->feed.inserts) != engine->insert_requests) {
        return;
    }
    struct insert_cmd cmd = {
        .value = load_f64_relaxed(&unit->command_w.dist_or_pos) / TENTH_UM,
        .mode = load_u16_relaxed(&unit->command_w.rel_abs_mode),
        .m_function = load_u16_relaxed(&unit->command_w.m_function_nr),
        .add = (int32_t)load_u32_relaxed((uint32_t *)&unit->command_w.add_nr)};
    uint32_t number = load_u16_relaxed(&unit->command_w.axis_nr);
    int axis = number ? channel_axis(engine, number) : -1;
    cmd.axis = axis + 1;
    cmd.base = axis >= 0 ? engine->geo.position[axis]
                         : engine->geo.dist_shift + engine->geo.dist;
    bool good = isfinite(cmd.value) && fabs(cmd.value) < 1e12
                && cmd.mode <= INSERT_RELATIVE_ONCE && (!number || axis >= 0);
    if (good && cmd.mode != INSERT_ABSOLUTE && !number && cmd.value < 0.0) {
        good = false;
    }
    if (good) {
        engine->insert_request = cmd;
        ATOMIC_SET(engine->insert_requests, engine->insert_requests + 1);
    } else {
        engine->bad_commands++;
    }
    store_u8_release(&unit->command_semaphor_rw, 0);
}

void take_commands(struct engine *engine) {
    HLI_BAHN_MC_CONTROL *bahn_mc_control = &engine->channel->bahn_mc_control;
    bool present = flag(&engine->channel->head.plc_present_w);
    mode_cycle(engine, present);
    engine->feedhold_now =
        level_bool(&bahn_mc_control->feedhold, present, false);
    bool hold = engine->feedhold_now | !axes_released(engine)
                | axes_held(engine) | ATOMIC_GET(engine->stopped);
    bool valid = level_bool(&bahn_mc_control->override_valid, present, false);
    double factor =
        level_override(engine, &bahn_mc_control->override, present, valid)
        / (double)OVERRIDE_FULL;
    bool rapid_valid =
        level_bool(&bahn_mc_control->rapid_override_valid, present, false);
    double rapid = rapid_factor(engine,
                                factor,
                                level_override(engine,
                                               &bahn_mc_control->rapid_override,
                                               present,
                                               rapid_valid)
                                    / (double)OVERRIDE_FULL);
    bool go_on =
        level_bool(&bahn_mc_control->continue_machining, present, false);
    if (go_on && !engine->geo.continue_seen) {
        engine->geo.waiting_continue = engine->geo.stands_single = false;
    }
    engine->geo.continue_seen = go_on;
    if (ATOMIC_GET(engine->override_ignored)) {
        factor = rapid = 1.0;
    }
    __atomic_store(&engine->override_now, &factor, __ATOMIC_RELEASE);
    __atomic_store(&engine->rapid_now, &rapid, __ATOMIC_RELEASE);
    bool external = take_external_speed(engine, bahn_mc_control, present);
    ATOMIC_SET(engine->backward_now,
               (level_bool(&bahn_mc_control->backward_motion, present, false)
                || external)
                   && !engine->program_end);
    ATOMIC_SET(engine->simulate_now,
               level_bool(&bahn_mc_control->simulate_motion, present, false));
    if (level_bool(&bahn_mc_control->backward_storage_off, present, false)
        && engine->program_end) {
        ATOMIC_SET(engine->store_first, ATOMIC_GET(engine->store_head));
    }
    take_shortcut(engine, bahn_mc_control, present);
    take_insert_command(engine, bahn_mc_control, present);
    ATOMIC_SET(engine->rt_loop_now,
               level_bool(&bahn_mc_control->rt_loop_enable, present, false));
    ATOMIC_SET(engine->single_now,
               level_bool(&bahn_mc_control->single_block, present, false));
    ATOMIC_SET(engine->m01_now,
               level_bool(&bahn_mc_control->m01_stop_enable, present, false));
    ATOMIC_SET(engine->hold_now, hold);
}

static void publish_axis(struct engine *engine, int i) {
    const struct geo *geo = &engine->geo;
    HLI_COORD *coord = &engine->channel->bahn_state.coord_r[i];
    const struct piece *piece = piece_at(engine, geo->piece);
    double target = geo->piece != UINT64_MAX ? load_f64_relaxed(&piece->end[i])
                                             : geo->position[i];
    int32_t now = dint(geo->position[i] * TENTH_UM);
    uint16_t state = geo->v > 0 ? 3 : 1;
    HLI_LR_STATE *lr = &engine->segment->axis[i].lr_state;
    show_u32(&coord->cmd_position_r, (uint32_t)dint(target * TENTH_UM));
    show_u32(&coord->act_position_r, (uint32_t)now);
    show_u32(&coord->current_position_r, (uint32_t)now);
    show_u32(&coord->acs_position_r, (uint32_t)now);
    show_u16(&coord->state_r, state);
    show_u32(&lr->end_position_acs_r, (uint32_t)dint(target * TENTH_UM));
    show_u32(&lr->active_position_acs_r, (uint32_t)now);
    show_u32(&lr->current_position_acs_r, (uint32_t)now);
    show_u16(&lr->axis_state_r, state);
}

static double display_distance(struct engine *engine) {
    const struct geo *geo = &engine->geo;
    return (geo->dist_shift + geo->dist) * TENTH_UM;
}

static uint32_t stop_conditions(struct engine *engine) {
    uint32_t bits = 0;
    if (engine->geo.v > 0) {
        return 0;
    }
    if (engine->feedhold_now) {
        bits |= 1u;
    }
    if (ATOMIC_GET(engine->held_axes)) {
        bits |= 2u;
    }
    if (ATOMIC_GET(engine->stopped)) {
        bits |= 1024u;
    }
    if (!engine->released) {
        bits |= 4096u;
    }
    if (engine->program_active && !engine->finished
        && engine->store_done >= ATOMIC_GET(engine->store_head)) {
        bits |= 8192u;
    }
    if (ATOMIC_GET(engine->mode_state) == 6u) {
        bits |= 512u;
    }
    if (engine->override_now <= 0) {
        bits |= 4u;
    }
    if (engine->geo.waiting_continue) {
        bits |= engine->geo.stands_single                        ? 8u
                : piece_at(engine, engine->geo.piece)->inserted  ? 2048u
                : piece_at(engine, engine->geo.piece)->code == 1 ? 32u
                                                                 : 16u;
    }
    if (engine->geo.waiting_techno) {
        bits |= 64u;
    }
    if (engine->geo.dwelling) {
        bits |= 256u;
    }
    return bits;
}

static void publish_next_stop(struct engine *engine) {
    HLI_INSERT_CMD_STATE *insert_cmd_state =
        &engine->channel->bahn_mc_control.insert_cmd.state_r;
    bool found = engine->stops_done < ATOMIC_GET(engine->stops_fed);
    const inserted_stop *stop = &engine->stops[engine->stops_done % STOPS_MAX];
    show_f64(&insert_cmd_state->distance_of_next_stop,
             found ? load_f64_relaxed(&stop->dist) * TENTH_UM : -1.0);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        show_u32((uint32_t *)&insert_cmd_state->position_at_next_stop[i],
                 (uint32_t)(found ? dint(load_f64_relaxed(&stop->position[i])
                                         * TENTH_UM)
                                  : 0));
    }
}

static void publish_bahn(struct engine *engine) {
    const struct geo *geo = &engine->geo;
    HLI_BAHN_STATE *bahn_state = &engine->channel->bahn_state;
    const struct piece *piece =
        geo->piece == UINT64_MAX ? NULL : piece_at(engine, geo->piece);
    bool motion = piece && is_motion(piece);
    show_f64(&bahn_state->dist_prog_start, display_distance(engine));
    /* the planner may shorten the piece in which GEO stands: read once */
    double length =
        !motion ? 0.0
        : piece->mapped
            ? element_at(engine, geo->active)->facts.length / TENTH_UM
            : load_f64_relaxed(&piece->length);
    double driven = !motion         ? 0.0
                    : piece->mapped ? fmin(geo->element_distance, length)
                                    : geo->s;
    show_f64(&bahn_state->dist_to_go_r, (length - driven) * TENTH_UM);
    show_u32(&bahn_state->covered_distance_r,
             length > 0.0 ? (uint32_t)lrint(1000.0 * driven / length) : 0);
    show_u32(&bahn_state->block_count_r, geo->count);
    show_u32(&bahn_state->block_number_r, geo->n);
    show_u32(&bahn_state->command_feed_r, (uint32_t)dint(geo->feed * 1000.0));
    bool external = engine->ext_speed < NEVER && motion && piece->dir < 0;
    show_u32(&bahn_state->active_feed_r,
             (uint32_t)dint(
                 (external ? -geo_path_speed(engine) : geo_path_speed(engine))
                 * 1000.0));
    show_u32(&bahn_state->stop_condition_r, stop_conditions(engine));
    show_u32(&bahn_state->tool_nr_r, (uint32_t)geo->tool);
    show_u16(&bahn_state->override_r,
             (uint16_t)lrint(engine->override_now * OVERRIDE_FULL));
    show_u8(&bahn_state->interpolation_active_r, motion && geo->has_phase);
    show_u8(&bahn_state->axes_in_position_r, geo->v <= 0);
    show_u8(&bahn_state->wait_continue_r, geo->waiting_continue);
    show_u8(&bahn_state->wait_techno_acknowledge_r, geo->waiting_techno);
    show_u8(&bahn_state->dwell_time_active_r, geo->dwelling && geo->has_phase);
    show_u8(&bahn_state->feedhold_active_r, engine->hold_now != 0);
    show_u8(&bahn_state->rapid_active_r, motion && geo->rapid);
    show_u8(&engine->channel->decoder_state.program_end_r,
            ATOMIC_GET(engine->finished) != 0);
    show_u8(&bahn_state->program_end_r, engine->program_end != 0);
    show_u8(&bahn_state->wait_error_removal_r,
            ATOMIC_GET(engine->mode_state) == 6u);
    show_u8(&engine->channel->decoder_state.wait_after_error_r,
            ATOMIC_GET(engine->mode_state) == 6u);
    show_u32(&bahn_state->error_id_r, ATOMIC_GET(engine->error_id));
    show_u8(&bahn_state->error_r, ATOMIC_GET(engine->error_id) != 0);
    if (ATOMIC_GET(engine->name_changed)) {
        ATOMIC_SET(engine->name_changed, 0);
        memcpy(bahn_state->prog_name_r,
               engine->program_name,
               sizeof engine->program_name);
    }
    show_u8(&bahn_state->backward_active_r, motion && piece->dir < 0);
    if (motion && engine->was_backward && piece->dir >= 0) {
        ATOMIC_SET(engine->retraced_event, 1);
    }
    if (motion) {
        engine->was_backward = piece->dir < 0;
    }
    show_u8(&bahn_state->delete_distance_to_go_active_r,
            ATOMIC_GET(engine->feed.shortcuts) != engine->shortcut_requests
                || (motion && piece->shortcut));
    publish_next_stop(engine);
    foresight_publish(engine);
}

/* Entries were written first; now their count, and f_log_is_active last. */
static void publish_lookahead(struct engine *engine) {
    HLI_CONTOUR_LOOKAHEAD_STATE *contour_lookahead_state =
        &engine->channel->contour_lookahead.state;
    uint32_t active = ATOMIC_GET(engine->log.active);
    show_f64(&contour_lookahead_state->max_dist_prog_start,
             max_dist_prog_start(engine));
    show_u32(&contour_lookahead_state->count_logged_blocks,
             ATOMIC_GET(engine->log.count));
    show_u8(&contour_lookahead_state->f_log_is_active, active != 0);
}

static void publish_stats(struct engine *engine) {
    HLI_SIDE_STATS *side_stats = &engine->side->stats;
    store_u64_relaxed(&side_stats->requests_mode1,
                      ATOMIC_GET(engine->requests_mode1));
    store_u64_relaxed(&side_stats->requests_mode2,
                      ATOMIC_GET(engine->requests_mode2));
    store_u64_relaxed(&side_stats->requests_bad,
                      ATOMIC_GET(engine->requests_bad));
    store_u64_relaxed(&side_stats->overruns, engine->overruns);
    store_u64_relaxed(&side_stats->bad_commands, engine->bad_commands);
}

/* Showing it twice is showing it once. */
static void show_channel(struct engine *engine) {
    publish_bahn(engine);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        publish_axis(engine, i);
    }
    publish_lookahead(engine);
    mode_publish_state(engine);
}

void publish(struct engine *engine) {
    seq_begin(&engine->side->channel_seq.word);
    show_channel(engine);
    mode_publish_errors(engine);
    seq_end(&engine->side->channel_seq.word);
    publish_stats(engine);
    store_u64_release(&engine->side->cnc.cell_time_ns,
                      (uint64_t)llrint((double)engine->geo.cycle
                                       * engine->cfg.cycle_s * 1e9));
    store_u64_release(&engine->side->cnc.cycle, engine->geo.cycle);
}

/* Between two cycles: the channel's state once more. */
void publish_again(struct engine *engine) {
    seq_begin(&engine->side->channel_seq.word);
    show_channel(engine);
    seq_end(&engine->side->channel_seq.word);
}

/* Power-up state, before the first cycle. */
void publish_initial(struct engine *engine) {
    publish(engine);
    store_u8_release(&engine->channel->head.init_done_r, 1);
}
