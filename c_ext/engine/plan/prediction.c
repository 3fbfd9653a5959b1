/* What lies ahead in time: the way to the next feed block, the place where the
 * path would rest, speeds to come.
 *
 * The planner's side copies, behind each commit, what is left of its plan into
 * one of three buffers; GEO reads the latest one. `held` tells the planner
 * which buffer GEO is reading, so neither waits for the other. FCT_CALC_TIME,
 * FCT_CALC_POS_V_0, FCT_CALC_STATE_AT_T of P-CHAN-00650.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "engine/plan/prediction.h"
#include "engine/commit/commit.h"
#include "engine/commit/planner.h"
#include "engine/path/piece.h"
#include "engine/path/speed_caps.h"
#include "engine/plan/timetable.h"
#include "engine/state/state.h"
#include "hli/sync.h"
#include "jerk/state/api.h"
#include "rows/nc_block.h"

#define BUFFERS 3u
#define NONE 3u
#define SECOND_US 1e6
#define SAME 1e-6

struct prediction {
    struct forecast of[BUFFERS];
    uint32_t latest, held;
    double times[ENGINE_ESA_TIMES]; /* GEO: as configured, or as the program has
                                       set them */
    uint32_t max;
    uint64_t seen; /* phases written when it was made */
    double
        override; /* of the last plan that was made for the one of its time */
    struct standstill_search search;
};

/* Planner: made when something is first wanted of it. */
bool prediction_new(struct engine *engine) {
    if (!plan_is_read(engine)) {
        return true;
    }
    struct prediction *prediction = calloc(1, sizeof *prediction);
    if (!prediction) {
        return false;
    }
    prediction->max = engine->commit.tail_max;
    prediction->latest = prediction->held = NONE;
    ATOMIC_SET(engine->prediction, prediction);
    prediction_begin_program(engine);
    for (uint32_t i = 0; i < BUFFERS; i++) {
        if (!(prediction->of[i].phases =
                  calloc(prediction->max, sizeof(phase)))) {
            return false;
        }
    }
    if (!engine->traits.tries_stops
        || !(engine->cfg.functions & ENGINE_FCT_CALC_POS_V_0)) {
        return true;
    }
    return (prediction->search.scratch = engine->planner->spare(engine))
           != NULL;
}

bool prediction_renew(struct engine *engine) {
    struct prediction *prediction = engine->prediction;
    if (!prediction || !prediction->search.scratch) {
        return true;
    }
    jerk_planner *scratch = engine->planner->spare(engine);
    if (!scratch) {
        return false;
    }
    jerk_free(prediction->search.scratch);
    prediction->search.scratch = scratch;
    prediction->search.next.v = 0.0; /* what was foreseen does not hold */
    return true;
}

void prediction_begin_program(struct engine *engine) {
    if (engine->prediction) {
        memcpy(engine->prediction->times,
               engine->cfg.esa_time,
               sizeof engine->cfg.esa_time);
    }
}

void prediction_time(struct engine *engine, int index, double seconds) {
    if (engine->prediction && index >= 0 && index < ENGINE_ESA_TIMES) {
        engine->prediction->times[index] = seconds;
    }
}

void prediction_free(struct engine *engine) {
    if (!engine->prediction) {
        return;
    }
    for (uint32_t i = 0; i < BUFFERS; i++) {
        free(engine->prediction->of[i].phases);
    }
    jerk_free(engine->prediction->search.scratch);
    free(engine->prediction);
}

static void remainder_of_plan(struct engine *engine, struct forecast *to) {
    struct writer writer = {.engine = engine,
                            .out = to->phases,
                            .max = engine->prediction->max,
                            .piece = engine->commit.piece,
                            .s = engine->commit.s,
                            .v = engine->commit.v,
                            .budget = NEVER};
    engine->planner->remainder_of_plan(engine, &writer);
    to->count = writer.count;
}

/* Piece i is the first of a feed block behind rapid motion. */
static bool begins_feed(struct run_ring *run, uint64_t i) {
    const struct piece *piece = piece_at(run, i);
    if (!is_motion(piece) || piece->feed <= 0.0 || piece->dir < 0) {
        return false;
    }
    for (uint64_t k = i; k-- > 0 && i - k < KEPT_BEHIND;) {
        const struct piece *piece_b = piece_at(run, k);
        if (is_motion(piece_b)) {
            return piece_b->feed <= 0.0 && piece_b->dir > 0;
        }
    }
    return false;
}

static void add_mark(struct forecast *to, double at) {
    to->marks[to->mark_count++] = at;
}

/* Time of motions first to last, from rest to rest: over a single line exactly;
 * else every piece at its own speed, with the ramps of the fastest one. */
static double stretch_time(struct engine *engine,
                           uint64_t first,
                           uint64_t last) {
    double length = 0.0, fastest = 0.0, time = 0.0, u[NC_AXES],
           most[NC_AXES] = {0};
    for (uint64_t i = first; i <= last; i++) {
        const struct piece *piece = piece_at(&engine->run, i);
        if (!is_motion(piece)) {
            continue;
        }
        double speed = soft_cap(&engine->plan, piece);
        if (speed <= 0.0) {
            return NEVER;
        }
        length += piece->length;
        fastest = fmax(fastest, speed);
        time += piece->length / speed;
        piece_tangent(engine, piece, 0.5 * piece->length, u);
        for (int axis = 0; axis < engine->cfg.axis_count; axis++) {
            most[axis] = fmax(most[axis], fabs(u[axis]));
        }
    }
    if (length <= 0.0) {
        return 0.0;
    }
    return engine->planner->line_time(engine, most, length, fastest) + time
           - length / fastest;
}

/* Behind the plan of the jerk-limited planner, which ends where the axes stand:
 * estimated, from stand to stand. */
static void marks_behind_plan(struct engine *engine,
                              struct forecast *to,
                              double at,
                              uint64_t i) {
    uint64_t first = i;
    for (uint32_t motions = 0;
         i < engine->run.head && motions <= engine->cfg.window && at < NEVER;
         i++) {
        const struct piece *piece = piece_at(&engine->run, i);
        if (!is_motion(piece)) {
            if (piece->type == NC_DWELL) {
                at += piece->value;
            }
            continue;
        }
        motions++;
        if (begins_feed(&engine->run, i)) {
            add_mark(
                to,
                at + (first < i ? stretch_time(engine, first, i - 1) : 0.0));
            return;
        }
        if (!engine->planner->stands_behind(engine, i)) {
            continue;
        }
        at += stretch_time(engine, first, i);
        first = i + 1;
    }
}

/* In committed phases, then in what is planned behind them. */
static void find_marks(struct engine *engine, struct forecast *to) {
    double at = to->begin_s;
    uint64_t first = ATOMIC_GET(engine->geo.consumed);
    for (uint64_t k = engine->commit.written; k-- > first;) {
        at -= engine->commit.ring[k & (PHASE_RING - 1)].time;
    }
    for (uint64_t k = first;
         k < engine->commit.written && to->mark_count < MARKS_MAX;
         k++) {
        const phase *ph = &engine->commit.ring[k & (PHASE_RING - 1)];
        if (ph->s0 <= 0.0 && begins_feed(&engine->run, ph->piece)) {
            add_mark(to, at);
        }
        at += ph->time;
    }
    at = to->begin_s;
    for (uint32_t i = 0; i < to->count && to->mark_count < MARKS_MAX; i++) {
        const phase *ph = &to->phases[i];
        if (ph->s0 <= 0.0 && begins_feed(&engine->run, ph->piece)) {
            add_mark(to, at);
        }
        at += ph->time;
    }
    if (!engine->planner->stands_behind || to->mark_count > 0) {
        return;
    }
    const phase *end = to->count ? &to->phases[to->count - 1] : NULL;
    if (!end || end->last || engine->commit.v <= 0.0) {
        marks_behind_plan(engine,
                          to,
                          at,
                          end ? end->piece + 1 : engine->commit.piece);
    }
}

/* Axis positions `way` mm behind the commit's end; false: the path has no place
 * there. */
static bool position_behind(struct engine *engine, double way, double *q) {
    double at = engine->commit.s + way;
    uint64_t i = engine->commit.piece;
    for (; i < engine->run.head; i++) {
        const struct piece *piece = piece_at(&engine->run, i);
        if (!is_motion(piece)) {
            continue;
        }
        if (at <= piece->length) {
            piece_position(engine, piece, at, q);
            return true;
        }
        at -= piece->length;
    }
    while (i-- > 0 && engine->run.head - i < KEPT_BEHIND) {
        if (is_motion(piece_at(&engine->run, i))) {
            memcpy(q, piece_at(&engine->run, i)->end, sizeof(double) * NC_AXES);
            return true;
        }
    }
    return false;
}

static struct forecast *free_buffer(struct prediction *prediction) {
    uint32_t held = __atomic_load_n(&prediction->held, __ATOMIC_SEQ_CST);
    for (uint32_t i = 0; i < BUFFERS; i++) {
        if (i != prediction->latest && i != held) {
            return &prediction->of[i];
        }
    }
    return NULL;
}

/* What is committed and not driven yet, then what is planned behind it. */
static void make_timetable(struct engine *engine, struct forecast *to) {
    struct timetable *table = &to->timetable;
    uint64_t first = ATOMIC_GET(engine->geo.consumed);
    first = first > 0 ? first - 1 : 0; /* the phase that is being driven */
    double at = to->begin_s;
    for (uint64_t k = engine->commit.written; k-- > first;) {
        at -= engine->commit.ring[k & (PHASE_RING - 1)].time;
    }
    timetable_begin(engine, table);
    for (uint64_t k = first; k < engine->commit.written; k++) {
        const phase *ph = &engine->commit.ring[k & (PHASE_RING - 1)];
        timetable_add(engine, table, ph, at);
        at += ph->time;
    }
    at = to->begin_s;
    for (uint32_t i = 0; i < to->count; at += to->phases[i++].time) {
        timetable_add(engine, table, &to->phases[i], at);
    }
    const struct planner_ops *planner = engine->planner;
    if (!planner->as_wanted || planner->as_wanted(engine)) {
        engine->prediction->override = engine->plan.override;
    }
    timetable_end(table,
                  to->complete,
                  to->stands,
                  engine->prediction->override);
}

/* Whether the axes stand where the plan ends, whatever comes behind. */
static bool stands_at_end(struct engine *engine, const struct forecast *to) {
    const phase *end = to->count ? &to->phases[to->count - 1] : NULL;
    return to->complete
           || (end && end->last && engine->planner->stands_behind
               && engine->planner->stands_behind(engine, end->piece));
}

void prediction_plan(struct engine *engine, bool pumped) {
    struct prediction *prediction = engine->prediction;
    if (!prediction) {
        if (!plan_is_read(engine) || !prediction_new(engine)) {
            return;
        }
        prediction = engine->prediction;
    }
    if (!plan_is_read(engine)) {
        return;
    }
    if (!pumped && prediction->latest != NONE
        && prediction->seen == engine->commit.written) {
        return;
    }
    if ((ATOMIC_GET(engine->commit.word) & 1)
        || ATOMIC_GET(engine->rejoin.state) != REJOIN_NONE) {
        return; /* GEO drives the stored tail */
    }
    struct forecast *to = free_buffer(prediction);
    if (!to) {
        return;
    }
    to->begin_s = engine->commit.committed_s;
    to->count = to->mark_count = 0;
    remainder_of_plan(engine, to);
    uint64_t last =
        to->count ? to->phases[to->count - 1].piece + 1 : engine->commit.piece;
    bool whole = to->count == 0 || to->phases[to->count - 1].last;
    to->complete = engine->dispatch.final && last >= engine->run.head && whole;
    to->stands = stands_at_end(engine, to);
    if (!engine->plan.hold && engine->cfg.functions & FORESEES) {
        find_marks(engine, to);
    }
    if (ATOMIC_GET(engine->orders.timetable)) {
        make_timetable(engine, to);
    }
    to->piece = engine->commit.piece;
    to->s = engine->commit.s;
    if (engine->cfg.functions & ENGINE_FCT_CALC_POS_V_0) {
        double way[2];
        engine->planner->ways_to_standstill(engine, &prediction->search, way);
        for (int i = 0; i < 2; i++) {
            to->standstill[i].way = way[i];
            to->standstill[i].moving =
                position_behind(engine, way[i], to->standstill[i].q);
        }
    }
    prediction->seen = engine->commit.written;
    __atomic_store_n(&prediction->latest,
                     (uint32_t)(to - prediction->of),
                     __ATOMIC_SEQ_CST);
}

static const struct forecast *hold_latest(struct prediction *prediction) {
    for (;;) {
        uint32_t i = __atomic_load_n(&prediction->latest, __ATOMIC_SEQ_CST);
        __atomic_store_n(&prediction->held, i, __ATOMIC_SEQ_CST);
        if (i == __atomic_load_n(&prediction->latest, __ATOMIC_SEQ_CST)) {
            return i == NONE ? NULL : &prediction->of[i];
        }
    }
}

static void publish_feed_block(struct engine *engine,
                               HLI_BAHN_STATE *bahn_state,
                               const struct forecast *forecast) {
    double now = engine->geo.consumed_s, at = NEVER;
    for (uint32_t i = 0; forecast && i < forecast->mark_count; i++) {
        if (forecast->marks[i] > now) {
            at = fmin(at, forecast->marks[i]);
        }
    }
    bool known = at < NEVER && !ATOMIC_GET(engine->program.end);
    show_f64(&bahn_state->eta_time_r, known ? (at - now) * SECOND_US : 0.0);
    show_u8(&bahn_state->eta_valid_r, known);
}

/* Way from where GEO is to the commit's end, mm. */
static double committed_way(struct engine *engine,
                            const struct forecast *forecast) {
    const struct geo *geo = &engine->geo;
    bool inside =
        geo->piece != UINT64_MAX && ATOMIC_GET(engine->run.done) <= geo->piece;
    double sum =
        forecast->s
        - (inside && is_motion(piece_at(&engine->run, geo->piece)) ? geo->s
                                                                   : 0.0);
    for (uint64_t i = inside ? geo->piece : ATOMIC_GET(engine->run.done);
         i < forecast->piece;
         i++) {
        if (is_motion(piece_at(&engine->run, i))) {
            sum += load_f64_relaxed(&piece_at(&engine->run, i)->length);
        }
    }
    return fmax(0.0, sum);
}

static void publish_standstill(struct engine *engine,
                               HLI_BAHN_STATE *bahn_state,
                               const struct forecast *forecast) {
    const struct geo *geo = &engine->geo;
    bool stands = geo->v <= 0.0 && !geo->has_phase;
    bool later =
        forecast && !ATOMIC_GET(engine->orders.hold)
        && forecast->begin_s - geo->consumed_s < commit_low(
               engine); /* the planner is first, then the hold is seen */
    const struct place_of_standstill *place_of_standstill =
        forecast ? &forecast->standstill[later] : NULL;
    bool known = place_of_standstill && place_of_standstill->moving && !stands;
    show_f64(&bahn_state->dist_v_0_r,
             known
                 ? (committed_way(engine, forecast) + place_of_standstill->way)
                       * TENTH_UM
                 : 0.0);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        uint32_t at = (uint32_t)(int32_t)llrint(
            fmax(-2147483648.0,
                 fmin(2147483647.0,
                      (known ? place_of_standstill->q[i] : geo->position[i])
                          * TENTH_UM)));
        show_u32((uint32_t *)&bahn_state->pos_v_0_pcs_r[i], at);
        show_u32((uint32_t *)&bahn_state->pos_v_0_acs_r[i], at);
    }
    show_u8(&bahn_state->pos_v_0_valid_r, known || stands);
}

static double speed_in(const phase *ph, double t) {
    const jerk_law law = law_of_phase(ph);
    jerk_state at;
    jerk_at(&law, t, &at);
    return fmax(0.0, at.v);
}

/* Path speed, mm/s, `ahead` seconds of motion from now; -1: not known. */
static double speed_at(struct engine *engine,
                       const struct forecast *forecast,
                       double ahead) {
    const struct geo *geo = &engine->geo;
    double t = ahead;
    if (forecast && geo->consumed_s + ahead >= forecast->begin_s) {
        t = geo->consumed_s + ahead - forecast->begin_s;
        for (uint32_t i = 0; i < forecast->count;
             t -= forecast->phases[i++].time) {
            if (t <= forecast->phases[i].time) {
                return speed_in(&forecast->phases[i], t);
            }
        }
        return forecast->complete ? 0.0 : -1.0;
    }
    if (geo->has_phase) {
        if (geo->t + t <= geo->now.time) {
            return speed_in(&geo->now, geo->t + t);
        }
        t -= geo->now.time - geo->t;
    }
    if (geo->in_tail) {
        return -1.0;
    }
    for (uint64_t k = geo->consumed, end = ATOMIC_GET(engine->commit.word) >> 2;
         k < end;
         k++) {
        const phase *ph = &engine->commit.ring[k & (PHASE_RING - 1)];
        if (t <= ph->time) {
            return speed_in(ph, t);
        }
        t -= ph->time;
    }
    return -1.0;
}

static void publish_speeds(struct engine *engine,
                           HLI_BAHN_STATE *bahn_state,
                           const struct forecast *forecast) {
    for (int i = 0; i < ENGINE_ESA_TIMES; i++) {
        double ahead = engine->prediction->times[i],
               v = ahead > 0.0 && !ATOMIC_GET(engine->program.end)
                       ? speed_at(engine, forecast, ahead)
                       : -1.0;
        show_f64(&bahn_state->esa_vb[i], v < 0.0 ? -1.0 : v * 1000.0);
        show_u8(&bahn_state->esa_data_valid[i], v >= 0.0);
    }
}

/* GEO drives a stored tail: no table is true until the planner goes on. */
static void publish_timetable(struct engine *engine,
                              const struct forecast *now) {
    HLI_AHEAD_STATE *state = &engine->hli.ahead->state;
    const struct shown_timetable *shown = &engine->timetable;
    bool known = now && now->timetable.count && !engine->geo.in_tail
                 && ATOMIC_GET(engine->orders.timetable);
    if (!known) {
        timetable_withdraw(engine);
    } else if (now->timetable.edition != shown->table.edition) {
        timetable_publish(engine, &now->timetable);
    }
    show_u32(&state->edition, shown->table.edition);
    show_u8(&state->plan_valid, shown->valid != 0);
}

void prediction_publish(struct engine *engine) {
    struct prediction *prediction = ATOMIC_GET(engine->prediction);
    if (!prediction) {
        return;
    }
    const struct forecast *now = hold_latest(prediction);
    HLI_BAHN_STATE *bahn_state = &engine->hli.channel->bahn_state;
    if (engine->cfg.functions & ENGINE_FCT_CALC_TIME) {
        publish_feed_block(engine, bahn_state, now);
    }
    if (engine->cfg.functions & ENGINE_FCT_CALC_POS_V_0) {
        publish_standstill(engine, bahn_state, now);
    }
    if (engine->cfg.functions & ENGINE_FCT_CALC_STATE_AT_T) {
        publish_speeds(engine, bahn_state, now);
    }
    if (engine->hli.ahead) {
        publish_timetable(engine, now);
    }
    __atomic_store_n(&prediction->held, NONE, __ATOMIC_SEQ_CST);
}
