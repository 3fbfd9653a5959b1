/* GEO drives the stored tail, because the planner was late. It need not come to
 * rest for that: the planner, which is where the tail begins, follows its plan
 * to a place of the tail that is still ahead of GEO, and offers a commit that
 * goes on from there.
 *
 * GEO answers at the beginning of a cycle. If the place is ahead it makes the
 * offer its commit, drives the tail to there and goes on; until it has left the
 * tail, nothing else is committed, since the next tail would be written over
 * the one it drives. If not, the tail is driven to its end. Without jerk the
 * tail brakes from its beginning on: the place is nearer, and where it was
 * passed or what lies ahead cannot be met from it, a later one is tried.
 */
#include <math.h>
#include "engine/state/state.h"

#define THREAD_MARGIN_S                                                        \
    0.010 /* the place is so far ahead of GEO where the planner has its own    \
             thread, ... */
#define QUICK_MARGIN_S                                                         \
    0.004 /* ... without jerk, where plans take less time, ... */
#define MARGIN_CYCLES 3.0 /* ... and at least so many cycles */
#define LEAST_LEFT_CYCLES                                                      \
    5.0 /* of the tail behind it: for less it is driven to its end */
#define SHORTEST                                                               \
    0.05 /* of a cycle: no shorter part of a phase is left on either side */
#define SAME_TIME 1e-9 /* s */

typedef struct place {
    uint32_t phase;        /* of the tail */
    double t;              /* s of it */
    double at_s, motion_s; /* of the tail ahead of it: time, time in motion */
} place;

static double margin_s(struct engine *engine) {
    double least = MARGIN_CYCLES * engine->cfg.cycle_s;
    return ATOMIC_GET(engine->run_running)
               ? fmax(engine->drive.planner ? THREAD_MARGIN_S : QUICK_MARGIN_S,
                      least)
               : least;
}

/* The first place far enough ahead of GEO, inside a motion; false if too little
 * of the tail would be left. */
static bool find_place(struct engine *engine,
                       const struct tail *tail,
                       place *out) {
    double consumed, at = 0.0, motion = 0.0,
                     shortest = SHORTEST * engine->cfg.cycle_s;
    bool found = false;
    __atomic_load(&engine->geo.consumed_s, &consumed, __ATOMIC_ACQUIRE);
    double from = consumed + margin_s(engine) - engine->plan.committed_s;
    for (uint32_t i = tail->first; i < tail->count; i++) {
        const phase *ph = &tail->phases[i];
        bool moves = is_motion(piece_at(engine, ph->piece));
        double into = fmax(from - at, shortest);
        if (!found && moves && into <= ph->time - shortest) {
            *out = (place){i, into, at + into, motion + into};
            found = true;
        }
        at += ph->time;
        if (moves) {
            motion += ph->time;
        }
    }
    return found
           && motion - out->motion_s >= LEAST_LEFT_CYCLES * engine->cfg.cycle_s;
}

/* GEO drives the tail, and the planner is where that begins. */
bool rejoin_possible(struct engine *e) {
    return !(e->drive.planner ? e->drive.restart : e->rejoin.over)
           && e->plan.v > 0.0 && (ATOMIC_GET(e->commit) & 1)
           && !ATOMIC_GET(e->tail_done);
}

static void place_writer(struct engine *engine,
                         const struct tail *tail,
                         const place *at,
                         struct writer *writer) {
    const phase *ph = &tail->phases[at->phase];
    const jerk_law law = law_of_phase(ph);
    jerk_state state;
    jerk_at(&law, at->t, &state);
    *writer = (struct writer){.e = engine,
                              .piece = ph->piece,
                              .s = state.s,
                              .v = state.v,
                              .budget = commit_high(engine)};
}

/* What was committed last, as long as the offer is not taken. */
static void remember_end(struct engine *engine) {
    struct rejoin *rejoin = &engine->rejoin;
    rejoin->piece = engine->plan.piece;
    rejoin->s = engine->plan.s;
    rejoin->v = engine->plan.v;
    rejoin->committed_s = engine->plan.committed_s;
    rejoin->written = engine->plan.written;
}

static void go_back(struct engine *engine) {
    const struct rejoin *rejoin = &engine->rejoin;
    engine->plan.piece = rejoin->piece;
    engine->plan.s = rejoin->s;
    engine->plan.v = rejoin->v;
    engine->plan.committed_s = rejoin->committed_s;
    engine->plan.written = rejoin->written;
    engine->drive.restart = true;
}

/* Committed motion ends where the writer is. */
static void end_at(struct engine *engine, const struct writer *writer) {
    engine->plan.piece = writer->piece;
    engine->plan.s = writer->s;
    engine->plan.v = writer->v;
}

/* The offer, as far as the planner has written it. */
static void offer(struct engine *engine, const place *at, uint32_t next) {
    engine->plan.late = false;
    engine->rejoin.phase = at->phase;
    engine->rejoin.t = at->t;
    engine->rejoin.word = engine->plan.written << 2 | next << 1;
    ATOMIC_SET(engine->rejoin.state, REJOIN_OFFERED);
}

/* Without jerk any place of the tail will do: all that lies ahead can be met
 * from where it begins, so from there too, unless it has been fed anew
 * meanwhile. */
static void offer_quickly(struct engine *engine) {
    uint64_t word = ATOMIC_GET(engine->commit);
    uint32_t old = (word >> 1) & 1, next = old ^ 1;
    place at;
    struct writer writer;
    if (!find_place(engine, &engine->plan.tails[old], &at)) {
        engine->rejoin.over = true;
        return;
    }
    remember_end(engine);
    place_writer(engine, &engine->plan.tails[old], &at, &writer);
    end_at(engine, &writer);
    engine->plan.committed_s += at.at_s;
    if (!profile_write(engine, &writer, &engine->plan.tails[next])) {
        go_back(engine);
        return;
    }
    end_at(engine, &writer);
    engine->plan.left = writer.left;
    engine->plan.committed_s += writer.seconds;
    offer(engine, &at, next);
}

/* Motion from a place on the tail on. If there is none the tail is driven to
 * its end. */
void rejoin_offer(struct engine *engine) {
    if (!engine->drive.planner) {
        offer_quickly(engine);
        return;
    }
    uint64_t word = ATOMIC_GET(engine->commit);
    uint32_t old = (word >> 1) & 1, next = old ^ 1;
    place at;
    struct writer writer;
    remember_end(engine);
    bool found = find_place(engine, &engine->plan.tails[old], &at);
    if (!found
        || fabs(jerk_advance(engine->drive.planner, at.motion_s) - at.motion_s)
               > SAME_TIME) {
        engine->drive.restart = true;
        return;
    }
    place_writer(engine, &engine->plan.tails[old], &at, &writer);
    if (!drive_write(engine, &writer, &engine->plan.tails[next])) {
        go_back(engine);
        return;
    }
    end_at(engine, &writer);
    engine->plan.committed_s += at.at_s + writer.seconds;
    offer(engine, &at, next);
}

/* No offer is out, and GEO has left the tail. */
bool rejoin_settled(struct engine *e) {
    int state = ATOMIC_GET(e->rejoin.state);
    if (state == REJOIN_NONE) {
        return true;
    }
    if (state != REJOIN_REFUSED) {
        return false;
    }
    go_back(e);
    ATOMIC_SET(e->rejoin.state, REJOIN_NONE);
    return true;
}
