/* One turn of the planner's thread: tails, jobs at standstill, recall, then a
 * commit. */
#include "engine/plan/pump.h"
#include "engine/commit/commit.h"
#include "engine/commit/cpu_clock.h"
#include "engine/commit/planner.h"
#include "engine/plan/orders_seen.h"
#include "engine/plan/recall.h"
#include "engine/plan/rejoin.h"
#include "engine/run/dispatch.h"
#include "engine/run/standstill_jobs.h"
#include "engine/state/state.h"
#include "engine/state/tuning.h"

/* The tail was driven: go on from where it ended. */
static bool resume_after_tail(struct engine *engine) {
    uint64_t word = ATOMIC_GET(engine->commit.word);
    if (!(word & 1)) {
        return true;
    }
    if (!ATOMIC_GET(engine->commit.tail_done)) {
        return false;
    }
    const struct tail *tail = &engine->commit.tails[(word >> 1) & 1];
    double driven = 0.0;
    for (uint32_t i = tail->first; i < tail->count; i++) {
        driven += tail->phases[i].time;
    }
    engine->commit.piece = tail->piece;
    engine->commit.s = tail->s;
    engine->commit.v = 0.0;
    engine->commit.committed_s += driven;
    engine->commit.written = word >> 2;
    struct tail *other = &engine->commit.tails[((word >> 1) & 1) ^ 1];
    other->first = other->count = 0;
    other->edition = 0;
    engine->planner->stand_elsewhere(engine);
    engine->rejoin.over = false;
    engine->commit.late = false;
    engine->commit.tail_done = 0;
    ATOMIC_SET(engine->commit.word, word ^ 3u);
    return true;
}

/* The path stands where GEO says; what was committed behind that place is taken
 * back. */
static bool withdraw(struct engine *engine) {
    if (ATOMIC_GET(engine->withdrawal.state) == WITHDRAW_NONE) {
        ATOMIC_SET(engine->withdrawal.state, WITHDRAW_ASKED);
    }
    if (ATOMIC_GET(engine->withdrawal.state) != WITHDRAW_DONE) {
        return false;
    }
    bool before =
        engine->withdrawal.piece
        < engine->dispatch
              .run; /* nothing of the present run has been driven yet */
    engine->commit.piece =
        before ? engine->dispatch.run : engine->withdrawal.piece;
    engine->commit.s = before ? 0.0 : engine->withdrawal.s;
    engine->commit.v = 0.0;
    engine->commit.late = false;
    engine->commit.written = ATOMIC_GET(engine->commit.word) >> 2;
    __atomic_load(&engine->geo.consumed_s,
                  &engine->commit.committed_s,
                  __ATOMIC_ACQUIRE);
    engine->planner->stand_elsewhere(engine);
    return true;
}

/* Jobs of the dispatch need standstill: brake, take back what is committed, do
 * them. False while they are pending and nothing may be committed. */
static bool jobs_allow(struct engine *engine) {
    if (ATOMIC_GET(engine->withdrawal.state) == WITHDRAW_NONE
        && !standstill_job_pending(engine)) {
        return true;
    }
    /* while GEO waits nothing more is driven, so nothing more would be
     * committed: it stands already */
    bool waits = ATOMIC_GET(engine->withdrawal.waits);
    if (engine->commit.v > 0.0 && !waits
        && ATOMIC_GET(engine->withdrawal.state) == WITHDRAW_NONE) {
        return true; /* the hold brakes */
    }
    if (!withdraw(engine)) {
        return false;
    }
    do_standstill_jobs(engine);
    ATOMIC_SET(
        engine->withdrawal.state,
        WITHDRAW_NONE); /* not before: until then the program does not end */
    return true;
}

static bool wants_hold(struct engine *engine) {
    double override;
    __atomic_load(&engine->orders.override, &override, __ATOMIC_ACQUIRE);
    return ATOMIC_GET(engine->orders.hold) || override <= 0.0
           || standstill_job_pending(engine);
}

/* The planner's work, timed: feed, plan, commit. `hold`: the path is to come to
 * rest. */
static __attribute__((noinline)) bool commit_more(struct engine *engine,
                                                  bool rejoins,
                                                  bool hold) {
    if (!rejoins) {
        dispatch_path(engine);
    }
    if (engine->commit.piece >= engine->run.head) {
        return false;
    }
    __atomic_load(&engine->orders.override,
                  &engine->plan.override,
                  __ATOMIC_ACQUIRE);
    __atomic_load(&engine->orders.ext_speed,
                  &engine->plan.ext_speed,
                  __ATOMIC_ACQUIRE);
    __atomic_load(&engine->orders.rapid, &engine->plan.rapid, __ATOMIC_ACQUIRE);
    engine->plan.hold = hold;
    choose_reach(engine);
    if (rejoins) {
        rejoin_offer(engine);
    } else {
        engine->planner->commit(engine);
    }
    return true;
}

static int pump(struct engine *engine) {
    if (ATOMIC_GET(engine->commit.stalled)
        || ATOMIC_GET(engine->program.hold_start) || !rejoin_settled(engine)) {
        return 0;
    }
    bool rejoins = rejoin_possible(engine);
    if (!rejoins && (!resume_after_tail(engine) || !jobs_allow(engine))) {
        return 0;
    }
    bool hold = wants_hold(engine);
    if (!rejoins) {
        if (hold && !engine->plan.hold) {
            recall_commit(engine);
        } else {
            recall_for_orders(engine);
        }
        if (engine->commit.late || ahead_s(engine) >= commit_low(engine)) {
            return 0;
        }
    }
    uint64_t before = engine->commit.written;
    watch_start(engine);
    if (!commit_more(engine, rejoins, hold)) {
        return 0;
    }
    watch_stop(engine);
    return engine->commit.written != before;
}

int planner_pump(struct engine *engine) {
    int added = pump(engine);
    if (engine->commit.tail_due
        && ahead_s(engine) < LAST_CYCLES * engine->cfg.cycle_s) {
        planner_store_tail(engine);
    }
    return added;
}
