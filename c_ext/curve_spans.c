/* Stretches of a polynomial for the acceleration-limited planner: rows at knots (bent.c) where they are certified.
 *
 * Between two knots the planner sees q' and q'' of every axis on their chords and a constant path acceleration u. What is
 * driven differs from that by at most
 *     |u| h^2/8 max|q'''| + x h^2/8 max|q''''| + |u| h/2 |change of q''|      (x = v^2; the last: x changes as well as q'')
 * with bounds that hold everywhere between them (curve_certify.c), and the largest u and x that the rows let through. That
 * much of the acceleration is not planned with. Where it would be much the stretch is cut; where cutting does not help,
 * because the curvature changes within micrometres, the constant bounds of the cells are left (curve_piece.c).
 */
#include <limits.h>
#include <math.h>
#include "engine_internal.h"

#define USABLE 0.999     /* share of the acceleration limit that is planned with */
#define LOSS 0.006       /* share of it that a stretch may lose before it is cut ... */
#define GIVEN_UP 0.1     /* ... and from which on constant bounds are better */
#define AT_ONCE 4        /* stretches that one certificate is cut into */
#define HALVINGS 6
#define STOP_HALVINGS 3  /* at least, between two standstills */
#define SHORTEST_MM 1e-5
#define OVER_FEED 2.0    /* the largest override */
#define TINY_MM 1e-9

typedef struct builder {
    engine *e;
    piece *p;
    const curve *c;
    span *spans;
    double *rows, scale, room[NC_AXES];
    double fast2;         /* speeds squared that occur at the most: feed and override */
    const double *reserve;
    int spare;            /* stretches kept for constant bounds of what is still to come */
} builder;

/* Largest path acceleration, speed squared. */
typedef struct extent {
    double u, x;
} extent;

static void knot_at(const builder *b, double w, double s, knot *k) {
    curve_point at;
    curve_at(b->c, w, &at);
    double bend2 = 0.0;
    for (int i = 0; i < b->c->axes; i++) {
        k->d1[i] = b->p->dir * at.d1[i];
        k->d2[i] = at.d2[i];
        if (b->c->metric >> i & 1) bend2 += at.d2[i] * at.d2[i];
    }
    k->bend = sqrt(bend2);
    k->w = w;
    k->s = s;
}

/* Knot at the parameter w, inside a piece. */
static void knot_inside(const builder *b, double w, knot *k) {
    knot_at(b, w, b->p->dir * (curve_length_to(b->c, w) * b->scale - b->p->from), k);
}

/* Knot s mm behind the start of the piece. */
static void knot_behind(const builder *b, double s, knot *k) {
    knot_at(b, curve_parameter(b->c, (b->p->from + b->p->dir * s) / b->scale), s, k);
}

/* What the limits of all axes let through at a knot. On the axes the length is measured over q' is a unit vector and q''
 * is at right angles to it, so the acceleration along either is a weighted sum of theirs. */
static extent extent_at(const builder *b, const knot *k) {
    const engine *e = b->e;
    const piece *p = b->p;
    double along = 0.0, across = 0.0, u = p->limits.path_acceleration > 0 ? (double)p->limits.path_acceleration : NEVER, x = b->fast2;
    for (int i = 0; i < b->c->axes; i++) {
        double d1 = fabs(k->d1[i]), d2 = fabs(k->d2[i]), v = piece_v_max(e, p, i);
        if (d1 > 1e-12) x = lesser(x, v * v / (d1 * d1));
        if (!(b->c->metric >> i & 1)) continue;
        along += d1 * b->room[i];
        across += d2 * b->room[i];
    }
    if (b->c->metric) u = lesser(u, along);
    if (b->c->metric && k->bend > 1e-12) x = lesser(x, across / (k->bend * k->bend));
    for (int i = 0; i < b->c->axes; i++)
        if (fabs(k->d1[i]) > 1e-12) u = lesser(u, (b->room[i] + fabs(k->d2[i]) * x) / fabs(k->d1[i]));
    for (int i = 0; i < b->c->axes; i++)
        if (fabs(k->d2[i]) > 1e-12) x = lesser(x, (b->room[i] + fabs(k->d1[i]) * u) / fabs(k->d2[i]));
    return (extent){u, x};
}

static extent extent_between(const builder *b, const knot *from, const knot *to) {
    extent first = extent_at(b, from), last = extent_at(b, to);
    double u = lesser(first.u, last.u), added = 2.0 * u * (to->s - from->s);
    return (extent){u, lesser(greater(first.x, last.x), lesser(first.x, last.x) + added)};
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

/* Rows between two knots, or constant bounds where too little would be left of an axis. */
static void add_stretch(builder *b, const knot *from, const knot *to, const double *third, const double *fourth) {
    double h = to->s - from->s, room[NC_AXES], slack[NC_AXES], turn2 = 0.0;
    if (h < TINY_MM) return;
    extent most = extent_between(b, from, to);
    for (int i = 0; i < b->c->axes; i++) {
        double steps = 0.5 * h * fabs(to->d2[i] - from->d2[i]), bend = 0.125 * h * h * fourth[i];
        slack[i] = 0.125 * h * h * third[i];
        double loss = (slack[i] + steps) * most.u + bend * most.x;
        if (!(loss <= GIVEN_UP * b->room[i])) {
            add_constant(b, from->s, to->s);
            return;
        }
        room[i] = b->room[i] - loss;
        if (b->c->metric >> i & 1) turn2 += bend * bend;
    }
    knot a = *from, z = *to;
    a.bend = z.bend = greater(a.bend, z.bend) + sqrt(turn2);
    span *s = &b->spans[b->p->span_count++];
    b->rows += bent_rows(b->e, b->p, &a, &z, room, slack, s, b->rows);
    for (int k = 0; k < 2; k++) s->cap2[k] = lesser(s->cap2[k], b->fast2);
}

/* Into how many stretches the part between two knots has to be cut. */
static int parts_needed(const builder *b, const knot *from, const knot *to, const double *third, const double *fourth) {
    double h = to->s - from->s, worst = 0.0;
    extent most = extent_between(b, from, to);
    for (int i = 0; i < b->c->axes; i++) {
        double loss = h * h * (0.625 * third[i] * most.u + 0.125 * fourth[i] * most.x);
        worst = greater(worst, loss / b->room[i]);
    }
    double n = ceil(sqrt(worst / LOSS));
    return n < 1.0 ? 1 : n < INT_MAX ? (int)n : INT_MAX;
}

static void add_stretches(builder *b, const knot *from, const knot *to, int n, const double *third, const double *fourth) {
    knot last = *from, next;
    for (int k = 1; k < n; k++) {
        knot_inside(b, from->w + (to->w - from->w) * k / n, &next);
        add_stretch(b, &last, &next, third, fourth);
        last = next;
    }
    add_stretch(b, &last, to, third, fourth);
}

/* From one knot to another; cut in halves at least `least` times, `halvings` at the most. */
static void refine(builder *b, const knot *from, const knot *to, int halvings, int least) {
    double third[NC_AXES], fourth[NC_AXES];
    int room = (int)SPANS_MAX - (int)b->p->span_count - b->spare;
    bool sure = least <= 0 && curve_certify(b->c, from->w, to->w, third, fourth);
    int n = sure ? parts_needed(b, from, to, third, fourth) : INT_MAX;
    if (n > AT_ONCE && halvings > 0 && room > 1 && to->s - from->s > SHORTEST_MM) {
        knot middle;
        knot_inside(b, 0.5 * (from->w + to->w), &middle);
        if (middle.s > from->s && middle.s < to->s) {
            refine(b, from, &middle, halvings - 1, least - 1);
            refine(b, &middle, to, halvings - 1, least - 1);
            return;
        }
    }
    if (!sure && least > 0) sure = curve_certify(b->c, from->w, to->w, third, fourth);
    if (!sure) add_constant(b, from->s, to->s);
    else add_stretches(b, from, to, n < AT_ONCE ? n : room < AT_ONCE ? room > 1 ? room : 1 : AT_ONCE, third, fourth);
}

/* Stretches of p, cut where the strips (zones of jumps) begin and end. `stands`: at both ends, and only there. */
void curve_piece_spans(engine *e, piece *p, span *spans, double *rows, const strip *strips, int n, bool stands) {
    const curve *c = curve_of(e, p);
    double top = e->plan.ext_speed < NEVER ? p->v_hard : p->feed > 0 ? lesser(p->v_hard, OVER_FEED * p->feed) : p->v_hard;
    builder b = {.e = e, .p = p, .c = c, .spans = spans, .rows = rows, .scale = p->whole / curve_length(c), .fast2 = top * top};
    b.spare = c->cells + n + HALVINGS;
    knot from, to;
    knot_behind(&b, 0.0, &from);
    for (int k = 0; k < n; k++) {
        double end = k + 1 == n ? p->length : from.s + strips[k].length;
        if (!(end > from.s)) continue;
        knot_behind(&b, end, &to);
        b.reserve = strips[k].reserve;
        for (int i = 0; i < e->cfg.axis_count; i++) b.room[i] = USABLE * piece_a_max(e, p, i) - b.reserve[i];
        refine(&b, &from, &to, HALVINGS, stands ? STOP_HALVINGS : 0);
        from = to;
    }
}
