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
#include "engine/state/tuning.h"
#include "jerk/state/api.h"

typedef struct place {
    uint32_t phase;        /* of the tail */
    double t;              /* s of it */
    double at_s, motion_s; /* of the tail ahead of it: time, time in motion */
} place;

static double margin_s(struct engine *engine) {
    double least = REJOIN_MARGIN_CYCLES * engine->cfg.cycle_s;
    return ATOMIC_GET(engine->threads.running)
               ? fmax(engine->traits.rejoin_margin_s, least)
               : least;
}

/* The first place far enough ahead of GEO, inside a motion; false if too little
 * of the tail would be left. */
static bool find_place(struct engine *engine,
                       const struct tail *tail,
                       place *out) {
    double consumed, at = 0.0, motion = 0.0,
                     shortest = SHORT_PART * engine->cfg.cycle_s;
    bool found = false;
    __atomic_load(&engine->geo.consumed_s, &consumed, __ATOMIC_ACQUIRE);
    double from = consumed + margin_s(engine) - engine->commit.committed_s;
    for (uint32_t i = tail->first; i < tail->count; i++) {
        const phase *ph = &tail->phases[i];
        bool moves = is_motion(piece_at(&engine->run, ph->piece));
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
           && motion - out->motion_s
                  >= REJOIN_LEFT_CYCLES * engine->cfg.cycle_s;
}

bool rejoin_possible(struct engine *engine) {
    return engine->planner->may_rejoin(engine) && engine->commit.v > 0.0
           && (ATOMIC_GET(engine->commit.word) & 1)
           && !ATOMIC_GET(engine->commit.tail_done);
}

static void place_writer(struct engine *engine,
                         const struct tail *tail,
                         const place *at,
                         struct writer *writer) {
    const phase *ph = &tail->phases[at->phase];
    const jerk_law law = law_of_phase(ph);
    jerk_state state;
    jerk_at(&law, at->t, &state);
    *writer = (struct writer){.engine = engine,
                              .piece = ph->piece,
                              .s = state.s,
                              .v = state.v,
                              .budget = commit_high(&engine->cfg),
                              .far_to = UINT64_MAX};
}

/* What was committed last, as long as the offer is not taken. */
static void remember_end(struct engine *engine) {
    struct rejoin *rejoin = &engine->rejoin;
    rejoin->piece = engine->commit.piece;
    rejoin->s = engine->commit.s;
    rejoin->v = engine->commit.v;
    rejoin->committed_s = engine->commit.committed_s;
    rejoin->written = engine->commit.written;
}

static void go_back(struct engine *engine) {
    const struct rejoin *rejoin = &engine->rejoin;
    engine->commit.piece = rejoin->piece;
    engine->commit.s = rejoin->s;
    engine->commit.v = rejoin->v;
    engine->commit.committed_s = rejoin->committed_s;
    engine->commit.written = rejoin->written;
}

/* The offer, as far as the planner has written it. */
static void offer(struct engine *engine, const place *at, uint32_t next) {
    engine->commit.late = false;
    engine->rejoin.phase = at->phase;
    engine->rejoin.t = at->t;
    engine->rejoin.word = engine->commit.written << 2 | next << 1;
    ATOMIC_SET(engine->rejoin.state, REJOIN_OFFERED);
}

void rejoin_offer(struct engine *engine) {
    const struct planner_ops *planner = engine->planner;
    uint32_t old = (ATOMIC_GET(engine->commit.word) >> 1) & 1, next = old ^ 1;
    place at;
    struct writer writer;
    remember_end(engine);
    if (!find_place(engine, &engine->commit.tails[old], &at)
        || !planner->follow(engine, at.motion_s)) {
        planner->give_up_rejoin(engine);
        return;
    }
    place_writer(engine, &engine->commit.tails[old], &at, &writer);
    if (!planner->write(engine,
                        at.at_s,
                        &writer,
                        &engine->commit.tails[next])) {
        go_back(engine);
        planner->stand_elsewhere(engine);
        return;
    }
    offer(engine, &at, next);
}

bool rejoin_settled(struct engine *engine) {
    int state = ATOMIC_GET(engine->rejoin.state);
    if (state == REJOIN_NONE) {
        return true;
    }
    if (state != REJOIN_REFUSED) {
        return false;
    }
    go_back(engine);
    engine->planner->refused(engine);
    ATOMIC_SET(engine->rejoin.state, REJOIN_NONE);
    return true;
}
