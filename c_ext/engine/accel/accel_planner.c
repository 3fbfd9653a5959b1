/* The acceleration-limited planner as the engine's planner: commits and
 * stopping tails. */
#include <math.h>
#include "engine/accel/accel_planner.h"
#include "engine/accel/conditions.h"
#include "engine/accel/lookahead.h"
#include "engine/accel/profile.h"
#include "engine/accel/tuning.h"
#include "engine/commit/commit.h"
#include "engine/commit/planner.h"
#include "engine/state/state.h"
#include "engine/state/tuning.h"
#include "jerk/state/api.h"

/* Stopping tail: brake to rest from the end of the commit. False if that is not
 * legal. */
static bool write_tail(struct engine *engine,
                       struct tail *tail,
                       const struct writer *from,
                       uint64_t end) {
    struct writer writer = {.engine = engine,
                            .out = tail->phases,
                            .max = engine->commit.tail_max,
                            .piece = from->piece,
                            .s = from->s,
                            .v = from->v,
                            .budget = NEVER};
    while (writer.v > 0.0 && writer.piece < end && !writer_full(&writer)) {
        if (!is_motion(piece_at(&engine->run, writer.piece))) {
            pass_event(&writer);
            continue;
        }
        stretch st = stretch_at(engine, writer.piece, end, writer.s);
        bool ends = st.to >= piece_at(&engine->run, writer.piece)->length;
        if (st.span->rows) {
            drive_curved(&writer, &st, ends, true);
        } else {
            brake_to(&writer, &st, 0.0, ends);
        }
        if (writer.s >= piece_at(&engine->run, writer.piece)->length) {
            leave_motion(&writer, end);
        }
    }
    tail->first = 0;
    tail->count = writer.count;
    tail->piece = writer.piece;
    tail->s = writer.s;
    return !writer.refused;
}

/* What GEO follows if nothing more is committed. GEO on the same thread cannot
 * outrun the planner: there it is written when somebody asks for it, or when
 * too little is committed for one more cycle. */
static void store_tail(struct engine *engine) {
    engine->commit.tail_due = false;
    const struct writer from = {.engine = engine,
                                .piece = engine->commit.piece,
                                .s = engine->commit.s,
                                .v = engine->commit.v};
    write_tail(
        engine,
        &engine->commit.tails[(ATOMIC_GET(engine->commit.word) >> 1) & 1],
        &from,
        engine->commit.tail_end);
}

/* Where nothing has changed, the last window does as long as the path does not
 * come to where it would be faster with a later end: the same motion is found
 * without looking at every window between. */
static bool drive_last_window(struct engine *engine, struct writer *writer) {
    uint64_t driven =
        engine->commit.piece
        - engine->accel.passed_at; /* the window is moved on in parts that take
                                     little time each */
    bool inside = driven * MOVES <= engine->cfg.window
                  && engine->commit.piece < engine->accel.fixed_to;
    if (engine->prediction || !inside) {
        return false;
    }
    if (!needs_hold(engine) || !conditions_hold(engine)) {
        return false;
    }
    uint64_t written = engine->commit.written;
    run_on(writer, engine->accel.need_end);
    drive_window(writer, engine->accel.need_end);
    bool fixed =
        writer->piece < engine->accel.fixed_to
        || (writer->piece == engine->accel.fixed_to && writer->s <= 0.0);
    if (!writer->refused && fixed) {
        return true;
    }
    engine->commit.written = written;
    return false;
}

/* A commit from where committed motion ends. What is of tails and of planning
 * with jerk is not looked at. */
static void begin_commit(struct engine *engine,
                         struct writer *writer,
                         double ahead) {
    writer->engine = engine;
    writer->out = NULL;
    writer->count = writer->max = 0;
    writer->piece = engine->commit.piece;
    writer->s = engine->commit.s;
    writer->v = engine->commit.v;
    writer->seconds = writer->motion = 0.0;
    writer->near = commit_high(&engine->cfg) - ahead;
    writer->far_to = engine->commit.piece + FAR_PIECES;
    bool far = engine->commit.far && conditions_hold(engine);
    writer->budget = writer->near + (far ? COMMIT_FAR_S - COMMIT_HIGH_S : 0.0);
    writer->least =
        commit_low(engine) + LEAST_CYCLES * engine->cfg.cycle_s - ahead;
    writer->too_fast = 0;
    writer->refused = false;
    writer->left = engine->accel.left;
}

static void commit(struct engine *engine) {
    struct writer writer;
    double ahead = ahead_s(engine);
    uint64_t word = ATOMIC_GET(engine->commit.word),
             before = engine->commit.written;
    uint32_t next = ((word >> 1) & 1) ^ 1;
    uint64_t end = engine->accel.need_end;
    begin_commit(engine, &writer, ahead);
    if (!drive_last_window(engine, &writer)) {
        end = choose_window(engine);
        begin_commit(engine,
                     &writer,
                     ahead); /* its stretch may be cut anew now */
        drive_window(&writer, end);
    }
    bool due = !ATOMIC_GET(engine->threads.running) && !engine->commit.fed_anew;
    bool stops =
        due || write_tail(engine, &engine->commit.tails[next], &writer, end);
    bool legal = stops && !writer.refused;
    engine->commit.fed_anew = false;
    if (!legal
        && engine->commit.v > GEO_MOVES) { /* the stored tail is: GEO takes it,
                                            and the path goes on from there */
        engine->commit.written = before;
        engine->commit.late = true;
        return;
    }
    if ((word & 1)
        || !__atomic_compare_exchange_n(&engine->commit.word,
                                        &word,
                                        engine->commit.written << 2 | next << 1,
                                        false,
                                        __ATOMIC_ACQ_REL,
                                        __ATOMIC_ACQUIRE)) {
        engine->commit.written = before;
        return;
    }
    engine->commit.infeasible += writer.too_fast;
    engine->commit.phases += engine->commit.written - before;
    engine->commit.piece = writer.piece;
    engine->commit.s = writer.s;
    engine->commit.v = writer.v;
    engine->accel.left = writer.left;
    engine->commit.tail_due = due;
    engine->commit.tail_end = end;
    engine->commit.committed_s += writer.seconds;
}

/* Motion from a place of the tail on, where the planner is (rejoin.c), and the
 * tail behind it. False: what lies ahead cannot be met from there. */
static bool write_from_tail(struct engine *engine,
                            struct writer *writer,
                            struct tail *tail) {
    uint64_t end = choose_window(engine);
    if (!state_feasible(engine, end, FEASIBLE_CURVED)) {
        return false;
    }
    writer->least =
        lesser(writer->budget,
               commit_low(engine) + LEAST_CYCLES * engine->cfg.cycle_s);
    drive_window(writer, end);
    if (writer->refused || !write_tail(engine, tail, writer, end)) {
        return false;
    }
    engine->commit.fed_anew = engine->commit.tail_due = false;
    engine->commit.infeasible += writer->too_fast;
    return true;
}

/* Committed motion ends where the writer is. */
static void end_at(struct commit_state *commit, const struct writer *writer) {
    commit->piece = writer->piece;
    commit->s = writer->s;
    commit->v = writer->v;
}

/* Any place of the tail will do: all that lies ahead can be met from where it
 * begins, so from there too, unless it has been fed anew meanwhile. */
static bool write_behind(struct engine *engine,
                         double at_s,
                         struct writer *writer,
                         struct tail *tail) {
    end_at(&engine->commit, writer);
    engine->commit.committed_s += at_s;
    if (!write_from_tail(engine, writer, tail)) {
        return false;
    }
    end_at(&engine->commit, writer);
    engine->accel.left = writer->left;
    engine->commit.committed_s += writer->seconds;
    return true;
}

/* No plan is stored: the window once more, to where the last backward pass
 * began. */
static void remainder_of_plan(struct engine *engine, struct writer *writer) {
    uint64_t end = engine->accel.need_end;
    if (engine->accel.capped < end) {
        return; /* pieces have come anew since */
    }
    writer->left = engine->accel.left;
    drive_window(writer, end);
}

/* The stopping tail ends where a hold would. */
static double tail_way(struct engine *engine) {
    planner_store_tail(engine);
    const struct tail *tail =
        &engine->commit.tails[(ATOMIC_GET(engine->commit.word) >> 1) & 1];
    double sum = -engine->commit.s;
    for (uint64_t i = engine->commit.piece; i < tail->piece; i++) {
        if (is_motion(piece_at(&engine->run, i))) {
            sum += piece_at(&engine->run, i)->length;
        }
    }
    return fmax(0.0, sum + (tail->piece < engine->run.head ? tail->s : 0.0));
}

static void ways_to_standstill(struct engine *engine,
                               struct standstill_search *search,
                               double way[2]) {
    (void)search;
    way[0] = way[1] = engine->commit.v > 0.0 ? tail_way(engine) : 0.0;
}

/* Corner limits of the pieces that are fed anew are not known. */
static void cap_anew(struct engine *engine) {
    engine->accel.capped = engine->commit.piece;
}

static void cut(struct engine *engine, uint64_t head) {
    (void)head;
    cap_anew(engine);
}

static void shorten(struct engine *engine, uint64_t i, double s) {
    (void)engine, (void)i, (void)s;
}

static bool shorten_tail(struct engine *engine) {
    (void)engine;
    return true;
}

static double take_back(struct engine *engine, double seconds) {
    (void)engine;
    return seconds;
}

/* What lies between was planned with windows that ended earlier. */
static void taken_back(struct engine *engine, bool follows, double seconds) {
    (void)follows, (void)seconds;
    engine->accel.need_end = 0;
}

static bool stands_elsewhere(const struct engine *engine) {
    (void)engine;
    return false;
}

static void stand_elsewhere(struct engine *engine) {
    (void)engine;
}

static bool may_rejoin(const struct engine *engine) {
    return !engine->rejoin.over;
}

static bool follow(struct engine *engine, double motion_s) {
    (void)engine, (void)motion_s;
    return true;
}

static void give_up_rejoin(struct engine *engine) {
    engine->rejoin.over = true;
}

static jerk_planner *no_spare(const struct engine *engine) {
    (void)engine;
    return NULL;
}

const struct planner_ops accel_planner = {
    .commit = commit,
    .write = write_behind,
    .store_tail = store_tail,
    .cut = cut,
    .begin_run = cap_anew,
    .shorten = shorten,
    .shorten_tail = shorten_tail,
    .take_back = take_back,
    .taken_back = taken_back,
    .stands_elsewhere = stands_elsewhere,
    .stand_elsewhere = stand_elsewhere,
    .may_rejoin = may_rejoin,
    .follow = follow,
    .give_up_rejoin = give_up_rejoin,
    .refused = stand_elsewhere,
    .remainder_of_plan = remainder_of_plan,
    .ways_to_standstill = ways_to_standstill,
    .spare = no_spare,
    .traits =
        {
            .rejoin_margin_s = REJOIN_QUICK_MARGIN_S,
            .fed_ahead = FED_NEAR,
            .feeds_in_batches = true,
            .uses_spans = true,
            .exact_arcs = true,
        },
};
