/* What lies ahead in time: the way to the next feed block, the place where the path would rest, speeds to come.
 *
 * The planner's side copies, behind each commit, what is left of its plan into one of three buffers; GEO reads the
 * latest one. `held` tells the planner which buffer GEO is reading, so neither waits for the other.
 * FCT_CALC_TIME, FCT_CALC_POS_V_0, FCT_CALC_STATE_AT_T of P-CHAN-00650.
 */
#include <math.h>
#include <stdlib.h>
#include "engine/state/state.h"

#define BUFFERS 3u
#define NONE 3u
#define MARKS_MAX 4        /* feed blocks looked ahead to */
#define SECOND_US 1e6
#define SAME 1e-6

typedef struct place_of_rest {
    bool moving;           /* there is one ahead of the commit's end, ... */
    double way;            /* ... mm from there */
    double q[NC_AXES];
} place_of_rest;

typedef struct forecast {
    double begin_s;        /* motion time at which the first phase begins */
    uint32_t count, mark_count;
    bool complete;         /* at rest at its end, and nothing comes behind */
    double marks[MARKS_MAX]; /* motion times at which feed blocks begin behind rapid motion */
    uint64_t piece;        /* the commit's end ... */
    double s;
    place_of_rest rest[2]; /* of a hold that comes now; that comes so late that more is committed before it acts */
    phase *phases;
} forecast;

struct foresight {
    forecast of[BUFFERS];
    uint32_t latest, held;
    double times[ENGINE_ESA_TIMES]; /* GEO: as configured, or as the program has set them */
    uint32_t max;
    uint64_t seen;         /* phases written when it was made */
    jerk_planner *scratch; /* a stop is tried in it */
    jerk_preview next;     /* of a hold behind the next commit, ... */
    double next_s;         /* ... which is expected to end there */
};

bool foresight_new(engine *e) {
    if (!(e->cfg.functions & (ENGINE_FCT_CALC_TIME | ENGINE_FCT_CALC_POS_V_0 | ENGINE_FCT_CALC_STATE_AT_T))) return true;
    struct foresight *f = e->foresight = calloc(1, sizeof *f);
    if (!f) return false;
    foresight_begin_program(e);
    f->max = e->plan.tail_max;
    f->latest = f->held = NONE;
    for (uint32_t i = 0; i < BUFFERS; i++)
        if (!(f->of[i].phases = calloc(f->max, sizeof(phase)))) return false;
    if (!e->drive.planner || !(e->cfg.functions & ENGINE_FCT_CALC_POS_V_0)) return true;
    return (f->scratch = drive_spare(e)) != NULL;
}

void foresight_begin_program(engine *e) {
    if (e->foresight) memcpy(e->foresight->times, e->cfg.esa_time, sizeof e->cfg.esa_time);
}

/* #CHANNEL SET [ESA_TIMEi]; any other index: not of this function. */
void foresight_time(engine *e, int index, double seconds) {
    if (e->foresight && index >= 0 && index < ENGINE_ESA_TIMES) e->foresight->times[index] = seconds;
}

void foresight_free(engine *e) {
    if (!e->foresight) return;
    for (uint32_t i = 0; i < BUFFERS; i++) free(e->foresight->of[i].phases);
    jerk_free(e->foresight->scratch);
    free(e->foresight);
}

/* ------------------------------------------------------------------------------------------------ rest of the plan */
static bool append(struct foresight *f, forecast *to, phase ph) {
    if (to->count >= f->max || !(ph.time >= 0.0)) return false;
    to->phases[to->count++] = ph;
    return true;
}

/* The jerk-limited planner's stored tail is the rest of its plan. */
static void rest_of_plan(engine *e, forecast *to) {
    const tail *t = &e->plan.tails[(ATOMIC_GET(e->commit) >> 1) & 1];
    for (uint32_t i = t->first; i < t->count; i++)
        if (!append(e->foresight, to, t->phases[i])) return;
}

/* The acceleration-limited planner stores no plan: its window once more, to where its last backward pass began. */
static void run_window(engine *e, forecast *to) {
    uint64_t end = e->plan.need_end;
    if (e->plan.capped < end) return; /* pieces have come anew since */
    writer w = {.e = e, .out = to->phases, .max = e->foresight->max, .piece = e->plan.piece, .s = e->plan.s, .v = e->plan.v, .budget = NEVER, .left = e->plan.left};
    drive_window(&w, end);
    to->count = w.count;
}

/* ------------------------------------------------------------------------------------------------ feed blocks */
/* Piece i is the first of a feed block behind rapid motion. */
static bool begins_feed(engine *e, uint64_t i) {
    const piece *p = piece_at(e, i);
    if (!is_motion(p) || p->feed <= 0.0 || p->dir < 0) return false;
    for (uint64_t k = i; k-- > 0 && i - k < KEPT_BEHIND;) {
        const piece *b = piece_at(e, k);
        if (is_motion(b)) return b->feed <= 0.0 && b->dir > 0;
    }
    return false;
}

static void add_mark(forecast *to, double at) { to->marks[to->mark_count++] = at; }

/* Time of motions first to last, from rest to rest: over a single line exactly; else every piece at its own speed, with
 * the ramps of the fastest one. */
static double stretch_time(engine *e, uint64_t first, uint64_t last) {
    double length = 0.0, fastest = 0.0, time = 0.0, u[NC_AXES], most[NC_AXES] = {0};
    for (uint64_t i = first; i <= last; i++) {
        const piece *p = piece_at(e, i);
        if (!is_motion(p)) continue;
        double speed = soft_cap(e, p);
        if (speed <= 0.0) return NEVER;
        length += p->length;
        fastest = fmax(fastest, speed);
        time += p->length / speed;
        piece_tangent(e, p, 0.5 * p->length, u);
        for (int a = 0; a < e->cfg.axis_count; a++) most[a] = fmax(most[a], fabs(u[a]));
    }
    if (length <= 0.0) return 0.0;
    return jerk_line_time(e->drive.planner, most, length, fastest) + time - length / fastest;
}

/* Behind the plan of the jerk-limited planner, which ends where the axes stand: estimated, from stand to stand. */
static void marks_behind_plan(engine *e, forecast *to, double at, uint64_t i) {
    uint64_t first = i;
    for (uint32_t motions = 0; i < e->piece_head && motions <= e->cfg.window && at < NEVER; i++) {
        const piece *p = piece_at(e, i);
        if (!is_motion(p)) {
            if (p->type == NC_DWELL) at += p->value;
            continue;
        }
        motions++;
        if (begins_feed(e, i)) {
            add_mark(to, at + (first < i ? stretch_time(e, first, i - 1) : 0.0));
            return;
        }
        if (!drive_stands_behind(e, i)) continue;
        at += stretch_time(e, first, i);
        first = i + 1;
    }
}

/* In committed phases, then in what is planned behind them. */
static void find_marks(engine *e, forecast *to) {
    double at = to->begin_s;
    uint64_t first = ATOMIC_GET(e->geo.consumed);
    for (uint64_t k = e->plan.written; k-- > first;) at -= e->phase_ring[k & (PHASE_RING - 1)].time;
    for (uint64_t k = first; k < e->plan.written && to->mark_count < MARKS_MAX; k++) {
        const phase *ph = &e->phase_ring[k & (PHASE_RING - 1)];
        if (ph->s0 <= 0.0 && begins_feed(e, ph->piece)) add_mark(to, at);
        at += ph->time;
    }
    at = to->begin_s;
    for (uint32_t i = 0; i < to->count && to->mark_count < MARKS_MAX; i++) {
        const phase *ph = &to->phases[i];
        if (ph->s0 <= 0.0 && begins_feed(e, ph->piece)) add_mark(to, at);
        at += ph->time;
    }
    if (!e->drive.planner || to->mark_count > 0) return;
    const phase *end = to->count ? &to->phases[to->count - 1] : NULL;
    if (!end || end->last || e->plan.v <= 0.0) marks_behind_plan(e, to, at, end ? end->piece + 1 : e->plan.piece);
}

/* ------------------------------------------------------------------------------------------------ the place of rest */
/* The acceleration-limited planner's stopping tail ends where a hold would. */
static double tail_way(engine *e) {
    planner_store_tail(e);
    const tail *t = &e->plan.tails[(ATOMIC_GET(e->commit) >> 1) & 1];
    double sum = -e->plan.s;
    for (uint64_t i = e->plan.piece; i < t->piece; i++)
        if (is_motion(piece_at(e, i))) sum += piece_at(e, i)->length;
    return fmax(0.0, sum + (t->piece < e->piece_head ? t->s : 0.0));
}

/* What is committed next, once too little is ahead of GEO; s. */
static double next_commit(engine *e) {
    double dt = e->cfg.cycle_s, low = commit_low(e), ahead = ahead_s(e);
    return e->plan.hold ? 0.0 : greater(0.0, commit_high(e) - (ahead - (floor(greater(0.0, ahead - low) / dt) + 1.0) * dt));
}

/* Whether the plan has come to where the last forecast has looked from: what it has found there holds. */
static bool as_foreseen(const engine *e) {
    const struct foresight *f = e->foresight;
    return !e->plan.hold && f->next.v > 0.0 && fabs(e->plan.committed_s - f->next_s) < SAME && fabs(e->plan.v - f->next.v) < SAME * f->next.v;
}

/* From the commit's end to where a hold brings the path to rest: one that comes now, one that comes behind the next commit. */
static void ways_to_rest(engine *e, double way[2]) {
    struct foresight *f = e->foresight;
    jerk_planner *p = e->drive.planner;
    way[0] = way[1] = 0.0;
    if (!p) {
        if (e->plan.v > 0.0) way[0] = way[1] = tail_way(e);
        return;
    }
    if (e->plan.v <= 0.0 && e->drive.restart) return;
    double later = next_commit(e);
    jerk_preview now = f->next;
    if (!as_foreseen(e)) jerk_stop_preview(p, f->scratch, 0.0, &now);
    jerk_stop_preview(p, f->scratch, later, &f->next);
    f->next_s = e->plan.committed_s + later;
    way[0] = now.way;
    way[1] = f->next.before + f->next.way;
}

/* Axis positions `way` mm behind the commit's end; false: the path has no place there. */
static bool position_behind(engine *e, double way, double *q) {
    double at = e->plan.s + way;
    uint64_t i = e->plan.piece;
    for (; i < e->piece_head; i++) {
        const piece *p = piece_at(e, i);
        if (!is_motion(p)) continue;
        if (at <= p->length) {
            piece_position(e, p, at, q);
            return true;
        }
        at -= p->length;
    }
    while (i-- > 0 && e->piece_head - i < KEPT_BEHIND)
        if (is_motion(piece_at(e, i))) {
            memcpy(q, piece_at(e, i)->end, sizeof(double) * NC_AXES);
            return true;
        }
    return false;
}

/* ------------------------------------------------------------------------------------------------ planner's side */
static forecast *free_buffer(struct foresight *f) {
    uint32_t held = __atomic_load_n(&f->held, __ATOMIC_SEQ_CST);
    for (uint32_t i = 0; i < BUFFERS; i++)
        if (i != f->latest && i != held) return &f->of[i];
    return NULL;
}

/* Behind a turn of the planner. */
void foresight_plan(engine *e, bool pumped) {
    struct foresight *f = e->foresight;
    if (!f || (!pumped && f->latest != NONE && f->seen == e->plan.written)) return;
    if ((ATOMIC_GET(e->commit) & 1) || ATOMIC_GET(e->rejoin.state) != REJOIN_NONE) return; /* GEO drives the stored tail */
    forecast *to = free_buffer(f);
    if (!to) return;
    to->begin_s = e->plan.committed_s;
    to->count = to->mark_count = 0;
    if (e->drive.planner) rest_of_plan(e, to);
    else run_window(e, to);
    uint64_t last = to->count ? to->phases[to->count - 1].piece + 1 : e->plan.piece;
    to->complete = e->feed.final && last >= e->piece_head;
    if (!e->plan.hold) find_marks(e, to);
    to->piece = e->plan.piece;
    to->s = e->plan.s;
    if (e->cfg.functions & ENGINE_FCT_CALC_POS_V_0) {
        double way[2];
        ways_to_rest(e, way);
        for (int i = 0; i < 2; i++) {
            to->rest[i].way = way[i];
            to->rest[i].moving = position_behind(e, way[i], to->rest[i].q);
        }
    }
    f->seen = e->plan.written;
    __atomic_store_n(&f->latest, (uint32_t)(to - f->of), __ATOMIC_SEQ_CST);
}

/* ------------------------------------------------------------------------------------------------ GEO's side */
static const forecast *hold_latest(struct foresight *f) {
    for (;;) {
        uint32_t i = __atomic_load_n(&f->latest, __ATOMIC_SEQ_CST);
        __atomic_store_n(&f->held, i, __ATOMIC_SEQ_CST);
        if (i == __atomic_load_n(&f->latest, __ATOMIC_SEQ_CST)) return i == NONE ? NULL : &f->of[i];
    }
}

static void publish_feed_block(engine *e, HLI_BAHN_STATE *b, const forecast *f) {
    double now = e->geo.consumed_s, at = NEVER;
    for (uint32_t i = 0; f && i < f->mark_count; i++)
        if (f->marks[i] > now) at = fmin(at, f->marks[i]);
    bool known = at < NEVER && !e->program_end;
    show_f64(&b->eta_time_r, known ? (at - now) * SECOND_US : 0.0);
    show_u8(&b->eta_valid_r, known);
}

/* Way from where GEO is to the commit's end, mm. */
static double committed_way(engine *e, const forecast *f) {
    const geo *g = &e->geo;
    bool inside = g->piece != UINT64_MAX && ATOMIC_GET(e->piece_done) <= g->piece;
    double sum = f->s - (inside && is_motion(piece_at(e, g->piece)) ? g->s : 0.0);
    for (uint64_t i = inside ? g->piece : ATOMIC_GET(e->piece_done); i < f->piece; i++)
        if (is_motion(piece_at(e, i))) sum += load_f64_relaxed(&piece_at(e, i)->length);
    return fmax(0.0, sum);
}

static void publish_rest(engine *e, HLI_BAHN_STATE *b, const forecast *f) {
    const geo *g = &e->geo;
    bool stands = g->v <= 0.0 && !g->has_phase;
    bool later = f && !ATOMIC_GET(e->hold_now) && f->begin_s - g->consumed_s < commit_low(e); /* the planner is first, then the hold is seen */
    const place_of_rest *r = f ? &f->rest[later] : NULL;
    bool known = r && r->moving && !stands;
    show_f64(&b->dist_v_0_r, known ? (committed_way(e, f) + r->way) * TENTH_UM : 0.0);
    for (int i = 0; i < e->cfg.axis_count; i++) {
        uint32_t at = (uint32_t)(int32_t)llrint(fmax(-2147483648.0, fmin(2147483647.0, (known ? r->q[i] : g->position[i]) * TENTH_UM)));
        show_u32((uint32_t *)&b->pos_v_0_pcs_r[i], at);
        show_u32((uint32_t *)&b->pos_v_0_acs_r[i], at);
    }
    show_u8(&b->pos_v_0_valid_r, known || stands);
}

static double speed_in(const phase *ph, double t) {
    const jerk_law law = law_of_phase(ph);
    jerk_state at;
    jerk_at(&law, t, &at);
    return fmax(0.0, at.v);
}

/* Path speed, mm/s, `ahead` seconds of motion from now; -1: not known. */
static double speed_at(engine *e, const forecast *f, double ahead) {
    const geo *g = &e->geo;
    double t = ahead;
    if (f && g->consumed_s + ahead >= f->begin_s) {
        t = g->consumed_s + ahead - f->begin_s;
        for (uint32_t i = 0; i < f->count; t -= f->phases[i++].time)
            if (t <= f->phases[i].time) return speed_in(&f->phases[i], t);
        return f->complete ? 0.0 : -1.0;
    }
    if (g->has_phase) {
        if (g->t + t <= g->now.time) return speed_in(&g->now, g->t + t);
        t -= g->now.time - g->t;
    }
    if (g->in_tail) return -1.0;
    for (uint64_t k = g->consumed, end = ATOMIC_GET(e->commit) >> 2; k < end; k++) {
        const phase *ph = &e->phase_ring[k & (PHASE_RING - 1)];
        if (t <= ph->time) return speed_in(ph, t);
        t -= ph->time;
    }
    return -1.0;
}

static void publish_speeds(engine *e, HLI_BAHN_STATE *b, const forecast *f) {
    for (int i = 0; i < ENGINE_ESA_TIMES; i++) {
        double ahead = e->foresight->times[i], v = ahead > 0.0 && !e->program_end ? speed_at(e, f, ahead) : -1.0;
        show_f64(&b->esa_vb[i], v < 0.0 ? -1.0 : v * 1000.0);
        show_u8(&b->esa_data_valid[i], v >= 0.0);
    }
}

/* In each cycle, inside the seqlock. */
void foresight_publish(engine *e) {
    struct foresight *f = e->foresight;
    if (!f) return;
    const forecast *now = hold_latest(f);
    HLI_BAHN_STATE *b = &e->channel->bahn_state;
    if (e->cfg.functions & ENGINE_FCT_CALC_TIME) publish_feed_block(e, b, now);
    if (e->cfg.functions & ENGINE_FCT_CALC_POS_V_0) publish_rest(e, b, now);
    if (e->cfg.functions & ENGINE_FCT_CALC_STATE_AT_T) publish_speeds(e, b, now);
    __atomic_store_n(&f->held, NONE, __ATOMIC_SEQ_CST);
}
