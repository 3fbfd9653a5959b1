#include <stdbool.h>

#include "plc.h"

/* A control unit that the PLC has taken, with a command of yes or no. */
#define COMMAND(unit, yes)                                                     \
    do {                                                                       \
        (unit).command_w = (yes);                                              \
        (unit).enable_w = 1;                                                   \
    } while (0)
#define NARROW 14 /* orders of inputs that know no others */
#define WIDE 32

static void insert_stop(struct bytes *bytes, HLI_BAHN_MC_CONTROL *bahn) {
    bahn->insert_cmd.enable_w = 1;
    bahn->insert_cmd.command_w.dist_or_pos = take_number(bytes) * 1e4;
    bahn->insert_cmd.command_w.rel_abs_mode = take_byte(bytes) % 4;
    bahn->insert_cmd.command_semaphor_rw = 1;
}

static void request(struct bytes *bytes, HLI_CHANNEL *channel) {
    channel->contour_lookahead.request.start_position =
        take_number(bytes) * 1000;
    channel->contour_lookahead.request.length = take_number(bytes) * 1000;
    channel->contour_lookahead.semaphor_rw = 1;
}

static void acknowledge(HLI_CHANNEL *channel) {
    for (int i = 0; i < 4; i++) {
        if (channel->techno_unit_std_sync[i].please_rw) {
            channel->techno_unit_std_sync[i].done_w = 1;
            channel->techno_unit_std_sync[i].please_rw = 0;
        }
    }
}

static void scribble(struct bytes *bytes, HLI_CHANNEL *channel) {
    for (int i = 0; i < 20; i++) {
        size_t at = take_word(bytes) * 7u % sizeof *channel;
        ((uint8_t *)channel)[at] = take_byte(bytes);
    }
}

static void drive(struct bytes *bytes, HLI_BAHN_MC_CONTROL *bahn, bool yes) {
    bahn->ext_command_speed.enable_w = 1;
    COMMAND(bahn->ext_command_speed_valid, yes);
    bahn->ext_command_speed.command_w = (int16_t)take_word(bytes) * 1000;
}

static void override(struct bytes *bytes, HLI_BAHN_MC_CONTROL *bahn) {
    bahn->override_valid.enable_w = bahn->override.enable_w = 1;
    bahn->override_valid.command_w = 1;
    bahn->override.command_w = take_word(bytes);
}

/* Functions of all arrays, those of the spindle too: fetched, or done. */
static void acknowledge_all(HLI_SEGMENT *segment, int axes, bool done) {
    HLI_CHANNEL *channel = &segment->channel[0];
    HLI_AXIS *spindle = &segment->axis[axes];
    for (int i = 0; i <= HLI_TU_CH_STD_SYNC_MAXIDX; i++) {
        channel->techno_unit_std_sync[i].done_w |= done;
        channel->techno_unit_std_sync[i].please_rw = 0;
    }
    for (int i = 0; i <= HLI_TU_CH_LATE_SYNC_MAXIDX; i++) {
        channel->techno_unit_late_sync[i].done_w |= done;
        channel->techno_unit_late_sync[i].please_rw = 0;
    }
    for (int i = 0; i <= HLI_TU_AX_STD_SYNC_MAXIDX; i++) {
        spindle->techno_unit_std_sync[i].done_w |= done;
        spindle->techno_unit_std_sync[i].please_rw = 0;
    }
}

static void rapid(struct bytes *bytes, HLI_BAHN_MC_CONTROL *bahn) {
    bahn->rapid_override_valid.enable_w = bahn->rapid_override.enable_w = 1;
    bahn->rapid_override_valid.command_w = 1;
    bahn->rapid_override.command_w = take_word(bytes);
}

static void insert_function(struct bytes *bytes, HLI_BAHN_MC_CONTROL *bahn) {
    insert_stop(bytes, bahn);
    bahn->insert_cmd.command_w.axis_nr = take_byte(bytes) % 8;
    bahn->insert_cmd.command_w.m_function_nr = take_byte(bytes);
    bahn->insert_cmd.command_w.add_nr = take_signed(bytes);
}

static void command_mode(struct bytes *bytes, HLI_CHANNEL *channel) {
    MC_CONTROL_MCM_MODE_STATE_UNIT *unit =
        &channel->channel_mc_control.mode_and_state;
    uint8_t target = take_byte(bytes), from = take_byte(bytes);
    unit->enable_w = 1;
    unit->command_w.to_mode =
        target & 1 ? target >> 5 : HLI_IMCM_AUTOMATIC_MODE;
    unit->command_w.to_state = target >> 1 & 15;
    unit->command_w.from_mode = from & 3;
    unit->command_w.from_state = from >> 2 & 15;
    unit->command_semaphor_rw = 1;
}

static void send_error(struct bytes *bytes, HLI_CHANNEL *channel) {
    channel->lc_error.satz_r.kopf.error_id = take_byte(bytes);
    channel->lc_error.satz_r.kopf.reaction_class = take_byte(bytes) % 9;
    channel->lc_error.semaphor_rw = 1;
}

static void watch(struct bytes *bytes, HLI_CHANNEL *channel, bool yes) {
    channel->head.mc_watchdog.enable_w = yes;
    channel->head.mc_watchdog.alive_rw = take_byte(bytes) & 1;
    channel->head.mc_watchdog.cycle_time_w = take_byte(bytes) * 500u;
    channel->head.lc_watchdog.enable_w = yes;
}

static void ask_for_manual(HLI_CHANNEL *channel) {
    HLI_HB_MC_CONTROL *units = &channel->hb_mc_control;
    units->activation.enable_w = units->activation.command_semaphor_rw = 1;
    units->key[3].enable_w = units->key[3].command_semaphor_rw = 1;
}

/* A request beside the manual's unit; a slot that is not free is left alone. */
static void queue(struct bytes *bytes, HLI_SEGMENT *segment) {
    uint8_t what = take_byte(bytes);
    HLI_AHEAD *ahead = &segment->ahead[0];
    HLI_AHEAD_SLOT *slot = &ahead->slot[what & 3];
    slot->request.start_position = take_number(bytes) * 1000;
    slot->request.length = take_number(bytes) * 1000;
    slot->request.mode = 1 + (what >> 2) % 3;
    slot->request.flags = what >> 4;
    slot->request.epoch = what & 64 ? take_byte(bytes) % 4 : 0;
    ahead->slot_rw[what & 3] = HLI_AHEAD_ASKED;
}

/* The axis' own units: feed hold, release, drive, torque, override. */
static void order_axis(struct bytes *bytes, HLI_SEGMENT *segment, bool yes) {
    uint8_t what = take_byte(bytes);
    HLI_AXIS *axis = &segment->axis[what & 3];
    axis->head.plc_present_w = 1;
    switch (what >> 2 & 7) {
    case 0:
    case 1:
        COMMAND(axis->ipo_mc_control.feedhold, yes);
        break;
    case 2:
        COMMAND(axis->lr_mc_control.drive_on, yes);
        break;
    case 3:
        COMMAND(axis->lr_mc_control.torque_permission, yes);
        break;
    case 4:
        axis->ipo_mc_control.override_valid.enable_w = 1;
        axis->ipo_mc_control.override_valid.command_w = 1;
        axis->ipo_mc_control.override.enable_w = 1;
        axis->ipo_mc_control.override.command_w = take_word(bytes);
        break;
    default:
        COMMAND(axis->lr_mc_control.release_feedhold, yes);
    }
}

static void end_distance(struct bytes *bytes, HLI_BAHN_MC_CONTROL *bahn) {
    bahn->del_dist_to_go_end.enable_w = 1;
    bahn->del_dist_to_go_end.command_w = take_byte(bytes);
}

/* Orders that only inputs with WIDE know. */
static void order_more(struct bytes *bytes,
                       HLI_SEGMENT *segment,
                       int axes,
                       uint8_t what,
                       bool yes) {
    HLI_CHANNEL *channel = &segment->channel[0];
    HLI_BAHN_MC_CONTROL *bahn = &channel->bahn_mc_control;
    switch (what) {
    case 14:
        rapid(bytes, bahn);
        break;
    case 15:
        COMMAND(bahn->m01_stop_enable, yes);
        break;
    case 16:
        COMMAND(bahn->simulate_motion, yes);
        break;
    case 17:
        COMMAND(bahn->backward_storage_off, yes);
        break;
    case 18:
        end_distance(bytes, bahn);
        break;
    case 19:
    case 20:
        command_mode(bytes, channel);
        break;
    case 21:
        send_error(bytes, channel);
        break;
    case 22:
        channel->mc_error.enable_w = yes;
        channel->mc_error.semaphor_rw = 0;
        break;
    case 23:
        watch(bytes, channel, yes);
        break;
    case 24:
        ask_for_manual(channel);
        break;
    case 25:
        queue(bytes, segment);
        break;
    case 26:
        segment->ahead[0].plan_enable_w = yes;
        break;
    case 27:
        channel->head.plc_present_w = yes;
        break;
    case 28:
        insert_function(bytes, bahn);
        break;
    case 29:
    case 30:
        order_axis(bytes, segment, yes);
        break;
    default:
        acknowledge_all(segment, axes, yes);
    }
}

bool fuzz_order(struct bytes *bytes,
                HLI_SEGMENT *segment,
                int axes,
                bool wide) {
    HLI_CHANNEL *channel = &segment->channel[0];
    HLI_BAHN_MC_CONTROL *bahn = &channel->bahn_mc_control;
    uint8_t order = take_byte(bytes);
    uint8_t what = order % (wide ? WIDE : NARROW);
    bool yes = order >> (wide ? 5 : 4) & 1;
    switch (what) {
    case 0:
        COMMAND(bahn->feedhold, yes);
        break;
    case 1:
        COMMAND(bahn->backward_motion, yes);
        break;
    case 2:
        override(bytes, bahn);
        break;
    case 3:
        COMMAND(bahn->single_block, yes);
        break;
    case 4:
        COMMAND(bahn->delete_distance_to_go, yes);
        break;
    case 5:
        COMMAND(bahn->continue_machining, yes);
        break;
    case 6:
        COMMAND(bahn->rt_loop_enable, yes);
        break;
    case 7:
        insert_stop(bytes, bahn);
        break;
    case 8:
        request(bytes, channel);
        break;
    case 9:
        acknowledge(channel);
        break;
    case 10:
        scribble(bytes, channel);
        break;
    case 11:
        drive(bytes, bahn, yes);
        break;
    case 12: {
        HLI_AXIS *axis = &segment->axis[order >> 4 & 3];
        axis->lr_mc_control.release_feedhold.enable_w = 1;
        axis->lr_mc_control.release_feedhold.command_w = take_byte(bytes) & 1;
        break;
    }
    case 13:
        return (order & 0xf0) == 0xf0 || (wide && order >> 6 == 3);
    default:
        order_more(bytes, segment, axes, what, yes);
    }
    return false;
}
