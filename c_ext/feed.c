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

static void feed_forward(engine *e) {
    const piece *from = store_at(e, e->feed.next);
    if (is_motion(from)) {
        feed_motion(e, from);
    } else {
        copy_next(e, from);
        publish_run(e);
    }
    e->feed.next++;
}

/* Feed as far as the planner has to see. */
void feed(engine *e) {
    uint64_t head = ATOMIC_GET(e->store_head);
    bool finished = ATOMIC_GET(e->finished);
    while (e->feed.next < head && e->piece_head - e->plan.piece < e->cfg.window + FED_AHEAD && run_has_room(e)) feed_forward(e);
    e->feed.final = finished && e->feed.next >= head;
    feed_store_floor(e);
}
