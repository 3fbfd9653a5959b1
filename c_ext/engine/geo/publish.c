/* GEO's side of the HLI: the channel's status, shown once a cycle. The CNC
 * never reads its own state back. */
#include <math.h>
#include <string.h>
#include "engine/geo/publish.h"
#include "engine/geo/commands.h"
#include "engine/geo/interpolate.h"
#include "engine/lookahead/service.h"
#include "engine/lookahead/window.h"
#include "engine/geo/modes.h"
#include "engine/geo/standstill.h"
#include "engine/plan/prediction.h"
#include "engine/state/state.h"
#include "hli/sync.h"

#define SECOND_US 1e6

static int32_t dint(double v) {
    return v >= 2147483647.0    ? INT32_MAX
           : v <= -2147483648.0 ? INT32_MIN
                                : (int32_t)lrint(v);
}

static void publish_axis(struct engine *engine, int i) {
    const struct geo *geo = &engine->geo;
    HLI_COORD *coord = &engine->hli.channel->bahn_state.coord_r[i];
    const struct piece *piece = piece_at(&engine->run, geo->piece);
    double target = geo->piece != UINT64_MAX ? load_f64_relaxed(&piece->end[i])
                                             : geo->position[i];
    int32_t now = dint(geo->position[i] * TENTH_UM);
    uint16_t state = geo->v > 0 ? 3 : 1;
    show_u32(&coord->cmd_position_r, (uint32_t)dint(target * TENTH_UM));
    show_u32(&coord->act_position_r, (uint32_t)now);
    show_u32(&coord->current_position_r, (uint32_t)now);
    show_u32(&coord->acs_position_r, (uint32_t)now);
    show_u16(&coord->state_r, state);
    if (!engine->hli.axis[i]) {
        return;
    }
    HLI_LR_STATE *lr = &engine->hli.axis[i]->lr_state;
    show_u32(&lr->end_position_acs_r, (uint32_t)dint(target * TENTH_UM));
    show_u32(&lr->active_position_acs_r, (uint32_t)now);
    show_u32(&lr->current_position_acs_r, (uint32_t)now);
    show_u16(&lr->axis_state_r, state);
}

/* Which axes stand at the channel's places. */
static void publish_axes(struct engine *engine) {
    if (!ATOMIC_GET(engine->program.axes_changed)) {
        return;
    }
    ATOMIC_SET(engine->program.axes_changed, 0);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        HLI_COORD *coord = &engine->hli.channel->bahn_state.coord_r[i];
        const engine_axis *axis = &engine->program.axes[i];
        show_u16(&coord->log_axis_nr_r, axis->number);
        show_u16(&coord->axis_type_r, axis->type);
        memcpy(coord->name, axis->name, sizeof axis->name);
        memcpy(coord->axis_name_r.zeichen, axis->name, sizeof axis->name);
    }
}

static void publish_next_stop(struct engine *engine) {
    HLI_INSERT_CMD_STATE *insert_cmd_state =
        &engine->hli.channel->bahn_mc_control.insert_cmd.state_r;
    bool found = engine->stops.done < ATOMIC_GET(engine->stops.fed);
    const inserted_stop *stop =
        &engine->stops.entries[engine->stops.done % STOPS_MAX];
    show_f64(&insert_cmd_state->distance_of_next_stop,
             found ? load_f64_relaxed(&stop->dist) * TENTH_UM : -1.0);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        show_u32((uint32_t *)&insert_cmd_state->position_at_next_stop[i],
                 (uint32_t)(found ? dint(load_f64_relaxed(&stop->position[i])
                                         * TENTH_UM)
                                  : 0));
    }
}

bool deletes_distance(const struct engine *engine) {
    uint64_t at = engine->geo.piece;
    const struct piece *piece =
        at == UINT64_MAX ? NULL : piece_at(&engine->run, at);
    return ATOMIC_GET(engine->dispatch.shortcuts)
               != engine->orders.shortcut_requests
           || (piece && is_motion(piece) && piece->shortcut);
}

static void publish_bahn(struct engine *engine) {
    const struct geo *geo = &engine->geo;
    HLI_BAHN_STATE *bahn_state = &engine->hli.channel->bahn_state;
    const struct piece *piece =
        geo->piece == UINT64_MAX ? NULL : piece_at(&engine->run, geo->piece);
    bool motion = piece && is_motion(piece);
    double shown = displayed_distance(&engine->geo);
    __atomic_store(&engine->geo.shown_dist, &shown, __ATOMIC_RELEASE);
    show_f64(&bahn_state->dist_prog_start, shown);
    /* the planner may shorten the piece in which GEO stands: read once */
    double length =
        !motion ? 0.0
        : piece->mapped
            ? element_at(&engine->store, geo->active)->facts.length / TENTH_UM
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
    bool external =
        engine->orders.ext_speed < NEVER && motion && piece->dir < 0;
    double speed = geo_path_speed(engine);
    engine->recording.path_speed = speed;
    show_u32(&bahn_state->active_feed_r,
             (uint32_t)dint((external ? -speed : speed) * 1000.0));
    engine->recording.stops = stop_conditions(engine);
    show_u32(&bahn_state->stop_condition_r, engine->recording.stops);
    show_u32(&bahn_state->tool_nr_r, (uint32_t)geo->tool);
    show_u16(&bahn_state->override_r,
             (uint16_t)lrint(engine->orders.override * OVERRIDE_FULL));
    show_u8(&bahn_state->interpolation_active_r, motion && geo->has_phase);
    show_u8(&bahn_state->axes_in_position_r, geo->v <= 0);
    show_u8(&bahn_state->wait_continue_r, geo->waiting_continue);
    show_u8(&bahn_state->wait_techno_acknowledge_r, geo->waiting_techno);
    show_u8(&bahn_state->dwell_time_active_r, geo->dwelling && geo->has_phase);
    show_u8(&bahn_state->feedhold_active_r, engine->orders.hold != 0);
    show_u8(&bahn_state->rapid_active_r, motion && geo->rapid);
    show_u8(&engine->hli.channel->decoder_state.program_end_r,
            ATOMIC_GET(engine->program.finished) != 0);
    show_u8(&bahn_state->program_end_r,
            ATOMIC_GET(engine->program.active) == 0);
    show_u8(&bahn_state->inside_rt_loop_r, geo->in_loop);
    show_u32(&bahn_state->rt_loop_count_r,
             loop_count_told(geo) > 0 ? (uint32_t)loop_count_told(geo) : 0);
    show_u8(&bahn_state->wait_error_removal_r,
            ATOMIC_GET(engine->modes.state) == 6u);
    show_u8(&engine->hli.channel->decoder_state.wait_after_error_r,
            ATOMIC_GET(engine->modes.state) == 6u);
    show_u32(&bahn_state->error_id_r, ATOMIC_GET(engine->errors.channel_id));
    show_u8(&bahn_state->error_r, ATOMIC_GET(engine->errors.channel_id) != 0);
    if (ATOMIC_GET(engine->program.name_changed)) {
        ATOMIC_SET(engine->program.name_changed, 0);
        memcpy(bahn_state->prog_name_r,
               engine->program.name,
               sizeof engine->program.name);
    }
    show_u8(&bahn_state->backward_active_r, motion && piece->dir < 0);
    if (motion && engine->retracing.backward && piece->dir >= 0) {
        ATOMIC_SET(engine->retracing.event, 1);
    }
    if (motion) {
        engine->retracing.backward = piece->dir < 0;
    }
    show_u8(&bahn_state->delete_distance_to_go_active_r,
            deletes_distance(engine));
    publish_next_stop(engine);
    prediction_publish(engine);
}

/* Entries were written first; now their count, and f_log_is_active last. */
static void publish_lookahead(struct engine *engine) {
    HLI_CONTOUR_LOOKAHEAD_STATE *contour_lookahead_state =
        &engine->hli.channel->contour_lookahead.state;
    uint32_t active = ATOMIC_GET(engine->log.active);
    engine->recording.known = max_dist_prog_start(engine);
    show_f64(&contour_lookahead_state->max_dist_prog_start,
             engine->recording.known);
    show_u32(&contour_lookahead_state->count_logged_blocks,
             ATOMIC_GET(engine->log.count));
    show_u8(&contour_lookahead_state->f_log_is_active, active != 0);
    if (engine->hli.ahead) {
        HLI_AHEAD_STATE *state = &engine->hli.ahead->state;
        show_u32(&state->epoch, epoch_shown(engine->geo.epoch));
        show_f64(&state->speed, engine->geo.v);
        for (int i = 0; i < engine->cfg.axis_count; i++) {
            show_f64(&state->position[i], engine->geo.position[i]);
        }
        if (engine->timetable.valid) {
            show_f64(&state->motion_time, engine->geo.consumed_s * SECOND_US);
        }
    }
}

/* Of all channels together. */
static void publish_stats(struct engine *engine) {
    HLI_SIDE_STATS *side_stats = &engine->hli.side->stats, sum = {0};
    for (uint32_t i = 0; i < engine->group.count; i++) {
        const struct engine *channel = engine->group.all[i];
        sum.requests_mode1 += ATOMIC_GET(channel->service.requests_mode1);
        sum.requests_mode2 += ATOMIC_GET(channel->service.requests_mode2);
        sum.requests_bad += ATOMIC_GET(channel->service.requests_bad);
        sum.bad_commands += channel->orders.bad;
        sum.planner_late += (uint32_t)channel->lateness.times;
        sum.planner_late_cycles += channel->lateness.cycles;
    }
    store_u64_relaxed(&side_stats->requests_mode1, sum.requests_mode1);
    store_u64_relaxed(&side_stats->requests_mode2, sum.requests_mode2);
    store_u64_relaxed(&side_stats->requests_bad, sum.requests_bad);
    store_u64_relaxed(&side_stats->overruns,
                      first_channel(engine)->timing.overruns);
    store_u64_relaxed(&side_stats->bad_commands, sum.bad_commands);
    store_u32_relaxed(&side_stats->planner_late, sum.planner_late);
    store_u64_relaxed(&side_stats->planner_late_cycles,
                      sum.planner_late_cycles);
}

/* The cell's cycle: shown when the last channel has shown its own. */
void publish_cell(struct engine *engine) {
    publish_stats(engine);
    store_u64_release(&engine->hli.side->cnc.cell_time_ns,
                      (uint64_t)llrint((double)engine->geo.cycle
                                       * engine->cfg.cycle_s * 1e9));
    store_u64_release(&engine->hli.side->cnc.cycle, engine->geo.cycle);
}

/* Showing it twice is showing it once. */
static void show_channel(struct engine *engine) {
    publish_axes(engine);
    publish_bahn(engine);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        publish_axis(engine, i);
    }
    publish_lookahead(engine);
}

void publish(struct engine *engine) {
    seq_begin(&engine->hli.side->channel_seq.word);
    show_channel(engine);
    mode_publish(engine);
    seq_end(&engine->hli.side->channel_seq.word);
    if (engine->group.all[engine->group.count - 1] == engine) {
        publish_cell(engine);
    }
}

void publish_again(struct engine *engine) {
    seq_begin(&engine->hli.side->channel_seq.word);
    show_channel(engine);
    mode_publish_state(engine);
    seq_end(&engine->hli.side->channel_seq.word);
}

void publish_initial(struct engine *engine) {
    publish(engine);
    store_u8_release(&engine->hli.channel->head.init_done_r, 1);
}
