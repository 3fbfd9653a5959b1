/* Phases without jerk: forward through the window, phase by phase, some
 * milliseconds ahead of the interpolator.
 *
 * Every commit leaves a stored stopping tail: GEO follows it when the planner
 * is late. Commit and tail are published together in one atomic word (head << 2
 * | tail buffer << 1 | taken).
 */
#include <math.h>
#include "engine/accel/profile.h"
#include "engine/accel/curved_span.h"
#include "engine/accel/lookahead.h"
#include "engine/accel/span_store.h"
#include "engine/accel/tuning.h"
#include "engine/commit/commit.h"
#include "engine/path/speed_caps.h"
#include "engine/path/stands.h"
#include "engine/state/state.h"
#include "engine/state/tuning.h"

/* Speed squared to be met at the end of piece i. */
static double need_behind(struct run_ring *run, uint64_t i, uint64_t end) {
    const struct piece *piece = piece_at(run, i);
    return piece->stop_after || i + 1 >= end
               ? 0.0
               : piece_at(run, i + 1)->controllable_v2;
}

stretch stretch_at(struct engine *engine, uint64_t i, uint64_t end, double s) {
    const struct piece *piece = piece_at(&engine->run, i);
    if (piece->cruises || !spans_known(engine, i)) {
        settle_spans(engine, i, need_behind(&engine->run, i, end));
    }
    const struct span *spans = spans_of(&engine->accel, i);
    span_cursor *at = &engine->accel.cursor;
    uint32_t last = piece->span_count - 1;
    if (at->piece != i || s < at->from) {
        *at = (span_cursor){.piece = i};
    }
    while (at->k < last && s >= at->from + spans[at->k].length) {
        at->from += spans[at->k++].length;
    }
    uint32_t k = at->k;
    double from = at->from;
    double soft = soft_cap(&engine->plan, piece),
           need = k < last ? spans[k + 1].controllable_v2
                           : need_behind(&engine->run, i, end);
    return (stretch){&spans[k],
                     from,
                     k < last ? from + spans[k].length : piece->length,
                     soft,
                     lesser(soft, spans[k].v_hard),
                     spans[k].accel,
                     need};
}

bool meets_all(struct engine *engine,
               uint64_t i,
               uint64_t end,
               double s,
               double v,
               double curved) {
    stretch st = stretch_at(engine, i, end, s);
    if (st.span->rows) {
        return v * v <= curved_controllable_v2(st.span,
                                               s - st.from,
                                               st.soft * st.soft,
                                               st.end2)
                                * curved
                            + 1e-12;
    }
    return v * v <= lesser(st.cap * st.cap,
                           lesser(st.end2, st.cap * st.cap)
                               + 2.0 * st.accel * (st.to - s))
                            * FEASIBLE
                        + 1e-12;
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
        emit_phase(writer, a, time, last);
        writer->s = s1;
        writer->v = v1;
        return;
    }
    emit_phase(writer, a, room, false);
    writer->s += writer->v * room + 0.5 * a * room * room;
    writer->v = greater(0.0, writer->v + a * room);
    if (!writer->out) {
        writer->engine->accel.remainder =
            (run_remainder){writer->piece,
                            writer->engine->accel.passes,
                            writer->s,
                            writer->v,
                            a,
                            time - room,
                            s1,
                            v1,
                            last};
    }
}

void brake_to(struct writer *writer, const stretch *st, double v1, bool ends) {
    double d = (writer->v * writer->v - v1 * v1) / (2.0 * st->accel),
           room = st->to - writer->s;
    if (d < room - TINY_STEP_MM) {
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
    emit_phase(writer, 0.0, 0.0, ends); /* what is left is rounding */
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

void drive_curved(struct writer *writer,
                  const stretch *st,
                  bool ends,
                  bool brake) {
    double at = writer->s - st->from, room = st->to - writer->s;
    const curved_remainder *left = &writer->left;
    uint64_t made = piece_at(&writer->engine->run, writer->piece)->spans_made;
    bool goes_on = !brake && left->to > writer->s
                   && left->piece == writer->piece && left->made == made
                   && left->s == writer->s && left->v == writer->v
                   && left->soft == st->soft && left->end2 == st->end2;
    curved_step step =
        goes_on ? (curved_step){.h = left->to - writer->s, .x1 = left->x1}
                : curved_forward(st->span,
                                 at,
                                 writer->v * writer->v,
                                 st->soft * st->soft,
                                 st->end2,
                                 brake);
    double to = writer->s + step.h;
    bool whole = step.h >= room - TINY_STEP_MM;
    double v1 = sqrt(step.x1), time = 2.0 * (whole ? room : step.h)
                                      / greater(writer->v + v1, 1e-30);
    if (whole && writer->v + v1 <= 1e-9) { /* what is left is rounding */
        emit_phase(writer, 0.0, 0.0, ends);
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
    writer->left =
        (curved_remainder){writer->piece,
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
        drive_curved(writer, st, ends, false);
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
    if (up > TINY_STEP_MM) {
        bool whole = flat <= TINY_STEP_MM && down <= TINY_STEP_MM;
        run(writer,
            a,
            (peak - v) / a,
            whole ? st->to : writer->s + up,
            peak,
            whole && ends);
    } else if (flat > TINY_STEP_MM) {
        writer->v = peak > 0 ? peak : v;
        run(writer,
            0.0,
            flat / writer->v,
            down <= TINY_STEP_MM ? st->to : writer->s + flat,
            writer->v,
            down <= TINY_STEP_MM && ends);
    } else {
        run_out(writer, st, out, ends);
    }
}

void leave_motion(struct writer *writer, uint64_t end) {
    struct engine *engine = writer->engine;
    const struct piece *piece = piece_at(&engine->run, writer->piece);
    double limit = piece->stop_after || writer->piece + 1 >= end ? 0.0 : NEVER;
    if (limit > 0.0) {
        const struct piece *next = piece_at(&engine->run, writer->piece + 1);
        limit = stands_before(&engine->plan, next) ? 0.0
                : is_motion(next)                  ? next->corner_v
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
    double soft = soft_cap(&writer->engine->plan, piece),
           room = piece->length - writer->s;
    bool keeps =
        piece->cruises && soft > 0.0
        && fabs(writer->v - soft) <= SAME_SPEED * soft
        && need_behind(&writer->engine->run, writer->piece, end) >= soft * soft;
    if (!keeps || room <= 0.0) {
        return false;
    }
    run(writer, 0.0, room / writer->v, piece->length, writer->v, true);
    return true;
}

void run_on(struct writer *writer, uint64_t end) {
    const run_remainder remainder = writer->engine->accel.remainder;
    bool fits = remainder.pass == writer->engine->accel.passes
                && remainder.piece == writer->piece && remainder.s == writer->s
                && remainder.v == writer->v && remainder.v > 0.0
                && !writer_full(writer);
    if (!fits) {
        return;
    }
    run(writer,
        remainder.a,
        remainder.time,
        remainder.s1,
        remainder.v1,
        remainder.last);
    if (writer->s >= piece_at(&writer->engine->run, writer->piece)->length) {
        leave_motion(writer, end);
    }
}

/* From here on more of the path would let it drive faster, and enough is
 * committed until then; or a commit that reaches far has as many pieces as it
 * may. */
static bool waits_for_path(const struct writer *writer) {
    if (writer->out) {
        return false;
    }
    return (writer->seconds >= writer->least
            && writer->piece >= writer->engine->accel.fixed_to)
           || (writer->seconds >= writer->near
               && writer->piece >= writer->far_to);
}

void drive_window(struct writer *writer, uint64_t end) {
    struct engine *engine = writer->engine;
    while (writer->piece < end && !writer_full(writer)
           && !waits_for_path(writer)) {
        const struct piece *piece = piece_at(&engine->run, writer->piece);
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
