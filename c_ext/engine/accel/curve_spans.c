/* Stretches of a polynomial: gentle ones whole, the others in parts
 * (curve_parts.c). */
#include <math.h>
#include <stdlib.h>
#include "engine/accel/curve_spans.h"
#include "curve/curve.h"
#include "engine/accel/curve_parts.h"
#include "engine/accel/span_store.h"
#include "engine/accel/tuning.h"
#include "engine/path/speed_caps.h"
#include "engine/state/state.h"
#include "engine/state/tuning.h"
#include "rows/nc_block.h"

/* Largest |q'|, |q''| of an axis over a piece, and |q'| at its ends. */
typedef struct swing {
    double d1, d2, ends[2];
} swing;

/* False if there was no room for stretches that lose as little as they should.
 */
static bool add_strips(struct builder *builder,
                       const strip *strips,
                       bool stands) {
    struct piece *piece = builder->piece;
    double *rows = builder->rows;
    place from = {0}, to;
    piece->span_count = 0;
    builder->starved = false;
    for (int k = 0; k < builder->strips; k++) {
        double end = k + 1 == builder->strips ? piece->length
                                              : from.at.s + strips[k].length;
        if (!(end > from.at.s)) {
            continue;
        }
        builder->reserve = strips[k].reserve;
        for (int i = 0; i < builder->c->axes; i++) {
            builder->room[i] = builder->usable[i] - builder->reserve[i];
        }
        place_behind(builder, from.at.s, &from);
        place_behind(builder, end, &to);
        refine(builder, &from, &to, HALVINGS, stands ? STOP_HALVINGS : 0, 0);
        from = to;
    }
    if (builder->starved) {
        builder->rows = rows;
    }
    return !builder->starved;
}

/* Room for as many stretches as there should be; where there may not be so many
 * each loses more: with k times as many stretches 1/k^2 as much. */
static void make_room(struct builder *builder,
                      span_room *has,
                      const strip *strips,
                      bool stands) {
    builder->counting = true;
    add_strips(builder, strips, stands);
    builder->counting = false;
    double extra = most_constant(builder, builder->piece->dir > 0 ? 0.0 : 1.0);
    spans_grow(&builder->engine->cfg, has, builder->count + extra, SIGNS);
    builder->has = has;
    builder->spans = has->spans;
    builder->rows = has->rows;
    double share = builder->count / greater(1.0, has->count - extra);
    if (share > 1.0) {
        builder->loss =
            lesser(MOST_LOSS,
                   builder->loss * greater(MORE_LOSS, share * share));
    }
}

/* About how long the piece takes: at the programmed feed, or up to full speed
 * and down again with the slowest axis alone. */
static double seconds_about(const engine_config *cfg,
                            const struct piece *piece) {
    double a = NEVER;
    for (int i = 0; i < cfg->axis_count; i++) {
        if (piece->moving >> i & 1) {
            a = lesser(a, piece_a_max(cfg, piece, i));
        }
    }
    return greater(piece->length / reachable(piece, 1.0),
                   0.5 * sqrt(piece->length / a));
}

/* What constant bounds may lose of the path acceleration that the axes have: on
 * a ramp over many pieces it adds up. */
static double gentle_loss(const struct builder *builder, double free) {
    return builder->fast2 > 2.0 * free * MANY_PIECES * builder->piece->length
               ? GENTLE_RAMP
               : GENTLE_ACCEL;
}

/* Constant bounds of a strip that hold up to the speed squared x; false where
 * they would cost too much of the path acceleration. */
static bool gentle_strip(const struct builder *builder,
                         const struct swing *swing,
                         const double *reserve,
                         double length,
                         double x,
                         struct span *out) {
    double accel = NEVER, free[2] = {NEVER, NEVER};
    for (int i = 0; i < builder->c->axes; i++) {
        double room = builder->usable[i] - reserve[i],
               left = room - swing[i].d2 * x;
        if (accel * swing[i].d1 > left) {
            accel = left / swing[i].d1;
        }
        for (int k = 0; k < 2; k++) {
            if (free[k] * swing[i].ends[k] > room) {
                free[k] = room / swing[i].ends[k];
            }
        }
    }
    for (int k = 0; k < 2; k++) {
        if (accel < (1.0 - gentle_loss(builder, free[k])) * free[k]) {
            return false;
        }
    }
    if (builder->piece->limits.path_acceleration > 0) {
        accel = lesser(accel, (double)builder->piece->limits.path_acceleration);
    }
    *out = (struct span){.length = length, .accel = accel, .v_hard = sqrt(x)};
    return true;
}

/* Whether x is about the speed squared that the axes allow at both ends. */
static bool fast_enough(const struct builder *builder,
                        const struct swing *swing,
                        double x) {
    for (int k = 0; k < 2; k++) {
        double fast = builder->fast2;
        for (int i = 0; i < builder->c->axes; i++) {
            double d = swing[i].ends[k];
            if (fast * d * d > builder->v2[i]) {
                fast = builder->v2[i] / (d * d);
            }
        }
        if (x < (1.0 - GENTLE_SPEED) * fast) {
            return false;
        }
    }
    return true;
}

/* Whether the piece bends little enough at its ends. */
static bool gentle_ends(const struct builder *builder) {
    for (int k = 0; k < 2; k++) {
        double free = NEVER, accel = NEVER;
        for (int i = 0; i < builder->c->axes; i++) {
            double d = fabs(builder->ends[k].d1[i]),
                   left = builder->usable[i]
                          - fabs(builder->ends[k].d2[i]) * builder->fast2;
            if (free * d > builder->usable[i]) {
                free = builder->usable[i] / d;
            }
            if (accel * d > left) {
                accel = left / d;
            }
        }
        if (accel < (1.0 - gentle_loss(builder, free)) * free) {
            return false;
        }
    }
    return true;
}

/* The bounds of its derivatives all over the piece, or a part of it between
 * `ends`; the speed squared that its axes and the program allow on it. */
static double swings_of(const struct builder *builder, struct swing *swing) {
    const struct piece *piece = builder->piece;
    double h = builder->ends[1].s - builder->ends[0].s, bend = 0.0,
           x = builder->fast2, h2 = 0.125 * h * h;
    for (int i = 0; i < builder->c->axes; i++) {
        for (int k = 0; k < 2; k++) {
            swing[i].ends[k] = fabs(builder->ends[k].d1[i]);
        }
        swing[i].d1 = greater(swing[i].ends[0], swing[i].ends[1])
                      + h2 * builder->third[i] + ROUNDING;
        swing[i].d2 =
            greater(fabs(builder->ends[0].d2[i]), fabs(builder->ends[1].d2[i]))
            + h2 * builder->fourth[i];
        if (x * swing[i].d1 * swing[i].d1 > builder->v2[i]) {
            x = builder->v2[i] / (swing[i].d1 * swing[i].d1);
        }
        if (builder->c->metric >> i & 1) {
            bend += swing[i].d2 * swing[i].d2;
        }
    }
    if (piece->limits.radial_acceleration > 0 && bend > 0.0) {
        x = lesser(x, (double)piece->limits.radial_acceleration / sqrt(bend));
    }
    if (piece->limits.path_velocity > 0) {
        x = lesser(x,
                   (double)piece->limits.path_velocity
                       * (double)piece->limits.path_velocity);
    }
    return x;
}

/* More than can be reached at either end: what the axes allow one by one. */
static struct extent reach_bound(const struct builder *builder) {
    double u = builder->piece->limits.path_acceleration > 0
                   ? (double)builder->piece->limits.path_acceleration
                   : NEVER;
    for (int i = 0; i < builder->c->axes; i++) {
        double d1 = fabs(builder->ends[0].d1[i]),
               most = builder->room[i]
                      + fabs(builder->ends[0].d2[i]) * builder->fast2;
        if (u * d1 > most) {
            u = most / d1;
        }
    }
    return (struct extent){u, builder->fast2};
}

/* Into how many stretches a part between `ends` would be cut; not looked at
 * closely where they are few. */
static int about_parts(struct builder *builder) {
    double h = builder->ends[1].s - builder->ends[0].s;
    int count = parts_for(builder,
                          reach_bound(builder),
                          h,
                          builder->third,
                          builder->fourth);
    if (count * KEPT_PARTS < (int)SPANS_FEW) {
        return count;
    }
    struct extent at[2] = {extent_at(builder, &builder->ends[0]),
                           extent_at(builder, &builder->ends[1])};
    return parts_for(builder,
                     extent_between(&at[0], &at[1], h),
                     h,
                     builder->third,
                     builder->fourth);
}

/* Largest speed squared that may be kept between two places, with what the rows
 * there will lose. `count`: how many stretches there will be. */
static double kept_between(struct builder *builder,
                           const struct knot *from,
                           const struct knot *to,
                           int *count) {
    struct swing swing[NC_AXES];
    builder->ends[0] = *from;
    builder->ends[1] = *to;
    if (!curve_certify(builder->c,
                       from->w,
                       to->w,
                       builder->third,
                       builder->fourth)) {
        return 0.0;
    }
    int number = about_parts(builder);
    *count += number < (int)SPANS_FEW ? number : (int)SPANS_FEW;
    double x = KEPT_SPEED * swings_of(builder, swing);
    for (int i = 0; i < builder->c->axes; i++) {
        if (x * swing[i].d2 > KEPT_ACCEL * builder->room[i]) {
            x = greater(0.0, KEPT_ACCEL * builder->room[i] / swing[i].d2);
        }
    }
    return x;
}

/* The speed `top` is not exceeded. What is not used is not cleared. */
static void builder_begin(struct builder *builder,
                          struct engine *engine,
                          struct piece *piece,
                          double top) {
    const struct curve *curve = curve_of(&engine->store, piece);
    builder->engine = engine;
    builder->piece = piece;
    builder->c = curve;
    builder->scale = piece->whole / curve_length(curve);
    builder->fast2 = top * top;
    builder->loss = LOSS;
    builder->starved = builder->likely = builder->counting = false;
    builder->certified = false;
    builder->count = 0;
    set_axes(builder);
}

double curve_cruise2(struct engine *engine,
                     struct piece *piece,
                     const double *reserve,
                     double wanted) {
    const struct curve *curve = curve_of(&engine->store, piece);
    double x = 0.0;
    struct builder builder;
    builder_begin(&builder, engine, piece, reachable(piece, OVER_FEED));
    for (int i = 0; i < curve->axes; i++) {
        builder.room[i] = builder.usable[i] - reserve[i];
    }
    struct knot at[KEPT_PARTS + 1];
    knot_at(&builder, parameter_behind(&builder, 0.0), 0.0, &at[0]);
    knot_at(&builder,
            parameter_behind(&builder, piece->length),
            piece->length,
            &at[KEPT_PARTS]);
    for (int step = KEPT_PARTS; step > 0 && x < wanted; step /= 2) {
        int count = 0;
        x = NEVER;
        for (int k = 0; k < KEPT_PARTS && (x >= wanted || step == KEPT_PARTS);
             k += step) {
            struct knot *to = &at[k + step];
            if (k + step < KEPT_PARTS && k / step % 2 == 0) {
                knot_inside(&builder, 0.5 * (at[k].w + at[k + 2 * step].w), to);
            }
            x = lesser(x, kept_between(&builder, &at[k], to, &count));
        }
        if (count >= (int)SPANS_FEW) {
            x = 0.0;
        }
    }
    return x;
}

/* Where a piece bends so little that constant bounds lose next to nothing. They
 * let the speed rise and fall on one stretch, which a constant path
 * acceleration between two knots does not. */
static bool add_gentle(struct builder *builder, const strip *strips) {
    const struct piece *piece = builder->piece;
    struct swing swing[NC_AXES];
    if (!gentle_ends(builder)) {
        return false;
    }
    builder->certified = curve_certify(builder->c,
                                       builder->ends[0].w,
                                       builder->ends[1].w,
                                       builder->third,
                                       builder->fourth);
    if (!builder->certified) {
        return false;
    }
    double x = swings_of(builder, swing), at = 0.0;
    int count = 0;
    if (!fast_enough(builder, swing, x)) {
        return false;
    }
    for (int i = 0; i < builder->strips; i++) {
        double end =
            i + 1 == builder->strips ? piece->length : at + strips[i].length;
        if (!(end > at)) {
            continue;
        }
        if (!gentle_strip(builder,
                          swing,
                          strips[i].reserve,
                          end - at,
                          x,
                          &builder->spans[count++])) {
            return false;
        }
        at = end;
    }
    builder->piece->span_count = (uint32_t)count;
    return true;
}

void curve_piece_spans(struct engine *engine,
                       struct piece *piece,
                       span_room *has,
                       const strip *strips,
                       int count,
                       bool stands) {
    double top =
        reachable(piece, greater(engine->plan.reserve_override, OVER_FEED));
    span_room first = spans_first(&engine->cfg, has);
    struct builder builder;
    builder_begin(&builder, engine, piece, top);
    builder.spans = has->spans;
    builder.rows = has->rows;
    builder.has = &first;
    builder.strips = count;
    if (seconds_about(&engine->cfg, piece) > LONG_S) {
        builder.loss = LOSS_LONG;
    }
    knot_at(&builder, parameter_behind(&builder, 0.0), 0.0, &builder.ends[0]);
    knot_at(&builder,
            parameter_behind(&builder, piece->length),
            piece->length,
            &builder.ends[1]);
    double reached = reachable(piece, engine->plan.reserve_override);
    builder.fast2 =
        reached * reached; /* these are made anew when the override comes above
                              1, and taken then if what is driven meets them */
    if (add_gentle(&builder, strips)) {
        return;
    }
    builder.fast2 = top * top;
    if (add_strips(&builder, strips, stands)) {
        return;
    }
    builder.likely = true;
    make_room(&builder, has, strips, stands);
    while (!add_strips(&builder, strips, stands) && builder.loss < MOST_LOSS) {
        builder.loss *= MORE_LOSS;
    }
}

void curve_prefetch(const struct engine *engine, uint64_t i) {
    const struct piece *piece = &engine->run.pieces[i & engine->run.mask];
    if (piece->kind != PIECE_CURVE) {
        return;
    }
    const struct curve *curve = curve_of(&engine->store, piece);
    for (int axis = 0; axis < engine->cfg.axis_count; axis++) {
        __builtin_prefetch(curve->c[axis]);
    }
    __builtin_prefetch(curve->s);
    __builtin_prefetch(curve->bend);
    __builtin_prefetch(&curve->natural);
}
