/* The feeder's jobs that need standstill: turning back, leaving out what is
 * left of a motion, ending the program.
 *
 * The run ring goes on with new pieces from where the path stands; nothing that
 * was committed is touched.
 */
#include <math.h>
#include <string.h>
#include "engine/run/standstill_jobs.h"
#include "engine/commit/planner.h"
#include "engine/run/dispatch.h"
#include "engine/run/run_ring.h"
#include "engine/state/state.h"
#include "engine/store/push.h"
#include "rows/nc_block.h"

typedef struct place {
    uint64_t i; /* piece of the store */
    double s;   /* in it; 0: ahead of it */
} place;

typedef struct target {
    uint64_t piece; /* motion whose end is driven to */
    bool found;
} target;

/* Where in the program the path stands. */
static place stand_place(struct engine *engine) {
    bool forward = engine->feed.dir > 0;
    if (engine->plan.piece >= engine->piece_head) {
        if (forward || engine->feed.at >= 0.0) {
            return (place){engine->feed.next,
                           fmax(0.0, engine->feed.at)}; /* it has turned, and
                                                           nothing is fed yet */
        }
        return (place){engine->feed.next + 1, 0.0};
    }
    const struct piece *piece = piece_at(engine, engine->plan.piece);
    if (!is_motion(piece) && !piece->inserted) {
        return (place){piece->origin + (piece->dir > 0 ? 0 : 1),
                       0.0}; /* fed before the last turn, it may be */
    }
    double s = piece->inserted ? piece->from
                               : piece->from + piece->dir * engine->plan.s;
    return s >= piece->whole - 1e-9 ? (place){piece->origin + 1, 0.0}
                                    : (place){piece->origin, fmax(0.0, s)};
}

static int wanted_direction(struct engine *engine) {
    return engine->store_kept && ATOMIC_GET(engine->backward_now) ? -1 : 1;
}

static bool on_shortcut(struct engine *engine) {
    return engine->plan.piece < engine->piece_head
           && piece_at(engine, engine->plan.piece)->shortcut
           && engine->plan.s > 0.0;
}

/* The axes stand beside the path, or on the line that leads them back to it. */
static bool off_path(struct engine *engine) {
    if (engine->feed.displaced) {
        return true;
    }
    for (uint64_t i = engine->plan.piece; i < engine->piece_head; i++) {
        if (is_motion(piece_at(engine, i))) {
            return piece_at(engine, i)->shortcut;
        }
    }
    return false;
}

static bool wants_turn(struct engine *engine) {
    int dir = wanted_direction(engine);
    if (dir == engine->feed.dir) {
        return false;
    }
    if (dir > 0) {
        return true;
    }
    if (off_path(engine)) {
        return false; /* what lies behind is left out */
    }
    place at = stand_place(engine);
    return at.s > 0.0 || at.i > feed_oldest(engine);
}

static bool wants_shortcut(struct engine *engine) {
    return engine->store_kept
           && ATOMIC_GET(engine->shortcut_requests) != engine->feed.shortcuts
           && engine->feed.dir > 0 && !on_shortcut(engine);
}

static bool wants_abort(struct engine *engine) {
    return ATOMIC_GET(engine->abort_now) == 1;
}

bool feed_job_pending(struct engine *e) {
    return wants_abort(e) || wants_turn(e) || wants_shortcut(e);
}

/* Nothing is left to stand in: an empty piece in its place tells where the path
 * stands, should it turn again. */
static void stand_at(struct engine *engine, place at) {
    struct piece *piece = piece_at(engine, engine->piece_head);
    memset(piece, 0, sizeof *piece);
    piece->kind = PIECE_EVENT;
    piece->type = NC_FLUSH;
    piece->dir = 1;
    piece->inserted = true;
    piece->origin = at.i;
    piece->from = at.s;
    piece->whole = INFINITY;
}

/* The run ring goes on with new pieces; the one GEO stands in is left as it is.
 */
static void begin_run(struct engine *engine, place at) {
    bool stands_in_piece = engine->plan.piece < engine->piece_head;
    feed_cut(engine, stands_in_piece ? engine->plan.piece : engine->piece_head);
    if (!stands_in_piece) {
        stand_at(engine, at);
    }
    engine->plan.piece = engine->feed.run = ++engine->piece_head;
    engine->plan.s = engine->plan.v = 0.0;
    engine->planner->begin_run(engine);
    engine->feed.has_motion = engine->feed.stop = engine->feed.m01 = false;
}

static void turn(struct engine *engine) {
    place at = stand_place(engine);
    if (engine->feed.dir > 0 && at.i > engine->feed.frontier) {
        engine->feed.frontier = at.i;
    }
    begin_run(engine, at);
    engine->feed.dir = -engine->feed.dir;
    engine->feed.next = engine->feed.dir > 0 || at.s > 0.0 ? at.i : at.i - 1;
    engine->feed.at = at.s > 0.0 ? at.s : -1.0;
}

/* A marker of #DEL DIST2GO that the PLC has made valid. */
static bool is_end_mark(struct engine *engine, const struct piece *piece) {
    return piece->kind == PIECE_EVENT && piece->type == NC_EVENT
           && piece->code == NC_EVENT_DIST2GO_END
           && ((uint32_t)piece->value & ATOMIC_GET(engine->shortcut_mask));
}

/* Last piece of the block of motion i, as far as it is prepared. */
static uint64_t block_end(struct engine *engine, uint64_t i, uint64_t head) {
    uint32_t count = store_at(engine, i)->count;
    for (uint64_t k = i + 1; k < head && store_at(engine, k)->count == count;
         k++) {
        if (is_motion(store_at(engine, k))) {
            i = k;
        }
    }
    return i;
}

/* The end of the next motion block; with end marks made valid, the first place
 * so marked. A loop is not left. */
static target shortcut_target(struct engine *engine, place at, uint64_t head) {
    target block = {head, false}, before = {at.i, at.s > 0.0};
    if (at.s > 0.0) {
        before.piece = block_end(engine, at.i, head);
    }
    for (uint64_t k = at.s > 0.0 ? before.piece + 1 : at.i; k < head; k++) {
        const struct piece *piece = store_at(engine, k);
        if (is_end_mark(engine, piece)) {
            return before;
        }
        if (piece->type == NC_RT_LOOP_END || piece->type == NC_RT_LOOP_BEGIN) {
            break;
        }
        if (!is_motion(piece)) {
            continue;
        }
        before = (target){k, true};
        if (!block.found) {
            block = (target){block_end(engine, k, head), true};
        }
        if (!ATOMIC_GET(engine->shortcut_mask)) {
            break;
        }
    }
    return block;
}

/* The rest of a piece is left out, with nothing in its place. */
static void feed_nothing(struct engine *engine, uint64_t i) {
    struct piece *piece = feed_copy(engine, store_at(engine, i));
    piece->kind = PIECE_EVENT;
    piece->type = NC_FLUSH;
    piece->length = piece->whole = 0.0;
    piece->gated = piece->stop_before = piece->m01 = false;
    feed_publish(engine);
}

/* Whether more rows may come that the shortcut could lead to. */
static bool rows_to_come(struct engine *engine) {
    return !ATOMIC_GET(engine->finished) && !ATOMIC_GET(engine->expect_drain)
           && ring_has_room(engine);
}

/* Leave out what lies between here and the target but for its events, then a
 * straight line. */
static void shortcut(struct engine *engine) {
    uint32_t request = ATOMIC_GET(engine->shortcut_requests);
    uint64_t head = ATOMIC_GET(engine->store_head);
    place at = stand_place(engine);
    target to = shortcut_target(engine, at, head);
    if (!to.found && rows_to_come(engine)) {
        return;
    }
    begin_run(engine, at);
    engine->feed.at = -1.0;
    engine->feed.next = at.i;
    engine->feed.displaced |= to.found || at.s > 0.0;
    uint64_t end = to.found ? to.piece : at.i;
    while (engine->feed.next
           < end) { /* events keep their order and their effect */
        const struct piece *piece = store_at(engine, engine->feed.next);
        if (is_motion(piece)) {
            engine->feed.next++;
        } else {
            feed_event(engine, piece);
        }
    }
    if (to.found) {
        feed_motion(engine, store_at(engine, end));
        ATOMIC_SET(engine->store_first, end + 1);
    } else if (at.s > 0.0) {
        feed_nothing(engine, at.i);
        engine->feed.next++;
        ATOMIC_SET(engine->store_first, at.i + 1);
    }
    ATOMIC_SET(engine->feed.shortcuts, request);
}

/* The program ends here: everything that is left is left out. */
static void leave_out_rest(struct engine *engine) {
    uint64_t head = ATOMIC_GET(engine->store_head);
    place at = stand_place(engine);
    bool left = at.i < head;
    engine->halt_row = left ? store_at(engine, at.i)->row : engine->rows_taken;
    engine->halt_s = left ? at.s : 0.0;
    engine->halt_whole = left ? store_at(engine, at.i)->whole : 0.0;
    begin_run(engine, (place){head, 0.0});
    engine->feed.dir = 1;
    engine->feed.next = head;
    engine->feed.at = -1.0;
    engine->feed.frontier = head;
    engine->feed.in_loop = engine->feed.displaced = false;
    if (head > ATOMIC_GET(engine->store_done)) {
        feed_nothing(engine, head - 1);
        piece_at(engine, engine->piece_head - 1)->flags = 0;
    }
    ATOMIC_SET(engine->abort_now, 2);
}

void feed_begin_program(struct engine *engine) {
    begin_run(engine, (place){ATOMIC_GET(engine->store_head), 0.0});
    memset(&engine->feed.pushed, 0, sizeof engine->feed.pushed);
    engine->feed.dir = 1;
    engine->feed.next = engine->feed.frontier = engine->feed.program_first =
        engine->store_head;
    engine->feed.at = -1.0;
    engine->feed.in_loop = engine->feed.displaced = false;
    ATOMIC_SET(engine->withdraw, WITHDRAW_NONE);
}

void feed_do_jobs(struct engine *engine) {
    if (wants_abort(engine)) {
        leave_out_rest(engine);
    } else if (wants_turn(engine)) {
        turn(engine);
    } else if (wants_shortcut(engine)) {
        shortcut(engine);
    }
}
