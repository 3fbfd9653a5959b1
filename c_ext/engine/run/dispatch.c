/* The feeder: copies pieces of the store into the run ring, in the order in
 * which they are to be driven.
 *
 * The store is the program; the run ring is what is done with it. Ordinarily
 * both run alike. Real-time loops feed their body again, backward motion feeds
 * pieces in reverse, a stop that the PLC inserts cuts one in two, a shortcut
 * leaves some out. The planner's thread runs the feeder. What has been
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
#include "rows/nc_block.h"

#define FED_AT_ONCE 8u /* ... of which so many may be missing ... */
#define LOOP_AHEAD                                                             \
    8u /* the same inside a real-time loop, whose end is decided as late as    \
          possible */

/* Lowest piece of the store that is still needed: the backward store, or the
 * beginning of the loop being driven. */
static void feed_store_floor(struct engine *engine) {
    uint64_t done = ATOMIC_GET(engine->store_done),
             kept =
                 engine->store_kept
                 + KEPT_BEHIND; /* curves are looked at behind the path too */
    uint64_t floor = done > kept ? done - kept : 0;
    if (engine->feed.next < floor) {
        floor = engine->feed.next;
    }
    if (engine->feed.in_loop && engine->feed.loop_begin < floor) {
        floor = engine->feed.loop_begin;
    }
    if (floor > engine->store_floor) {
        ATOMIC_SET(engine->store_floor, floor);
    }
}

/* Change of direction per axis between the piece before and this one. */
static void set_jump(struct engine *engine, struct piece *piece) {
    if (piece->stop_before || !engine->feed.has_motion) {
        return;
    }
    const struct piece *before = piece_at(engine, engine->feed.last_motion);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        piece->jump[i] = fabs(piece->tangent_in[i] - before->tangent_out[i]);
    }
}

/* How a function acts on a stretch driven before: MOS, unless a flag asks for
 * more; simply repeated, as configured. */
static uint32_t synch_again(struct engine *engine, const struct piece *piece) {
    bool waits = piece->synch & ~(SYNCH_MOS | SYNCH_BWD | SYNCH_FWD);
    if (engine->feed.dir < 0) {
        return piece->synch & SYNCH_BWD ? SYNCH_MVS_SVS : SYNCH_MOS;
    }
    if (ATOMIC_GET(engine->simulate_now) && !(piece->synch & SYNCH_FWD)) {
        return SYNCH_MOS;
    }
    return waits ? SYNCH_MVS_SVS : SYNCH_MOS;
}

static bool is_branch(const struct piece *piece) {
    return piece->kind == PIECE_EVENT
           && piece->type
                  == (piece->dir > 0 ? NC_RT_LOOP_END : NC_RT_LOOP_BEGIN);
}

/* Whether a loop is driven once more; one without a path would never end. */
static bool loop_wanted(struct engine *engine, const struct piece *piece) {
    return ATOMIC_GET(engine->rt_loop_now) && piece->value > 0.0;
}

static void decide_branch(struct engine *engine,
                          struct piece *piece,
                          bool again) {
    piece->again = again;
    engine->feed.next = again ? piece->mate + (uint64_t)piece->dir
                              : piece->origin + (uint64_t)piece->dir;
    engine->feed.at = -1.0;
    engine->feed.in_loop = true; /* until the path has passed the decision */
}

/* Where the stopping tail runs over a decision that has changed, a shorter one
 * may leave it open. */
static void free_decisions(struct engine *engine) {
    for (uint64_t i = engine->plan.piece + 1, end = feed_first_free(engine);
         i < end && i < engine->piece_head;
         i++) {
        const struct piece *piece = piece_at(engine, i);
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
    for (uint64_t i = feed_first_free(engine); i < engine->piece_head; i++) {
        struct piece *piece = piece_at(engine, i);
        if (!is_branch(piece)) {
            continue;
        }
        ahead = true;
        bool again = loop_wanted(engine, piece);
        if (piece->again == again) {
            continue;
        }
        feed_cut(engine, i + 1);
        decide_branch(engine, piece, again);
        return;
    }
    const struct piece *begin = store_at(engine, engine->feed.loop_begin);
    if (!ahead) {
        engine->feed.in_loop =
            engine->feed.next >= engine->feed.loop_begin
            && (!begin->mate || engine->feed.next <= begin->mate);
    }
}

static double piece_end(const struct engine *engine, const struct piece *from) {
    return engine->feed.dir > 0 ? from->whole : 0.0;
}

/* The part of `from` that is driven from `begin` on. */
static void feed_part(struct engine *engine,
                      struct piece *piece,
                      const struct piece *from,
                      double begin) {
    bool whole = engine->feed.dir > 0 && begin <= 0.0;
    if (engine->feed.displaced) {
        piece_shortcut(engine,
                       piece,
                       engine->geo.position,
                       engine->geo.path - engine->geo.path_shift,
                       engine->geo.dist);
        engine->feed.displaced = false;
        return;
    }
    if (whole) {
        return;
    }
    piece_cut(engine, piece, begin, piece_end(engine, from));
    piece->stop_before = piece->m01 = piece->gated = false;
    if (engine->feed.dir < 0) {
        piece->stop_after = false;
    }
    if (engine->feed.dir < 0 && engine->cfg.retrace_feed > 0.0) {
        piece->feed = engine->cfg.retrace_feed;
    }
    piece->new_block =
        engine->feed.has_motion
        && piece_at(engine, engine->feed.last_motion)->count != piece->count;
}

void feed_motion(struct engine *engine, const struct piece *from) {
    struct piece *piece = feed_copy(engine, from);
    double begin = engine->feed.at >= 0.0 ? engine->feed.at
                   : engine->feed.dir > 0 ? 0.0
                                          : from->whole;
    feed_part(engine, piece, from, begin);
    if (from->origin < engine->feed.frontier) {
        piece->gated = false;
    }
    double stop = engine->feed.dir > 0 && !piece->shortcut
                      ? feed_stop_in(engine, piece, 0.0)
                      : -1.0;
    bool cut = stop >= 0.0 && stop < piece->length - 1e-9;
    if (cut) {
        feed_shorten(engine, piece, stop);
    }
    piece->stop_before |= !engine->feed.has_motion || engine->feed.stop;
    piece->m01 |= engine->feed.m01;
    engine->feed.stop = engine->feed.m01 = false;
    set_jump(engine, piece);
    engine->feed.last_motion = engine->piece_head;
    engine->feed.has_motion = true;
    feed_publish(engine);
    engine->feed.at = cut ? piece->from + piece->length : -1.0;
    if (!cut) {
        engine->feed.next += (uint64_t)engine->feed.dir;
    }
    if (stop >= 0.0) {
        feed_stop(engine, piece);
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
        return engine->feed.dir < 0;
    case NC_M:
        return engine->feed.dir < 0 || ATOMIC_GET(engine->simulate_now);
    default:
        return true;
    }
}

void feed_event(struct engine *engine, const struct piece *from) {
    bool again = engine->feed.dir < 0 || from->origin < engine->feed.frontier;
    uint64_t next = engine->feed.next + (uint64_t)engine->feed.dir;
    engine->feed.at = -1.0;
    engine->feed.next = next;
    if (again && (from->flags & NC_OUTPUT)) {
        if (from->type != NC_T) {
            feed_function(engine, from, synch_again(engine, from));
        }
        return;
    }
    if (again && passes_by(engine, from)) {
        return;
    }
    struct piece *piece = feed_copy(engine, from);
    piece->dir = (int8_t)engine->feed.dir;
    if (piece->dir < 0) {
        piece->stop_before = piece->m01 = false;
    }
    if (piece->type == NC_RT_LOOP_BEGIN || piece->type == NC_RT_LOOP_END) {
        engine->feed.in_loop = true;
        engine->feed.loop_begin =
            piece->type == NC_RT_LOOP_BEGIN ? piece->origin : piece->mate;
    }
    if (is_branch(piece)) {
        decide_branch(engine, piece, loop_wanted(engine, piece));
    }
    feed_publish(engine);
}

/* Backward motion ends here. */
uint64_t feed_oldest(struct engine *engine) {
    uint64_t kept = engine->feed.frontier > engine->store_kept
                        ? engine->feed.frontier - engine->store_kept
                        : 0,
             first = ATOMIC_GET(engine->store_first);
    if (kept < engine->feed.program_first) {
        kept = engine->feed.program_first;
    }
    return first > kept ? first : kept;
}

static bool can_feed(struct engine *engine, uint64_t head) {
    if (engine->feed.dir < 0) {
        return engine->feed.next != UINT64_MAX
               && engine->feed.next >= feed_oldest(engine);
    }
    return engine->feed.next < head;
}

/* Neither the piece that is copied next nor its place in the ring has been
 * touched for a long time. */
static void prefetch_next(struct engine *engine) {
    const char *from = (const char *)store_at(
                   engine,
                   engine->feed.next + (uint64_t)(2 * engine->feed.dir)),
               *to = (const char *)piece_at(engine, engine->piece_head + 1);
    for (size_t at = 0; at < sizeof(struct piece); at += 64) {
        __builtin_prefetch(from + at, 0);
        __builtin_prefetch(to + at, 1);
    }
}

static void feed_next(struct engine *engine) {
    const struct piece *from = store_at(engine, engine->feed.next);
    if (is_motion(from)) {
        feed_motion(engine, from);
    } else {
        feed_event(engine, from);
    }
}

static uint64_t fed_ahead(const struct engine *engine) {
    return engine->cfg.window
           + (engine->feed.in_loop
                  ? LOOP_AHEAD
                  : engine->traits.fed_ahead + engine->feed.reach);
}

static bool wants_more(struct engine *engine) {
    return engine->piece_head - engine->plan.piece < fed_ahead(engine)
           && run_has_room(engine)
           && engine->stops_fed - ATOMIC_GET(engine->stops_done) < STOPS_MAX;
}

/* Nothing has changed but the path: without jerk some pieces are fed at a time.
 */
static bool feed_waits(struct engine *engine, bool finished, uint64_t head) {
    const struct feeder *feeder = &engine->feed;
    if (!engine->traits.feeds_in_batches || feeder->in_loop || feeder->dir < 0
        || feeder->armed
        || ATOMIC_GET(engine->insert_requests) != feeder->inserts) {
        return false;
    }
    return feeder->final == (finished && feeder->next >= head)
           && (feeder->next >= head
               || engine->piece_head - engine->plan.piece + FED_AT_ONCE
                      > fed_ahead(engine));
}

/* Feed as far as the planner has to see. */
void feed(struct engine *engine) {
    bool finished = ATOMIC_GET(
        engine->finished); /* before the head: nothing is pushed behind it */
    uint64_t head = ATOMIC_GET(engine->store_head);
    if (feed_waits(engine, finished, head)) {
        feed_store_floor(engine);
        return;
    }
    if (engine->feed.in_loop) {
        reconsider_loop(engine);
    }
    feed_take_insert(engine);
    while (can_feed(engine, head) && wants_more(engine)) {
        prefetch_next(engine);
        feed_next(engine);
    }
    engine->feed.final = engine->feed.dir < 0
                             ? !can_feed(engine, head)
                             : finished && engine->feed.next >= head;
    feed_stop_at_end(engine);
    feed_store_floor(engine);
}

/* Corner limits look further than what is fed: feed more from now on. */
bool feed_further(struct engine *e) {
    if (e->feed.reach || e->feed.in_loop) {
        return false;
    }
    uint64_t head = e->piece_head;
    e->feed.reach = FED_AHEAD - FED_NEAR;
    feed(e);
    return e->piece_head > head;
}
