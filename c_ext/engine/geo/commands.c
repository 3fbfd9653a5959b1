/* What the PLC commands the channel, once a cycle: levels, overrides,
 * shortcuts, inserted stops. */
#include <math.h>
#include "engine/geo/commands.h"
#include "engine/geo/modes.h"
#include "engine/state/state.h"
#include "hli/sync.h"

static bool flag(const volatile uint8_t *p) {
    return load_u8_acquire(p) != 0;
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

static uint32_t level_override(struct orders *orders,
                               MC_CONTROL_UNS16_UNIT *unit,
                               bool present,
                               bool valid) {
    uint32_t value = OVERRIDE_FULL;
    if (present && valid && flag(&unit->enable_w)) {
        value = load_u16_relaxed(&unit->command_w);
        if (value > OVERRIDE_MAX) {
            value = OVERRIDE_MAX;
            orders->bad++;
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
        HLI_AXIS *ax = engine->hli.axis[i];
        if (!ax) {
            continue;
        }
        bool present = flag(&ax->head.plc_present_w);
        released &=
            level_bool(&ax->lr_mc_control.release_feedhold, present, true);
        released &= level_bool(&ax->lr_mc_control.drive_on, present, true);
        released &=
            level_bool(&ax->lr_mc_control.torque_permission, present, true);
    }
    engine->orders.released = released;
    return released;
}

/* Override of an axis: acts on independent axes and spindles, of which there
 * are none that move; shown all the same. */
static void show_axis_override(struct orders *orders,
                               HLI_AXIS *ax,
                               bool present) {
    bool valid = level_bool(&ax->ipo_mc_control.override_valid, present, false);
    (void)level_override(orders, &ax->ipo_mc_control.override, present, valid);
}

/* An axis that moves now is held: the path stands. The others that are held
 * stop the path ahead of their next motion. */
static bool axes_held(struct engine *engine) {
    uint32_t held = 0;
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        HLI_AXIS *ax = engine->hli.axis[i];
        if (!ax) {
            continue;
        }
        bool present = flag(&ax->head.plc_present_w);
        show_axis_override(&engine->orders, ax, present);
        if (level_bool(&ax->ipo_mc_control.feedhold, present, false)) {
            held |= 1u << i;
        }
    }
    ATOMIC_SET(engine->orders.held_axes, held);
    return held && engine->geo.piece != UINT64_MAX
           && engine->run.done <= engine->geo.piece
           && (piece_at(&engine->run, engine->geo.piece)->moving & held);
}

/* External path speed, valid while both units are enabled; true if it is
 * negative: backward. */
static bool take_external_speed(struct orders *orders,
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
    __atomic_store(&orders->ext_speed, &value, __ATOMIC_RELEASE);
    return speed < 0;
}

/* P-CHAN-00181: what rapid motion follows. */
static double rapid_factor(const engine_config *cfg,
                           double feed,
                           double rapid) {
    switch (cfg->rapid_override_mode) {
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
    ATOMIC_SET(engine->orders.shortcut_mask, mask);
    bool wanted =
        level_bool(&bahn_mc_control->delete_distance_to_go, present, false);
    bool possible = engine->store.kept && !engine->program.end;
    if (wanted && !engine->orders.shortcut_seen && possible) {
        ATOMIC_SET(engine->orders.shortcut_requests,
                   engine->orders.shortcut_requests + 1);
    }
    engine->orders.shortcut_seen = wanted;
}

/* Channel axis of a logical axis number, -1 if it is none. */
static int channel_axis(engine_config *cfg, uint32_t number) {
    for (int i = 0; i < cfg->axis_count; i++) {
        if (cfg->axis_id[i] == number) {
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
    if (ATOMIC_GET(engine->dispatch.inserts)
        != engine->orders.insert_requests) {
        return;
    }
    struct insert_cmd cmd = {
        .value = load_f64_relaxed(&unit->command_w.dist_or_pos) / TENTH_UM,
        .mode = load_u16_relaxed(&unit->command_w.rel_abs_mode),
        .m_function = load_u16_relaxed(&unit->command_w.m_function_nr),
        .add = (int32_t)load_u32_relaxed((uint32_t *)&unit->command_w.add_nr)};
    uint32_t number = load_u16_relaxed(&unit->command_w.axis_nr);
    int axis = number ? channel_axis(&engine->cfg, number) : -1;
    cmd.axis = axis + 1;
    cmd.base = axis >= 0 ? engine->geo.position[axis]
                         : engine->geo.dist_shift + engine->geo.dist;
    bool good = isfinite(cmd.value) && fabs(cmd.value) < 1e12
                && cmd.mode <= INSERT_RELATIVE_ONCE && (!number || axis >= 0);
    bool by_path = cmd.mode != INSERT_ABSOLUTE && !number;
    if (good && by_path && cmd.value < 0.0) {
        good = false;
    }
    if (good) {
        engine->orders.insert_request = cmd;
        ATOMIC_SET(engine->orders.insert_requests,
                   engine->orders.insert_requests + 1);
    } else {
        engine->orders.bad++;
    }
    store_u8_release(&unit->command_semaphor_rw, 0);
}

/* A unit with usage check that is not supported: its command is taken and
 * counted as bad, so that a PLC does not wait for ever. */
static void refuse_command(struct orders *orders,
                           const uint8_t *enable,
                           uint8_t *semaphor) {
    if (flag(semaphor) && flag(enable)) {
        orders->bad++;
        store_u8_release(semaphor, 0);
    }
}

/* There is no manual mode. */
static void refuse_manual(struct engine *engine, bool present) {
    HLI_HB_MC_CONTROL *units = &engine->hli.channel->hb_mc_control;
    struct orders *orders = &engine->orders;
    if (!present) {
        return;
    }
    refuse_command(orders,
                   &units->activation.enable_w,
                   &units->activation.command_semaphor_rw);
    refuse_command(orders,
                   &units->tip_parameter.enable_w,
                   &units->tip_parameter.command_semaphor_rw);
    refuse_command(orders,
                   &units->jog_parameter.enable_w,
                   &units->jog_parameter.command_semaphor_rw);
    refuse_command(orders,
                   &units->hr_parameter.enable_w,
                   &units->hr_parameter.command_semaphor_rw);
    refuse_command(orders,
                   &units->rapid_key.enable_w,
                   &units->rapid_key.command_semaphor_rw);
    for (int i = 0; i <= HLI_KEY_MAXIDX; i++) {
        refuse_command(orders,
                       &units->key[i].enable_w,
                       &units->key[i].command_semaphor_rw);
    }
}

void take_rt_loop(struct engine *engine) {
    bool enabled = engine->orders.rt_loop_program;
    if (engine->hli.segment) {
        HLI_CHANNEL *channel = engine->hli.channel;
        enabled = level_bool(&channel->bahn_mc_control.rt_loop_enable,
                             flag(&channel->head.plc_present_w),
                             enabled);
    }
    ATOMIC_SET(engine->orders.rt_loop, enabled);
}

static int32_t passes_over(const struct geo *geo) {
    return geo->loop_count > 0 ? geo->loop_count : 0;
}

static int32_t whole(double value) {
    return (int32_t)fmin(fmax(round(value), INT32_MIN), INT32_MAX);
}

int32_t loop_count_told(const struct geo *geo) {
    return whole((double)passes_over(geo) + geo->loop_written);
}

void loop_count_set(struct geo *geo, double count) {
    geo->loop_written = whole(whole(count) - (double)passes_over(geo));
}

void program_enables_loops(struct engine *engine, bool enabled) {
    engine->orders.rt_loop_program = enabled;
    take_rt_loop(engine);
}

void take_commands(struct engine *engine) {
    HLI_BAHN_MC_CONTROL *bahn_mc_control =
        &engine->hli.channel->bahn_mc_control;
    bool present = flag(&engine->hli.channel->head.plc_present_w);
    mode_cycle(engine, present);
    engine->orders.feedhold =
        level_bool(&bahn_mc_control->feedhold, present, false);
    bool hold = engine->orders.feedhold | !axes_released(engine)
                | axes_held(engine) | ATOMIC_GET(engine->modes.stopped);
    bool valid = level_bool(&bahn_mc_control->override_valid, present, false);
    double factor = level_override(&engine->orders,
                                   &bahn_mc_control->override,
                                   present,
                                   valid)
                    / (double)OVERRIDE_FULL;
    bool rapid_valid =
        level_bool(&bahn_mc_control->rapid_override_valid, present, false);
    double rapid = rapid_factor(&engine->cfg,
                                factor,
                                level_override(&engine->orders,
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
    if (ATOMIC_GET(engine->orders.override_ignored)) {
        factor = rapid = 1.0;
    }
    ATOMIC_SET(engine->orders.timetable,
               present && engine->hli.ahead
                   && flag(&engine->hli.ahead->plan_enable_w));
    __atomic_store(&engine->orders.override, &factor, __ATOMIC_RELEASE);
    __atomic_store(&engine->orders.rapid, &rapid, __ATOMIC_RELEASE);
    bool external =
        take_external_speed(&engine->orders, bahn_mc_control, present);
    ATOMIC_SET(engine->orders.backward,
               (level_bool(&bahn_mc_control->backward_motion, present, false)
                || external)
                   && !engine->program.end);
    ATOMIC_SET(engine->orders.simulate,
               level_bool(&bahn_mc_control->simulate_motion, present, false));
    if (level_bool(&bahn_mc_control->backward_storage_off, present, false)
        && engine->program.end) {
        ATOMIC_SET(engine->store.first, ATOMIC_GET(engine->store.head));
    }
    take_shortcut(engine, bahn_mc_control, present);
    take_insert_command(engine, bahn_mc_control, present);
    refuse_manual(engine, present);
    take_rt_loop(engine);
    bool single = level_bool(&bahn_mc_control->single_block, present, false),
         macro = ATOMIC_GET(engine->modes.macro_runs)
                 || ATOMIC_GET(engine->modes.state) == ABORTING;
    ATOMIC_SET(engine->orders.single, single && !macro);
    ATOMIC_SET(engine->orders.m01,
               level_bool(&bahn_mc_control->m01_stop_enable, present, false));
    ATOMIC_SET(engine->orders.hold, hold);
}
