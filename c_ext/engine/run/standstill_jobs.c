/* The feeder's jobs that need standstill: turning back, leaving out what is left of a motion, ending the program.
 *
 * The run ring goes on with new pieces from where the path stands; nothing that was committed is touched.
 */
#include <math.h>
#include "engine/run/run_ring.h"

typedef struct place {
    uint64_t i; /* piece of the store */
    double s;   /* in it; 0: ahead of it */
} place;

/* Where in the program the path stands. */
static place stand_place(engine *e) {
    bool forward = e->feed.dir > 0;
    if (e->plan.piece >= e->piece_head) {
        if (forward || e->feed.at >= 0.0) return (place){e->feed.next, fmax(0.0, e->feed.at)}; /* it has turned, and nothing is fed yet */
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

/* The axes stand beside the path, or on the line that leads them back to it. */
static bool off_path(engine *e) {
    if (e->feed.displaced) return true;
    for (uint64_t i = e->plan.piece; i < e->piece_head; i++)
        if (is_motion(piece_at(e, i))) return piece_at(e, i)->shortcut;
    return false;
}

static bool wants_turn(engine *e) {
    int dir = wanted_direction(e);
    if (dir == e->feed.dir) return false;
    if (dir > 0) return true;
    if (off_path(e)) return false; /* what lies behind is left out */
    place at = stand_place(e);
    return at.s > 0.0 || at.i > feed_oldest(e);
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
    feed_cut(e, stands_in_piece ? e->plan.piece : e->piece_head);
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
    piece *p = feed_copy(e, store_at(e, i));
    p->kind = PIECE_EVENT;
    p->type = NC_FLUSH;
    p->length = p->whole = 0.0;
    p->gated = p->stop_before = p->m01 = false;
    feed_publish(e);
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
    e->feed.displaced |= to.found || at.s > 0.0;
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
