/* The feeder: copies pieces of the store into the run ring, in the order in which they are to be driven.
 *
 * The store is the program; the run ring is what is done with it. Ordinarily both run alike. Real-time loops feed their
 * body again, backward motion feeds pieces in reverse, a stop that the PLC inserts cuts one in two, a shortcut leaves
 * some out. The planner's thread runs the feeder. What has been committed is never changed, nor is anything that the
 * stored stopping tail runs over: so a tail stays true whatever is fed anew, and every change leaves room to stop.
 */
#include <math.h>
#include "engine_internal.h"

#define FED_AHEAD 1064u /* pieces fed beyond the window: what corner limits may have to look at */
#define LOOP_AHEAD 8u   /* the same inside a real-time loop, whose end is decided as late as possible */

/* Lowest piece of the store that is still needed: the backward store, or the beginning of the loop being driven. */
void feed_store_floor(engine *e) {
    uint64_t done = ATOMIC_GET(e->store_done), floor = done > e->store_kept ? done - e->store_kept : 0;
    if (e->feed.next < floor) floor = e->feed.next;
    if (e->feed.in_loop && e->feed.loop_begin < floor) floor = e->feed.loop_begin;
    if (floor > e->store_floor) ATOMIC_SET(e->store_floor, floor);
}

static bool run_has_room(engine *e) { return e->piece_head - ATOMIC_GET(e->piece_done) < PIECE_RING - KEPT_BEHIND - 8; }

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
    *p = *from;
    return p;
}

static void publish_run(engine *e) { e->piece_head++; }

static void feed_motion(engine *e, const piece *from) {
    piece *p = copy_next(e, from);
    p->stop_before |= !e->feed.has_motion;
    set_jump(e, p);
    e->feed.last_motion = e->piece_head;
    e->feed.has_motion = true;
    publish_run(e);
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

static void feed_event(engine *e, const piece *from) {
    piece *p = copy_next(e, from);
    e->feed.next += (uint64_t)e->feed.dir;
    p->dir = (int8_t)e->feed.dir;
    if (p->type == NC_RT_LOOP_BEGIN && p->dir > 0) {
        e->feed.in_loop = true;
        e->feed.loop_begin = p->origin;
    }
    if (is_branch(p)) decide_branch(e, p, loop_wanted(e, p));
    publish_run(e);
}

/* First piece of the run ring that may still be changed: none that is committed, none that the tail runs over. */
static uint64_t first_free(const engine *e) {
    if (e->plan.v <= 0.0) return e->plan.piece + (e->plan.s > 0.0);
    uint64_t word = ATOMIC_GET(e->commit);
    return e->plan.tails[(word >> 1) & 1].piece + 1;
}

/* Drop what has been fed from `head` on. */
static void cut_run(engine *e, uint64_t head) {
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

/* The condition of a loop may have changed since its end was fed. */
static void reconsider_loop(engine *e) {
    bool ahead = false;
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
    if (!ahead) e->feed.in_loop = e->feed.next > e->feed.loop_begin && e->feed.next <= store_at(e, e->feed.loop_begin)->mate;
}

/* ------------------------------------------------------------------------------------------------ feeding */
static void feed_next(engine *e) {
    const piece *from = store_at(e, e->feed.next);
    if (!is_motion(from)) {
        feed_event(e, from);
        return;
    }
    feed_motion(e, from);
    e->feed.next++;
}

static bool wants_more(engine *e) {
    uint64_t ahead = e->cfg.window + (e->feed.in_loop ? LOOP_AHEAD : FED_AHEAD);
    return e->piece_head - e->plan.piece < ahead && run_has_room(e);
}

/* Feed as far as the planner has to see. */
void feed(engine *e) {
    bool finished = ATOMIC_GET(e->finished); /* before the head: nothing is pushed behind it */
    uint64_t head = ATOMIC_GET(e->store_head);
    if (e->feed.in_loop) reconsider_loop(e);
    while (e->feed.next < head && wants_more(e)) feed_next(e);
    e->feed.final = finished && e->feed.next >= head;
    feed_store_floor(e);
}
