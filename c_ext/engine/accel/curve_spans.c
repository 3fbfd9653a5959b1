/* Stretches of a polynomial for the acceleration-limited planner: rows at knots (curved_span.c) where they are certified.
 *
 * Between two knots the planner sees q' and q'' of every axis on their chords and a constant path acceleration u. What is
 * driven differs from that by at most
 *     |u| h^2/8 max|q'''| + x h^2/8 max|q''''| + |u| h/2 |change of q''|      (x = v^2; the last: x changes as well as q'')
 * with bounds that hold everywhere between them (bounds.c). Where that is little at the largest u and x that the rows
 * let through, it is taken off the acceleration. Else the rows carry it along, so that it counts at the u and x that occur:
 * near where a slow axis stands its rows alone let through a hundred times of what is ever driven. Where a part would lose
 * much it is cut; where there would be many stretches then, by what is likely to occur (at a standstill, at constant speed).
 * Where the speed of the parameter changes too much to tell, the constant bounds of the cells are left (piece_curve.c).
 */
#include <limits.h>
#include <math.h>
#include "engine/state/state.h"

#define USABLE 0.999     /* share of the acceleration limit that is planned with */
#define LITTLE 0.02      /* share of the limit that may be taken off */
#define LOSS 0.01       /* share of it that a stretch may lose before it is cut, more where there would be too many, ... */
#define LOSS_LONG 0.003 /* the same of pieces that take so long that stretches cost nothing */
#define LONG_S 0.02
#define MORE_LOSS 1.5    /* ... by so much each time ... */
#define MOST_LOSS 1.0    /* ... up to that */
#define GIVEN_UP 0.3     /* from which on constant bounds are better, if there is no room for more rows */
#define SIGNS 4          /* rows of an axis that carry along what they lose */
#define AT_ONCE 12       /* stretches that a certificate of a whole piece is cut into ... */
#define OF_PART 4        /* ... and one of a part */
#define CLEARLY 2         /* so many times that: it is cut in halves without being looked at */
#define TIGHTER 4         /* about how many times fewer stretches a half needs by its own certificate */
#define HALVINGS 8
#define STOP_HALVINGS 3  /* at least, between two standstills */
#define SHORTEST_MM 1e-5
#define GENTLE_ACCEL 0.1  /* share of the acceleration that constant bounds may lose ... */
#define GENTLE_RAMP 0.03  /* ... where a ramp takes many pieces ... */
#define MANY_PIECES 8.0
#define GENTLE_SPEED 0.01 /* ... and of speeds squared, if no more */
#define KEPT_ACCEL 0.97   /* share of the acceleration, ... */
#define KEPT_SPEED 0.75   /* ... of squares of speeds that may be kept: the rows of the piece let that pass */
#define KEPT_PARTS 4      /* that a piece is looked at in, for that: 1, 2, 4 */
#define OVER_FEED 2.0    /* the largest override: what is planned under a lower one must hold when it comes */
#define ROUNDING 1e-9
#define TINY_MM 1e-9

typedef struct builder {
    engine *e;
    piece *p;
    const curve *c;
    span *spans;
    double *rows, scale, room[NC_AXES];
    double usable[NC_AXES], v2[NC_AXES]; /* of the axes: acceleration that is planned with, squares of their speeds */
    double fast2;         /* speeds squared that occur at the most: feed and override */
    const double *reserve;
    double loss;          /* share of the acceleration that a stretch may lose before it is cut */
    bool starved;         /* there was no room for as many stretches */
    bool likely;          /* cut by what is likely to occur, not by what could occur at the most */
    const span_room *has;
    bool counting;        /* only how many there would be, whatever the room */
    int count;
    int strips;
    knot ends[2];         /* of the piece */
    bool certified;       /* the whole piece is, with these bounds of its derivatives */
    double third[NC_AXES], fourth[NC_AXES];
} builder;

/* Largest path acceleration, speed squared. */
typedef struct extent {
    double u, x;
} extent;

typedef struct place {
    knot at;
    extent most, likely; /* at the most; u at a standstill, x at constant speed */
} place;

static void set_axes(builder *b) {
    for (int i = 0; i < b->c->axes; i++) {
        double v = piece_v_max(b->e, b->p, i);
        b->usable[i] = USABLE * piece_a_max(b->e, b->p, i);
        b->v2[i] = v * v;
    }
}

/* The largest u and x that meet |q' u + q'' x| <= room on all axes: two axes together bound both, one axis the one by the
 * other. */
static extent extent_at(const builder *b, const knot *k) {
    const piece *p = b->p;
    double u = p->limits.path_acceleration > 0 ? (double)p->limits.path_acceleration : NEVER, x = b->fast2;
    for (int i = 0; i < b->c->axes; i++) {
        double d1 = k->d1[i], d2 = k->d2[i], room = b->room[i];
        if (x * d1 * d1 > b->v2[i]) x = b->v2[i] / (d1 * d1);
        for (int j = 0; j < i; j++) {
            double cross = fabs(d1 * k->d2[j] - k->d1[j] * d2);
            double along = fabs(d2) * b->room[j] + fabs(k->d2[j]) * room, across = fabs(d1) * b->room[j] + fabs(k->d1[j]) * room;
            if (u * cross > along) u = along / cross;
            if (x * cross > across) x = across / cross;
        }
    }
    for (int i = 0; i < b->c->axes; i++) {
        double d1 = fabs(k->d1[i]), most = b->room[i] + fabs(k->d2[i]) * x;
        if (u * d1 > most) u = most / d1;
    }
    for (int i = 0; i < b->c->axes; i++) {
        double d2 = fabs(k->d2[i]), most = b->room[i] + fabs(k->d1[i]) * u;
        if (x * d2 > most) x = most / d2;
    }
    return (extent){u, x};
}

static void knot_at(const builder *b, double w, double s, knot *k) {
    double bend2 = 0.0;
    curve_derivatives(b->c, w, k->d1, k->d2);
    for (int i = 0; i < b->c->axes; i++) {
        if (b->p->dir < 0) k->d1[i] = -k->d1[i];
        if (b->c->metric >> i & 1) bend2 += k->d2[i] * k->d2[i];
    }
    k->bend = sqrt(bend2);
    k->w = w;
    k->s = s;
}

/* What can be reached at a knot. */
static void reach_at(const builder *b, place *out) {
    const knot *k = &out->at;
    out->most = out->likely = extent_at(b, k);
    for (int i = 0; b->likely && i < b->c->axes; i++) {
        if (out->likely.u * fabs(k->d1[i]) > b->room[i]) out->likely.u = b->room[i] / fabs(k->d1[i]);
        if (out->likely.x * fabs(k->d2[i]) > b->room[i]) out->likely.x = b->room[i] / fabs(k->d2[i]);
    }
}

static void place_at(const builder *b, double w, double s, place *out) {
    knot_at(b, w, s, &out->at);
    reach_at(b, out);
}

/* Inside of a piece, at the parameter w. */
static void knot_inside(const builder *b, double w, knot *k) {
    knot_at(b, w, b->p->dir * (curve_length_to(b->c, w) * b->scale - b->p->from), k);
}

static void place_inside(const builder *b, double w, place *out) {
    knot_inside(b, w, &out->at);
    reach_at(b, out);
}

static double parameter_behind(const builder *b, double s) { return curve_parameter(b->c, (b->p->from + b->p->dir * s) / b->scale); }

/* s mm behind the start of the piece. */
static void place_behind(const builder *b, double s, place *out) {
    if (s <= 0.0 || s >= b->p->length) {
        out->at = b->ends[s > 0.0];
        reach_at(b, out);
        return;
    }
    place_at(b, parameter_behind(b, s), s, out);
}

static extent extent_between(const extent *a, const extent *z, double h) {
    double u = lesser(a->u, z->u), added = 2.0 * u * h;
    return (extent){u, lesser(greater(a->x, z->x), lesser(a->x, z->x) + added)};
}

/* ------------------------------------------------------------------------------------------------ stretches */
/* Constant bounds, cell by cell. */
static void add_constant(builder *b, double from, double to) {
    for (double at = from; at < to;) {
        int cell;
        double end = lesser(to, curve_cell_behind(b->c, b->p, at, &cell));
        span *s = &b->spans[b->p->span_count++];
        curve_cell_span(b->e, b->p, cell, b->reserve, end - at, s);
        at = end;
    }
}

/* Whether there is room for a stretch whose rows carry along what they lose, and one row an axis for all behind it. */
static bool has_more_rows(const builder *b) {
    int64_t left = b->has->row_numbers - (b->rows - b->has->rows), behind = (int64_t)b->has->count - b->p->span_count - 1;
    return left >= (SIGNS + behind) * SPAN_ROW * b->c->axes;
}

/* Rows between two knots, or constant bounds where too little would be left of an axis. */
static void add_stretch(builder *b, const place *from, const place *to, const double *third, const double *fourth) {
    double h = to->at.s - from->at.s, part = 0.125 * h * h, room[NC_AXES], turn2 = 0.0;
    if (h < TINY_MM) return;
    bent_loss lost;
    extent most = extent_between(&from->most, &to->most, h);
    bool more_rows = has_more_rows(b);
    for (int i = 0; i < b->c->axes; i++) {
        lost.above[i] = part * third[i] + ROUNDING;
        lost.u[i] = lost.above[i] + 0.5 * h * fabs(to->at.d2[i] - from->at.d2[i]);
        lost.x[i] = part * fourth[i];
        room[i] = b->room[i];
        if (b->c->metric >> i & 1) turn2 += lost.x[i] * lost.x[i];
        double loss = lost.u[i] * most.u + lost.x[i] * most.x;
        if (more_rows && loss > LITTLE * b->room[i]) continue;
        b->starved |= loss > LITTLE * b->room[i];
        if (!(loss <= GIVEN_UP * b->room[i])) {
            add_constant(b, from->at.s, to->at.s);
            return;
        }
        room[i] -= loss;
        lost.u[i] = lost.x[i] = 0.0;
    }
    knot a = from->at, z = to->at;
    a.bend = z.bend = greater(a.bend, z.bend) + sqrt(turn2);
    span *s = &b->spans[b->p->span_count++];
    b->rows += bent_rows(b->e, b->p, &a, &z, room, &lost, s, b->rows);
    for (int k = 0; k < 2; k++) s->cap2[k] = lesser(s->cap2[k], b->fast2);
}

/* Into how many stretches a part of length h has to be cut where that is reached. */
static int parts_for(const builder *b, extent most, double h, const double *third, const double *fourth) {
    double worst = 0.0;
    for (int i = 0; i < b->c->axes; i++) {
        double loss = h * h * (0.625 * third[i] * most.u + 0.125 * fourth[i] * most.x);
        if (loss > worst * b->room[i]) worst = loss / b->room[i];
    }
    if (worst >= 0.0 && worst <= b->loss) return 1;
    double n = ceil(sqrt(worst / b->loss));
    return n < INT_MAX ? (int)n : INT_MAX;
}

static int parts_needed(const builder *b, const place *from, const place *to, const double *third, const double *fourth) {
    double h = to->at.s - from->at.s;
    return parts_for(b, b->likely ? extent_between(&from->likely, &to->likely, h) : extent_between(&from->most, &to->most, h), h, third, fourth);
}

static void add_stretches(builder *b, const place *from, const place *to, int n, const double *third, const double *fourth) {
    place last = *from, next;
    for (int k = 1; k < n; k++) {
        double w = from->at.w + (to->at.w - from->at.w) * k / n;
        place_at(b, w, last.at.s + b->scale * curve_length_between(b->c, last.at.w, w), &next);
        add_stretch(b, &last, &next, third, fourth);
        last = next;
    }
    add_stretch(b, &last, to, third, fourth);
}

/* As many stretches as constant bounds from the parameter w on can take. */
static int most_constant(const builder *b, double w) {
    int cells = 0;
    for (int k = 0; k < b->c->cells; k++) cells += b->p->dir > 0 ? b->c->w[k + 1] > w : b->c->w[k] < w;
    return cells + b->strips + HALVINGS;
}

static bool cut_in_halves(builder *b, const place *from, const place *to, int halvings, int least, int about);

/* From one place to another; cut in halves at least `least` times, `halvings` at the most. `about`: so many stretches, by the
 * certificate of a part twice as long or more; 0: that says nothing. */
static void refine(builder *b, const place *from, const place *to, int halvings, int least, int about) {
    double parts[2][NC_AXES];
    if (least > 0 && cut_in_halves(b, from, to, halvings, least, about)) return;
    int left = b->counting ? INT_MAX : (int)b->has->count - (int)b->p->span_count - most_constant(b, from->at.w);
    bool clearly = about > CLEARLY * OF_PART && halvings > 0 && left > 1;
    if (clearly && cut_in_halves(b, from, to, halvings, least, about)) return;
    bool whole = b->certified && from->at.s <= 0.0 && to->at.s >= b->p->length;
    bool sure = whole || curve_certify(b->c, from->at.w, to->at.w, parts[0], parts[1]);
    const double *third = whole ? b->third : parts[0], *fourth = whole ? b->fourth : parts[1];
    int n = sure ? parts_needed(b, from, to, third, fourth) : INT_MAX, most = halvings < HALVINGS ? OF_PART : AT_ONCE;
    if (n > most && halvings > 0 && left > 1 && cut_in_halves(b, from, to, halvings, least, n < INT_MAX ? n : 0)) return;
    if (n > most) n = most;
    b->starved |= left < n;
    if (n > left) n = left < 1 ? 1 : left;
    if (b->counting) b->count += n;
    else if (sure) add_stretches(b, from, to, n, third, fourth);
    else add_constant(b, from->at.s, to->at.s);
}

static bool cut_in_halves(builder *b, const place *from, const place *to, int halvings, int least, int about) {
    place middle;
    if (to->at.s - from->at.s < SHORTEST_MM) return false;
    place_inside(b, 0.5 * (from->at.w + to->at.w), &middle);
    if (!(middle.at.s > from->at.s && middle.at.s < to->at.s)) return false;
    refine(b, from, &middle, halvings - 1, least - 1, about / TIGHTER);
    refine(b, &middle, to, halvings - 1, least - 1, about / TIGHTER);
    return true;
}

/* False if there was no room for stretches that lose as little as they should. */
static bool add_strips(builder *b, const strip *strips, bool stands) {
    piece *p = b->p;
    double *rows = b->rows;
    place from = {0}, to;
    p->span_count = 0;
    b->starved = false;
    for (int k = 0; k < b->strips; k++) {
        double end = k + 1 == b->strips ? p->length : from.at.s + strips[k].length;
        if (!(end > from.at.s)) continue;
        b->reserve = strips[k].reserve;
        for (int i = 0; i < b->c->axes; i++) b->room[i] = b->usable[i] - b->reserve[i];
        place_behind(b, from.at.s, &from);
        place_behind(b, end, &to);
        refine(b, &from, &to, HALVINGS, stands ? STOP_HALVINGS : 0, 0);
        from = to;
    }
    if (b->starved) b->rows = rows;
    return !b->starved;
}

/* Room for as many stretches as there should be; where there may not be so many each loses more: with k times as many
 * stretches 1/k^2 as much. */
static void make_room(builder *b, span_room *has, const strip *strips, bool stands) {
    b->counting = true;
    add_strips(b, strips, stands);
    b->counting = false;
    double extra = most_constant(b, b->p->dir > 0 ? 0.0 : 1.0);
    spans_grow(b->e, has, b->count + extra, SIGNS);
    b->has = has;
    b->spans = has->spans;
    b->rows = has->rows;
    double share = b->count / greater(1.0, has->count - extra);
    if (share > 1.0) b->loss = lesser(MOST_LOSS, b->loss * greater(MORE_LOSS, share * share));
}

/* About how long the piece takes: at the programmed feed, or up to full speed and down again with the slowest axis alone. */
static double seconds_about(const engine *e, const piece *p) {
    double a = NEVER;
    for (int i = 0; i < e->cfg.axis_count; i++)
        if (p->moving >> i & 1) a = lesser(a, piece_a_max(e, p, i));
    return greater(p->length / reachable(p, 1.0), 0.5 * sqrt(p->length / a));
}

/* ------------------------------------------------------------------------------------------------ gentle pieces */
/* Largest |q'|, |q''| of an axis over a piece, and |q'| at its ends. */
typedef struct swing {
    double d1, d2, ends[2];
} swing;

/* What constant bounds may lose of the path acceleration that the axes have: on a ramp over many pieces it adds up. */
static double gentle_loss(const builder *b, double free) {
    return b->fast2 > 2.0 * free * MANY_PIECES * b->p->length ? GENTLE_RAMP : GENTLE_ACCEL;
}

/* Constant bounds of a strip that hold up to the speed squared x; false where they would cost too much of the path acceleration. */
static bool gentle_strip(const builder *b, const swing *w, const double *reserve, double length, double x, span *out) {
    double accel = NEVER, free[2] = {NEVER, NEVER};
    for (int i = 0; i < b->c->axes; i++) {
        double room = b->usable[i] - reserve[i], left = room - w[i].d2 * x;
        if (accel * w[i].d1 > left) accel = left / w[i].d1;
        for (int k = 0; k < 2; k++)
            if (free[k] * w[i].ends[k] > room) free[k] = room / w[i].ends[k];
    }
    for (int k = 0; k < 2; k++)
        if (accel < (1.0 - gentle_loss(b, free[k])) * free[k]) return false;
    if (b->p->limits.path_acceleration > 0) accel = lesser(accel, (double)b->p->limits.path_acceleration);
    *out = (span){.length = length, .accel = accel, .v_hard = sqrt(x)};
    return true;
}

/* Whether x is about the speed squared that the axes allow at both ends. */
static bool fast_enough(const builder *b, const swing *w, double x) {
    for (int k = 0; k < 2; k++) {
        double fast = b->fast2;
        for (int i = 0; i < b->c->axes; i++) {
            double d = w[i].ends[k];
            if (fast * d * d > b->v2[i]) fast = b->v2[i] / (d * d);
        }
        if (x < (1.0 - GENTLE_SPEED) * fast) return false;
    }
    return true;
}

/* Whether the piece bends little enough at its ends. */
static bool gentle_ends(const builder *b) {
    for (int k = 0; k < 2; k++) {
        double free = NEVER, accel = NEVER;
        for (int i = 0; i < b->c->axes; i++) {
            double d = fabs(b->ends[k].d1[i]), left = b->usable[i] - fabs(b->ends[k].d2[i]) * b->fast2;
            if (free * d > b->usable[i]) free = b->usable[i] / d;
            if (accel * d > left) accel = left / d;
        }
        if (accel < (1.0 - gentle_loss(b, free)) * free) return false;
    }
    return true;
}

/* The bounds of its derivatives all over the piece, or a part of it between `ends`; the speed squared that its axes and the program allow on it. */
static double swings_of(const builder *b, swing *w) {
    const piece *p = b->p;
    double h = b->ends[1].s - b->ends[0].s, bend = 0.0, x = b->fast2, h2 = 0.125 * h * h;
    for (int i = 0; i < b->c->axes; i++) {
        for (int k = 0; k < 2; k++) w[i].ends[k] = fabs(b->ends[k].d1[i]);
        w[i].d1 = greater(w[i].ends[0], w[i].ends[1]) + h2 * b->third[i] + ROUNDING;
        w[i].d2 = greater(fabs(b->ends[0].d2[i]), fabs(b->ends[1].d2[i])) + h2 * b->fourth[i];
        if (x * w[i].d1 * w[i].d1 > b->v2[i]) x = b->v2[i] / (w[i].d1 * w[i].d1);
        if (b->c->metric >> i & 1) bend += w[i].d2 * w[i].d2;
    }
    if (p->limits.radial_acceleration > 0 && bend > 0.0) x = lesser(x, (double)p->limits.radial_acceleration / sqrt(bend));
    if (p->limits.path_velocity > 0) x = lesser(x, (double)p->limits.path_velocity * (double)p->limits.path_velocity);
    return x;
}

/* More than can be reached at either end: what the axes allow one by one. */
static extent reach_bound(const builder *b) {
    double u = b->p->limits.path_acceleration > 0 ? (double)b->p->limits.path_acceleration : NEVER;
    for (int i = 0; i < b->c->axes; i++) {
        double d1 = fabs(b->ends[0].d1[i]), most = b->room[i] + fabs(b->ends[0].d2[i]) * b->fast2;
        if (u * d1 > most) u = most / d1;
    }
    return (extent){u, b->fast2};
}

/* Into how many stretches a part between `ends` would be cut; not looked at closely where they are few. */
static int about_parts(builder *b) {
    double h = b->ends[1].s - b->ends[0].s;
    int n = parts_for(b, reach_bound(b), h, b->third, b->fourth);
    if (n * KEPT_PARTS < (int)SPANS_FEW) return n;
    extent at[2] = {extent_at(b, &b->ends[0]), extent_at(b, &b->ends[1])};
    return parts_for(b, extent_between(&at[0], &at[1], h), h, b->third, b->fourth);
}

/* Largest speed squared that may be kept between two places, with what the rows there will lose. `count`: how many stretches
 * there will be. */
static double kept_between(builder *b, const knot *from, const knot *to, int *count) {
    swing w[NC_AXES];
    b->ends[0] = *from;
    b->ends[1] = *to;
    if (!curve_certify(b->c, from->w, to->w, b->third, b->fourth)) return 0.0;
    int n = about_parts(b);
    *count += n < (int)SPANS_FEW ? n : (int)SPANS_FEW;
    double x = KEPT_SPEED * swings_of(b, w);
    for (int i = 0; i < b->c->axes; i++)
        if (x * w[i].d2 > KEPT_ACCEL * b->room[i]) x = greater(0.0, KEPT_ACCEL * b->room[i] / w[i].d2);
    return x;
}

/* A speed squared that all limits let be kept all over the piece, `wanted` or more if that can be shown. In more parts
 * the certificates are sharper. */
double curve_cruise2(engine *e, piece *p, const double *reserve, double wanted) {
    const curve *c = curve_of(e, p);
    double top = reachable(p, OVER_FEED), x = 0.0;
    builder b; /* of which little is of use here: not cleared */
    b.e = e;
    b.p = p;
    b.c = c;
    b.scale = p->whole / curve_length(c);
    b.fast2 = top * top;
    b.loss = LOSS;
    set_axes(&b);
    for (int i = 0; i < c->axes; i++) b.room[i] = b.usable[i] - reserve[i];
    knot at[KEPT_PARTS + 1];
    knot_at(&b, parameter_behind(&b, 0.0), 0.0, &at[0]);
    knot_at(&b, parameter_behind(&b, p->length), p->length, &at[KEPT_PARTS]);
    for (int step = KEPT_PARTS; step > 0 && x < wanted; step /= 2) {
        int count = 0;
        x = NEVER;
        for (int k = 0; k < KEPT_PARTS && (x >= wanted || step == KEPT_PARTS); k += step) {
            knot *to = &at[k + step];
            if (k + step < KEPT_PARTS && k / step % 2 == 0) knot_inside(&b, 0.5 * (at[k].w + at[k + 2 * step].w), to);
            x = lesser(x, kept_between(&b, &at[k], to, &count));
        }
        if (count >= (int)SPANS_FEW) x = 0.0;
    }
    return x;
}

/* Where a piece bends so little that constant bounds lose next to nothing. They let the speed rise and fall on one stretch,
 * which a constant path acceleration between two knots does not. */
static bool add_gentle(builder *b, const strip *strips) {
    const piece *p = b->p;
    swing w[NC_AXES];
    if (!gentle_ends(b)) return false;
    b->certified = curve_certify(b->c, b->ends[0].w, b->ends[1].w, b->third, b->fourth);
    if (!b->certified) return false;
    double x = swings_of(b, w), at = 0.0;
    int n = 0;
    if (!fast_enough(b, w, x)) return false;
    for (int i = 0; i < b->strips; i++) {
        double end = i + 1 == b->strips ? p->length : at + strips[i].length;
        if (!(end > at)) continue;
        if (!gentle_strip(b, w, strips[i].reserve, end - at, x, &b->spans[n++])) return false;
        at = end;
    }
    b->p->span_count = (uint32_t)n;
    return true;
}

/* Stretches of p, cut where the strips (zones of jumps) begin and end. `stands`: at both ends, and only there. */
void curve_piece_spans(engine *e, piece *p, span_room *has, const strip *strips, int n, bool stands) {
    const curve *c = curve_of(e, p);
    double top = reachable(p, greater(e->plan.reserve_override, OVER_FEED));
    span_room first = spans_first(e, has);
    builder b = {.e = e, .p = p, .c = c, .spans = has->spans, .rows = has->rows, .has = &first, .scale = p->whole / curve_length(c),
                 .fast2 = top * top, .strips = n, .loss = seconds_about(e, p) > LONG_S ? LOSS_LONG : LOSS};
    set_axes(&b);
    knot_at(&b, parameter_behind(&b, 0.0), 0.0, &b.ends[0]);
    knot_at(&b, parameter_behind(&b, p->length), p->length, &b.ends[1]);
    double reached = reachable(p, e->plan.reserve_override);
    b.fast2 = reached * reached; /* these are made anew when the override comes above 1, and taken then if what is driven meets them */
    if (add_gentle(&b, strips)) return;
    b.fast2 = top * top;
    if (add_strips(&b, strips, stands)) return;
    b.likely = true;
    make_room(&b, has, strips, stands);
    while (!add_strips(&b, strips, stands) && b.loss < MOST_LOSS) b.loss *= MORE_LOSS;
}
