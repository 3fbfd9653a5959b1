/* The planner: forward through the window, phase by phase, some milliseconds
 * ahead of the interpolator.
 *
 * Every commit leaves a stored stopping tail: GEO follows it when the planner
 * is late. Commit and tail are published together in one atomic word (head << 2
 * | tail buffer << 1 | taken).
 */
#include <math.h>
#include "engine/state/state.h"

#define PARTS_MAX 64    /* of a phase */
#define SHORT_PART 0.05 /* of a cycle: no part is shorter */
#define TINY_MM 1e-12
#define MOVES 3 /* the window is moved on so often while it is driven through  \
                 */
#define SAME_SPEED 1e-12 /* relative */
#define SAME_TIME 1e-9   /* s */
#define PUMPED_CYCLES                                                          \
    3.0 /* motion ahead of GEO below which a pumped planner commits more */
#define LEAST_CYCLES 1.0 /* ... and that is at least so many */
#define LAST_CYCLES                                                            \
    1.5 /* motion ahead of GEO below which it may take the tail in this cycle  \
         */
#define FEASIBLE 1.0000001 /* speeds squared may miss by rounding, ... */
#define FEASIBLE_BENT                                                          \
    1.002 /* ... inside a curved stretch by what the chord of its limits is    \
             off */
#define REFUSED_FROM                                                           \
    1.01 /* times the speed that a corner or stand allows, and ... */
#define REFUSED_MM_S 0.01 /* ... so much more: no commit does that */

/* Feed and override: what the operator and the program ask for. The machine's
 * own limits come on top. */
double soft_cap(const struct engine *engine, const struct piece *piece) {
    if (engine->plan.hold) {
        return 0.0;
    }
    if (engine->plan.ext_speed < NEVER) {
        return lesser(reachable(piece, engine->plan.reserve_override),
                      engine->plan.ext_speed);
    }
    if (piece->feed > 0) {
        return lesser(piece->v_hard,
                      piece->feed
                          * (piece->flags & NC_NO_OVERRIDE
                                 ? 1.0
                                 : engine->plan.override));
    }
    return piece->v_hard * lesser(1.0, engine->plan.rapid);
}

typedef struct stretch {
    const struct span *span;
    double from, to;  /* path length in the piece */
    double soft, cap; /* feed and override; straight: with the hard limit */
    double accel;     /* straight */
    double end2;      /* speed squared that must be met at `to` */
} stretch;

/* Speed squared to be met at the end of piece i. */
static double need_behind(struct engine *engine, uint64_t i, uint64_t end) {
    const struct piece *piece = piece_at(engine, i);
    return piece->stop_after || i + 1 >= end ? 0.0
                                             : piece_at(engine, i + 1)->need2;
}

/* The stretch of piece i that holds s, s < length; its needs are those of the
 * last backward pass. */
static stretch stretch_at(struct engine *engine,
                          uint64_t i,
                          uint64_t end,
                          double s) {
    const struct piece *piece = piece_at(engine, i);
    if (piece->cruises || !spans_known(engine, i)) {
        settle_spans(engine, i, need_behind(engine, i, end));
    }
    const struct span *spans = spans_of(engine, i);
    span_cursor *at = &engine->plan.cursor;
    uint32_t last = piece->span_count - 1;
    if (at->piece != i || s < at->from) {
        *at = (span_cursor){.piece = i};
    }
    while (at->k < last && s >= at->from + spans[at->k].length) {
        at->from += spans[at->k++].length;
    }
    uint32_t k = at->k;
    double from = at->from;
    double soft = soft_cap(engine, piece),
           need = k < last ? spans[k + 1].need2 : need_behind(engine, i, end);
    return (stretch){&spans[k],
                     from,
                     k < last ? from + spans[k].length : piece->length,
                     soft,
                     lesser(soft, spans[k].v_hard),
                     spans[k].accel,
                     need};
}

/* Whether everything ahead can be met from v at s of piece i. */
static bool meets_all(struct engine *engine,
                      uint64_t i,
                      uint64_t end,
                      double s,
                      double v,
                      double bent) {
    stretch st = stretch_at(engine, i, end, s);
    if (st.span->rows) {
        return v * v
               <= bent_need(st.span, s - st.from, st.soft * st.soft, st.end2)
                          * bent
                      + 1e-12;
    }
    return v * v <= lesser(st.cap * st.cap,
                           lesser(st.end2, st.cap * st.cap)
                               + 2.0 * st.accel * (st.to - s))
                            * FEASIBLE
                        + 1e-12;
}

bool writer_full(const struct writer *w) {
    if (w->seconds >= w->budget) {
        return true;
    }
    if (w->out) {
        return w->count + 4 >= w->max;
    }
    return w->e->plan.written - ATOMIC_GET(w->e->geo.consumed)
           >= PHASE_RING - 4 - PARTS_MAX;
}

/* What is left of a phase from t on begins so. */
static void begin_at(phase *ph, double t) {
    jerk_law law = law_of_phase(ph);
    jerk_begin_at(&law, t);
    ph->s0 = law.s0;
    ph->v0 = law.v0;
    ph->a = law.a0;
    ph->jerk = law.jerk;
    ph->snap = law.snap;
    ph->crackle = law.crackle;
}

/* From `at` (committed motion, s) to the end of the cycle of GEO in which it is
 * driven. */
static double rest_of_cycle(struct engine *engine, double at) {
    double now, dt = engine->cfg.cycle_s;
    __atomic_load(&engine->geo.consumed_s, &now, __ATOMIC_ACQUIRE);
    double cycles = (at - now) / dt, rest = (floor(cycles) + 1.0 - cycles) * dt;
    return rest < SHORT_PART * dt ? rest + dt : rest;
}

static inline bool cuts_phases(struct engine *engine) {
    return engine->drive.planner || ATOMIC_GET(engine->run_running);
}

/* Committed motion is written cycle by cycle: what has not begun can be taken
 * back (recall.c). Pumped on one thread without jerk it is cut then and there.
 */
static void commit_phase(struct writer *writer, const phase *ph) {
    struct engine *engine = writer->e;
    if (!cuts_phases(engine)) {
        engine->phase_ring[engine->plan.written++ & (PHASE_RING - 1)] = *ph;
        return;
    }
    bool motion = is_motion(piece_at(engine, ph->piece));
    double from = 0.0,
           to = motion
                    ? rest_of_cycle(engine,
                                    engine->plan.committed_s + writer->seconds)
                    : ph->time;
    for (int i = 1;; i++) {
        phase *out =
            &engine->phase_ring[engine->plan.written++ & (PHASE_RING - 1)];
        bool end =
            i >= PARTS_MAX || to >= ph->time - SHORT_PART * engine->cfg.cycle_s;
        *out = *ph;
        if (from > 0.0) {
            begin_at(out, from);
        }
        out->time = (end ? ph->time : to) - from;
        out->last = ph->last && end;
        if (end) {
            return;
        }
        from = to;
        to += engine->cfg.cycle_s;
    }
}

void write_phase(struct writer *writer, const phase *ph) {
    if (writer->out) {
        writer->out[writer->count++] = *ph;
    } else {
        commit_phase(writer, ph);
    }
    writer->seconds += ph->time;
}

/* Pumped on one thread without jerk phases are not cut: they are written where
 * they stay. */
static inline phase *phase_slot(struct writer *writer) {
    if (writer->out) {
        return &writer->out[writer->count++];
    }
    return &writer->e->phase_ring[writer->e->plan.written++ & (PHASE_RING - 1)];
}

static void emit(struct writer *writer, double a, double time, bool last) {
    const phase ph = {.piece = writer->piece,
                      .s0 = writer->s,
                      .v0 = writer->v,
                      .a = a,
                      .time = time,
                      .last = last};
    if (writer->out || !cuts_phases(writer->e)) {
        *phase_slot(writer) = ph;
        writer->seconds += time;
    } else {
        write_phase(writer, &ph);
    }
}

/* Constant acceleration until speed v1 or distance d (whichever the caller
 * computed to coincide); cut at the budget. */
static void run(struct writer *writer,
                double a,
                double time,
                double s1,
                double v1,
                bool last) {
    double room = writer->budget - writer->seconds;
    if (time <= room + SAME_TIME) { /* the end of a piece is not cut off by
                                       rounding */
        emit(writer, a, time, last);
        writer->s = s1;
        writer->v = v1;
        return;
    }
    emit(writer, a, room, false);
    writer->s += writer->v * room + 0.5 * a * room * room;
    writer->v = greater(0.0, writer->v + a * room);
    if (!writer->out) {
        writer->e->plan.rest = (run_left){writer->piece,
                                          writer->e->plan.passes,
                                          writer->s,
                                          writer->v,
                                          a,
                                          time - room,
                                          s1,
                                          v1,
                                          last};
    }
}

static void brake_to(struct writer *writer,
                     const stretch *st,
                     double v1,
                     bool ends) {
    double d = (writer->v * writer->v - v1 * v1) / (2.0 * st->accel),
           room = st->to - writer->s;
    if (d < room - TINY_MM) {
        run(writer,
            -st->accel,
            (writer->v - v1) / st->accel,
            writer->s + d,
            v1,
            false);
        return;
    }
    double end =
        sqrt(greater(0.0, writer->v * writer->v - 2.0 * st->accel * room));
    if (end + writer->v > 0) {
        run(writer,
            -st->accel,
            2.0 * room / (end + writer->v),
            st->to,
            end,
            ends);
    }
}

/* Constant acceleration to the end of the stretch, where the speed is v1. */
static void run_out(struct writer *writer,
                    const stretch *st,
                    double v1,
                    bool ends) {
    double room = st->to - writer->s, sum = writer->v + v1;
    if (sum > 1e-9) {
        double time = 2.0 * room / sum;
        run(writer, (v1 - writer->v) / time, time, st->to, v1, ends);
        return;
    }
    emit(writer, 0.0, 0.0, ends); /* what is left is rounding */
    writer->s = st->to;
    writer->v = 0.0;
}

/* Brake towards end2. A speed above what still meets it comes from a reduced
 * feed or override: brake with all that is allowed (the machine's own limits
 * are still met, the speed was legal before); rounding is taken up by the last
 * stretch. */
static void brake(struct writer *writer,
                  const stretch *st,
                  double end2,
                  bool ends) {
    double room = st->to - writer->s, meets = end2 + 2.0 * st->accel * room;
    if (writer->v * writer->v <= meets * FEASIBLE + 1e-9) {
        run_out(writer, st, sqrt(end2), ends);
    } else {
        brake_to(writer, st, 0.0, ends);
    }
}

/* One step over a curved stretch with constant acceleration along the path, cut
 * at the budget. */
static void drive_bent(struct writer *writer,
                       const stretch *st,
                       bool ends,
                       bool brake) {
    double at = writer->s - st->from, room = st->to - writer->s;
    const bent_left *left = &writer->left;
    uint64_t made = piece_at(writer->e, writer->piece)->spans_made;
    bool goes_on = !brake && left->to > writer->s
                   && left->piece == writer->piece && left->made == made
                   && left->s == writer->s && left->v == writer->v
                   && left->soft == st->soft && left->end2 == st->end2;
    bent_step step =
        goes_on ? (bent_step){.h = left->to - writer->s, .x1 = left->x1}
                : bent_forward(st->span,
                               at,
                               writer->v * writer->v,
                               st->soft * st->soft,
                               st->end2,
                               brake);
    double to = writer->s + step.h;
    bool whole = step.h >= room - TINY_MM;
    double v1 = sqrt(step.x1), time = 2.0 * (whole ? room : step.h)
                                      / greater(writer->v + v1, 1e-30);
    if (whole && writer->v + v1 <= 1e-9) { /* what is left is rounding */
        emit(writer, 0.0, 0.0, ends);
        writer->s = st->to;
        writer->v = 0.0;
        return;
    }
    run(writer,
        (v1 - writer->v) / time,
        time,
        whole ? st->to : to,
        v1,
        whole && ends);
    writer->left = (bent_left){writer->piece,
                               made,
                               writer->s,
                               writer->v,
                               to,
                               step.x1,
                               st->soft,
                               st->end2}; /* of use if the budget has cut it */
}

/* One step over the stretch: accelerate, cruise or brake, each cut at the
 * budget. */
static void drive_stretch(struct writer *writer, const stretch *st, bool ends) {
    if (st->span->rows) {
        drive_bent(writer, st, ends, false);
        return;
    }
    double room = st->to - writer->s, v = writer->v, a = st->accel,
           end2 = lesser(st->end2, st->cap * st->cap);
    if (v * v >= end2 + 2.0 * a * room) {
        brake(writer, st, end2, ends);
        return;
    }
    if (v > st->cap * (1.0 + 1e-12) + 1e-12) {
        brake_to(writer, st, st->cap, ends);
        return;
    }
    double out2 = lesser(end2, v * v + 2.0 * a * room),
           peak2 = 0.5 * (2.0 * a * room + v * v + out2);
    double peak = lesser(st->cap, sqrt(peak2)), out = sqrt(out2);
    double up = (peak * peak - v * v) / (2.0 * a),
           down = (peak * peak - out2) / (2.0 * a);
    double flat = room - up - down;
    if (up > TINY_MM) {
        bool whole = flat <= TINY_MM && down <= TINY_MM;
        run(writer,
            a,
            (peak - v) / a,
            whole ? st->to : writer->s + up,
            peak,
            whole && ends);
    } else if (flat > TINY_MM) {
        writer->v = peak > 0 ? peak : v;
        run(writer,
            0.0,
            flat / writer->v,
            down <= TINY_MM ? st->to : writer->s + flat,
            writer->v,
            down <= TINY_MM && ends);
    } else {
        run_out(writer, st, out, ends);
    }
}

void pass_event(struct writer *writer) {
    const struct piece *piece = piece_at(writer->e, writer->piece);
    double time = piece->type == NC_DWELL ? piece->value : 0.0;
    emit(writer, 0.0, time, true);
    writer->piece++;
    writer->s = 0.0;
}

/* A standstill or a corner passed too fast: where it is committed it is
 * counted, and a test holds that at 0. What is more than rounding is not
 * committed: a path that is fed anew (an inserted stop, a loop that ends) may
 * have other stretches than the plan has met. */
static void leave_motion(struct writer *writer, uint64_t end) {
    struct engine *engine = writer->e;
    const struct piece *piece = piece_at(engine, writer->piece);
    double limit = piece->stop_after || writer->piece + 1 >= end ? 0.0 : NEVER;
    if (limit > 0.0) {
        const struct piece *next = piece_at(engine, writer->piece + 1);
        limit = stands_before(engine, next) ? 0.0
                : is_motion(next)           ? next->corner_v
                                            : NEVER;
    }
    writer->too_fast += writer->v > limit * (1.0 + 1e-6) + 1e-4;
    if (writer->v > limit * REFUSED_FROM + REFUSED_MM_S) {
        writer->refused = true;
    }
    if (limit <= 0.0 && writer->v <= REFUSED_MM_S) {
        writer->v =
            0.0; /* rounding; who waits for a standstill would wait for ever */
    }
    writer->piece++;
    writer->s = 0.0;
}

/* The feed is kept over the rest of the piece. */
static bool cruise(struct writer *writer,
                   const struct piece *piece,
                   uint64_t end) {
    double soft = soft_cap(writer->e, piece), room = piece->length - writer->s;
    bool keeps = piece->cruises && soft > 0.0
                 && fabs(writer->v - soft) <= SAME_SPEED * soft
                 && need_behind(writer->e, writer->piece, end) >= soft * soft;
    if (!keeps || room <= 0.0) {
        return false;
    }
    run(writer, 0.0, room / writer->v, piece->length, writer->v, true);
    return true;
}

/* The phase that the end of the last commit has cut. */
static void run_on(struct writer *writer, uint64_t end) {
    const run_left rest = writer->e->plan.rest;
    bool fits = rest.pass == writer->e->plan.passes
                && rest.piece == writer->piece && rest.s == writer->s
                && rest.v == writer->v && rest.v > 0.0 && !writer_full(writer);
    if (!fits) {
        return;
    }
    run(writer, rest.a, rest.time, rest.s1, rest.v1, rest.last);
    if (writer->s >= piece_at(writer->e, writer->piece)->length) {
        leave_motion(writer, end);
    }
}

/* From here on more of the path would let it drive faster, and enough is
 * committed until then. */
static bool waits_for_path(const struct writer *writer) {
    return !writer->out && writer->seconds >= writer->least
           && writer->piece >= writer->e->plan.fixed_to;
}

/* Forward until the budget is used up, the window ends or the path stands
 * (hold, override 0). */
void drive_window(struct writer *writer, uint64_t end) {
    struct engine *engine = writer->e;
    while (writer->piece < end && !writer_full(writer)
           && !waits_for_path(writer)) {
        const struct piece *piece = piece_at(engine, writer->piece);
        if (!is_motion(piece)) {
            pass_event(writer);
            continue;
        }
        if (!cruise(writer, piece, end)) {
            stretch st = stretch_at(engine, writer->piece, end, writer->s);
            if (writer->v < GEO_STANDS && st.soft <= 0.0) {
                writer->v = 0.0;
                return;
            }
            drive_stretch(writer, &st, st.to >= piece->length);
        }
        if (writer->s >= piece->length) {
            leave_motion(writer, end);
        }
    }
}

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
void planner_store_tail(struct engine *engine) {
    if (!engine->plan.tail_due) {
        return;
    }
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

/* The tail was driven: go on from where it ended. */
static bool resume_after_tail(struct engine *engine) {
    uint64_t word = ATOMIC_GET(engine->commit);
    if (!(word & 1)) {
        return true;
    }
    if (!ATOMIC_GET(engine->tail_done)) {
        return false;
    }
    const struct tail *tail = &engine->plan.tails[(word >> 1) & 1];
    double driven = 0.0;
    for (uint32_t i = tail->first; i < tail->count; i++) {
        driven += tail->phases[i].time;
    }
    engine->plan.piece = tail->piece;
    engine->plan.s = tail->s;
    engine->plan.v = 0.0;
    engine->plan.committed_s += driven;
    engine->plan.written = word >> 2;
    struct tail *other = &engine->plan.tails[((word >> 1) & 1) ^ 1];
    other->first = other->count = 0;
    other->edition = 0;
    engine->drive.restart = true;
    engine->rejoin.over = false;
    engine->plan.late = false;
    engine->tail_done = 0;
    ATOMIC_SET(engine->commit, word ^ 3u);
    return true;
}

static bool state_feasible(struct engine *engine, uint64_t end, double bent) {
    if (engine->plan.v <= 0.0) {
        return true;
    }
    if (engine->plan.piece >= end) {
        return false;
    }
    return !is_motion(piece_at(engine, engine->plan.piece))
           || meets_all(engine,
                        engine->plan.piece,
                        end,
                        engine->plan.s,
                        engine->plan.v,
                        bent);
}

/* What the corner limits depend on besides the path: the override that zones
 * are sized for, and which gates are open. */
typedef struct conditions {
    double reserve_override;
    struct techno_counts done, done_again;
    bool single, m01;
    uint32_t held_axes;
} conditions;

static uint64_t plan_under(struct engine *engine,
                           const struct conditions *conditions) {
    engine->plan.reserve_override = conditions->reserve_override;
    engine->plan.done = conditions->done;
    engine->plan.done_again = conditions->done_again;
    engine->plan.single = conditions->single;
    engine->plan.m01 = conditions->m01;
    engine->plan.held_axes = conditions->held_axes;
    engine->plan.capped = engine->plan.piece;
    corner_caps(engine);
    uint64_t end = window_end(engine);
    backward_pass(engine, end);
    return end;
}

static double reserve_wanted(const struct engine *engine) {
    return engine->plan.ext_speed < NEVER ? NEVER
           : engine->plan.override > 1.0  ? 2.0
                                          : 1.0;
}

static bool same_counts(const struct techno_counts *now,
                        const struct techno_counts *then) {
    return ATOMIC_GET(now->std_freed) == then->std_freed
           && ATOMIC_GET(now->std_acked) == then->std_acked
           && ATOMIC_GET(now->late_freed) == then->late_freed
           && ATOMIC_GET(now->slm_acked) == then->slm_acked
           && ATOMIC_GET(now->slp_acked) == then->slp_acked;
}

/* The last plan was made under the present conditions. */
static bool conditions_hold(struct engine *engine) {
    const planner *plan = &engine->plan;
    return reserve_wanted(engine) == plan->reserve_override
           && ATOMIC_GET(engine->single_now) == plan->single
           && ATOMIC_GET(engine->m01_now) == plan->m01
           && ATOMIC_GET(engine->held_axes) == plan->held_axes
           && same_counts(&engine->done, &plan->done)
           && same_counts(&engine->done_again, &plan->done_again);
}

static struct conditions conditions_now(const struct engine *engine) {
    const planner *plan = &engine->plan;
    return (struct conditions){plan->reserve_override,
                               plan->done,
                               plan->done_again,
                               plan->single,
                               plan->m01,
                               plan->held_axes};
}

static struct conditions conditions_wanted(struct engine *engine) {
    return (struct conditions){reserve_wanted(engine),
                               techno_done(&engine->done),
                               techno_done(&engine->done_again),
                               ATOMIC_GET(engine->single_now),
                               ATOMIC_GET(engine->m01_now),
                               ATOMIC_GET(engine->held_axes)};
}

/* New conditions are taken over where the present state can be continued
 * legally under them: a larger override, a speed that the PLC commands (any
 * speed may come) and an opened gate all make zones, where less acceleration is
 * left. Until then the old ones hold. Returns the window's end. */
static uint64_t choose_conditions(struct engine *engine) {
    if (conditions_hold(engine)) {
        corner_caps(engine);
        uint64_t end = window_end(engine);
        backward_pass(engine, end);
        return end;
    }
    struct conditions old = conditions_now(engine),
                      want = conditions_wanted(engine);
    uint64_t end = plan_under(engine, &want);
    if (state_feasible(engine,
                       end,
                       want.reserve_override == old.reserve_override
                           ? FEASIBLE_BENT
                           : FEASIBLE)) {
        return end; /* else cut anew */
    }
    if (want.reserve_override > old.reserve_override) {
        engine->plan.override =
            lesser(engine->plan.override, old.reserve_override);
    }
    want.reserve_override = old.reserve_override;
    end = plan_under(engine, &want);
    return state_feasible(engine, end, FEASIBLE_BENT)
               ? end
               : plan_under(engine, &old);
}

/* The window's end; where corner limits need more of the path than is fed, more
 * is fed. */
static uint64_t choose_window(struct engine *engine) {
    watch_window(engine);
    uint64_t end = choose_conditions(engine);
    bool wants = (engine->plan.window_motions <= engine->cfg.window
                      ? engine->plan.capped < engine->piece_head
                      : engine->plan.unsettled < end)
                 && !engine->feed.final;
    return wants && feed_further(engine) ? choose_conditions(engine) : end;
}

double ahead_s(struct engine *engine) {
    double consumed;
    __atomic_load(&engine->geo.consumed_s, &consumed, __ATOMIC_ACQUIRE);
    return engine->plan.committed_s - consumed;
}

/* So much motion is ahead of GEO behind a commit; never less than the cycle
 * that comes next, or GEO would live on the tails. */
double commit_high(const struct engine *engine) {
    return greater(COMMIT_HIGH_S, COMMIT_HIGH_CYCLES * engine->cfg.cycle_s);
}

/* Less motion ahead than this: more is committed. Without jerk a planner that
 * is pumped with every cycle needs no time of its own; fewer and longer commits
 * spare it stopping tails. */
double commit_low(const struct engine *engine) {
    double least = COMMIT_LOW_CYCLES * engine->cfg.cycle_s;
    if (engine->drive.planner || ATOMIC_GET(engine->run_running)) {
        return greater(COMMIT_LOW_S, least);
    }
    return greater(lesser(COMMIT_LOW_S, PUMPED_CYCLES * engine->cfg.cycle_s),
                   least);
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
bool profile_write(struct engine *e, struct writer *w, struct tail *t) {
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

/* The path stands where GEO says; what was committed behind that place is taken
 * back. */
static bool withdraw(struct engine *engine) {
    if (ATOMIC_GET(engine->withdraw) == WITHDRAW_NONE) {
        ATOMIC_SET(engine->withdraw, WITHDRAW_ASKED);
    }
    if (ATOMIC_GET(engine->withdraw) != WITHDRAW_DONE) {
        return false;
    }
    bool before =
        engine->stand_piece
        < engine->feed.run; /* nothing of the present run has been driven yet */
    engine->plan.piece = before ? engine->feed.run : engine->stand_piece;
    engine->plan.s = before ? 0.0 : engine->stand_s;
    engine->plan.v = 0.0;
    engine->plan.late = false;
    engine->plan.written = ATOMIC_GET(engine->commit) >> 2;
    __atomic_load(&engine->geo.consumed_s,
                  &engine->plan.committed_s,
                  __ATOMIC_ACQUIRE);
    engine->drive.restart = true;
    return true;
}

/* Jobs of the feeder need standstill: brake, take back what is committed, do
 * them. False while they are pending and nothing may be committed. */
static bool jobs_allow(struct engine *engine) {
    if (ATOMIC_GET(engine->withdraw) == WITHDRAW_NONE
        && !feed_job_pending(engine)) {
        return true;
    }
    /* while GEO waits nothing more is driven, so nothing more would be
     * committed: it stands already */
    bool waits = ATOMIC_GET(engine->waits_now);
    if (engine->plan.v > 0.0 && !waits
        && ATOMIC_GET(engine->withdraw) == WITHDRAW_NONE) {
        return true; /* the hold brakes */
    }
    if (!withdraw(engine)) {
        return false;
    }
    feed_do_jobs(engine);
    ATOMIC_SET(
        engine->withdraw,
        WITHDRAW_NONE); /* not before: until then the program does not end */
    return true;
}

static bool wants_hold(struct engine *engine) {
    double override;
    __atomic_load(&engine->override_now, &override, __ATOMIC_ACQUIRE);
    return ATOMIC_GET(engine->hold_now) || override <= 0.0
           || feed_job_pending(engine);
}

/* The planner's work, timed: feed, plan, commit. `hold`: the path is to come to
 * rest. */
static __attribute__((noinline)) bool commit_more(struct engine *engine,
                                                  bool rejoins,
                                                  bool hold) {
    if (!rejoins) {
        feed(engine);
    }
    if (engine->plan.piece >= engine->piece_head) {
        return false;
    }
    __atomic_load(&engine->override_now,
                  &engine->plan.override,
                  __ATOMIC_ACQUIRE);
    __atomic_load(&engine->ext_speed,
                  &engine->plan.ext_speed,
                  __ATOMIC_ACQUIRE);
    __atomic_load(&engine->rapid_now, &engine->plan.rapid, __ATOMIC_ACQUIRE);
    engine->plan.hold = hold;
    if (rejoins) {
        rejoin_offer(engine);
    } else if (engine->drive.planner) {
        drive_commit(engine);
    } else {
        commit(engine);
    }
    return true;
}

static int pump(struct engine *engine) {
    if (ATOMIC_GET(engine->plan.stalled) || ATOMIC_GET(engine->hold_start)
        || !rejoin_settled(engine)) {
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
        }
        if (engine->plan.late || ahead_s(engine) >= commit_low(engine)) {
            return 0;
        }
    }
    uint64_t before = engine->plan.written;
    watch_start(engine);
    if (!commit_more(engine, rejoins, hold)) {
        return 0;
    }
    watch_stop(engine);
    return engine->plan.written != before;
}

/* Commit more motion if too little is ahead; returns 1 if phases were added. */
int planner_pump(struct engine *engine) {
    int added = pump(engine);
    if (engine->plan.tail_due
        && ahead_s(engine) < LAST_CYCLES * engine->cfg.cycle_s) {
        planner_store_tail(engine);
    }
    return added;
}
