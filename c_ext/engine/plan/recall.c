/* Feed hold, and other orders behind a far commit (orders_seen.h): what is
 * committed but not begun is taken back, so that they act from the next cycle
 * on and not behind the motion that was committed ahead.
 *
 * What is taken back first becomes the beginning of the stored tail (the same
 * motion, published in the same atomic word): if the planner is late with the
 * stop, GEO goes on as before and comes to rest where the old plan does.
 */
#include <string.h>
#include "engine/plan/recall.h"
#include "engine/commit/commit.h"
#include "engine/commit/planner.h"
#include "engine/state/state.h"
#include "engine/state/tuning.h"

typedef struct cut {
    uint64_t phase;  /* first one that is taken back */
    double at_s;     /* committed motion ahead of it */
    double motion_s; /* of what is taken back, dwells left out */
} cut;

static const phase *phase_at(const struct commit_state *commit, uint64_t i) {
    return &commit->ring[i & (PHASE_RING - 1)];
}

static double consumed_s(struct geo *geo) {
    double s;
    __atomic_load(&geo->consumed_s, &s, __ATOMIC_ACQUIRE);
    return s;
}

/* Pumped on one thread without jerk phases are not written cycle by cycle: the
 * one that GEO is in ends with the cycle it has come to (at least one cycle
 * behind its beginning), the rest of it becomes a phase of its own. */
static void end_present_phase(struct engine *engine) {
    struct geo *geo = &engine->geo;
    if (cuts_phases(engine)) {
        return; /* GEO may be at work on another thread */
    }
    double dt = engine->cfg.cycle_s,
           t = greater(geo->t, geo->t > 0.0 ? 0.0 : dt);
    if (geo->in_tail || !geo->has_phase
        || !is_motion(piece_at(&engine->run, geo->now.piece))) {
        return;
    }
    if (geo->now.time - t < SHORT_PART * dt) {
        return;
    }
    phase *remainder =
        &engine->commit.ring[(geo->consumed - 1) & (PHASE_RING - 1)];
    *remainder = geo->now;
    remainder->s0 = geo->now.s0 + (geo->now.v0 + 0.5 * geo->now.a * t) * t;
    remainder->v0 = greater(0.0, geo->now.v0 + geo->now.a * t);
    remainder->time = geo->now.time - t;
    geo->now.time = t;
    geo->now.last = false;
    ATOMIC_SET(geo->consumed, geo->consumed - 1);
    engine->commit.phases++;
}

static double margin_s(struct engine *engine) {
    return ATOMIC_GET(engine->threads.running)
               ? greater(RECALL_MARGIN_S,
                         RECALL_MARGIN_CYCLES * engine->cfg.cycle_s)
               : 0.0;
}

/* Motion is taken back, and on its own thread GEO takes a tail there. */
static bool can_cut(struct engine *engine, const struct cut *cut) {
    if (cut->phase >= engine->commit.written || !(cut->motion_s > 0.0)) {
        return false;
    }
    return !ATOMIC_GET(engine->threads.running)
           || phase_at(&engine->commit, cut->phase)->v0 > GEO_MOVES;
}

/* Everything that begins no earlier than `margin` from where GEO is. */
static bool find_cut(struct engine *engine, double margin, struct cut *cut) {
    double earliest = consumed_s(&engine->geo) + margin;
    uint64_t first = ATOMIC_GET(engine->geo.consumed);
    *cut =
        (struct cut){engine->commit.written, engine->commit.committed_s, 0.0};
    while (cut->phase > first) {
        const phase *ph = phase_at(&engine->commit, cut->phase - 1);
        if (cut->at_s - ph->time < earliest - SAME_TIME) {
            break;
        }
        cut->phase--;
        cut->at_s -= ph->time;
        if (is_motion(piece_at(&engine->run, ph->piece))) {
            cut->motion_s += ph->time;
        }
    }
    return can_cut(engine, cut);
}

/* The motion that is taken back, and the stored tail behind it. */
static bool longer_tail(const struct commit_state *commit,
                        const struct cut *cut,
                        const struct tail *old,
                        struct tail *tail) {
    uint64_t count = commit->written - cut->phase,
             kept = old->count - old->first;
    if (count + kept > commit->tail_max) {
        return false;
    }
    for (uint64_t i = 0; i < count; i++) {
        tail->phases[i] = *phase_at(commit, cut->phase + i);
    }
    memcpy(tail->phases + count,
           old->phases + old->first,
           kept * sizeof(phase));
    tail->first = 0;
    tail->count = (uint32_t)(count + kept);
    tail->edition = 0;
    tail->piece = old->piece;
    tail->s = old->s;
    return true;
}

static void go_back(struct commit_state *commit, const struct cut *cut) {
    const phase *ph = phase_at(commit, cut->phase);
    commit->phases -= commit->written - cut->phase;
    commit->written = cut->phase;
    commit->committed_s = cut->at_s;
    commit->piece = ph->piece;
    commit->s = ph->s0;
    commit->v = ph->v0;
}

/* GEO has come too near to the cut: it may be about to read the next phase, so
 * that one is not written any more. */
static bool too_late(struct engine *engine, const struct cut *cut) {
    return ATOMIC_GET(engine->threads.running)
           && consumed_s(&engine->geo) > cut->at_s - engine->cfg.cycle_s;
}

/* Forward to where the last `seconds` of motion begin. */
static void cut_later(struct engine *engine, struct cut *cut, double seconds) {
    while (cut->motion_s > seconds + SAME_TIME) {
        const phase *ph = phase_at(&engine->commit, cut->phase++);
        cut->at_s += ph->time;
        if (is_motion(piece_at(&engine->run, ph->piece))) {
            cut->motion_s -= ph->time;
        }
    }
}

/* The planner goes back to the cut, which becomes a later one where the planner
 * cannot begin there. Returns the motion that is taken back, s. */
static double take_back(struct engine *engine, struct cut *cut) {
    const struct planner_ops *planner = engine->planner;
    for (;;) {
        double seconds = planner->take_back(engine, cut->motion_s);
        if (seconds <= 0.0) {
            return 0.0;
        }
        cut_later(engine, cut, seconds);
        /* else the planner's place is inside a phase */
        bool meets = seconds <= cut->motion_s + SAME_TIME;
        if (meets && can_cut(engine, cut)) {
            return seconds;
        }
        planner->taken_back(engine, false, seconds);
        if (meets || planner->stands_elsewhere(engine)
            || !can_cut(engine, cut)) {
            return 0.0;
        }
    }
}

/* The commit ends at the cut from now on; the motion behind it is the beginning
 * of the stored tail. */
static bool publish_cut(struct engine *engine,
                        uint64_t word,
                        const struct cut *cut) {
    uint32_t old = (word >> 1) & 1, next = old ^ 1;
    if (cut->phase >= engine->commit.written
        || !longer_tail(&engine->commit,
                        cut,
                        &engine->commit.tails[old],
                        &engine->commit.tails[next])) {
        return false;
    }
    if (!__atomic_compare_exchange_n(&engine->commit.word,
                                     &word,
                                     cut->phase << 2 | next << 1,
                                     false,
                                     __ATOMIC_ACQ_REL,
                                     __ATOMIC_ACQUIRE)) {
        return false;
    }
    go_back(&engine->commit, cut);
    engine->commit.late = too_late(engine, cut);
    return !engine->commit.late;
}

void recall_commit(struct engine *engine) {
    uint64_t word = ATOMIC_GET(engine->commit.word);
    struct cut cut;
    if ((word & 1) || ATOMIC_GET(engine->withdrawal.state) != WITHDRAW_NONE
        || engine->planner->stands_elsewhere(engine)) {
        return;
    }
    if (engine->cfg.functions & ENGINE_FCT_CALC_POS_V_0) {
        return; /* the place of rest has been told the PLC */
    }
    planner_store_tail(engine);
    end_present_phase(engine);
    if (!find_cut(engine, margin_s(engine), &cut)) {
        return;
    }
    double seconds = take_back(engine, &cut);
    if (seconds <= 0.0) {
        return;
    }
    bool in_time = publish_cut(engine, word, &cut);
    bool follows = in_time || engine->commit.late;
    engine->planner->taken_back(engine, follows, seconds);
}
