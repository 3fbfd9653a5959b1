/* The acceleration-limited planner as the engine's planner: commits and
 * stopping tails. */
#include <math.h>
#include "engine/accel/accel_planner.h"
#include "engine/accel/conditions.h"
#include "engine/accel/lookahead.h"
#include "engine/accel/profile.h"
#include "engine/commit/commit.h"
#include "engine/commit/planner.h"
#include "engine/run/dispatch.h"
#include "engine/state/state.h"
#include "jerk/planner.h"

#define MOVES                                                                  \
    3 /* the window is moved on so often while it is driven through            \
       */
#define QUICK_MARGIN_S                                                         \
    0.004 /* a place to rejoin at is so far ahead of GEO: plans take little    \
             time */
#define LEAST_CYCLES 1.0 /* ... and that is at least so many */
#define FEASIBLE_BENT                                                          \
    1.002 /* ... inside a curved stretch by what the chord of its limits is    \
             off */

/* Stopping tail: brake to rest from the end of the commit. False if that is not
 * legal. */
static bool write_tail(struct engine *engine,
                       struct tail *tail,
                       const struct writer *from,
                       uint64_t end) {
    struct writer writer = {.e = engine,
                            .out = tail->phases,
                            .max = engine->plan.tail_max,
                            .piece = from->piece,
                            .s = from->s,
                            .v = from->v,
                            .budget = NEVER};
    while (writer.v > 0.0 && writer.piece < end && !writer_full(&writer)) {
        if (!is_motion(piece_at(engine, writer.piece))) {
            pass_event(&writer);
            continue;
        }
        stretch st = stretch_at(engine, writer.piece, end, writer.s);
        bool ends = st.to >= piece_at(engine, writer.piece)->length;
        if (st.span->rows) {
            drive_bent(&writer, &st, ends, true);
        } else {
            brake_to(&writer, &st, 0.0, ends);
        }
        if (writer.s >= piece_at(engine, writer.piece)->length) {
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
    engine->plan.tail_due = false;
    const struct writer from = {.e = engine,
                                .piece = engine->plan.piece,
                                .s = engine->plan.s,
                                .v = engine->plan.v};
    write_tail(engine,
               &engine->plan.tails[(ATOMIC_GET(engine->commit) >> 1) & 1],
               &from,
               engine->plan.tail_end);
}

/* Where nothing has changed, the last window does as long as the path does not
 * come to where it would be faster with a later end: the same motion is found
 * without looking at every window between. */
static bool drive_last_window(struct engine *engine, struct writer *writer) {
    uint64_t driven =
        engine->plan.piece
        - engine->plan.passed_at; /* the window is moved on in parts that take
                                     little time each */
    if (engine->foresight || driven * MOVES > engine->cfg.window
        || engine->plan.piece >= engine->plan.fixed_to || !needs_hold(engine)
        || !conditions_hold(engine)) {
        return false;
    }
    uint64_t written = engine->plan.written;
    run_on(writer, engine->plan.need_end);
    drive_window(writer, engine->plan.need_end);
    if (!writer->refused
        && (writer->piece < engine->plan.fixed_to
            || (writer->piece == engine->plan.fixed_to && writer->s <= 0.0))) {
        return true;
    }
    engine->plan.written = written;
    return false;
}

/* A commit from where committed motion ends. What is of tails and of planning
 * with jerk is not looked at. */
static void begin_commit(struct engine *engine,
                         struct writer *writer,
                         double ahead) {
    writer->e = engine;
    writer->out = NULL;
    writer->count = writer->max = 0;
    writer->piece = engine->plan.piece;
    writer->s = engine->plan.s;
    writer->v = engine->plan.v;
    writer->seconds = writer->motion = 0.0;
    writer->budget = commit_high(engine) - ahead;
    writer->least =
        commit_low(engine) + LEAST_CYCLES * engine->cfg.cycle_s - ahead;
    writer->too_fast = 0;
    writer->refused = false;
    writer->left = engine->plan.left;
}

static void commit(struct engine *engine) {
    struct writer writer;
    double ahead = ahead_s(engine);
    uint64_t word = ATOMIC_GET(engine->commit), before = engine->plan.written;
    uint32_t next = ((word >> 1) & 1) ^ 1;
    uint64_t end = engine->plan.need_end;
    begin_commit(engine, &writer, ahead);
    if (!drive_last_window(engine, &writer)) {
        end = choose_window(engine);
        begin_commit(engine,
                     &writer,
                     ahead); /* its stretch may be cut anew now */
        drive_window(&writer, end);
    }
    bool due = !ATOMIC_GET(engine->run_running) && !engine->plan.fed_anew;
    bool legal =
        !writer.refused
        && (due || write_tail(engine, &engine->plan.tails[next], &writer, end));
    engine->plan.fed_anew = false;
    if (!legal
        && engine->plan.v > GEO_MOVES) { /* the stored tail is: GEO takes it,
                                            and the path goes on from there */
        engine->plan.written = before;
        engine->plan.late = true;
        return;
    }
    if ((word & 1)
        || !__atomic_compare_exchange_n(&engine->commit,
                                        &word,
                                        engine->plan.written << 2 | next << 1,
                                        false,
                                        __ATOMIC_ACQ_REL,
                                        __ATOMIC_ACQUIRE)) {
        engine->plan.written = before;
        return;
    }
    engine->plan.infeasible += writer.too_fast;
    engine->plan.phases += engine->plan.written - before;
    engine->plan.piece = writer.piece;
    engine->plan.s = writer.s;
    engine->plan.v = writer.v;
    engine->plan.left = writer.left;
    engine->plan.tail_due = due;
    engine->plan.tail_end = end;
    engine->plan.committed_s += writer.seconds;
}

/* Motion from a place of the tail on, where the planner is (rejoin.c), and the
 * tail behind it. False: what lies ahead cannot be met from there. */
static bool write_from_tail(struct engine *e,
                            struct writer *w,
                            struct tail *t) {
    uint64_t end = choose_window(e);
    if (!state_feasible(e, end, FEASIBLE_BENT)) {
        return false;
    }
    w->least = lesser(w->budget, commit_low(e) + LEAST_CYCLES * e->cfg.cycle_s);
    drive_window(w, end);
    if (w->refused || !write_tail(e, t, w, end)) {
        return false;
    }
    e->plan.fed_anew = e->plan.tail_due = false;
    e->plan.infeasible += w->too_fast;
    return true;
}

/* Committed motion ends where the writer is. */
static void end_at(struct engine *engine, const struct writer *writer) {
    engine->plan.piece = writer->piece;
    engine->plan.s = writer->s;
    engine->plan.v = writer->v;
}

/* Any place of the tail will do: all that lies ahead can be met from where it
 * begins, so from there too, unless it has been fed anew meanwhile. */
static bool write_behind(struct engine *engine,
                         double at_s,
                         struct writer *writer,
                         struct tail *tail) {
    end_at(engine, writer);
    engine->plan.committed_s += at_s;
    if (!write_from_tail(engine, writer, tail)) {
        return false;
    }
    end_at(engine, writer);
    engine->plan.left = writer->left;
    engine->plan.committed_s += writer->seconds;
    return true;
}

/* No plan is stored: the window once more, to where the last backward pass
 * began. */
static void rest_of_plan(struct engine *engine, struct writer *writer) {
    uint64_t end = engine->plan.need_end;
    if (engine->plan.capped < end) {
        return; /* pieces have come anew since */
    }
    writer->left = engine->plan.left;
    drive_window(writer, end);
}

/* The stopping tail ends where a hold would. */
static double tail_way(struct engine *engine) {
    planner_store_tail(engine);
    const struct tail *tail =
        &engine->plan.tails[(ATOMIC_GET(engine->commit) >> 1) & 1];
    double sum = -engine->plan.s;
    for (uint64_t i = engine->plan.piece; i < tail->piece; i++) {
        if (is_motion(piece_at(engine, i))) {
            sum += piece_at(engine, i)->length;
        }
    }
    return fmax(0.0, sum + (tail->piece < engine->piece_head ? tail->s : 0.0));
}

static void ways_to_rest(struct engine *engine,
                         struct rest_search *search,
                         double way[2]) {
    (void)search;
    way[0] = way[1] = engine->plan.v > 0.0 ? tail_way(engine) : 0.0;
}

/* Corner limits of the pieces that are fed anew are not known. */
static void cap_anew(struct engine *engine) {
    engine->plan.capped = engine->plan.piece;
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

static void taken_back(struct engine *engine, bool follows) {
    (void)engine, (void)follows;
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
    .rest_of_plan = rest_of_plan,
    .ways_to_rest = ways_to_rest,
    .spare = no_spare,
    .traits =
        {
            .rejoin_margin_s = QUICK_MARGIN_S,
            .fed_ahead = FED_NEAR,
            .feeds_in_batches = true,
            .uses_spans = true,
            .exact_arcs = true,
        },
};
