/* Look-ahead: how fast everything ahead can still be met, backward from the end
 * of the window. */
#include <stdlib.h>
#include "engine/accel/lookahead.h"
#include "engine/accel/corner_limits.h"
#include "engine/accel/corner_zones.h"
#include "engine/accel/curved_span.h"
#include "engine/accel/span_store.h"
#include "engine/accel/spans.h"
#include "engine/path/speed_caps.h"
#include "engine/path/stands.h"
#include "engine/state/state.h"

/* The motion behind piece i, if it is known and the axes do not stand between.
 */
static const struct piece *next_of(struct engine *engine, uint64_t i) {
    uint64_t count = i;
    return piece_at(engine, i)->stop_after
                   || !next_motion(engine, &count, engine->plan.capped)
               ? NULL
               : piece_at(engine, count);
}

static void make_spans(struct engine *engine, uint64_t i) {
    const struct piece *next = next_of(engine, i);
    struct piece *piece = piece_at(engine, i);
    piece_spans(engine, i, next);
    piece->spanned = true;
}

/* First piece behind the window: N motion pieces after the one where committed
 * motion ends, or what is known. Counted on from where it was counted to. */
uint64_t window_end(struct engine *engine) {
    planner *plan = &engine->plan;
    if (plan->piece < plan->window_from || plan->piece > plan->window_to
        || plan->window_from == plan->window_to) {
        plan->window_from = plan->window_to = plan->piece;
        plan->window_motions = 0;
    }
    for (; plan->window_from < plan->piece; plan->window_from++) {
        plan->window_motions -= is_motion(piece_at(engine, plan->window_from));
    }
    while (plan->window_to < plan->capped
           && plan->window_motions <= engine->cfg.window
           && plan->window_to - plan->piece <= plan->span_mask) {
        plan->window_motions += is_motion(piece_at(engine, plan->window_to++));
    }
    return plan->window_to;
}

/* Largest speed squared at the start of the stretch from which `next` can be
 * met at its end. `free`: it is the largest one that the stretch and the feed
 * allow, so it stays whatever comes behind. */
static double back_over_span(const struct span *sp,
                             double soft2,
                             double next,
                             bool *free) {
    double cap2 =
        lesser(soft2, sp->rows ? sp->cap2[0] : sp->v_hard * sp->v_hard);
    double need2 =
        sp->rows
            ? bent_need(sp, 0.0, soft2, next)
            : lesser(cap2, lesser(next, cap2) + 2.0 * sp->accel * sp->length);
    *free |= need2 >= cap2;
    return need2;
}

static double back_over_spans(struct engine *engine,
                              uint64_t i,
                              double soft,
                              double need2,
                              bool *free) {
    struct piece *piece = piece_at(engine, i);
    if (!spans_known(engine, i)) {
        make_spans(engine, i);
    }
    struct span *spans = spans_of(engine, i);
    piece->cruises = false;
    for (uint32_t k = piece->span_count; k-- > 0;) {
        need2 = spans[k].need2 =
            back_over_span(&spans[k], soft * soft, need2, free);
    }
    *free &= piece->settled; /* corners further on may leave less */
    return need2;
}

/* Where the feed can be kept all over a piece, and what lies behind it can be
 * met from there, nothing else has to be known. */
static double back_over(struct engine *engine,
                        uint64_t i,
                        double need2,
                        bool *free) {
    struct piece *piece = piece_at(engine, i);
    double soft = soft_cap(engine, piece);
    const struct piece *next = next_of(engine, i);
    if (!piece->settled) {
        piece->spanned = false; /* more is known now */
        piece->settled = zones_known(engine, piece, next);
    }
    piece->cruises =
        soft > 0.0
        && can_cruise(engine, piece, next, piece->settled, soft, need2);
    if (!piece->cruises) {
        return back_over_spans(engine, i, soft, need2, free);
    }
    *free = true;
    return soft * soft;
}

/* The stretches of a piece over which feed is not kept after all; `need2`: to
 * be met at its end. */
void settle_spans(struct engine *engine, uint64_t i, double need2) {
    bool free = false;
    back_over_spans(engine,
                    i,
                    soft_cap(engine, piece_at(engine, i)),
                    need2,
                    &free);
}

static need_key key_of(const planner *plan) {
    return (need_key){plan->override, plan->rapid, plan->ext_speed, plan->hold};
}

/* Needs below this piece are those of the last pass: nothing that they depend
 * on has changed but the window's end. */
static uint64_t kept_needs(const planner *plan) {
    need_key now = key_of(plan), then = plan->need_key;
    bool same = now.override == then.override && now.rapid == then.rapid
                && now.ext_speed == then.ext_speed && now.hold == then.hold;
    return same ? plan->need_end : 0;
}

/* Whether what the last pass has found holds on: nothing that it depends on has
 * changed but what lies behind its window. */
bool needs_hold(const struct engine *e) {
    uint64_t kept = kept_needs(&e->plan);
    return kept > e->plan.piece && kept <= e->plan.capped;
}

/* need2 at the start of piece i, from that behind it. `fixed`: it is the same
 * whatever comes behind the window. */
static double need_before(struct engine *engine,
                          uint64_t i,
                          double need2,
                          bool *fixed) {
    struct piece *piece = piece_at(engine, i);
    if (is_motion(piece)) {
        double corner2 = piece->corner_v * piece->corner_v;
        if (piece->stop_after) {
            need2 = 0.0;
        }
        *fixed |= piece->stop_after;
        need2 = back_over(engine, i, need2, fixed);
        *fixed |= need2 >= corner2 && (piece->settled || piece->cruises);
        need2 = lesser(need2, corner2);
    }
    if (!stands_before(engine, piece)) {
        return need2;
    }
    *fixed = true;
    return 0.0;
}

/* need2 of every piece from `end` back to where committed motion ends; the
 * window ends at standstill. Where a piece comes to the value it has had, all
 * those ahead of it keep theirs: so the cost for a block does not grow with the
 * window. */
void backward_pass(struct engine *engine, uint64_t end) {
    double need2 = 0.0;
    uint64_t kept = kept_needs(&engine->plan), fixed_to = 0,
             unsettled = UINT64_MAX;
    engine->plan.passed_at = engine->plan.piece;
    engine->plan.passes++;
    if (kept == end && end > engine->plan.piece
        && engine->plan.unsettled == UINT64_MAX) {
        return;
    }
    kept = kept < engine->plan.unsettled ? kept : engine->plan.unsettled;
    for (uint64_t i = end; i-- > engine->plan.piece;) {
        struct piece *piece = piece_at(engine, i);
        bool same = i < kept && is_motion(piece) && piece->settled,
             fixed = fixed_to > 0;
        need2 = need_before(engine, i, need2, &fixed);
        if (is_motion(piece) && !piece->settled) {
            unsettled = i;
        }
        if (is_motion(piece) && !piece->settled && !piece->cruises) {
            fixed_to = 0;
        }
        if (fixed && !fixed_to) {
            fixed_to = i;
        }
        if (same && need2 == piece->need2) {
            break;
        }
        piece->need2 = need2;
    }
    if (!kept || fixed_to > engine->plan.fixed_to) {
        engine->plan.fixed_to = fixed_to;
    }
    engine->plan.unsettled = unsettled;
    engine->plan.need_end = end;
    engine->plan.need_key = key_of(&engine->plan);
}
