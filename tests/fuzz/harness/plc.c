#include <stdbool.h>

#include "plc.h"

/* A control unit that the PLC has taken, with a command of yes or no. */
#define COMMAND(unit, order)                                                   \
    do {                                                                       \
        (unit).command_w = (order) >> 4 & 1;                                   \
        (unit).enable_w = 1;                                                   \
    } while (0)

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

static void drive(struct bytes *bytes, HLI_BAHN_MC_CONTROL *bahn, int order) {
    bahn->ext_command_speed.enable_w = 1;
    COMMAND(bahn->ext_command_speed_valid, order);
    bahn->ext_command_speed.command_w = (int16_t)take_word(bytes) * 1000;
}

static void override(struct bytes *bytes, HLI_BAHN_MC_CONTROL *bahn) {
    bahn->override_valid.enable_w = bahn->override.enable_w = 1;
    bahn->override_valid.command_w = 1;
    bahn->override.command_w = take_word(bytes);
}

bool fuzz_order(struct bytes *bytes, HLI_SEGMENT *segment) {
    HLI_CHANNEL *channel = &segment->channel[0];
    HLI_BAHN_MC_CONTROL *bahn = &channel->bahn_mc_control;
    uint8_t order = take_byte(bytes);
    switch (order % 14) {
    case 0:
        COMMAND(bahn->feedhold, order);
        break;
    case 1:
        COMMAND(bahn->backward_motion, order);
        break;
    case 2:
        override(bytes, bahn);
        break;
    case 3:
        COMMAND(bahn->single_block, order);
        break;
    case 4:
        COMMAND(bahn->delete_distance_to_go, order);
        break;
    case 5:
        COMMAND(bahn->continue_machining, order);
        break;
    case 6:
        COMMAND(bahn->rt_loop_enable, order);
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
        drive(bytes, bahn, order);
        break;
    case 12: {
        HLI_AXIS *axis = &segment->axis[order >> 4 & 3];
        axis->lr_mc_control.release_feedhold.enable_w = 1;
        axis->lr_mc_control.release_feedhold.command_w = take_byte(bytes) & 1;
        break;
    }
    default:
        return (order & 0xf0) == 0xf0;
    }
    return false;
}
