/* The dispatch's jobs that need standstill: turning back, leaving out what is
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
    bool forward = engine->dispatch.dir > 0;
    if (engine->commit.piece >= engine->run.head) {
        if (forward || engine->dispatch.at >= 0.0) {
            return (place){
                engine->dispatch.next,
                fmax(0.0, engine->dispatch.at)}; /* it has turned, and
                                                nothing is fed yet */
        }
        return (place){engine->dispatch.next + 1, 0.0};
    }
    const struct piece *piece = piece_at(&engine->run, engine->commit.piece);
    if (!is_motion(piece) && !piece->inserted) {
        return (place){piece->origin + (piece->dir > 0 ? 0 : 1),
                       0.0}; /* fed before the last turn, it may be */
    }
    double s = piece->inserted ? piece->from
                               : piece->from + piece->dir * engine->commit.s;
    return s >= piece->whole - 1e-9 ? (place){piece->origin + 1, 0.0}
                                    : (place){piece->origin, fmax(0.0, s)};
}

static int wanted_direction(struct engine *engine) {
    return engine->store.kept && ATOMIC_GET(engine->orders.backward) ? -1 : 1;
}

static bool on_shortcut(struct engine *engine) {
    return engine->commit.piece < engine->run.head
           && piece_at(&engine->run, engine->commit.piece)->shortcut
           && engine->commit.s > 0.0;
}

/* The axes stand beside the path, or on the line that leads them back to it. */
static bool off_path(struct engine *engine) {
    if (engine->dispatch.displaced) {
        return true;
    }
    for (uint64_t i = engine->commit.piece; i < engine->run.head; i++) {
        if (is_motion(piece_at(&engine->run, i))) {
            return piece_at(&engine->run, i)->shortcut;
        }
    }
    return false;
}

static bool wants_turn(struct engine *engine) {
    int dir = wanted_direction(engine);
    if (dir == engine->dispatch.dir) {
        return false;
    }
    if (dir > 0) {
        return true;
    }
    if (off_path(engine)) {
        return false; /* what lies behind is left out */
    }
    place at = stand_place(engine);
    return at.s > 0.0 || at.i > dispatch_oldest(engine);
}

static bool wants_shortcut(struct engine *engine) {
    return engine->store.kept
           && ATOMIC_GET(engine->orders.shortcut_requests)
                  != engine->dispatch.shortcuts
           && engine->dispatch.dir > 0 && !on_shortcut(engine);
}

static bool wants_abort(struct program_state *program) {
    return ATOMIC_GET(program->abort) == ABORT_ASKED;
}

bool standstill_job_pending(struct engine *engine) {
    return wants_abort(&engine->program) || wants_turn(engine)
           || wants_shortcut(engine);
}

/* Nothing is left to stand in: an empty piece in its place tells where the path
 * stands, should it turn again. */
static void stand_at(struct run_ring *run, place at) {
    const struct piece empty = {.kind = PIECE_EVENT,
                                .type = NC_FLUSH,
                                .dir = 1,
                                .inserted = true,
                                .origin = at.i,
                                .from = at.s,
                                .whole = INFINITY};
    run_copy(run, &empty);
}

/* The run ring goes on with new pieces; the one GEO stands in is left as it is.
 */
static void begin_run(struct engine *engine, place at) {
    bool stands_in_piece = engine->commit.piece < engine->run.head;
    memcpy(engine->dispatch.stand,
           engine->geo.position,
           sizeof engine->dispatch.stand);
    run_cut(engine, stands_in_piece ? engine->commit.piece : engine->run.head);
    if (!stands_in_piece) {
        stand_at(&engine->run, at);
    }
    run_publish(&engine->run);
    engine->commit.piece = engine->dispatch.run = engine->run.head;
    engine->commit.s = engine->commit.v = 0.0;
    engine->planner->begin_run(engine);
    engine->dispatch.has_motion = engine->dispatch.stop = engine->dispatch.m01 =
        false;
}

static void turn(struct engine *engine) {
    place at = stand_place(engine);
    if (engine->dispatch.dir > 0 && at.i > engine->dispatch.frontier) {
        engine->dispatch.frontier = at.i;
    }
    begin_run(engine, at);
    engine->dispatch.final = engine->dispatch.ends = false;
    bool more = at.i < ATOMIC_GET(engine->store.head);
    ATOMIC_SET(engine->dispatch.drives_on, more && engine->dispatch.dir < 0);
    ATOMIC_SET(engine->dispatch.dir, -engine->dispatch.dir);
    engine->dispatch.next =
        engine->dispatch.dir > 0 || at.s > 0.0 ? at.i : at.i - 1;
    engine->dispatch.at = at.s > 0.0 ? at.s : -1.0;
}

/* A marker of #DEL DIST2GO that the PLC has made valid. */
static bool is_end_mark(struct orders *orders, const struct piece *piece) {
    return piece->kind == PIECE_EVENT && piece->type == NC_EVENT
           && piece->code == NC_EVENT_DIST2GO_END
           && ((uint32_t)piece->value & ATOMIC_GET(orders->shortcut_mask));
}

/* Last piece of the block of motion i, as far as it is prepared. */
static uint64_t block_end(struct piece_store *store,
                          uint64_t i,
                          uint64_t head) {
    uint32_t count = store_at(store, i)->count;
    for (uint64_t k = i + 1; k < head && store_at(store, k)->count == count;
         k++) {
        if (is_motion(store_at(store, k))) {
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
        before.piece = block_end(&engine->store, at.i, head);
    }
    for (uint64_t k = at.s > 0.0 ? before.piece + 1 : at.i; k < head; k++) {
        const struct piece *piece = store_at(&engine->store, k);
        if (is_end_mark(&engine->orders, piece)) {
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
            block = (target){block_end(&engine->store, k, head), true};
        }
        if (!ATOMIC_GET(engine->orders.shortcut_mask)) {
            break;
        }
    }
    return block;
}

/* The rest of a piece is left out, with nothing in its place. */
static void dispatch_nothing(struct engine *engine, uint64_t i) {
    struct piece *piece = run_copy(&engine->run, store_at(&engine->store, i));
    piece->kind = PIECE_EVENT;
    piece->type = NC_FLUSH;
    piece->length = piece->whole = 0.0;
    piece->gated = piece->stop_before = piece->m01 = false;
    run_publish(&engine->run);
}

/* Whether more rows may come that the shortcut could lead to. */
static bool rows_to_come(struct engine *engine) {
    return !ATOMIC_GET(engine->program.finished)
           && !ATOMIC_GET(engine->program.expect_drain)
           && store_has_room(engine);
}

/* Leave out what lies between here and the target but for its events, then a
 * straight line. */
static void shortcut(struct engine *engine) {
    uint32_t request = ATOMIC_GET(engine->orders.shortcut_requests);
    uint64_t head = ATOMIC_GET(engine->store.head);
    place at = stand_place(engine);
    target to = shortcut_target(engine, at, head);
    if (!to.found && rows_to_come(engine)) {
        return;
    }
    begin_run(engine, at);
    engine->dispatch.at = -1.0;
    engine->dispatch.next = at.i;
    engine->dispatch.displaced |= to.found || at.s > 0.0;
    uint64_t end = to.found ? to.piece : at.i;
    while (engine->dispatch.next
           < end) { /* events keep their order and their effect */
        const struct piece *piece =
            store_at(&engine->store, engine->dispatch.next);
        if (is_motion(piece)) {
            engine->dispatch.next++;
        } else {
            dispatch_event(engine, piece);
        }
    }
    if (to.found) {
        dispatch_motion(engine, store_at(&engine->store, end));
        ATOMIC_SET(engine->store.first, end + 1);
    } else if (at.s > 0.0) {
        dispatch_nothing(engine, at.i);
        engine->dispatch.next++;
        ATOMIC_SET(engine->store.first, at.i + 1);
    }
    ATOMIC_SET(engine->dispatch.shortcuts, request);
}

/* Where the path stands when the rest is left out. */
static void note_halt(struct program_state *program,
                      const struct piece_store *store,
                      place at,
                      uint64_t head) {
    program->halt_piece = at.i;
    program->halt_s = at.s;
    program->halt_whole = at.i < head ? store_at(store, at.i)->whole : 0.0;
}

/* The program ends here: everything that is left is left out. The path does not
 * turn back to it. */
static void leave_out_remainder(struct engine *engine) {
    uint64_t head = ATOMIC_GET(engine->store.head);
    place at = stand_place(engine);
    note_halt(&engine->program, &engine->store, at, head);
    begin_run(engine, (place){head, 0.0});
    ATOMIC_SET(engine->store.first, head);
    ATOMIC_SET(engine->dispatch.drives_on, 0);
    ATOMIC_SET(engine->dispatch.dir, 1);
    engine->dispatch.next = head;
    engine->dispatch.at = -1.0;
    engine->dispatch.frontier = head;
    engine->dispatch.in_loop = engine->dispatch.displaced = false;
    if (head > ATOMIC_GET(engine->store.done)) {
        dispatch_nothing(engine, head - 1);
        piece_at(&engine->run, engine->run.head - 1)->flags = 0;
    }
    ATOMIC_SET(engine->program.abort, ABORT_DONE);
}

void dispatch_begin_program(struct engine *engine) {
    begin_run(engine, (place){ATOMIC_GET(engine->store.head), 0.0});
    memset(&engine->dispatch.pushed, 0, sizeof engine->dispatch.pushed);
    ATOMIC_SET(engine->dispatch.drives_on, 0);
    ATOMIC_SET(engine->dispatch.dir, 1);
    engine->dispatch.next = engine->dispatch.frontier =
        engine->dispatch.program_first = engine->store.head;
    engine->dispatch.at = -1.0;
    engine->dispatch.in_loop = engine->dispatch.displaced = false;
    ATOMIC_SET(engine->withdrawal.state, WITHDRAW_NONE);
}

void do_standstill_jobs(struct engine *engine) {
    if (wants_abort(&engine->program)) {
        leave_out_remainder(engine);
    } else if (wants_turn(engine)) {
        turn(engine);
    } else if (wants_shortcut(engine)) {
        shortcut(engine);
    }
}
