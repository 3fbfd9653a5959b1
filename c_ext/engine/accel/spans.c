/* Stretches of a piece for the acceleration-limited planner: lines whole, arcs between knots (curved_span.c), polynomials
 * between certified ones (curve_spans.c);
 * cut where the zones begin in which the jumps of a corner use up acceleration (lookahead.c).
 */
#include <math.h>
#include <stdlib.h>
#include "engine/state/state.h"

#define USABLE 0.999       /* share of the acceleration limit that is planned with */
#define TURN_STEP 0.15     /* rad of an arc between knots, ... */
#define LIMITED_STEP 0.08  /* ... where the axes cannot follow its feed, ... */
#define LEAST_STEP 0.04    /* ... at least, where the one axis of its plane is much slower than the other */
#define RAMP_STEP 0.035    /* the same where it has to change its speed much, ... */
#define LEAST_RAMP 0.015   /* ... at least */
#define KEPT_SPEED2 0.8    /* squares of speeds: a change to less is much */
#define RAMP_PIECES 8      /* looked at to either side */
#define STOP_PARTS 8       /* stretches at least between two standstills */
#define ARC_TANGENT 0.6    /* an arc of too many turns for knots: sqrt(1 - ARC_NORMAL^2) ... */
#define ARC_NORMAL 0.8     /* ... and the share of the limit for the normal direction */
#define TINY_MM 1e-9
#define FEW 12u            /* stretches that most pieces do with: these lie close together in memory */
#define FEW_ROOM (FEW + 1u)
#define SURE 0.75          /* squares of axis speeds up to which the chords of their bounds let everything pass */
#define MORE_ROOM 1.25
#define ROUNDED 1.000001
#define ENDS 3.0           /* stretches of an arc that zones can add */
#define SLOTS 2u           /* pieces, events among them, over motions of a window */

static void free_room(span_room *room) {
    free(room->spans);
    free(room->rows);
}

/* Without memory it stays as it is. */
static void room_for(span_room *room, uint32_t count, uint32_t numbers) {
    if (room->count >= count && room->row_numbers >= numbers) return;
    span *spans = malloc(count * sizeof(span)); /* nothing is read that has not been written */
    double *rows = malloc(numbers * sizeof(double));
    if (!spans || !rows) {
        free(spans);
        free(rows);
        return;
    }
    free_room(room);
    *room = (span_room){spans, rows, count, numbers};
}

static uint32_t first_count(const engine *e) { return SPANS_FIRST < spans_max(e) ? SPANS_FIRST : spans_max(e); }

/* The share of a room that there is at first, whatever pieces before have needed. */
span_room spans_first(const engine *e, const span_room *room) {
    return (span_room){room->spans, room->rows, first_count(e), ROWS_FIRST * SPAN_ROW * (uint32_t)e->cfg.axis_count};
}

bool spans_new(engine *e) {
    planner *w = &e->plan;
    uint64_t slots = 1;
    while (slots < SLOTS * ((uint64_t)e->cfg.window + 64)) slots <<= 1;
    size_t few = (size_t)(slots * FEW_ROOM), row = SPAN_ROW * (size_t)e->cfg.axis_count;
    w->span_mask = slots - 1;
    w->spans = calloc(few, sizeof(span));
    w->rows = calloc(few * row, sizeof(double));
    w->span_slots = calloc((size_t)slots, sizeof(span_slot));
    room_for(&w->made, first_count(e), ROWS_FIRST * (uint32_t)row);
    if (!w->spans || !w->rows || !w->span_slots || !w->made.count) return false;
    if (e->drive.planner) return true; /* it needs none of them */
    memory_touch(w->spans, few * sizeof(span));
    memory_touch(w->span_slots, (size_t)slots * sizeof(span_slot));
    return true;
}

void spans_free(engine *e) {
    for (uint64_t i = 0; e->plan.span_slots && i <= e->plan.span_mask; i++) free_room(&e->plan.span_slots[i].many);
    free_room(&e->plan.made);
    free(e->plan.spans);
    free(e->plan.rows);
    free(e->plan.span_slots);
}

/* Room for `count` stretches of so many rows per axis, or as many as a piece may have; what was in it is lost. */
void spans_grow(const engine *e, span_room *room, double count, uint32_t per_axis) {
    uint32_t most = (uint32_t)lesser(spans_max(e), count), row = SPAN_ROW * per_axis * (uint32_t)e->cfg.axis_count;
    if (room->count >= most && room->row_numbers >= most * row) return;
    most = (uint32_t)lesser(spans_max(e), MORE_ROOM * greater(most, room->count));
    room_for(room, most, most * row);
}

/* The stretches of piece i are those in the room it shares with others. */
bool spans_known(const engine *e, uint64_t i) {
    return e->pieces[i & e->piece_mask].spanned && e->plan.span_slots[i & e->plan.span_mask].owner == i;
}

typedef struct builder {
    engine *e;
    piece *p;
    span *spans;
    double *rows, room[NC_AXES];
    double step; /* rad of an arc between knots */
} builder;

static double room_of(const engine *e, const piece *p, const double *reserve, int axis) {
    return USABLE * piece_a_max(e, p, axis) - reserve[axis];
}

static void add_bent(builder *b, const knot *from, const knot *to) {
    if (to->s - from->s < TINY_MM) return;
    b->rows += bent_rows(b->e, b->p, from, to, b->room, NULL, &b->spans[b->p->span_count++], b->rows);
}

/* ------------------------------------------------------------------------------------------------ knots */
static void arc_knot(const engine *e, const piece *p, double s, knot *k) {
    double w = p->sweep / p->whole, angle = p->angle0 + w * (p->from + p->dir * s), c = cos(angle), n = sin(angle);
    double speed = p->sweep * p->dir > 0 ? p->plane_speed : -p->plane_speed, bend = p->radius * w * w;
    for (int i = 0; i < e->cfg.axis_count; i++) {
        k->d1[i] = p->dir * p->slope[i];
        k->d2[i] = 0.0;
    }
    k->d1[p->axis1] = -speed * n;
    k->d1[p->axis2] = speed * c;
    k->d2[p->axis1] = -bend * c;
    k->d2[p->axis2] = -bend * n;
    k->bend = bend;
    k->s = s;
}

/* ------------------------------------------------------------------------------------------------ strips */
static void turn_by(double *d, const piece *p, double c, double z) {
    double d1 = d[p->axis1], d2 = d[p->axis2];
    d[p->axis1] = c * d1 - z * d2;
    d[p->axis2] = z * d1 + c * d2;
}

static void arc_strip(builder *b, double from, double to, int least) {
    double turn = fabs(b->p->sweep) / b->p->whole * (to - from);
    int n = (int)greater(ceil(turn / b->step - 1e-9), least);
    knot last, next;
    arc_knot(b->e, b->p, from, &last);
    double step = b->p->dir * b->p->sweep / b->p->whole * (to - from) / n, c = cos(step), z = sin(step);
    next = last;
    for (int k = 1; k <= n; k++) {
        next.s = k == n ? to : from + (to - from) * k / n;
        turn_by(next.d1, b->p, c, z);
        turn_by(next.d2, b->p, c, z);
        add_bent(b, &last, &next);
        last = next;
    }
}

/* Acceleration along a piece that `room` of its axes lets through; of an arc: the axes beside its plane. */
static double straight_accel(const engine *e, const piece *p, const double *room) {
    double accel = p->limits.path_acceleration > 0 ? (double)p->limits.path_acceleration : NEVER;
    for (int a = 0; a < e->cfg.axis_count; a++) {
        double share = fabs(p->slope[a]); /* zero in the plane of an arc */
        if (share > 1e-12 && accel * share > room[a]) accel = room[a] / share;
    }
    return accel;
}

static void straight_strip(builder *b, double length) {
    const piece *p = b->p;
    span *s = &b->spans[b->p->span_count++];
    *s = (span){.length = length, .accel = straight_accel(b->e, p, b->room), .v_hard = p->v_hard};
    if (p->kind != PIECE_ARC) return;
    double room = lesser(b->room[p->axis1], b->room[p->axis2]);
    s->accel = lesser(s->accel, ARC_TANGENT * room / p->plane_speed);
    s->v_hard = lesser(s->v_hard, sqrt(ARC_NORMAL * room / p->curvature));
    for (int a = 0; a < 2; a++) s->v_hard = lesser(s->v_hard, piece_v_max(b->e, p, a ? p->axis2 : p->axis1) / p->plane_speed);
}

static double turns_of(const piece *p) { return fabs(p->sweep) / p->whole * p->length; }

static bool too_many_turns(const engine *e, const piece *p) { return turns_of(p) > (spans_max(e) - ENDS) * TURN_STEP * ROUNDED; }

/* About the square of the speed that can be kept on a piece. */
static double kept_speed2(const engine *e, const piece *p) {
    double v = reachable(p, 1.0), x = v * v;
    if (p->kind != PIECE_ARC) return x;
    for (int a = 0; a < 2; a++) {
        int axis = a ? p->axis2 : p->axis1;
        double rate = piece_v_max(e, p, axis) / p->plane_speed;
        x = lesser(x, lesser(rate * rate, piece_a_max(e, p, axis) / p->curvature));
    }
    return x;
}

/* Whether the axes stand or drive much slower than at x within the way of a ramp to one side of piece i. */
static bool slows_down(const engine *e, uint64_t i, int side, double x, double way) {
    for (int n = 0; n < RAMP_PIECES && way > 0.0; n++) {
        const piece *p = &e->pieces[i & e->piece_mask];
        if (side < 0 ? stands_before(e, p) || i == 0 : p->stop_after) return true;
        if (side > 0 && i + 1 >= e->plan.capped) return e->feed.final;
        i = side < 0 ? i - 1 : i + 1;
        p = &e->pieces[i & e->piece_mask];
        if (!is_motion(p)) continue;
        if (side > 0 && stands_before(e, p)) return true;
        if (kept_speed2(e, p) < KEPT_SPEED2 * x) return true;
        way -= p->length;
    }
    return false;
}

/* Whether an arc is likely to be driven with much acceleration along it. */
static bool has_ramps(const engine *e, uint64_t i, double slow) {
    const piece *p = &e->pieces[i & e->piece_mask];
    double v = reachable(p, 1.0), x = kept_speed2(e, p), way = x / (2.0 * slow);
    return x < KEPT_SPEED2 * v * v || slows_down(e, i, -1, x, way) || slows_down(e, i, 1, x, way);
}

/* u is constant between knots, so what is lost of it grows with the step. Near where a slow axis stands beside a quick one its
 * share of the path changes at once, and with it what it allows. */
static double turn_step(const engine *e, uint64_t i) {
    const piece *p = &e->pieces[i & e->piece_mask];
    double a = piece_a_max(e, p, p->axis1), b = piece_a_max(e, p, p->axis2);
    double slow = lesser(a, b), v = reachable(p, 1.0);
    bool ramps = has_ramps(e, i, slow);
    double step = ramps ? RAMP_STEP : v * v * p->curvature > slow ? LIMITED_STEP : TURN_STEP;
    step = greater(ramps ? LEAST_RAMP : LEAST_STEP, step * sqrt(slow / greater(a, b)));
    return lesser(TURN_STEP, greater(step, turns_of(p) / (spans_max(e) - ENDS))); /* so many turns: as fine as there is room for */
}

/* Whether all limits let an arc be driven at a constant speed v, as far as v_hard allows it, and the acceleration along the
 * path that they leave everywhere on it at v and below. */
static bool cruise_arc(const engine *e, const piece *p, const double *room, double v, double *accel) {
    double least = lesser(room[p->axis1], room[p->axis2]), bend = p->curvature * v * v, rate = p->plane_speed * v;
    double v_max = lesser(piece_v_max(e, p, p->axis1), piece_v_max(e, p, p->axis2));
    if (rate * rate > SURE * v_max * v_max || bend > least) return false;
    *accel = lesser(*accel, sqrt(least * least - bend * bend) / p->plane_speed);
    return true;
}

/* What jumps use up somewhere on a piece. */
static void used_on(engine *e, const piece *p, const piece *next, double *reserve) {
    zone_use first, last;
    zones_use(e, p, next, &first, &last);
    for (int i = 0; i < e->cfg.axis_count; i++)
        reserve[i] = greater(first.reach > 0.0 ? first.reserve[i] : 0.0, last.reach > 0.0 ? last.reserve[i] : 0.0);
}

static bool cruise_curve(engine *e, piece *p, const piece *next, double speed2) {
    const curve *c = curve_of(e, p);
    double reserve[NC_AXES];
    used_on(e, p, next, reserve);
    for (int i = 0; i < e->cfg.axis_count; i++) {
        if (c->bend[i] * speed2 > USABLE * piece_a_max(e, p, i) - reserve[i]) return false; /* most that cannot are found here */
    }
    if (p->cruise2 < 0.0) p->cruise2 = curve_cruise2(e, p, reserve, speed2);
    return speed2 <= p->cruise2;
}

/* Whether the speed can be kept all over the piece and be brought to `end2` (squared) at its end: whatever its stretches
 * are, the largest speed at its start is that one then. `next`: the motion behind it, NULL where that ends in a standstill;
 * `known`: all corners are that use up acceleration on it. */
bool can_cruise(engine *e, piece *p, const piece *next, bool known, double speed, double end2) {
    bool meets = end2 >= speed * speed;
    if (p->kind == PIECE_LINE && meets) return true;
    if (!known) return false;
    if (p->kind == PIECE_CURVE) return meets && cruise_curve(e, p, next, speed * speed);
    if (p->kind == PIECE_ARC && too_many_turns(e, p)) return false;
    if (!meets && speed * speed > end2 + 2.0 * p->accel * p->length) return false;
    double room[NC_AXES];
    used_on(e, p, next, room);
    for (int i = 0; i < e->cfg.axis_count; i++) room[i] = USABLE * piece_a_max(e, p, i) - room[i];
    double accel = straight_accel(e, p, room);
    if (p->kind == PIECE_ARC && !cruise_arc(e, p, room, speed, &accel)) return false;
    return meets || speed * speed <= end2 + 2.0 * accel * p->length;
}

/* The path is not driven any further: one stretch that stands. */
static void no_memory(builder *b, uint64_t i) {
    planner *w = &b->e->plan;
    uint64_t slot = i & w->span_mask;
    ATOMIC_SET(b->e->fault, ENGINE_NO_MEMORY);
    b->spans = w->span_slots[slot].spans = w->spans + slot * FEW_ROOM;
    b->spans[0] = (span){.length = b->p->length, .accel = NEVER};
    b->p->span_count = 1;
}

/* Where `count` stretches of piece i go, with rows of `numbers` in all (0: one an axis and stretch). False: no memory. */
static bool choose_room(uint64_t i, double count, uint32_t numbers, builder *b) {
    planner *w = &b->e->plan;
    uint64_t slot = i & w->span_mask;
    uint32_t row = SPAN_ROW * (uint32_t)b->e->cfg.axis_count, few = FEW_ROOM * row;
    span_slot *to = &w->span_slots[slot];
    to->owner = i;
    if (count <= FEW && numbers <= few) {
        b->spans = to->spans = w->spans + slot * FEW_ROOM;
        b->rows = w->rows + slot * few;
        return true;
    }
    uint32_t n = (uint32_t)lesser(count, spans_max(b->e)) + 1u;
    if (!numbers) numbers = n * row;
    if (to->many.count < n || to->many.row_numbers < numbers) room_for(&to->many, (uint32_t)(MORE_ROOM * n), (uint32_t)(MORE_ROOM * numbers));
    b->spans = to->spans = to->many.spans;
    b->rows = to->many.rows;
    return to->many.count >= n && to->many.row_numbers >= numbers;
}

/* How many there are of a polynomial is seen when they are made. */
static void curve_strips(builder *b, uint64_t i, const strip *strips, int n, bool stands) {
    planner *w = &b->e->plan;
    piece *p = b->p;
    uint32_t numbers = 0;
    curve_piece_spans(b->e, p, &w->made, strips, n, stands);
    for (uint32_t k = 0; k < p->span_count; k++) numbers += w->made.spans[k].rows ? SPAN_ROW * w->made.spans[k].n_rows : 0u;
    if (!choose_room(i, p->span_count, numbers, b)) {
        no_memory(b, i);
        return;
    }
    double *rows = b->rows;
    for (uint32_t k = 0; k < p->span_count; k++) {
        span *s = &b->spans[k];
        *s = w->made.spans[k];
        if (!s->rows) continue;
        memcpy(rows, s->rows, SPAN_ROW * sizeof(double) * s->n_rows);
        s->rows = rows;
        rows += SPAN_ROW * s->n_rows;
    }
}

/* Stretches of piece i: a zone at either end where jumps use up acceleration, and the rest. `next`: the motion behind it,
 * NULL where it ends in a standstill or is not known. */
void piece_spans(engine *e, uint64_t i, const piece *next) {
    piece *p = piece_at(e, i);
    static const double none[NC_AXES] = {0};
    builder b;
    b.e = e;
    b.p = p;
    b.step = p->kind == PIECE_ARC ? turn_step(e, i) : 0.0;
    zone_use used1, used2;
    zones_use(e, p, next, &used1, &used2);
    double first = used1.reach, last = used2.reach, both[NC_AXES];
    const strip parts[3] = {{first, used1.reserve}, {p->length - first - last, none}, {last, used2.reserve}};
    const strip whole = {p->length, both};
    bool apart = first + last <= 0.9 * p->length;
    for (int a = 0; !apart && a < e->cfg.axis_count; a++) both[a] = greater(first > 0.0 ? used1.reserve[a] : 0.0, last > 0.0 ? used2.reserve[a] : 0.0);
    const strip *strips = apart ? parts : &whole;
    int n = apart ? 3 : 1, least = !next && stands_before(e, p) ? STOP_PARTS : 1;
    double at = 0.0;
    e->plan.cursor.piece = UINT64_MAX;
    p->span_count = 0;
    p->spans_made = ++e->plan.spans_made;
    if (p->kind == PIECE_CURVE) curve_strips(&b, i, strips, n, least > 1);
    else if (!choose_room(i, p->kind == PIECE_ARC ? greater(turns_of(p) / b.step + ENDS, least) : n, 0, &b)) {
        no_memory(&b, i);
        return;
    }
    for (int k = 0; k < n && p->kind != PIECE_CURVE; k++) {
        if (strips[k].length <= 0) continue;
        double to = k + 1 == n || (k == 1 && last <= 0.0) ? p->length : at + strips[k].length;
        for (int a = 0; a < e->cfg.axis_count; a++) b.room[a] = room_of(e, p, strips[k].reserve, a);
        if (p->kind == PIECE_LINE || (p->kind == PIECE_ARC && too_many_turns(e, p))) straight_strip(&b, to - at);
        else arc_strip(&b, at, to, apart && k != 1 ? 1 : least);
        at = to;
    }
}
