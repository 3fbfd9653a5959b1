/* Look-ahead: how fast everything ahead can still be met, backward from the end
 * of the window. */
#include <stdlib.h>
#include "engine/accel/lookahead.h"
#include "engine/accel/corner_limits.h"
#include "engine/accel/corner_zones.h"
#include "engine/accel/curve_spans.h"
#include "engine/accel/curved_span.h"
#include "engine/accel/span_store.h"
#include "engine/accel/spans.h"
#include "engine/accel/tuning.h"
#include "engine/path/speed_caps.h"
#include "engine/path/stands.h"
#include "engine/state/state.h"

/* The motion behind piece i, if it is known and the axes do not stand between.
 */
static const struct piece *next_of(struct engine *engine, uint64_t i) {
    uint64_t count = i;
    return piece_at(&engine->run, i)->stop_after
                   || !next_motion(&engine->run, &count, engine->accel.capped)
               ? NULL
               : piece_at(&engine->run, count);
}

static void make_spans(struct engine *engine, uint64_t i) {
    const struct piece *next = next_of(engine, i);
    struct piece *piece = piece_at(&engine->run, i);
    spans_prefetch(&engine->accel, i + 1);
    spans_prefetch(&engine->accel, i - 1);
    piece_spans(engine, i, next);
    piece->spanned = true;
}

uint64_t window_end(struct engine *engine) {
    if (engine->commit.piece < engine->accel.window_from
        || engine->commit.piece > engine->accel.window_to
        || engine->accel.window_from == engine->accel.window_to) {
        engine->accel.window_from = engine->accel.window_to =
            engine->commit.piece;
        engine->accel.window_motions = 0;
    }
    for (; engine->accel.window_from < engine->commit.piece;
         engine->accel.window_from++) {
        engine->accel.window_motions -=
            is_motion(piece_at(&engine->run, engine->accel.window_from));
    }
    while (engine->accel.window_to < engine->accel.capped
           && engine->accel.window_motions <= engine->cfg.window
           && engine->accel.window_to - engine->commit.piece
                  <= engine->accel.span_mask) {
        engine->accel.window_motions +=
            is_motion(piece_at(&engine->run, engine->accel.window_to++));
    }
    return engine->accel.window_to;
}

/* Largest speed squared at the start of the stretch from which `next` can be
 * met at its end. `free`: it is the largest one that the stretch and the feed
 * allow, so it stays whatever comes behind. */
static double back_over_span(const struct span *sp,
                             double soft2,
                             double next,
                             bool *free) {
    double v2_limit =
        lesser(soft2, sp->rows ? sp->v2_limit[0] : sp->v_hard * sp->v_hard);
    double controllable_v2 =
        sp->rows
            ? curved_controllable_v2(sp, 0.0, soft2, next)
            : lesser(v2_limit,
                     lesser(next, v2_limit) + 2.0 * sp->accel * sp->length);
    *free |= controllable_v2 >= v2_limit;
    return controllable_v2;
}

static double back_over_spans(struct engine *engine,
                              uint64_t i,
                              double soft,
                              double controllable_v2,
                              bool *free) {
    struct piece *piece = piece_at(&engine->run, i);
    if (!spans_known(engine, i)) {
        make_spans(engine, i);
    }
    struct span *spans = spans_of(&engine->accel, i);
    piece->cruises = false;
    for (uint32_t k = piece->span_count; k-- > 0;) {
        controllable_v2 = spans[k].controllable_v2 =
            back_over_span(&spans[k], soft * soft, controllable_v2, free);
    }
    *free &= piece->settled; /* corners further on may leave less */
    return controllable_v2;
}

/* Where the feed can be kept all over a piece, and what lies behind it can be
 * met from there, nothing else has to be known. */
static double back_over(struct engine *engine,
                        uint64_t i,
                        double controllable_v2,
                        bool *free) {
    struct piece *piece = piece_at(&engine->run, i);
    double soft = soft_cap(&engine->plan, piece);
    const struct piece *next = next_of(engine, i);
    if (!piece->settled) {
        piece->spanned = false; /* more is known now */
        piece->settled = corner_zones_known(engine, piece, next);
    }
    piece->cruises = soft > 0.0
                     && can_cruise(engine,
                                   piece,
                                   next,
                                   piece->settled,
                                   soft,
                                   controllable_v2);
    if (!piece->cruises) {
        return back_over_spans(engine, i, soft, controllable_v2, free);
    }
    *free = true;
    return soft * soft;
}

void settle_spans(struct engine *engine, uint64_t i, double controllable_v2) {
    bool free = false;
    back_over_spans(engine,
                    i,
                    soft_cap(&engine->plan, piece_at(&engine->run, i)),
                    controllable_v2,
                    &free);
}

static need_key key_of(const struct plan_conditions *plan) {
    return (need_key){plan->override, plan->rapid, plan->ext_speed, plan->hold};
}

/* Needs below this piece are those of the last pass: nothing that they depend
 * on has changed but the window's end. */
static uint64_t kept_needs(const struct engine *engine) {
    need_key now = key_of(&engine->plan), then = engine->accel.need_key;
    bool same = now.override == then.override && now.rapid == then.rapid
                && now.ext_speed == then.ext_speed && now.hold == then.hold;
    return same ? engine->accel.need_end : 0;
}

bool needs_hold(const struct engine *engine) {
    uint64_t kept = kept_needs(engine);
    return kept > engine->commit.piece && kept <= engine->accel.capped;
}

/* controllable_v2 at the start of piece i, from that behind it. `fixed`: it is
 * the same whatever comes behind the window. */
static double need_before(struct engine *engine,
                          uint64_t i,
                          double controllable_v2,
                          bool *fixed) {
    struct piece *piece = piece_at(&engine->run, i);
    if (is_motion(piece)) {
        double corner2 = piece->corner_v * piece->corner_v;
        if (piece->stop_after) {
            controllable_v2 = 0.0;
        }
        *fixed |= piece->stop_after;
        controllable_v2 = back_over(engine, i, controllable_v2, fixed);
        *fixed |=
            controllable_v2 >= corner2 && (piece->settled || piece->cruises);
        controllable_v2 = lesser(controllable_v2, corner2);
    }
    if (!stands_before(&engine->plan, piece)) {
        return controllable_v2;
    }
    *fixed = true;
    return 0.0;
}

void backward_pass(struct engine *engine, uint64_t end) {
    double controllable_v2 = 0.0;
    uint64_t kept = kept_needs(engine), fixed_to = 0, unsettled = UINT64_MAX;
    engine->accel.passed_at = engine->commit.piece;
    engine->accel.passes++;
    if (kept == end && end > engine->commit.piece
        && engine->accel.unsettled == UINT64_MAX) {
        return;
    }
    kept = kept < engine->accel.unsettled ? kept : engine->accel.unsettled;
    for (uint64_t i = end; i-- > engine->commit.piece;) {
        struct piece *piece = piece_at(&engine->run, i);
        curve_prefetch(engine, i - FETCHED_AHEAD);
        bool same = i < kept && is_motion(piece) && piece->settled,
             fixed = fixed_to > 0;
        controllable_v2 = need_before(engine, i, controllable_v2, &fixed);
        if (is_motion(piece) && !piece->settled) {
            unsettled = i;
        }
        if (is_motion(piece) && !piece->settled && !piece->cruises) {
            fixed_to = 0;
        }
        if (fixed && !fixed_to) {
            fixed_to = i;
        }
        if (same && controllable_v2 == piece->controllable_v2) {
            break;
        }
        piece->controllable_v2 = controllable_v2;
    }
    if (!kept || fixed_to > engine->accel.fixed_to) {
        engine->accel.fixed_to = fixed_to;
    }
    engine->accel.unsettled = unsettled;
    engine->accel.need_end = end;
    engine->accel.need_key = key_of(&engine->plan);
}
