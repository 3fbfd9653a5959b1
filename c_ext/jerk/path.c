/* The path as it was pushed: a ring of intervals, its entry checks, and the part of an interval. */
#include <math.h>
#include <string.h>
#include "jerk/state.h"

static bool finite_interval(const jerk_interval *q, int axes) {
    for (int e = 0; e < 2; e++)
        for (int a = 0; a < axes; a++)
            if (!isfinite(q->d1[e][a]) || !isfinite(q->d2[e][a]) || !isfinite(q->d3[e][a])) return false;
    return isfinite(q->length) && isfinite(q->feed) && isfinite(q->v_hard) && isfinite(q->offset);
}

/* What was consumed last stays in the ring: it may be taken back. */
int64_t jerk_room(const jerk_planner *p) { return (int64_t)(p->mask + 1 - (p->tail - p->head)) - HANDED_MAX; }

int64_t jerk_push(jerk_planner *p, const jerk_interval *intervals, int64_t n) {
    for (int64_t i = 0; i < n; i++) {
        const jerk_interval *q = &intervals[i];
        if (jerk_room(p) <= 0) return i;
        int64_t error = !finite_interval(q, p->cfg.axes) ? JERK_NOT_FINITE : !(q->length > 1e-9) ? JERK_BAD_LENGTH : 0;
        if (error) return i > 0 ? i : error;
        p->ring[p->tail & p->mask] = *q;
        p->tight[p->tail & p->mask] = 1.0;
        p->steps[p->tail & p->mask] = interval_steps(p, q);
        p->tail++;
        p->finished = false;
    }
    return n;
}

void jerk_finish(jerk_planner *p, int finished) { p->finished = finished != 0; }

/* q', q'', q''' inside an interval: the polynomial of degree 5 for q' that meets all three at both ends. */
static void inside(const jerk_interval *in, double t, int a, double *d1, double *d2, double *d3) {
    double h = in->length, p = in->d1[0][a], v = h * in->d2[0][a], w = 0.5 * h * h * in->d3[0][a];
    double dp = in->d1[1][a] - p - v - w, dv = h * in->d2[1][a] - v - 2.0 * w, dw = 0.5 * (h * h * in->d3[1][a] - 2.0 * w);
    double c3 = 10.0 * dp - 4.0 * dv + dw, c4 = -15.0 * dp + 7.0 * dv - 2.0 * dw, c5 = 6.0 * dp - 3.0 * dv + dw;
    *d1 = p + t * (v + t * (w + t * (c3 + t * (c4 + t * c5))));
    *d2 = (v + t * (2.0 * w + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5)))) / h;
    *d3 = (2.0 * w + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5))) / (h * h);
}

double jerk_third(const jerk_interval *q, double t, int axis) {
    double d1, d2, d3;
    inside(q, t, axis, &d1, &d2, &d3);
    return d3;
}

/* The part of an interval between two lengths of it. */
void interval_part(const jerk_interval *in, double from, double to, int axes, jerk_interval *out) {
    bool whole_start = from <= 0.0, whole_end = to >= in->length;
    jerk_interval part = *in;
    for (int a = 0; a < axes; a++) {
        if (!whole_start) inside(in, from / in->length, a, &part.d1[0][a], &part.d2[0][a], &part.d3[0][a]);
        if (!whole_end) inside(in, to / in->length, a, &part.d1[1][a], &part.d2[1][a], &part.d3[1][a]);
    }
    part.length = to - from;
    part.offset = in->offset + from;
    if (!whole_end) {
        part.flags &= ~JERK_STAND;
        part.blocks = 0;
    }
    *out = part;
}

/* A length of the path was handed out. */
void ring_consume(jerk_planner *p, double length, bool whole) {
    jerk_interval *q = &p->ring[p->head & p->mask];
    if (whole) {
        p->head++;
        return;
    }
    interval_part(q, length, q->length, p->cfg.axes, q);
}
