/* The dispatch: copies pieces of the store into the run ring, in the order in
 * which they are to be driven.
 *
 * The store is the program; the run ring is what is done with it. Ordinarily
 * both run alike. Real-time loops feed their body again, backward motion feeds
 * pieces in reverse, a stop that the PLC inserts cuts one in two, a shortcut
 * leaves some out. The planner's thread runs it. What has been
 * committed is never changed, nor is anything that the stored stopping tail
 * runs over: so a tail stays true whatever is fed anew, and every change leaves
 * room to stop.
 */
#include <math.h>
#include "engine/run/dispatch.h"
#include "engine/commit/planner.h"
#include "engine/path/piece.h"
#include "engine/run/inserted_stop.h"
#include "engine/run/run_ring.h"
#include "engine/state/state.h"
#include "engine/state/tuning.h"
#include "hli/sync.h"
#include "rows/nc_block.h"

/* Lowest piece of the store that is still needed: the backward store, or the
 * beginning of the loop being driven. */
static void set_store_floor(struct engine *engine) {
    uint64_t done = ATOMIC_GET(engine->store.done),
             kept =
                 engine->store.kept
                 + KEPT_BEHIND; /* curves are looked at behind the path too */
    uint64_t floor = done > kept ? done - kept : 0;
    if (engine->dispatch.next < floor) {
        floor = engine->dispatch.next;
    }
    if (engine->dispatch.in_loop && engine->dispatch.loop_begin < floor) {
        floor = engine->dispatch.loop_begin;
    }
    if (floor > engine->store.floor) {
        ATOMIC_SET(engine->store.floor, floor);
    }
}

/* Change of direction per axis between the piece before and this one. */
static void set_jump(struct engine *engine, struct piece *piece) {
    if (piece->stop_before || !engine->dispatch.has_motion) {
        return;
    }
    const struct piece *before =
        piece_at(&engine->run, engine->dispatch.last_motion);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        piece->jump[i] = fabs(piece->tangent_in[i] - before->tangent_out[i]);
    }
}

/* How a function acts on a stretch driven before: MOS, unless a flag asks for
 * more; simply repeated, as configured. */
static uint32_t synch_again(struct engine *engine, const struct piece *piece) {
    bool waits = piece->synch & ~(SYNCH_MOS | SYNCH_BWD | SYNCH_FWD);
    if (engine->dispatch.dir < 0) {
        return piece->synch & SYNCH_BWD ? SYNCH_MVS_SVS : SYNCH_MOS;
    }
    if (ATOMIC_GET(engine->orders.simulate) && !(piece->synch & SYNCH_FWD)) {
        return SYNCH_MOS;
    }
    return waits ? SYNCH_MVS_SVS : SYNCH_MOS;
}

/* Both ends of a real-time loop: at the one that comes first it is entered or
 * left out, at the other one repeated or left. */
static bool is_branch(const struct piece *piece) {
    return piece->kind == PIECE_EVENT
           && (piece->type == NC_RT_LOOP_END
               || piece->type == NC_RT_LOOP_BEGIN);
}

static bool is_entry(const struct piece *piece) {
    return (piece->type == NC_RT_LOOP_BEGIN) == (piece->dir > 0);
}

/* The other end of a real-time loop; of its beginning 0 as long as that end is
 * not prepared. */
static uint64_t loop_mate(struct engine *engine, const struct piece *piece) {
    return ATOMIC_GET(store_at(&engine->store, piece->origin)->mate);
}

/* Whether a loop is driven (once more); one without a path would never end. One
 * whose end is not prepared, nor will be, cannot be left out. */
static bool loop_wanted(struct engine *engine, const struct piece *piece) {
    /* the beginning, which may be the store's first row, is always prepared */
    if (piece->type == NC_RT_LOOP_BEGIN && !loop_mate(engine, piece)) {
        return true;
    }
    return ATOMIC_GET(engine->orders.rt_loop)
           && store_at(&engine->store, piece->origin)->value > 0.0;
}

static void decide_branch(struct engine *engine,
                          struct piece *piece,
                          bool again) {
    struct dispatch *dispatch = &engine->dispatch;
    uint64_t from =
        again == is_entry(piece) ? piece->origin : loop_mate(engine, piece);
    piece->again = again;
    dispatch->next = from + (uint64_t)piece->dir;
    dispatch->at = -1.0;
    dispatch->in_loop = true; /* until the path has passed the decision */
}

/* A loop that is not wanted can be left out only when its end is prepared. */
static bool loop_to_come(struct engine *engine,
                         const struct piece *from,
                         bool finished) {
    return from->type == NC_RT_LOOP_BEGIN && engine->dispatch.dir > 0
           && !finished && !ATOMIC_GET(engine->orders.rt_loop)
           && !ATOMIC_GET(store_at(&engine->store, from->origin)->mate);
}

/* Where the stopping tail runs over a decision that has changed, a shorter one
 * may leave it open. */
static void free_decisions(struct engine *engine) {
    for (uint64_t i = engine->commit.piece + 1, end = run_first_free(engine);
         i < end && i < engine->run.head;
         i++) {
        const struct piece *piece = piece_at(&engine->run, i);
        if (!is_branch(piece) || piece->again == loop_wanted(engine, piece)) {
            continue;
        }
        engine->planner->shorten_tail(engine);
        return;
    }
}

/* The condition of a loop may have changed since its end was fed. */
static void reconsider_loop(struct engine *engine) {
    bool ahead = false;
    free_decisions(engine);
    for (uint64_t i = run_first_free(engine); i < engine->run.head; i++) {
        struct piece *piece = piece_at(&engine->run, i);
        if (!is_branch(piece)) {
            continue;
        }
        ahead = true;
        bool again = loop_wanted(engine, piece);
        if (piece->again == again) {
            continue;
        }
        run_cut(engine, i + 1);
        decide_branch(engine, piece, again);
        return;
    }
    uint64_t mate =
        ATOMIC_GET(store_at(&engine->store, engine->dispatch.loop_begin)->mate);
    if (!ahead) {
        engine->dispatch.in_loop =
            engine->dispatch.next >= engine->dispatch.loop_begin
            && (!mate || engine->dispatch.next <= mate);
    }
}

static double piece_end(const struct dispatch *dispatch,
                        const struct piece *from) {
    return dispatch->dir > 0 ? from->whole : 0.0;
}

/* The part of `from` that is driven from `begin` on. */
static void dispatch_part(struct engine *engine,
                          struct piece *piece,
                          const struct piece *from,
                          double begin) {
    bool whole = engine->dispatch.dir > 0 && begin <= 0.0;
    if (engine->dispatch.displaced) {
        piece_shortcut(engine,
                       piece,
                       engine->dispatch.stand,
                       load_f64_relaxed(&engine->geo.path)
                           - load_f64_relaxed(&engine->geo.path_shift),
                       load_f64_relaxed(&engine->geo.dist));
        engine->dispatch.displaced = false;
        return;
    }
    if (whole) {
        return;
    }
    piece_cut(engine, piece, begin, piece_end(&engine->dispatch, from));
    piece->stop_before = piece->m01 = piece->gated = false;
    if (engine->dispatch.dir < 0) {
        piece->stop_after = false;
    }
    if (engine->dispatch.dir < 0 && engine->cfg.retrace_feed > 0.0) {
        piece->feed = engine->cfg.retrace_feed;
    }
    piece->new_block =
        engine->dispatch.has_motion
        && piece_at(&engine->run, engine->dispatch.last_motion)->count
               != piece->count;
}

void dispatch_motion(struct engine *engine, const struct piece *from) {
    struct piece *piece = run_copy(&engine->run, from);
    double begin = engine->dispatch.at >= 0.0 ? engine->dispatch.at
                   : engine->dispatch.dir > 0 ? 0.0
                                              : from->whole;
    dispatch_part(engine, piece, from, begin);
    if (from->origin < engine->dispatch.frontier) {
        piece->gated = false;
    }
    double stop = engine->dispatch.dir > 0 && !piece->shortcut
                      ? inserted_stop_in(engine, piece, 0.0)
                      : -1.0;
    bool cut = stop >= 0.0 && stop < piece->length - 1e-9;
    if (cut) {
        run_shorten(engine, piece, stop);
    }
    piece->stop_before |= !engine->dispatch.has_motion || engine->dispatch.stop;
    piece->m01 |= engine->dispatch.m01;
    engine->dispatch.stop = engine->dispatch.m01 = false;
    set_jump(engine, piece);
    engine->dispatch.last_motion = engine->run.head;
    engine->dispatch.has_motion = true;
    run_publish(&engine->run);
    engine->dispatch.at = cut ? piece->from + piece->length : -1.0;
    if (!cut) {
        engine->dispatch.next += (uint64_t)engine->dispatch.dir;
    }
    if (stop >= 0.0) {
        insert_stop(engine, piece);
    }
}

/* Events that mean nothing on a stretch that has been driven before. */
static bool passes_by(const struct engine *engine, const struct piece *piece) {
    switch (piece->type) {
    case NC_RT_LOOP_BEGIN:
    case NC_RT_LOOP_END:
    case NC_DISTANCE_RESET:
        return false;
    case NC_DWELL:
        return engine->dispatch.dir < 0;
    case NC_M:
        return engine->dispatch.dir < 0 || ATOMIC_GET(engine->orders.simulate);
    default:
        return true;
    }
}

void dispatch_event(struct engine *engine, const struct piece *from) {
    bool again =
        engine->dispatch.dir < 0 || from->origin < engine->dispatch.frontier;
    uint64_t next = engine->dispatch.next + (uint64_t)engine->dispatch.dir;
    engine->dispatch.at = -1.0;
    engine->dispatch.next = next;
    if (again && (from->flags & NC_OUTPUT)) {
        if (from->type != NC_T) {
            run_function(engine, from, synch_again(engine, from));
        }
        return;
    }
    if (again && passes_by(engine, from)) {
        return;
    }
    struct piece *piece = run_copy(&engine->run, from);
    piece->dir = (int8_t)engine->dispatch.dir;
    if (piece->dir < 0) {
        piece->stop_before = piece->m01 = false;
    }
    if (is_branch(piece)) {
        engine->dispatch.loop_begin =
            piece->type == NC_RT_LOOP_BEGIN ? piece->origin : piece->mate;
        decide_branch(engine, piece, loop_wanted(engine, piece));
    }
    run_publish(&engine->run);
}

uint64_t dispatch_oldest(struct engine *engine) {
    uint64_t kept = engine->dispatch.frontier > engine->store.kept
                        ? engine->dispatch.frontier - engine->store.kept
                        : 0,
             first = ATOMIC_GET(engine->store.first);
    if (kept < engine->dispatch.program_first) {
        kept = engine->dispatch.program_first;
    }
    return first > kept ? first : kept;
}

static bool can_dispatch(struct engine *engine, uint64_t head, bool finished) {
    if (engine->dispatch.dir < 0) {
        return engine->dispatch.next != UINT64_MAX
               && engine->dispatch.next >= dispatch_oldest(engine);
    }
    return engine->dispatch.next < head
           && !loop_to_come(engine,
                            store_at(&engine->store, engine->dispatch.next),
                            finished);
}

/* Neither the piece that is copied next nor its place in the ring has been
 * touched for a long time. */
static void prefetch_next(struct engine *engine) {
    const char *from = (const char *)store_at(
                   &engine->store,
                   engine->dispatch.next
                       + (uint64_t)(2 * engine->dispatch.dir)),
               *to = (const char *)piece_at(&engine->run, engine->run.head + 1);
    for (size_t at = 0; at < sizeof(struct piece); at += 64) {
        __builtin_prefetch(from + at, 0);
        __builtin_prefetch(to + at, 1);
    }
}

static void dispatch_next(struct engine *engine) {
    const struct piece *from = store_at(&engine->store, engine->dispatch.next);
    if (is_motion(from)) {
        dispatch_motion(engine, from);
    } else {
        dispatch_event(engine, from);
    }
}

static uint64_t fed_ahead(const struct engine *engine) {
    return engine->cfg.window
           + (engine->dispatch.in_loop
                  ? LOOP_AHEAD
                  : engine->traits.fed_ahead + engine->dispatch.reach);
}

static bool wants_more(struct engine *engine) {
    return engine->run.head - engine->commit.piece < fed_ahead(engine)
           && run_has_room(&engine->run)
           && engine->stops.fed - ATOMIC_GET(engine->stops.done) < STOPS_MAX;
}

/* Nothing has changed but the path: without jerk some pieces are fed at a time.
 */
static bool dispatch_waits(struct engine *engine,
                           bool finished,
                           bool draining,
                           uint64_t head) {
    const struct dispatch *dispatch = &engine->dispatch;
    if (!engine->traits.feeds_in_batches || dispatch->in_loop
        || dispatch->dir < 0) {
        return false;
    }
    if (dispatch->armed
        || ATOMIC_GET(engine->orders.insert_requests) != dispatch->inserts) {
        return false;
    }
    bool all = dispatch->next >= head;
    return dispatch->final == (finished && all)
           && dispatch->ends == (all && (finished || draining))
           && (dispatch->next >= head
               || engine->run.head - engine->commit.piece + FED_AT_ONCE
                      > fed_ahead(engine));
}

/* Behind a turn forward the path has come to its end again. */
static void note_driven(struct engine *engine) {
    if (engine->dispatch.drives_on && engine->dispatch.final
        && ATOMIC_GET(engine->run.done) >= engine->run.head) {
        ATOMIC_SET(engine->dispatch.drives_on, 0);
    }
}

void dispatch_path(struct engine *engine) {
    note_driven(engine);
    bool finished = ATOMIC_GET(
        engine->program
            .finished); /* before the head: nothing is pushed behind it */
    bool draining = ATOMIC_GET(engine->program.expect_drain);
    uint64_t head = ATOMIC_GET(engine->store.head);
    draining = draining
               && ATOMIC_GET(engine->program.drain_at)
                      == head; /* else it has ended meanwhile */
    if (dispatch_waits(engine, finished, draining, head)) {
        set_store_floor(engine);
        return;
    }
    if (engine->dispatch.in_loop) {
        reconsider_loop(engine);
    }
    take_insert(engine);
    while (can_dispatch(engine, head, finished) && wants_more(engine)) {
        prefetch_next(engine);
        dispatch_next(engine);
    }
    engine->dispatch.final = engine->dispatch.dir < 0
                                 ? !can_dispatch(engine, head, finished)
                                 : finished && engine->dispatch.next >= head;
    engine->dispatch.ends = engine->dispatch.final
                            || (draining && engine->dispatch.dir >= 0
                                && engine->dispatch.next >= head);
    insert_stop_at_end(engine);
    set_store_floor(engine);
}

bool dispatch_further(struct engine *engine) {
    if (engine->dispatch.reach || engine->dispatch.in_loop) {
        return false;
    }
    uint64_t head = engine->run.head;
    engine->dispatch.reach = FED_AHEAD - FED_NEAR;
    dispatch_path(engine);
    return engine->run.head > head;
}
