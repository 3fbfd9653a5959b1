/* Stretches of a piece for the acceleration-limited planner: lines whole, arcs
 * between knots (curved_span.c), polynomials between certified ones
 * (curve_spans.c); cut where the zones begin in which the jumps of a corner use
 * up acceleration (lookahead.c).
 */
#include <math.h>
#include <string.h>
#include "engine/accel/spans.h"
#include "curve/curve.h"
#include "engine/accel/corner_zones.h"
#include "engine/accel/curve_spans.h"
#include "engine/accel/curved_span.h"
#include "engine/accel/span_store.h"
#include "engine/accel/tuning.h"
#include "engine/path/speed_caps.h"
#include "engine/path/stands.h"
#include "engine/state/state.h"
#include "engine/state/tuning.h"
#include "rows/nc_block.h"
#include "maths/plain.h"

typedef struct builder {
    struct engine *engine;
    struct piece *piece;
    struct span *spans;
    double *rows, room[NC_AXES];
    double step; /* rad of an arc between knots */
} builder;

static double room_of(const engine_config *cfg,
                      const struct piece *piece,
                      const double *reserve,
                      int axis) {
    return USABLE * piece_a_max(cfg, piece, axis) - reserve[axis];
}

static void add_curved(struct builder *builder,
                       const struct knot *from,
                       const struct knot *to) {
    if (to->s - from->s < TINY_MM) {
        return;
    }
    builder->rows += curved_rows(&builder->engine->cfg,
                                 builder->piece,
                                 from,
                                 to,
                                 builder->room,
                                 NULL,
                                 &builder->spans[builder->piece->span_count++],
                                 builder->rows);
}

static void arc_knot(const engine_config *cfg,
                     const struct piece *piece,
                     double s,
                     struct knot *knot) {
    double w = piece->sweep / piece->whole,
           angle = piece->angle0 + w * (piece->from + piece->dir * s),
           c = plain_cos(angle), n = plain_sin(angle);
    double speed = piece->sweep * piece->dir > 0 ? piece->plane_speed
                                                 : -piece->plane_speed,
           bend = piece->radius * w * w;
    for (int i = 0; i < cfg->axis_count; i++) {
        knot->d1[i] = piece->dir * piece->slope[i];
        knot->d2[i] = 0.0;
    }
    knot->d1[piece->axis1] = -speed * n;
    knot->d1[piece->axis2] = speed * c;
    knot->d2[piece->axis1] = -bend * c;
    knot->d2[piece->axis2] = -bend * n;
    knot->bend = bend;
    knot->s = s;
}

static void turn_by(double *d, const struct piece *piece, double c, double z) {
    double d1 = d[piece->axis1], d2 = d[piece->axis2];
    d[piece->axis1] = c * d1 - z * d2;
    d[piece->axis2] = z * d1 + c * d2;
}

static void arc_strip(struct builder *builder,
                      double from,
                      double to,
                      int least) {
    double turn =
        fabs(builder->piece->sweep) / builder->piece->whole * (to - from);
    int count = (int)greater(ceil(turn / builder->step - 1e-9), least);
    struct knot last, next;
    arc_knot(&builder->engine->cfg, builder->piece, from, &last);
    double step = builder->piece->dir * builder->piece->sweep
                  / builder->piece->whole * (to - from) / count,
           c = plain_cos(step), z = plain_sin(step);
    next = last;
    for (int k = 1; k <= count; k++) {
        next.s = k == count ? to : from + (to - from) * k / count;
        turn_by(next.d1, builder->piece, c, z);
        turn_by(next.d2, builder->piece, c, z);
        add_curved(builder, &last, &next);
        last = next;
    }
}

/* Acceleration along a piece that `room` of its axes lets through; of an arc:
 * the axes beside its plane. */
static double straight_accel(const engine_config *cfg,
                             const struct piece *piece,
                             const double *room) {
    double accel = piece->limits.path_acceleration > 0
                       ? (double)piece->limits.path_acceleration
                       : NEVER;
    for (int axis = 0; axis < cfg->axis_count; axis++) {
        double share =
            fabs(piece->slope[axis]); /* zero in the plane of an arc */
        if (share > 1e-12 && accel * share > room[axis]) {
            accel = room[axis] / share;
        }
    }
    return accel;
}

static void straight_strip(struct builder *builder, double length) {
    const struct piece *piece = builder->piece;
    struct span *span = &builder->spans[builder->piece->span_count++];
    *span = (struct span){
        .length = length,
        .accel = straight_accel(&builder->engine->cfg, piece, builder->room),
        .v_hard = piece->v_hard};
    if (piece->kind != PIECE_ARC) {
        return;
    }
    double room =
        lesser(builder->room[piece->axis1], builder->room[piece->axis2]);
    span->accel = lesser(span->accel, ARC_TANGENT * room / piece->plane_speed);
    span->v_hard =
        lesser(span->v_hard, sqrt(ARC_NORMAL * room / piece->curvature));
    for (int axis = 0; axis < 2; axis++) {
        span->v_hard = lesser(span->v_hard,
                              piece_v_max(&builder->engine->cfg,
                                          piece,
                                          axis ? piece->axis2 : piece->axis1)
                                  / piece->plane_speed);
    }
}

static double turns_of(const struct piece *piece) {
    return fabs(piece->sweep) / piece->whole * piece->length;
}

static bool too_many_turns(const engine_config *cfg,
                           const struct piece *piece) {
    return turns_of(piece) > (spans_max(cfg) - ENDS) * TURN_STEP * ROUNDED;
}

/* About the square of the speed that can be kept on a piece. */
static double kept_speed2(const engine_config *cfg, const struct piece *piece) {
    double v = reachable(piece, 1.0), x = v * v;
    if (piece->kind != PIECE_ARC) {
        return x;
    }
    for (int index = 0; index < 2; index++) {
        int axis = index ? piece->axis2 : piece->axis1;
        double rate = piece_v_max(cfg, piece, axis) / piece->plane_speed;
        x = lesser(x,
                   lesser(rate * rate,
                          piece_a_max(cfg, piece, axis) / piece->curvature));
    }
    return x;
}

/* Whether the axes stand or drive much slower than at x within the way of a
 * ramp to one side of piece i. */
static bool slows_down(const struct engine *engine,
                       uint64_t i,
                       int side,
                       double x,
                       double way) {
    for (int count = 0; count < RAMP_PIECES && way > 0.0; count++) {
        const struct piece *piece = &engine->run.pieces[i & engine->run.mask];
        if (side < 0 ? stands_before(&engine->plan, piece) || i == 0
                     : piece->stop_after) {
            return true;
        }
        if (side > 0 && i + 1 >= engine->accel.capped) {
            return engine->dispatch.ends;
        }
        i = side < 0 ? i - 1 : i + 1;
        piece = &engine->run.pieces[i & engine->run.mask];
        if (!is_motion(piece)) {
            continue;
        }
        if (side > 0 && stands_before(&engine->plan, piece)) {
            return true;
        }
        if (kept_speed2(&engine->cfg, piece) < KEPT_SPEED2 * x) {
            return true;
        }
        way -= piece->length;
    }
    return false;
}

/* Whether an arc is likely to be driven with much acceleration along it. */
static bool has_ramps(const struct engine *engine, uint64_t i, double slow) {
    const struct piece *piece = &engine->run.pieces[i & engine->run.mask];
    double v = reachable(piece, 1.0), x = kept_speed2(&engine->cfg, piece),
           way = x / (2.0 * slow);
    return x < KEPT_SPEED2 * v * v || slows_down(engine, i, -1, x, way)
           || slows_down(engine, i, 1, x, way);
}

/* u is constant between knots, so what is lost of it grows with the step. Near
 * where a slow axis stands beside a quick one its share of the path changes at
 * once, and with it what it allows. */
static double turn_step(const struct engine *engine, uint64_t i) {
    const struct piece *piece = &engine->run.pieces[i & engine->run.mask];
    double a = piece_a_max(&engine->cfg, piece, piece->axis1),
           b = piece_a_max(&engine->cfg, piece, piece->axis2);
    double slow = lesser(a, b), v = reachable(piece, 1.0);
    bool ramps = has_ramps(engine, i, slow);
    double step = ramps                             ? RAMP_STEP
                  : v * v * piece->curvature > slow ? LIMITED_STEP
                                                    : TURN_STEP;
    step = greater(ramps ? LEAST_RAMP : LEAST_STEP,
                   step * sqrt(slow / greater(a, b)));
    return lesser(
        TURN_STEP,
        greater(
            step,
            turns_of(piece)
                / (spans_max(&engine->cfg)
                   - ENDS))); /* so many turns: as fine as there is room for */
}

/* Whether all limits let an arc be driven at a constant speed v, as far as
 * v_hard allows it, and the acceleration along the path that they leave
 * everywhere on it at v and below. */
static bool cruise_arc(const engine_config *cfg,
                       const struct piece *piece,
                       const double *room,
                       double v,
                       double *accel) {
    double least = lesser(room[piece->axis1], room[piece->axis2]),
           bend = piece->curvature * v * v, rate = piece->plane_speed * v;
    double v_max = lesser(piece_v_max(cfg, piece, piece->axis1),
                          piece_v_max(cfg, piece, piece->axis2));
    if (rate * rate > SURE * v_max * v_max || bend > least) {
        return false;
    }
    *accel =
        lesser(*accel, sqrt(least * least - bend * bend) / piece->plane_speed);
    return true;
}

/* What jumps use up somewhere on a piece. */
static void used_on(struct engine *engine,
                    const struct piece *piece,
                    const struct piece *next,
                    double *reserve) {
    zone_use first, last;
    corner_zones_use(engine, piece, next, &first, &last);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        reserve[i] = greater(first.reach > 0.0 ? first.reserve[i] : 0.0,
                             last.reach > 0.0 ? last.reserve[i] : 0.0);
    }
}

static bool cruise_curve(struct engine *engine,
                         struct piece *piece,
                         const struct piece *next,
                         double speed2) {
    const struct curve *curve = curve_of(&engine->store, piece);
    double reserve[NC_AXES];
    used_on(engine, piece, next, reserve);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        if (curve->bend[i] * speed2
            > USABLE * piece_a_max(&engine->cfg, piece, i) - reserve[i]) {
            return false; /* most that cannot are found here */
        }
    }
    if (piece->cruise2 < 0.0) {
        piece->cruise2 = curve_cruise2(engine, piece, reserve, speed2);
    }
    return speed2 <= piece->cruise2;
}

bool can_cruise(struct engine *engine,
                struct piece *piece,
                const struct piece *next,
                bool known,
                double speed,
                double end2) {
    bool meets = end2 >= speed * speed;
    if (piece->kind == PIECE_LINE && meets) {
        return true;
    }
    if (!known) {
        return false;
    }
    if (piece->kind == PIECE_CURVE) {
        return meets && cruise_curve(engine, piece, next, speed * speed);
    }
    if (piece->kind == PIECE_ARC && too_many_turns(&engine->cfg, piece)) {
        return false;
    }
    if (!meets && speed * speed > end2 + 2.0 * piece->accel * piece->length) {
        return false;
    }
    double room[NC_AXES];
    used_on(engine, piece, next, room);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        room[i] = USABLE * piece_a_max(&engine->cfg, piece, i) - room[i];
    }
    double accel = straight_accel(&engine->cfg, piece, room);
    if (piece->kind == PIECE_ARC
        && !cruise_arc(&engine->cfg, piece, room, speed, &accel)) {
        return false;
    }
    return meets || speed * speed <= end2 + 2.0 * accel * piece->length;
}

/* The path is not driven any further: one stretch that stands. */
static void no_memory(struct builder *builder, uint64_t i) {
    struct accel_state *accel = &builder->engine->accel;
    uint64_t slot = i & accel->span_mask;
    ATOMIC_SET(builder->engine->fault, ENGINE_NO_MEMORY);
    builder->spans = accel->span_slots[slot].spans =
        accel->spans + slot * FEW_ROOM;
    builder->spans[0] =
        (struct span){.length = builder->piece->length, .accel = NEVER};
    builder->piece->span_count = 1;
}

/* Where `count` stretches of piece i go, with rows of `numbers` in all (0: one
 * an axis and stretch). False: no memory. */
static bool choose_room(uint64_t i,
                        double count,
                        uint32_t numbers,
                        struct builder *builder) {
    struct accel_state *accel = &builder->engine->accel;
    uint64_t slot = i & accel->span_mask;
    uint32_t row = SPAN_ROW * (uint32_t)builder->engine->cfg.axis_count,
             few = FEW_ROOM * row;
    span_slot *to = &accel->span_slots[slot];
    to->owner = i;
    if (count <= FEW && numbers <= few) {
        builder->spans = to->spans = accel->spans + slot * FEW_ROOM;
        builder->rows = accel->rows + slot * few;
        return true;
    }
    uint32_t number =
        (uint32_t)lesser(count, spans_max(&builder->engine->cfg)) + 1u;
    if (!numbers) {
        numbers = number * row;
    }
    if (to->many.count < number || to->many.row_numbers < numbers) {
        room_for(&to->many,
                 (uint32_t)(MORE_ROOM * number),
                 (uint32_t)(MORE_ROOM * numbers));
    }
    builder->spans = to->spans = to->many.spans;
    builder->rows = to->many.rows;
    return to->many.count >= number && to->many.row_numbers >= numbers;
}

/* How many there are of a polynomial is seen when they are made. */
static void curve_strips(struct builder *builder,
                         uint64_t i,
                         const strip *strips,
                         int count,
                         bool stands) {
    struct accel_state *accel = &builder->engine->accel;
    struct piece *piece = builder->piece;
    uint32_t numbers = 0;
    curve_piece_spans(builder->engine,
                      piece,
                      &accel->made,
                      strips,
                      count,
                      stands);
    for (uint32_t k = 0; k < piece->span_count; k++) {
        numbers += accel->made.spans[k].rows
                       ? SPAN_ROW * accel->made.spans[k].n_rows
                       : 0u;
    }
    if (!choose_room(i, piece->span_count, numbers, builder)) {
        no_memory(builder, i);
        return;
    }
    double *rows = builder->rows;
    for (uint32_t k = 0; k < piece->span_count; k++) {
        struct span *span = &builder->spans[k];
        *span = accel->made.spans[k];
        if (!span->rows) {
            continue;
        }
        memcpy(rows, span->rows, SPAN_ROW * sizeof(double) * span->n_rows);
        span->rows = rows;
        rows += SPAN_ROW * span->n_rows;
    }
}

void piece_spans(struct engine *engine, uint64_t i, const struct piece *next) {
    struct piece *piece = piece_at(&engine->run, i);
    static const double none[NC_AXES] = {0};
    struct builder builder;
    builder.engine = engine;
    builder.piece = piece;
    builder.step = piece->kind == PIECE_ARC ? turn_step(engine, i) : 0.0;
    zone_use used1, used2;
    corner_zones_use(engine, piece, next, &used1, &used2);
    double first = used1.reach, last = used2.reach, both[NC_AXES];
    const strip parts[3] = {{first, used1.reserve},
                            {piece->length - first - last, none},
                            {last, used2.reserve}};
    const strip whole = {piece->length, both};
    bool apart = first + last < 0.9 * piece->length;
    for (int axis = 0; !apart && axis < engine->cfg.axis_count; axis++) {
        both[axis] = greater(first > 0.0 ? used1.reserve[axis] : 0.0,
                             last > 0.0 ? used2.reserve[axis] : 0.0);
    }
    const strip *strips = apart ? parts : &whole;
    int count = apart ? 3 : 1,
        least = !next && stands_before(&engine->plan, piece) ? STOP_PARTS : 1;
    double at = 0.0;
    engine->accel.cursor.piece = UINT64_MAX;
    piece->span_count = 0;
    piece->spans_made = ++engine->accel.spans_made;
    if (piece->kind == PIECE_CURVE) {
        curve_strips(&builder, i, strips, count, least > 1);
    } else if (!choose_room(
                   i,
                   piece->kind == PIECE_ARC
                       ? greater(turns_of(piece) / builder.step + ENDS, least)
                       : count,
                   0,
                   &builder)) {
        no_memory(&builder, i);
        return;
    }
    for (int k = 0; k < count && piece->kind != PIECE_CURVE; k++) {
        if (apart && strips[k].length <= 0) {
            continue;
        }
        double to = k + 1 == count || (k == 1 && last <= 0.0)
                        ? piece->length
                        : at + strips[k].length;
        for (int axis = 0; axis < engine->cfg.axis_count; axis++) {
            builder.room[axis] =
                room_of(&engine->cfg, piece, strips[k].reserve, axis);
        }
        if (piece->kind == PIECE_LINE
            || (piece->kind == PIECE_ARC
                && too_many_turns(&engine->cfg, piece))) {
            straight_strip(&builder, to - at);
        } else {
            arc_strip(&builder, at, to, apart && k != 1 ? 1 : least);
        }
        at = to;
    }
    if (piece->span_count == 0) { /* too short for knots: nothing bends */
        straight_strip(&builder, piece->length);
    }
}
