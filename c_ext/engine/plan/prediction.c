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
#include "engine/state/state.h"
#include "hli/sync.h"
#include "jerk/planner.h"
#include "rows/nc_block.h"

#define BUFFERS 3u
#define NONE 3u
#define SECOND_US 1e6
#define SAME 1e-6

struct foresight {
    struct forecast of[BUFFERS];
    uint32_t latest, held;
    double times[ENGINE_ESA_TIMES]; /* GEO: as configured, or as the program has
                                       set them */
    uint32_t max;
    uint64_t seen; /* phases written when it was made */
    struct rest_search search;
};

bool foresight_new(struct engine *e) {
    if (!(e->cfg.functions
          & (ENGINE_FCT_CALC_TIME | ENGINE_FCT_CALC_POS_V_0
             | ENGINE_FCT_CALC_STATE_AT_T))) {
        return true;
    }
    struct foresight *f = e->foresight = calloc(1, sizeof *f);
    if (!f) {
        return false;
    }
    foresight_begin_program(e);
    f->max = e->plan.tail_max;
    f->latest = f->held = NONE;
    for (uint32_t i = 0; i < BUFFERS; i++) {
        if (!(f->of[i].phases = calloc(f->max, sizeof(phase)))) {
            return false;
        }
    }
    if (!e->traits.tries_stops
        || !(e->cfg.functions & ENGINE_FCT_CALC_POS_V_0)) {
        return true;
    }
    return (f->search.scratch = e->planner->spare(e)) != NULL;
}

void foresight_begin_program(struct engine *engine) {
    if (engine->foresight) {
        memcpy(engine->foresight->times,
               engine->cfg.esa_time,
               sizeof engine->cfg.esa_time);
    }
}

/* #CHANNEL SET [ESA_TIMEi]; any other index: not of this function. */
void foresight_time(struct engine *engine, int index, double seconds) {
    if (engine->foresight && index >= 0 && index < ENGINE_ESA_TIMES) {
        engine->foresight->times[index] = seconds;
    }
}

void foresight_free(struct engine *engine) {
    if (!engine->foresight) {
        return;
    }
    for (uint32_t i = 0; i < BUFFERS; i++) {
        free(engine->foresight->of[i].phases);
    }
    jerk_free(engine->foresight->search.scratch);
    free(engine->foresight);
}

static void rest_of_plan(struct engine *engine, struct forecast *to) {
    struct writer writer = {.e = engine,
                            .out = to->phases,
                            .max = engine->foresight->max,
                            .piece = engine->plan.piece,
                            .s = engine->plan.s,
                            .v = engine->plan.v,
                            .budget = NEVER};
    engine->planner->rest_of_plan(engine, &writer);
    to->count = writer.count;
}

/* Piece i is the first of a feed block behind rapid motion. */
static bool begins_feed(struct engine *engine, uint64_t i) {
    const struct piece *piece = piece_at(engine, i);
    if (!is_motion(piece) || piece->feed <= 0.0 || piece->dir < 0) {
        return false;
    }
    for (uint64_t k = i; k-- > 0 && i - k < KEPT_BEHIND;) {
        const struct piece *piece_b = piece_at(engine, k);
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
        const struct piece *piece = piece_at(engine, i);
        if (!is_motion(piece)) {
            continue;
        }
        double speed = soft_cap(engine, piece);
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
         i < engine->piece_head && motions <= engine->cfg.window && at < NEVER;
         i++) {
        const struct piece *piece = piece_at(engine, i);
        if (!is_motion(piece)) {
            if (piece->type == NC_DWELL) {
                at += piece->value;
            }
            continue;
        }
        motions++;
        if (begins_feed(engine, i)) {
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
    for (uint64_t k = engine->plan.written; k-- > first;) {
        at -= engine->phase_ring[k & (PHASE_RING - 1)].time;
    }
    for (uint64_t k = first;
         k < engine->plan.written && to->mark_count < MARKS_MAX;
         k++) {
        const phase *ph = &engine->phase_ring[k & (PHASE_RING - 1)];
        if (ph->s0 <= 0.0 && begins_feed(engine, ph->piece)) {
            add_mark(to, at);
        }
        at += ph->time;
    }
    at = to->begin_s;
    for (uint32_t i = 0; i < to->count && to->mark_count < MARKS_MAX; i++) {
        const phase *ph = &to->phases[i];
        if (ph->s0 <= 0.0 && begins_feed(engine, ph->piece)) {
            add_mark(to, at);
        }
        at += ph->time;
    }
    if (!engine->planner->stands_behind || to->mark_count > 0) {
        return;
    }
    const phase *end = to->count ? &to->phases[to->count - 1] : NULL;
    if (!end || end->last || engine->plan.v <= 0.0) {
        marks_behind_plan(engine,
                          to,
                          at,
                          end ? end->piece + 1 : engine->plan.piece);
    }
}

/* Axis positions `way` mm behind the commit's end; false: the path has no place
 * there. */
static bool position_behind(struct engine *engine, double way, double *q) {
    double at = engine->plan.s + way;
    uint64_t i = engine->plan.piece;
    for (; i < engine->piece_head; i++) {
        const struct piece *piece = piece_at(engine, i);
        if (!is_motion(piece)) {
            continue;
        }
        if (at <= piece->length) {
            piece_position(engine, piece, at, q);
            return true;
        }
        at -= piece->length;
    }
    while (i-- > 0 && engine->piece_head - i < KEPT_BEHIND) {
        if (is_motion(piece_at(engine, i))) {
            memcpy(q, piece_at(engine, i)->end, sizeof(double) * NC_AXES);
            return true;
        }
    }
    return false;
}

static struct forecast *free_buffer(struct foresight *foresight) {
    uint32_t held = __atomic_load_n(&foresight->held, __ATOMIC_SEQ_CST);
    for (uint32_t i = 0; i < BUFFERS; i++) {
        if (i != foresight->latest && i != held) {
            return &foresight->of[i];
        }
    }
    return NULL;
}

/* Behind a turn of the planner. */
void foresight_plan(struct engine *engine, bool pumped) {
    struct foresight *foresight = engine->foresight;
    if (!foresight
        || (!pumped && foresight->latest != NONE
            && foresight->seen == engine->plan.written)) {
        return;
    }
    if ((ATOMIC_GET(engine->commit) & 1)
        || ATOMIC_GET(engine->rejoin.state) != REJOIN_NONE) {
        return; /* GEO drives the stored tail */
    }
    struct forecast *to = free_buffer(foresight);
    if (!to) {
        return;
    }
    to->begin_s = engine->plan.committed_s;
    to->count = to->mark_count = 0;
    rest_of_plan(engine, to);
    uint64_t last =
        to->count ? to->phases[to->count - 1].piece + 1 : engine->plan.piece;
    to->complete = engine->feed.final && last >= engine->piece_head;
    if (!engine->plan.hold) {
        find_marks(engine, to);
    }
    to->piece = engine->plan.piece;
    to->s = engine->plan.s;
    if (engine->cfg.functions & ENGINE_FCT_CALC_POS_V_0) {
        double way[2];
        engine->planner->ways_to_rest(engine, &foresight->search, way);
        for (int i = 0; i < 2; i++) {
            to->rest[i].way = way[i];
            to->rest[i].moving = position_behind(engine, way[i], to->rest[i].q);
        }
    }
    foresight->seen = engine->plan.written;
    __atomic_store_n(&foresight->latest,
                     (uint32_t)(to - foresight->of),
                     __ATOMIC_SEQ_CST);
}

static const struct forecast *hold_latest(struct foresight *foresight) {
    for (;;) {
        uint32_t i = __atomic_load_n(&foresight->latest, __ATOMIC_SEQ_CST);
        __atomic_store_n(&foresight->held, i, __ATOMIC_SEQ_CST);
        if (i == __atomic_load_n(&foresight->latest, __ATOMIC_SEQ_CST)) {
            return i == NONE ? NULL : &foresight->of[i];
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
    bool known = at < NEVER && !engine->program_end;
    show_f64(&bahn_state->eta_time_r, known ? (at - now) * SECOND_US : 0.0);
    show_u8(&bahn_state->eta_valid_r, known);
}

/* Way from where GEO is to the commit's end, mm. */
static double committed_way(struct engine *engine,
                            const struct forecast *forecast) {
    const struct geo *geo = &engine->geo;
    bool inside = geo->piece != UINT64_MAX
                  && ATOMIC_GET(engine->piece_done) <= geo->piece;
    double sum =
        forecast->s
        - (inside && is_motion(piece_at(engine, geo->piece)) ? geo->s : 0.0);
    for (uint64_t i = inside ? geo->piece : ATOMIC_GET(engine->piece_done);
         i < forecast->piece;
         i++) {
        if (is_motion(piece_at(engine, i))) {
            sum += load_f64_relaxed(&piece_at(engine, i)->length);
        }
    }
    return fmax(0.0, sum);
}

static void publish_rest(struct engine *engine,
                         HLI_BAHN_STATE *bahn_state,
                         const struct forecast *forecast) {
    const struct geo *geo = &engine->geo;
    bool stands = geo->v <= 0.0 && !geo->has_phase;
    bool later =
        forecast && !ATOMIC_GET(engine->hold_now)
        && forecast->begin_s - geo->consumed_s < commit_low(
               engine); /* the planner is first, then the hold is seen */
    const struct place_of_rest *place_of_rest =
        forecast ? &forecast->rest[later] : NULL;
    bool known = place_of_rest && place_of_rest->moving && !stands;
    show_f64(&bahn_state->dist_v_0_r,
             known ? (committed_way(engine, forecast) + place_of_rest->way)
                         * TENTH_UM
                   : 0.0);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        uint32_t at = (uint32_t)(int32_t)llrint(fmax(
            -2147483648.0,
            fmin(2147483647.0,
                 (known ? place_of_rest->q[i] : geo->position[i]) * TENTH_UM)));
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
    for (uint64_t k = geo->consumed, end = ATOMIC_GET(engine->commit) >> 2;
         k < end;
         k++) {
        const phase *ph = &engine->phase_ring[k & (PHASE_RING - 1)];
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
        double ahead = engine->foresight->times[i],
               v = ahead > 0.0 && !engine->program_end
                       ? speed_at(engine, forecast, ahead)
                       : -1.0;
        show_f64(&bahn_state->esa_vb[i], v < 0.0 ? -1.0 : v * 1000.0);
        show_u8(&bahn_state->esa_data_valid[i], v >= 0.0);
    }
}

/* In each cycle, inside the seqlock. */
void foresight_publish(struct engine *engine) {
    struct foresight *foresight = engine->foresight;
    if (!foresight) {
        return;
    }
    const struct forecast *now = hold_latest(foresight);
    HLI_BAHN_STATE *bahn_state = &engine->channel->bahn_state;
    if (engine->cfg.functions & ENGINE_FCT_CALC_TIME) {
        publish_feed_block(engine, bahn_state, now);
    }
    if (engine->cfg.functions & ENGINE_FCT_CALC_POS_V_0) {
        publish_rest(engine, bahn_state, now);
    }
    if (engine->cfg.functions & ENGINE_FCT_CALC_STATE_AT_T) {
        publish_speeds(engine, bahn_state, now);
    }
    __atomic_store_n(&foresight->held, NONE, __ATOMIC_SEQ_CST);
}
