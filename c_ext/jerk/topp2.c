/* TOPP2 on a stream: see topp2.h.
 *
 * need[k] is the largest x = v^2 at knot k from which the end of the window can be met at rest.  More path can only
 * raise it, and where a new value equals the old one nothing before it changes: the backward pass stops there, so that
 * a knot is visited a bounded number of times whatever the length of the path.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "jerk/state.h"
#include "jerk/topp2.h"

#define USABLE 0.9995    /* share of the acceleration limits that is planned with */
#define SPACING_MM 1.0
#define STOP_PARTS 8     /* planner intervals at least between two stands */
#define BATCH 0.25       /* share of the window that is used up before the backward pass runs again */
#define SAME 1e-12

typedef struct knot_rows { /* u along the path and x: |cu u + cx x| <= 1, at the start and, through x + 2 h u, at the end */
    double h, cap, feed;
    double cu[2 * JERK_AXES], cx[2 * JERK_AXES];
    double need;           /* largest x at the start */
    bool last, stand, rapid;
    uint64_t tag;
    double offset;
    uint32_t blocks;
} knot_rows;

struct topp2 {
    jerk_config cfg;
    knot_rows *ring;
    uint64_t head, tail, planned, mask; /* intervals; `planned`: first whose need is not of the present window */
    uint64_t rest_from;                 /* first interval that does not know of the standstill before it */
    double x, feed_factor, rapid_factor, spacing;
    bool hold, changed;
    uint64_t steps;
};

static knot_rows *row_at(const topp2 *p, uint64_t i) { return &p->ring[i & p->mask]; }

static double soft_cap_of(const topp2 *p, const knot_rows *r) {
    double v = r->feed > 0 ? r->feed * (r->rapid ? p->rapid_factor : p->feed_factor) : 1e30;
    return fmin(r->cap, v * v);
}

/* Range of u at x, with the lines (value and slope by x) that bound it. */
typedef struct range {
    double low, high, low_slope, high_slope;
} range;

/* `least`: smallest x allowed at the end. */
static range range_at(const topp2 *p, const knot_rows *r, double x, double least, double next) {
    range o = {(least - x) / (2.0 * r->h), (next - x) / (2.0 * r->h), -0.5 / r->h, -0.5 / r->h};
    for (int a = 0; a < 2 * p->cfg.axes; a++) {
        double cu = r->cu[a], cx = r->cx[a];
        if (fabs(cu) < 1e-12) continue;
        double inv = 1.0 / cu, middle = -cx * x * inv, half = fabs(inv);
        if (middle + half < o.high) o.high = middle + half, o.high_slope = -cx * inv;
        if (middle - half > o.low) o.low = middle - half, o.low_slope = -cx * inv;
    }
    return o;
}

/* Largest x at the start of the interval with an input that leads to at most `next`. */
static double controllable(const topp2 *p, const knot_rows *r, double next) {
    double x = soft_cap_of(p, r);
    for (int i = 0; i < 4 * JERK_AXES; i++) {
        range o = range_at(p, r, x, 0.0, next);
        double gap = o.low - o.high, slope = o.low_slope - o.high_slope;
        if (gap <= 1e-13 * (fabs(o.low) + 1.0)) return x;
        if (!(slope > 0.0)) return 0.0;
        x = fmax(0.0, x - gap / slope);
    }
    return x;
}

/* Needs of the window: from its end, where the axes stand, back to where nothing changes any more. */
static void backward(topp2 *p) {
    uint64_t end = p->head;
    int blocks = 0;
    while (end != p->tail && blocks < p->cfg.window_blocks && end - p->head < (uint64_t)p->cfg.window_knots) blocks += (int)row_at(p, end++)->blocks;
    uint64_t fresh = p->changed ? end : p->planned;
    double next = 0.0;
    for (uint64_t i = end; i-- > p->head;) {
        knot_rows *r = row_at(p, i);
        if (r->stand) next = 0.0;
        double need = controllable(p, r, next);
        p->steps++;
        if (i < fresh && fabs(need - r->need) <= SAME * need) break;
        r->need = next = need;
    }
    p->planned = end;
    p->changed = false;
}

static void add_part(topp2 *p, const jerk_interval *q, bool stand) {
    knot_rows *r = row_at(p, p->tail++);
    double v = q->v_hard > 0 ? q->v_hard : 1e15;
    *r = (knot_rows){.h = q->length, .feed = q->feed, .rapid = q->flags & JERK_RAPID, .tag = q->tag, .offset = q->offset,
                     .blocks = q->blocks, .last = q->blocks != 0, .stand = stand};
    for (int a = 0; a < p->cfg.axes; a++) {
        double most = fmax(fabs(q->d1[0][a]), fabs(q->d1[1][a])), acc = USABLE * p->cfg.a_max[a] * (q->acc_share[a] > 0.0f ? (double)q->acc_share[a] : 1.0);
        if (most * v > p->cfg.v_max[a]) v = p->cfg.v_max[a] / most;
        for (int e = 0; e < 2; e++) {
            int k = 2 * a + e;
            r->cx[k] = q->d2[e][a] / acc;
            r->cu[k] = q->d1[e][a] / acc + (e ? 2.0 * q->length * r->cx[k] : 0.0);
            double bend = fabs(q->d2[e][a]) / acc;
            if (fabs(q->d1[e][a]) < 1e-9 && bend * v * v > 1.0) v = sqrt(1.0 / bend);
        }
    }
    r->cap = v * v;
}

static int parts_of(const topp2 *p, const jerk_interval *q) {
    bool alone = (p->tail == p->rest_from) && (q->flags & JERK_STAND);
    return (int)fmin(4096.0, fmax(alone ? STOP_PARTS : 1.0, ceil(q->length / p->spacing - 1e-9)));
}

int64_t topp2_room(const topp2 *p) { return (int64_t)(p->mask + 1 - (p->tail - p->head)); }

static int64_t refusal(const topp2 *p, const jerk_interval *q) {
    double sum = q->length + q->feed + q->v_hard + q->offset;
    for (int e = 0; e < 2; e++)
        for (int a = 0; a < p->cfg.axes; a++) sum += q->d1[e][a] + q->d2[e][a];
    return !isfinite(sum) ? JERK_NOT_FINITE : !(q->length > 1e-9) ? JERK_BAD_LENGTH : 0;
}

int64_t topp2_push(topp2 *p, const jerk_interval *intervals, int64_t n) {
    for (int64_t i = 0; i < n; i++) {
        const jerk_interval *q = &intervals[i];
        int64_t error = refusal(p, q);
        if (error) return i > 0 ? i : error;
        int parts = parts_of(p, q);
        if (topp2_room(p) < parts) return i;
        for (int k = 0; k < parts; k++) {
            jerk_interval part;
            interval_part(q, q->length * k / parts, k + 1 == parts ? q->length : q->length * (k + 1) / parts, p->cfg.axes, &part);
            part.blocks = k + 1 == parts ? q->blocks : 0;
            add_part(p, &part, k + 1 == parts && (q->flags & JERK_STAND));
            row_at(p, p->tail - 1)->last = k + 1 == parts;
        }
        if (q->flags & JERK_STAND) p->rest_from = p->tail;
    }
    return n;
}

static void set_law(const knot_rows *r, double h, double x, double u, jerk_law *law, bool last) {
    double x1 = fmax(0.0, x + 2.0 * h * u), v = sqrt(x), v1 = sqrt(x1);
    *law = (jerk_law){.tag = r->tag, .s0 = r->offset, .v0 = v, .a0 = u, .time = 2.0 * h / (v + v1), .length = h, .last = last};
    law->flags = x1 <= 0.0 ? JERK_STAND : 0;
}

/* Path acceleration that all axes allow at both ends at a standstill. */
static double standing_acc(const topp2 *p, const knot_rows *r) {
    double most = 1e-30;
    for (int a = 0; a < p->cfg.axes; a++) {
        double end = r->cu[2 * a + 1] - 2.0 * r->h * r->cx[2 * a + 1];
        most = fmax(most, fmax(fabs(r->cu[2 * a]), fabs(end)));
    }
    return 1.0 / most;
}

/* From rest to rest over one interval, accelerating over one half and braking over the other: two laws. */
static void hop(const topp2 *p, const knot_rows *r, jerk_law *laws) {
    double half = 0.5 * r->h, u = fmin(0.5 * standing_acc(p, r), soft_cap_of(p, r) / (2.0 * half)), bend = 0.0;
    for (int a = 0; a < 2 * p->cfg.axes; a++) bend = fmax(bend, fabs(r->cx[a]));
    u = fmin(u, 0.5 / fmax(1e-30, 2.0 * half * bend));
    double v = sqrt(2.0 * half * u), t = v / u;
    laws[0] = (jerk_law){.tag = r->tag, .s0 = r->offset, .a0 = u, .time = t, .length = half};
    laws[1] = (jerk_law){.tag = r->tag, .s0 = r->offset + half, .v0 = v, .a0 = -u, .time = t, .length = half, .last = r->last, .flags = JERK_STAND};
}

/* What a step over interval i does: as fast as `next` allows, or braking with all there is. */
typedef struct step {
    double h, u, x1;
    bool whole;
} step;

static step brake_over(const topp2 *p, const knot_rows *r, double x, double next) {
    step o = {r->h, 0.0, 0.0, true};
    range at = range_at(p, r, x, -1e30, next);
    o.u = fmin(at.low, at.high);
    if (x + 2.0 * r->h * o.u <= 0.0) { /* the stop lies inside, or at the end */
        o.u = fmin(fmax(o.u, -standing_acc(p, r)), -x / (2.0 * r->h));
        o.h = -x / (2.0 * o.u);
        o.whole = o.h >= r->h * (1.0 - 1e-9);
        if (o.whole) o.h = r->h;
        return o;
    }
    o.x1 = x + 2.0 * r->h * o.u;
    return o;
}

static step step_over(const topp2 *p, uint64_t i, double x, bool brake, double next) {
    const knot_rows *r = row_at(p, i);
    if (brake) return brake_over(p, r, x, next);
    range at = range_at(p, r, x, 0.0, next);
    step o = {r->h, at.high, fmin(next, fmax(0.0, x + 2.0 * r->h * at.high)), true};
    return o;
}

static double next_need(const topp2 *p, uint64_t i) {
    return row_at(p, i)->stand || i + 1 >= p->planned ? 0.0 : row_at(p, i + 1)->need;
}

/* The step from the head: a hold brakes; so does a speed that a reduced override no longer allows, and then what the
 * caps ask of the next knot cannot be met yet. */
static step next_step(const topp2 *p) {
    bool above = p->x > row_at(p, p->head)->need * (1.0 + 1e-9);
    return step_over(p, p->head, p->x, p->hold || above, above ? 1e30 : next_need(p, p->head));
}

static void consume(topp2 *p, const step *s) {
    knot_rows *r = row_at(p, p->head);
    p->x = s->x1;
    if (s->whole) {
        p->head++;
        return;
    }
    double share = s->h / r->h; /* a stop inside: rows of the rest stay those of the ends, cut linearly */
    for (int a = 0; a < p->cfg.axes; a++) {
        double cx = r->cx[2 * a], cu = r->cu[2 * a], ex = r->cx[2 * a + 1], eu = r->cu[2 * a + 1] - 2.0 * r->h * ex;
        r->cx[2 * a] = cx + share * (ex - cx);
        r->cu[2 * a] = cu + share * (eu - cu);
        r->cu[2 * a + 1] = eu + 2.0 * (r->h - s->h) * ex;
    }
    r->h -= s->h;
    r->offset += s->h;
    p->changed = true;
}

static bool due(const topp2 *p) {
    if (p->changed || p->head >= p->planned) return true;
    return p->tail != p->planned && (double)(p->planned - p->head) < (1.0 - BATCH) * fmin(p->cfg.window_knots, p->cfg.window_blocks);
}

int64_t topp2_take(topp2 *p, jerk_law *laws, int64_t max, double seconds) {
    int64_t n = 0;
    double t = 0.0;
    while (n < max && t < seconds && p->head != p->tail) {
        if (due(p)) backward(p);
        knot_rows *r = row_at(p, p->head);
        if (p->x <= 0.0 && (p->hold || soft_cap_of(p, r) <= 0.0)) break;
        step s = next_step(p);
        if (!(p->x + s.x1 > 0.0)) { /* between two standstills */
            if (n + 2 > max || !(next_need(p, p->head) <= 0.0)) break;
            hop(p, r, &laws[n]);
            t += laws[n].time + laws[n + 1].time;
            n += 2;
            p->head++;
            continue;
        }
        s.u = (s.x1 - p->x) / (2.0 * s.h);
        set_law(r, s.h, p->x, s.u, &laws[n], s.whole && r->last);
        t += laws[n++].time;
        p->steps++;
        consume(p, &s);
    }
    return n;
}

int64_t topp2_tail(const topp2 *p, jerk_law *laws, int64_t max) {
    int64_t n = 0;
    double x = p->x;
    for (uint64_t i = p->head; i != p->tail && n < max && x > 0.0; i++) {
        step s = step_over(p, i, x, true, 1e30);
        if (row_at(p, i)->stand) s.x1 = 0.0;
        s.u = (s.x1 - x) / (2.0 * s.h);
        set_law(row_at(p, i), s.h, x, s.u, &laws[n++], s.whole && row_at(p, i)->last);
        x = s.x1;
    }
    return n;
}

void topp2_override(topp2 *p, double feed, double rapid) {
    if (!isfinite(feed) || !isfinite(rapid)) return;
    p->changed = p->changed || feed != p->feed_factor || rapid != p->rapid_factor;
    p->feed_factor = fmax(0.0, feed);
    p->rapid_factor = fmax(0.0, rapid);
}

void topp2_hold(topp2 *p, int hold) { p->hold = hold != 0; }

uint64_t topp2_steps(const topp2 *p) { return p->steps; }

topp2 *topp2_new(const jerk_config *config, int capacity) {
    jerk_config c = *config;
    for (int a = 0; a < JERK_AXES; a++) c.j_max[a] = 1.0;
    if (jerk_check_config(&c)) return NULL;
    topp2 *p = calloc(1, sizeof *p);
    if (!p) return NULL;
    p->cfg = c;
    p->spacing = c.spacing_mm > 0 ? c.spacing_mm : SPACING_MM;
    p->feed_factor = p->rapid_factor = 1.0;
    p->mask = 1023;
    while (p->mask + 1 < (uint64_t)(capacity > 0 ? capacity : 0)) p->mask = 2 * p->mask + 1;
    p->ring = calloc(p->mask + 1, sizeof *p->ring);
    if (p->ring) return p;
    free(p);
    return NULL;
}

void topp2_free(topp2 *p) {
    if (!p) return;
    free(p->ring);
    free(p);
}
