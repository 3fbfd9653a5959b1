/* The feeder: copies pieces of the store into the run ring, in the order in which they are to be driven.
 *
 * The store is the program; the run ring is what is done with it. Ordinarily both run alike. Real-time loops feed their
 * body again, backward motion feeds pieces in reverse, a stop that the PLC inserts cuts one in two, a shortcut leaves
 * some out. The planner's thread runs the feeder. What has been committed is never changed, nor is anything that the
 * stored stopping tail runs over: so a tail stays true whatever is fed anew, and every change leaves room to stop.
 */
#include <math.h>
#include <stddef.h>
#include "engine_internal.h"

#define FED_NEAR 64u    /* pieces fed beyond the window: what corner limits mostly have to look at ... */
#define FED_AHEAD 1064u /* ... and at the most */
#define LOOP_AHEAD 8u   /* the same inside a real-time loop, whose end is decided as late as possible */

/* Lowest piece of the store that is still needed: the backward store, or the beginning of the loop being driven. */
void feed_store_floor(engine *e) {
    uint64_t done = ATOMIC_GET(e->store_done), kept = e->store_kept + KEPT_BEHIND; /* curves are looked at behind the path too */
    uint64_t floor = done > kept ? done - kept : 0;
    if (e->feed.next < floor) floor = e->feed.next;
    if (e->feed.in_loop && e->feed.loop_begin < floor) floor = e->feed.loop_begin;
    if (floor > e->store_floor) ATOMIC_SET(e->store_floor, floor);
}

static bool run_has_room(engine *e) { return e->piece_head - ATOMIC_GET(e->piece_done) < e->piece_mask + 1 - KEPT_BEHIND - 8; }

/* Change of direction per axis between the piece before and this one. */
static void set_jump(engine *e, piece *p) {
    p->jump_max = 0.0;
    if (p->stop_before || !e->feed.has_motion) return;
    const piece *before = piece_at(e, e->feed.last_motion);
    for (int i = 0; i < e->cfg.axis_count; i++) {
        p->jump[i] = fabs(p->tangent_in[i] - before->tangent_out[i]);
        p->jump_max = fmax(p->jump_max, p->jump[i]);
    }
}

static piece *copy_next(engine *e, const piece *from) {
    piece *p = piece_at(e, e->piece_head);
    memcpy(p, from, offsetof(piece, capped));
    p->capped = p->spanned = false;
    p->corner_v = p->need2 = 0.0;
    p->span_count = 0;
    return p;
}

static void publish_run(engine *e) { e->piece_head++; }

/* ------------------------------------------------------------------------------------------------ functions again */
static piece *feed_gate(engine *e, const piece *from, techno_counts need) {
    piece *p = copy_next(e, from);
    p->type = NC_EVENT;
    p->code = EVENT_GATE;
    p->flags = 0;
    p->need = need;
    p->dir = (int8_t)e->feed.dir;
    p->gated = p->replay = true;
    p->stop_before = false;
    publish_run(e);
    return p;
}

/* A function outside the program's count: again on a stretch driven before, or inserted by the PLC. One at a time. */
static void feed_function(engine *e, const piece *from, uint32_t synch) {
    techno_counts need = {0};
    need.std_freed = e->feed.pushed.std_freed;
    if (need.std_freed) feed_gate(e, from, need);
    piece *p = copy_next(e, from);
    p->flags |= NC_OUTPUT;
    p->replay = true;
    p->put_out = false;
    p->synch = synch;
    p->dir = (int8_t)e->feed.dir;
    p->stop_before = false;
    publish_run(e);
    e->feed.pushed.std_freed++;
    if (!(synch & SYNCH_MVS_SVS)) return;
    e->feed.pushed.std_acked++;
    need = (techno_counts){.std_acked = e->feed.pushed.std_acked};
    feed_gate(e, from, need);
}

/* How a function acts on a stretch driven before: MOS, unless a flag asks for more; simply repeated, as configured. */
static uint32_t synch_again(engine *e, const piece *p) {
    bool waits = p->synch & ~(SYNCH_MOS | SYNCH_BWD | SYNCH_FWD);
    if (e->feed.dir < 0) return p->synch & SYNCH_BWD ? SYNCH_MVS_SVS : SYNCH_MOS;
    if (ATOMIC_GET(e->simulate_now) && !(p->synch & SYNCH_FWD)) return SYNCH_MOS;
    return waits ? SYNCH_MVS_SVS : SYNCH_MOS;
}

/* ------------------------------------------------------------------------------------------------ run ring, again */
/* First piece of the run ring that may still be changed: none that is committed, none that the tail runs over. */
static uint64_t first_free(const engine *e) {
    if (e->plan.v <= 0.0) return e->plan.piece + (e->plan.s > 0.0);
    uint64_t word = ATOMIC_GET(e->commit);
    return e->plan.tails[(word >> 1) & 1].piece + 1;
}

/* An inserted stop that is dropped has to be found again; of several the first. */
static void drop_stop(engine *e, const piece *p) {
    ATOMIC_SET(e->stops_fed, e->stops_fed - 1);
    if (e->feed.dropped_stop) return;
    e->feed.dropped_stop = e->feed.armed = true;
    e->feed.target = p->path0;
}

/* Drop what has been fed from `head` on. */
static void cut_run(engine *e, uint64_t head) {
    for (uint64_t i = head; i < e->piece_head; i++) {
        const piece *p = piece_at(e, i);
        if (p->inserted && p->type == NC_M) drop_stop(e, p);
        if (!p->replay || !(p->flags & NC_OUTPUT)) continue;
        e->feed.pushed.std_freed--;
        if (p->synch & SYNCH_MVS_SVS) e->feed.pushed.std_acked--;
    }
    e->feed.dropped_stop = false;
    drive_cut_run(e, head);
    e->piece_head = head;
    e->plan.capped = e->plan.piece;
    e->feed.has_motion = false;
    for (uint64_t i = head; i-- > 0 && i + KEPT_BEHIND > e->plan.piece;) {
        if (!is_motion(piece_at(e, i))) continue;
        e->feed.last_motion = i;
        e->feed.has_motion = true;
        return;
    }
}

/* ------------------------------------------------------------------------------------------------ real-time loops */
static bool is_branch(const piece *p) { return p->kind == PIECE_EVENT && p->type == (p->dir > 0 ? NC_RT_LOOP_END : NC_RT_LOOP_BEGIN); }

/* Whether a loop is driven once more; one without a path would never end. */
static bool loop_wanted(engine *e, const piece *p) { return ATOMIC_GET(e->rt_loop_now) && p->value > 0.0; }

static void decide_branch(engine *e, piece *p, bool again) {
    p->again = again;
    e->feed.next = again ? p->mate + (uint64_t)p->dir : p->origin + (uint64_t)p->dir;
    e->feed.in_loop = true; /* until the path has passed the decision */
}

/* Where the stopping tail runs over a decision that has changed, a shorter one may leave it open. */
static void free_decisions(engine *e) {
    for (uint64_t i = e->plan.piece + 1, end = first_free(e); i < end && i < e->piece_head; i++) {
        const piece *p = piece_at(e, i);
        if (!is_branch(p) || p->again == loop_wanted(e, p)) continue;
        drive_shorten_tail(e);
        return;
    }
}

/* The condition of a loop may have changed since its end was fed. */
static void reconsider_loop(engine *e) {
    bool ahead = false;
    if (e->drive.planner) free_decisions(e);
    for (uint64_t i = first_free(e); i < e->piece_head; i++) {
        piece *p = piece_at(e, i);
        if (!is_branch(p)) continue;
        ahead = true;
        bool again = loop_wanted(e, p);
        if (p->again == again) continue;
        cut_run(e, i + 1);
        decide_branch(e, p, again);
        return;
    }
    const piece *begin = store_at(e, e->feed.loop_begin);
    if (!ahead) e->feed.in_loop = e->feed.next >= e->feed.loop_begin && (!begin->mate || e->feed.next <= begin->mate);
}

/* ------------------------------------------------------------------------------------------------ inserted stops */
/* Where in a piece an axis is at `target`: the first place found, or -1. Lines and arcs change direction rarely enough. */
static double axis_crossing(engine *e, const piece *p, int axis, double target, double begin) {
    enum { STEPS = 64 };
    double q[NC_AXES], before, s0 = begin;
    piece_position(e, p, begin, q);
    before = q[axis] - target;
    for (int k = 1; k <= STEPS; k++) {
        double s1 = begin + (p->length - begin) * k / STEPS;
        piece_position(e, p, s1, q);
        if (before != 0.0 && before * (q[axis] - target) <= 0.0) {
            for (int i = 0; i < 60; i++) {
                double middle = 0.5 * (s0 + s1);
                piece_position(e, p, middle, q);
                if (before * (q[axis] - target) > 0.0) s0 = middle;
                else s1 = middle;
            }
            return s1;
        }
        before = q[axis] - target;
        s0 = s1;
    }
    return -1.0;
}

static double dist_shift(engine *e) {
    double shift;
    __atomic_load(&e->geo.dist_shift, &shift, __ATOMIC_ACQUIRE);
    return shift;
}

/* Where in a piece, as it is driven, the inserted stop lies, behind `begin`; -1 if not there. */
static double stop_in(engine *e, const piece *p, double begin) {
    if (!e->feed.armed) return -1.0;
    if (e->feed.insert.axis) return axis_crossing(e, p, e->feed.insert.axis - 1, e->feed.target, begin);
    if (p->dist_rate <= 0.0) return -1.0;
    double s = (e->feed.target - (dist_shift(e) + p->dist0)) / p->dist_rate;
    return s > begin + 1e-9 && s <= p->length + 1e-9 ? fmin(s, p->length) : -1.0;
}

static double run_dist(engine *e, const piece *p, double s) { return dist_shift(e) + p->dist0 + p->dist_rate * s; }

/* The stop stands behind the piece `before`. */
static void feed_stop(engine *e, const piece *before) {
    const insert_cmd *c = &e->feed.insert;
    piece stop;
    memset(&stop, 0, sizeof stop);
    stop.kind = PIECE_EVENT;
    stop.type = NC_M;
    stop.inserted = true;
    stop.dir = 1;
    stop.code = c->m_function;
    stop.value = c->add;
    stop.flags = c->add ? NC_HAS_VALUE : 0;
    stop.n = before->n;
    stop.count = before->count;
    stop.line = before->line;
    stop.element = before->element;
    stop.origin = before->origin;
    stop.from = before->from + before->length;
    stop.whole = before->whole;
    stop.path0 = e->feed.target;
    memcpy(stop.end, before->end, sizeof stop.end);
    inserted_stop *entry = &e->stops[e->stops_fed % STOPS_MAX];
    store_f64_relaxed(&entry->dist, run_dist(e, before, before->length)); /* GEO may be showing the stop it replaces */
    for (int i = 0; i < NC_AXES; i++) store_f64_relaxed(&entry->position[i], before->end[i]);
    ATOMIC_SET(e->stops_fed, e->stops_fed + 1);
    e->feed.armed = c->mode == INSERT_RELATIVE_REPEATED;
    if (e->feed.armed) e->feed.target = (c->axis ? before->end[c->axis - 1] : entry->dist) + c->value;
    if (c->m_function > 1) {
        feed_function(e, &stop, SYNCH_MVS_SVS);
        e->feed.stop = true;
        return;
    }
    piece *p = copy_next(e, &stop);
    p->stop_before = c->m_function == 0;
    p->m01 = c->m_function == 1;
    publish_run(e);
    e->feed.stop = p->stop_before;
    e->feed.m01 = p->m01;
}

/* ------------------------------------------------------------------------------------------------ feeding */
static double piece_end(const engine *e, const piece *from) { return e->feed.dir > 0 ? from->whole : 0.0; }

/* The part of `from` that is driven from `begin` on. */
static void feed_part(engine *e, piece *p, const piece *from, double begin) {
    bool whole = e->feed.dir > 0 && begin <= 0.0;
    if (e->feed.displaced) {
        piece_shortcut(e, p, e->geo.position, e->geo.path - e->geo.path_shift, e->geo.dist);
        e->feed.displaced = false;
        return;
    }
    if (whole) return;
    piece_cut(e, p, begin, piece_end(e, from));
    p->stop_before = p->m01 = p->gated = false;
    if (e->feed.dir < 0) p->stop_after = false;
    if (e->feed.dir < 0 && e->cfg.retrace_feed > 0.0) p->feed = e->cfg.retrace_feed;
    p->new_block = e->feed.has_motion && piece_at(e, e->feed.last_motion)->count != p->count;
}

/* Shorten a motion that is driven forward to its first s mm. */
static void shorten(engine *e, piece *p, double s) {
    double end[NC_AXES];
    piece_position(e, p, s, end);
    piece_tangent(e, p, s, p->tangent_out);
    for (int i = 0; i < NC_AXES; i++) store_f64_relaxed(&p->end[i], end[i]); /* GEO may be in it, ahead of s */
    store_f64_release(&p->length, s); /* who takes it for the end finds the new end */
    p->stop_after = p->spanned = false;
}

static void feed_motion(engine *e, const piece *from) {
    piece *p = copy_next(e, from);
    double begin = e->feed.at >= 0.0 ? e->feed.at : e->feed.dir > 0 ? 0.0 : from->whole;
    feed_part(e, p, from, begin);
    if (from->origin < e->feed.frontier) p->gated = false;
    double stop = e->feed.dir > 0 && !p->shortcut ? stop_in(e, p, 0.0) : -1.0;
    bool cut = stop >= 0.0 && stop < p->length - 1e-9;
    if (cut) shorten(e, p, stop);
    p->stop_before |= !e->feed.has_motion || e->feed.stop;
    p->m01 |= e->feed.m01;
    e->feed.stop = e->feed.m01 = false;
    set_jump(e, p);
    e->feed.last_motion = e->piece_head;
    e->feed.has_motion = true;
    publish_run(e);
    e->feed.at = cut ? p->from + p->length : -1.0;
    if (!cut) e->feed.next += (uint64_t)e->feed.dir;
    if (stop >= 0.0) feed_stop(e, p);
}

/* Events that mean nothing on a stretch that has been driven before. */
static bool passes_by(const engine *e, const piece *p) {
    switch (p->type) {
    case NC_RT_LOOP_BEGIN: case NC_RT_LOOP_END: case NC_DISTANCE_RESET:
        return false;
    case NC_DWELL:
        return e->feed.dir < 0;
    case NC_M:
        return e->feed.dir < 0 || ATOMIC_GET(e->simulate_now);
    default:
        return true;
    }
}

static void feed_event(engine *e, const piece *from) {
    bool again = e->feed.dir < 0 || from->origin < e->feed.frontier;
    uint64_t next = e->feed.next + (uint64_t)e->feed.dir;
    e->feed.at = -1.0;
    e->feed.next = next;
    if (again && (from->flags & NC_OUTPUT)) {
        if (from->type != NC_T) feed_function(e, from, synch_again(e, from));
        return;
    }
    if (again && passes_by(e, from)) return;
    piece *p = copy_next(e, from);
    p->dir = (int8_t)e->feed.dir;
    if (p->dir < 0) p->stop_before = p->m01 = false;
    if (p->type == NC_RT_LOOP_BEGIN || p->type == NC_RT_LOOP_END) {
        e->feed.in_loop = true;
        e->feed.loop_begin = p->type == NC_RT_LOOP_BEGIN ? p->origin : p->mate;
    }
    if (is_branch(p)) decide_branch(e, p, loop_wanted(e, p));
    publish_run(e);
}

/* Backward motion ends here. */
static uint64_t oldest(engine *e) {
    uint64_t kept = e->feed.frontier > e->store_kept ? e->feed.frontier - e->store_kept : 0, first = ATOMIC_GET(e->store_first);
    if (kept < e->feed.program_first) kept = e->feed.program_first;
    return first > kept ? first : kept;
}

static bool can_feed(engine *e, uint64_t head) {
    if (e->feed.dir < 0) return e->feed.next != UINT64_MAX && e->feed.next >= oldest(e);
    return e->feed.next < head;
}

/* Neither the piece that is copied next nor its place in the ring has been touched for a long time. */
static void prefetch_next(engine *e) {
    const char *from = (const char *)store_at(e, e->feed.next + (uint64_t)(2 * e->feed.dir)), *to = (const char *)piece_at(e, e->piece_head + 1);
    for (size_t at = 0; at < sizeof(piece); at += 64) {
        __builtin_prefetch(from + at, 0);
        __builtin_prefetch(to + at, 1);
    }
}

static void feed_next(engine *e) {
    const piece *from = store_at(e, e->feed.next);
    if (is_motion(from)) feed_motion(e, from);
    else feed_event(e, from);
}

static bool wants_more(engine *e) {
    uint64_t ahead = e->cfg.window + (e->feed.in_loop ? LOOP_AHEAD : e->drive.planner ? FED_AHEAD : FED_NEAR + e->feed.reach);
    return e->piece_head - e->plan.piece < ahead && run_has_room(e) && e->stops_fed - ATOMIC_GET(e->stops_done) < STOPS_MAX;
}

/* The program ends ahead of an inserted stop: it stands at the end. */
static void stop_at_end(engine *e) {
    if (!e->feed.final || e->feed.dir < 0 || !e->feed.armed || !e->feed.has_motion) return;
    if (e->feed.insert.axis || e->feed.insert.mode == INSERT_RELATIVE_REPEATED || e->piece_head == ATOMIC_GET(e->piece_done)) return;
    feed_stop(e, piece_at(e, e->feed.last_motion));
}

static bool is_inserted_stop(const piece *p) { return p->inserted && p->type == NC_M; }

/* Feed from piece i of the run ring on anew: a motion or an inserted stop. */
static void feed_again_from(engine *e, uint64_t i) {
    const piece *p = piece_at(e, i);
    bool behind = p->inserted && p->from >= p->whole - 1e-9;
    uint64_t next = behind ? p->origin + 1 : p->origin;
    double at = !behind && p->from > 0.0 ? p->from : -1.0;
    if (p->inserted) e->feed.stop = e->feed.m01 = false; /* unless fed anew, nothing stops here */
    cut_run(e, i);
    e->feed.next = next;
    e->feed.at = at;
}

/* Where the path would come to rest if it braked now. */
static uint64_t rest_piece(engine *e, double *s) {
    uint64_t word = ATOMIC_GET(e->commit);
    const tail *t = &e->plan.tails[(word >> 1) & 1];
    *s = e->plan.v > 0.0 ? t->s : e->plan.s;
    return e->plan.v > 0.0 ? t->piece : e->plan.piece;
}

/* The stop lies in the piece in which the path could come to rest: that one is cut in two. */
static bool cut_rest_piece(engine *e) {
    double rest;
    uint64_t i = rest_piece(e, &rest);
    if (i >= e->piece_head) return false;
    piece *p = piece_at(e, i);
    if (!is_motion(p) || p->shortcut || p->dir < 0) return false;
    if (!e->feed.insert.axis && e->feed.target < run_dist(e, p, rest)) e->feed.target = run_dist(e, p, rest + 1e-6);
    double stop = stop_in(e, p, rest);
    if (stop < 0.0) return false;
    bool armed = e->feed.armed;
    double target = e->feed.target;
    cut_run(e, i + 1);
    e->feed.armed = armed;
    e->feed.target = target;
    e->feed.last_motion = i;
    e->feed.has_motion = true;
    bool cut = stop < p->length - 1e-9;
    if (cut) shorten(e, p, stop);
    if (cut) drive_shorten(e, i, stop);
    double at = p->from + p->length; /* behind an earlier stop the piece is a part already */
    bool left = at < p->whole - 1e-9;
    e->feed.next = left ? p->origin : p->origin + 1;
    e->feed.at = left ? at : -1.0;
    feed_stop(e, p);
    e->feed.stop = true; /* the path comes to rest here, whatever is inserted: only that is sure to be possible */
    return true;
}

/* A new insert_cmd: what has been fed is fed again from where that is free, so that the stop finds its place. */
static void take_insert(engine *e) {
    uint32_t request = ATOMIC_GET(e->insert_requests);
    if (request == e->feed.inserts || e->feed.dir < 0 || !drive_shorten_tail(e)) return;
    uint64_t i = first_free(e);
    while (i < e->piece_head && !is_inserted_stop(piece_at(e, i)) && (!is_motion(piece_at(e, i)) || piece_at(e, i)->shortcut)) i++;
    if (i < e->piece_head) feed_again_from(e, i); /* this drops the stops of the command before */
    insert_cmd *c = &e->feed.insert;
    *c = e->insert_request;
    e->feed.target = c->mode == INSERT_ABSOLUTE ? c->value : c->base + c->value;
    e->feed.armed = c->mode == INSERT_ABSOLUTE ? c->axis || c->value >= c->base : c->value != 0.0;
    if (e->feed.armed) cut_rest_piece(e);
    ATOMIC_SET(e->feed.inserts, request);
}

/* Feed as far as the planner has to see. */
void feed(engine *e) {
    bool finished = ATOMIC_GET(e->finished); /* before the head: nothing is pushed behind it */
    uint64_t head = ATOMIC_GET(e->store_head);
    if (e->feed.in_loop) reconsider_loop(e);
    take_insert(e);
    while (can_feed(e, head) && wants_more(e)) {
        prefetch_next(e);
        feed_next(e);
    }
    e->feed.final = e->feed.dir < 0 ? !can_feed(e, head) : finished && e->feed.next >= head;
    stop_at_end(e);
    feed_store_floor(e);
}

/* Corner limits look further than what is fed: feed more from now on. */
bool feed_further(engine *e) {
    if (e->feed.reach || e->feed.in_loop) return false;
    uint64_t head = e->piece_head;
    e->feed.reach = FED_AHEAD - FED_NEAR;
    feed(e);
    return e->piece_head > head;
}

/* ------------------------------------------------------------------------------------------------ jobs at standstill */
typedef struct place {
    uint64_t i; /* piece of the store */
    double s;   /* in it; 0: ahead of it */
} place;

/* Where in the program the path stands. */
static place stand_place(engine *e) {
    bool forward = e->feed.dir > 0;
    if (e->plan.piece >= e->piece_head) {
        if (forward) return (place){e->feed.next, fmax(0.0, e->feed.at)};
        return (place){e->feed.next + 1, 0.0};
    }
    const piece *p = piece_at(e, e->plan.piece);
    if (!is_motion(p) && !p->inserted) return (place){p->origin + (p->dir > 0 ? 0 : 1), 0.0}; /* fed before the last turn, it may be */
    double s = p->inserted ? p->from : p->from + p->dir * e->plan.s;
    return s >= p->whole - 1e-9 ? (place){p->origin + 1, 0.0} : (place){p->origin, fmax(0.0, s)};
}

static int wanted_direction(engine *e) {
    return e->store_kept && ATOMIC_GET(e->backward_now) ? -1 : 1;
}

static bool on_shortcut(engine *e) {
    return e->plan.piece < e->piece_head && piece_at(e, e->plan.piece)->shortcut && e->plan.s > 0.0;
}

static bool wants_turn(engine *e) {
    int dir = wanted_direction(e);
    if (dir == e->feed.dir || on_shortcut(e)) return false;
    if (dir > 0) return true;
    place at = stand_place(e);
    return at.s > 0.0 || at.i > oldest(e);
}

static bool wants_shortcut(engine *e) {
    return e->store_kept && ATOMIC_GET(e->shortcut_requests) != e->feed.shortcuts && e->feed.dir > 0 && !on_shortcut(e);
}

static bool wants_abort(engine *e) { return ATOMIC_GET(e->abort_now) == 1; }

bool feed_job_pending(engine *e) { return wants_abort(e) || wants_turn(e) || wants_shortcut(e); }

/* Nothing is left to stand in: an empty piece in its place tells where the path stands, should it turn again. */
static void stand_at(engine *e, place at) {
    piece *p = piece_at(e, e->piece_head);
    memset(p, 0, sizeof *p);
    p->kind = PIECE_EVENT;
    p->type = NC_FLUSH;
    p->dir = 1;
    p->inserted = true;
    p->origin = at.i;
    p->from = at.s;
    p->whole = INFINITY;
}

/* The run ring goes on with new pieces; the one GEO stands in is left as it is. */
static void begin_run(engine *e, place at) {
    bool stands_in_piece = e->plan.piece < e->piece_head;
    cut_run(e, stands_in_piece ? e->plan.piece : e->piece_head);
    if (!stands_in_piece) stand_at(e, at);
    e->plan.piece = e->feed.run = ++e->piece_head;
    e->plan.s = e->plan.v = 0.0;
    e->plan.capped = e->plan.piece;
    e->drive.restart = true;
    e->feed.has_motion = e->feed.stop = e->feed.m01 = false;
}

static void turn(engine *e) {
    place at = stand_place(e);
    if (e->feed.dir > 0 && at.i > e->feed.frontier) e->feed.frontier = at.i;
    begin_run(e, at);
    e->feed.dir = -e->feed.dir;
    e->feed.next = e->feed.dir > 0 || at.s > 0.0 ? at.i : at.i - 1;
    e->feed.at = at.s > 0.0 ? at.s : -1.0;
}

/* A marker of #DEL DIST2GO that the PLC has made valid. */
static bool is_end_mark(engine *e, const piece *p) {
    return p->kind == PIECE_EVENT && p->type == NC_EVENT && p->code == NC_EVENT_DIST2GO_END && ((uint32_t)p->value & ATOMIC_GET(e->shortcut_mask));
}

/* Last piece of the block of motion i, as far as it is prepared. */
static uint64_t block_end(engine *e, uint64_t i, uint64_t head) {
    uint32_t count = store_at(e, i)->count;
    for (uint64_t k = i + 1; k < head && store_at(e, k)->count == count; k++)
        if (is_motion(store_at(e, k))) i = k;
    return i;
}

typedef struct target {
    uint64_t piece; /* motion whose end is driven to */
    bool found;
} target;

/* The end of the next motion block; with end marks made valid, the first place so marked. A loop is not left. */
static target shortcut_target(engine *e, place at, uint64_t head) {
    target block = {head, false}, before = {at.i, at.s > 0.0};
    if (at.s > 0.0) before.piece = block_end(e, at.i, head);
    for (uint64_t k = at.s > 0.0 ? before.piece + 1 : at.i; k < head; k++) {
        const piece *p = store_at(e, k);
        if (is_end_mark(e, p)) return before;
        if (p->type == NC_RT_LOOP_END || p->type == NC_RT_LOOP_BEGIN) break;
        if (!is_motion(p)) continue;
        before = (target){k, true};
        if (!block.found) block = (target){block_end(e, k, head), true};
        if (!ATOMIC_GET(e->shortcut_mask)) break;
    }
    return block;
}

/* The rest of a piece is left out, with nothing in its place. */
static void feed_nothing(engine *e, uint64_t i) {
    piece *p = copy_next(e, store_at(e, i));
    p->kind = PIECE_EVENT;
    p->type = NC_FLUSH;
    p->length = p->whole = 0.0;
    p->gated = p->stop_before = p->m01 = false;
    publish_run(e);
}

/* Whether more rows may come that the shortcut could lead to. */
static bool rows_to_come(engine *e) {
    return !ATOMIC_GET(e->finished) && !ATOMIC_GET(e->expect_drain) && ring_has_room(e);
}

/* Leave out what lies between here and the target but for its events, then a straight line. */
static void shortcut(engine *e) {
    uint32_t request = ATOMIC_GET(e->shortcut_requests);
    uint64_t head = ATOMIC_GET(e->store_head);
    place at = stand_place(e);
    target to = shortcut_target(e, at, head);
    if (!to.found && rows_to_come(e)) return;
    begin_run(e, at);
    e->feed.at = -1.0;
    e->feed.next = at.i;
    e->feed.displaced = true;
    uint64_t end = to.found ? to.piece : at.i;
    while (e->feed.next < end) { /* events keep their order and their effect */
        const piece *p = store_at(e, e->feed.next);
        if (is_motion(p)) e->feed.next++;
        else feed_event(e, p);
    }
    if (to.found) {
        feed_motion(e, store_at(e, end));
        ATOMIC_SET(e->store_first, end + 1);
    } else if (at.s > 0.0) {
        feed_nothing(e, at.i);
        e->feed.next++;
        ATOMIC_SET(e->store_first, at.i + 1);
    }
    ATOMIC_SET(e->feed.shortcuts, request);
}

/* The program ends here: everything that is left is left out. */
static void leave_out_rest(engine *e) {
    uint64_t head = ATOMIC_GET(e->store_head);
    place at = stand_place(e);
    bool left = at.i < head;
    e->halt_row = left ? store_at(e, at.i)->row : e->rows_taken;
    e->halt_s = left ? at.s : 0.0;
    e->halt_whole = left ? store_at(e, at.i)->whole : 0.0;
    begin_run(e, (place){head, 0.0});
    e->feed.dir = 1;
    e->feed.next = head;
    e->feed.at = -1.0;
    e->feed.frontier = head;
    e->feed.in_loop = e->feed.displaced = false;
    if (head > ATOMIC_GET(e->store_done)) {
        feed_nothing(e, head - 1);
        piece_at(e, e->piece_head - 1)->flags = 0;
    }
    ATOMIC_SET(e->abort_now, 2);
}

void feed_begin_program(engine *e) {
    begin_run(e, (place){ATOMIC_GET(e->store_head), 0.0});
    memset(&e->feed.pushed, 0, sizeof e->feed.pushed);
    e->feed.dir = 1;
    e->feed.next = e->feed.frontier = e->feed.program_first = e->store_head;
    e->feed.at = -1.0;
    e->feed.in_loop = e->feed.displaced = false;
    ATOMIC_SET(e->withdraw, WITHDRAW_NONE);
}

void feed_do_jobs(engine *e) {
    if (wants_abort(e)) leave_out_rest(e);
    else if (wants_turn(e)) turn(e);
    else if (wants_shortcut(e)) shortcut(e);
}
