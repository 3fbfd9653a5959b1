/* The feeder: copies pieces of the store into the run ring, in the order in which they are to be driven.
 *
 * The store is the program; the run ring is what is done with it. Ordinarily both run alike. Real-time loops feed their
 * body again, backward motion feeds pieces in reverse, a stop that the PLC inserts cuts one in two, a shortcut leaves
 * some out. The planner's thread runs the feeder. What has been committed is never changed, nor is anything that the
 * stored stopping tail runs over: so a tail stays true whatever is fed anew, and every change leaves room to stop.
 */
#include <math.h>
#include <stddef.h>
#include "engine/run/run_ring.h"

#define FED_NEAR 64u    /* pieces fed beyond the window: what corner limits mostly have to look at ... */
#define FED_AT_ONCE 8u  /* ... of which so many may be missing ... */
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
    if (p->stop_before || !e->feed.has_motion) return;
    const piece *before = piece_at(e, e->feed.last_motion);
    for (int i = 0; i < e->cfg.axis_count; i++) p->jump[i] = fabs(p->tangent_in[i] - before->tangent_out[i]);
}

piece *feed_copy(engine *e, const piece *from) {
    piece *p = piece_at(e, e->piece_head);
    memcpy(p, from, offsetof(piece, capped));
    p->capped = p->spanned = p->settled = p->cruises = false;
    p->corner_v = p->need2 = 0.0;
    p->cruise2 = -1.0;
    p->span_count = 0;
    return p;
}

void feed_publish(engine *e) { e->piece_head++; }

/* ------------------------------------------------------------------------------------------------ functions again */
static piece *feed_gate(engine *e, const piece *from, techno_counts need) {
    piece *p = feed_copy(e, from);
    p->type = NC_EVENT;
    p->code = EVENT_GATE;
    p->flags = 0;
    p->need = need;
    p->dir = (int8_t)e->feed.dir;
    p->gated = p->replay = true;
    p->stop_before = false;
    feed_publish(e);
    return p;
}

/* A function outside the program's count: again on a stretch driven before, or inserted by the PLC. One at a time. */
void feed_function(engine *e, const piece *from, uint32_t synch) {
    techno_counts need = {0};
    need.std_freed = e->feed.pushed.std_freed;
    if (need.std_freed) feed_gate(e, from, need);
    piece *p = feed_copy(e, from);
    p->flags |= NC_OUTPUT;
    p->replay = true;
    p->put_out = false;
    p->synch = synch;
    p->dir = (int8_t)e->feed.dir;
    p->stop_before = false;
    feed_publish(e);
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
uint64_t feed_first_free(engine *e) {
    if (e->plan.v <= 0.0) return e->plan.piece + (e->plan.s > 0.0);
    planner_store_tail(e);
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

/* An inserted stop that stays is one for the motion behind it too, when that is fed again. */
static void stop_behind(engine *e, const piece *p) {
    if (!p->inserted || p->type != NC_M) return;
    if (p->m01) e->feed.m01 = true;
    else e->feed.stop = true;
}

/* Drop what has been fed from `head` on. */
void feed_cut(engine *e, uint64_t head) {
    for (uint64_t i = head; i < e->piece_head; i++) {
        const piece *p = piece_at(e, i);
        e->feed.displaced |= p->shortcut && (i > e->plan.piece || e->plan.s <= 0.0); /* not begun: the way back to the path is still to go */
        if (p->inserted && p->type == NC_M) drop_stop(e, p);
        if (!p->replay || !(p->flags & NC_OUTPUT)) continue;
        e->feed.pushed.std_freed--;
        if (p->synch & SYNCH_MVS_SVS) e->feed.pushed.std_acked--;
    }
    e->feed.dropped_stop = false;
    e->plan.fed_anew |= e->plan.v > 0.0;
    drive_cut_run(e, head);
    e->piece_head = head;
    e->plan.capped = e->plan.piece;
    e->feed.has_motion = e->feed.stop = e->feed.m01 = false;
    for (uint64_t i = head; i-- > 0 && i + KEPT_BEHIND > e->plan.piece;) {
        if (!is_motion(piece_at(e, i))) {
            stop_behind(e, piece_at(e, i));
            continue;
        }
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
    e->feed.at = -1.0;
    e->feed.in_loop = true; /* until the path has passed the decision */
}

/* Where the stopping tail runs over a decision that has changed, a shorter one may leave it open. */
static void free_decisions(engine *e) {
    for (uint64_t i = e->plan.piece + 1, end = feed_first_free(e); i < end && i < e->piece_head; i++) {
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
    for (uint64_t i = feed_first_free(e); i < e->piece_head; i++) {
        piece *p = piece_at(e, i);
        if (!is_branch(p)) continue;
        ahead = true;
        bool again = loop_wanted(e, p);
        if (p->again == again) continue;
        feed_cut(e, i + 1);
        decide_branch(e, p, again);
        return;
    }
    const piece *begin = store_at(e, e->feed.loop_begin);
    if (!ahead) e->feed.in_loop = e->feed.next >= e->feed.loop_begin && (!begin->mate || e->feed.next <= begin->mate);
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
void feed_shorten(engine *e, piece *p, double s) {
    double end[NC_AXES];
    piece_position(e, p, s, end);
    piece_tangent(e, p, s, p->tangent_out);
    for (int i = 0; i < NC_AXES; i++) store_f64_relaxed(&p->end[i], end[i]); /* GEO may be in it, ahead of s */
    store_f64_release(&p->length, s); /* who takes it for the end finds the new end */
    p->stop_after = p->spanned = p->settled = false;
    p->cruise2 = -1.0;
}

void feed_motion(engine *e, const piece *from) {
    piece *p = feed_copy(e, from);
    double begin = e->feed.at >= 0.0 ? e->feed.at : e->feed.dir > 0 ? 0.0 : from->whole;
    feed_part(e, p, from, begin);
    if (from->origin < e->feed.frontier) p->gated = false;
    double stop = e->feed.dir > 0 && !p->shortcut ? feed_stop_in(e, p, 0.0) : -1.0;
    bool cut = stop >= 0.0 && stop < p->length - 1e-9;
    if (cut) feed_shorten(e, p, stop);
    p->stop_before |= !e->feed.has_motion || e->feed.stop;
    p->m01 |= e->feed.m01;
    e->feed.stop = e->feed.m01 = false;
    set_jump(e, p);
    e->feed.last_motion = e->piece_head;
    e->feed.has_motion = true;
    feed_publish(e);
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

void feed_event(engine *e, const piece *from) {
    bool again = e->feed.dir < 0 || from->origin < e->feed.frontier;
    uint64_t next = e->feed.next + (uint64_t)e->feed.dir;
    e->feed.at = -1.0;
    e->feed.next = next;
    if (again && (from->flags & NC_OUTPUT)) {
        if (from->type != NC_T) feed_function(e, from, synch_again(e, from));
        return;
    }
    if (again && passes_by(e, from)) return;
    piece *p = feed_copy(e, from);
    p->dir = (int8_t)e->feed.dir;
    if (p->dir < 0) p->stop_before = p->m01 = false;
    if (p->type == NC_RT_LOOP_BEGIN || p->type == NC_RT_LOOP_END) {
        e->feed.in_loop = true;
        e->feed.loop_begin = p->type == NC_RT_LOOP_BEGIN ? p->origin : p->mate;
    }
    if (is_branch(p)) decide_branch(e, p, loop_wanted(e, p));
    feed_publish(e);
}

/* Backward motion ends here. */
uint64_t feed_oldest(engine *e) {
    uint64_t kept = e->feed.frontier > e->store_kept ? e->feed.frontier - e->store_kept : 0, first = ATOMIC_GET(e->store_first);
    if (kept < e->feed.program_first) kept = e->feed.program_first;
    return first > kept ? first : kept;
}

static bool can_feed(engine *e, uint64_t head) {
    if (e->feed.dir < 0) return e->feed.next != UINT64_MAX && e->feed.next >= feed_oldest(e);
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

static uint64_t fed_ahead(const engine *e) {
    return e->cfg.window + (e->feed.in_loop ? LOOP_AHEAD : e->drive.planner ? FED_AHEAD : FED_NEAR + e->feed.reach);
}

static bool wants_more(engine *e) {
    return e->piece_head - e->plan.piece < fed_ahead(e) && run_has_room(e) && e->stops_fed - ATOMIC_GET(e->stops_done) < STOPS_MAX;
}

/* Nothing has changed but the path: without jerk some pieces are fed at a time. */
static bool feed_waits(engine *e, bool finished, uint64_t head) {
    const feeder *f = &e->feed;
    if (e->drive.planner || f->in_loop || f->dir < 0 || f->armed || ATOMIC_GET(e->insert_requests) != f->inserts) return false;
    return f->final == (finished && f->next >= head) && (f->next >= head || e->piece_head - e->plan.piece + FED_AT_ONCE > fed_ahead(e));
}

/* Feed as far as the planner has to see. */
void feed(engine *e) {
    bool finished = ATOMIC_GET(e->finished); /* before the head: nothing is pushed behind it */
    uint64_t head = ATOMIC_GET(e->store_head);
    if (feed_waits(e, finished, head)) {
        feed_store_floor(e);
        return;
    }
    if (e->feed.in_loop) reconsider_loop(e);
    feed_take_insert(e);
    while (can_feed(e, head) && wants_more(e)) {
        prefetch_next(e);
        feed_next(e);
    }
    e->feed.final = e->feed.dir < 0 ? !can_feed(e, head) : finished && e->feed.next >= head;
    feed_stop_at_end(e);
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
