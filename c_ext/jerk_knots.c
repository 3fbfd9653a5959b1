/* The path as it was pushed: a ring of intervals, its entry checks, and the part of an interval. */
#include <math.h>
#include <string.h>
#include "jerk_internal.h"

static bool finite_interval(const jerk_interval *q, int axes) {
    for (int e = 0; e < 2; e++)
        for (int a = 0; a < axes; a++)
            if (!isfinite(q->d1[e][a]) || !isfinite(q->d2[e][a]) || !isfinite(q->d3[e][a])) return false;
    return isfinite(q->length) && isfinite(q->feed) && isfinite(q->v_hard) && isfinite(q->offset);
}

int64_t jerk_room(const jerk_planner *p) { return (int64_t)(p->mask + 1 - (p->tail - p->head)); }

int64_t jerk_push(jerk_planner *p, const jerk_interval *intervals, int64_t n) {
    for (int64_t i = 0; i < n; i++) {
        const jerk_interval *q = &intervals[i];
        if (jerk_room(p) == 0) return i;
        int64_t error = !finite_interval(q, p->cfg.axes) ? JERK_NOT_FINITE : !(q->length > 1e-9) ? JERK_BAD_LENGTH : 0;
        if (error) return i > 0 ? i : error;
        p->ring[p->tail & p->mask] = *q;
        p->tight[p->tail & p->mask] = 1.0;
        p->tail++;
        p->finished = false;
    }
    return n;
}

void jerk_finish(jerk_planner *p, int finished) { p->finished = finished != 0; }

/* q' by the cubic through both ends with the slopes q''; q'' likewise with the slopes q'''. */
static void hermite(const jerk_interval *in, double t, int a, double *d1, double *d2, double *d3) {
    double h = in->length, t2 = t * t, t3 = t2 * t;
    double h00 = 2 * t3 - 3 * t2 + 1, h10 = t3 - 2 * t2 + t, h01 = 1 - h00, h11 = t3 - t2;
    *d1 = h00 * in->d1[0][a] + h10 * h * in->d2[0][a] + h01 * in->d1[1][a] + h11 * h * in->d2[1][a];
    *d2 = h00 * in->d2[0][a] + h10 * h * in->d3[0][a] + h01 * in->d2[1][a] + h11 * h * in->d3[1][a];
    *d3 = in->d3[0][a] + t * (in->d3[1][a] - in->d3[0][a]);
}

/* The part of an interval between two lengths of it. */
void interval_part(const jerk_interval *in, double from, double to, int axes, jerk_interval *out) {
    bool whole_start = from <= 0.0, whole_end = to >= in->length;
    jerk_interval part = *in;
    for (int a = 0; a < axes; a++) {
        if (!whole_start) hermite(in, from / in->length, a, &part.d1[0][a], &part.d2[0][a], &part.d3[0][a]);
        if (!whole_end) hermite(in, to / in->length, a, &part.d1[1][a], &part.d2[1][a], &part.d3[1][a]);
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
