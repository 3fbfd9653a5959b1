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
#include "engine/plan/rejoin.h"
#include "engine/commit/commit.h"
#include "engine/commit/planner.h"
#include "engine/state/state.h"
#include "jerk/planner.h"

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
               ? fmax(engine->traits.rejoin_margin_s, least)
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
    return e->planner->may_rejoin(e) && e->plan.v > 0.0
           && (ATOMIC_GET(e->commit) & 1) && !ATOMIC_GET(e->tail_done);
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
    engine->planner->stand_elsewhere(engine);
}

/* The offer, as far as the planner has written it. */
static void offer(struct engine *engine, const place *at, uint32_t next) {
    engine->plan.late = false;
    engine->rejoin.phase = at->phase;
    engine->rejoin.t = at->t;
    engine->rejoin.word = engine->plan.written << 2 | next << 1;
    ATOMIC_SET(engine->rejoin.state, REJOIN_OFFERED);
}

/* Motion from a place on the tail on. If there is none the tail is driven to
 * its end. */
void rejoin_offer(struct engine *engine) {
    const struct planner_ops *planner = engine->planner;
    uint32_t old = (ATOMIC_GET(engine->commit) >> 1) & 1, next = old ^ 1;
    place at;
    struct writer writer;
    remember_end(engine);
    if (!find_place(engine, &engine->plan.tails[old], &at)
        || !planner->follow(engine, at.motion_s)) {
        planner->give_up_rejoin(engine);
        return;
    }
    place_writer(engine, &engine->plan.tails[old], &at, &writer);
    if (!planner->write(engine, at.at_s, &writer, &engine->plan.tails[next])) {
        go_back(engine);
        return;
    }
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
