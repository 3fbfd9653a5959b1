/* From rest to rest on a straight line the time-optimal motion is known: at most seven phases of constant path jerk. */
#include <math.h>
#include "jerk/state.h"

#define SAME 1e-12        /* difference of directions */
#define LEAST_TIME 1e-12  /* s: shorter phases are left out */

typedef struct line_limits {
    double v, a, j; /* along the line */
} line_limits;

static bool straight(const jerk_planner *p, const jerk_interval *q, const jerk_interval *first) {
    for (int i = 0; i < p->cfg.axes; i++) {
        if (q->d2[0][i] != 0.0 || q->d2[1][i] != 0.0 || q->d3[0][i] != 0.0 || q->d3[1][i] != 0.0) return false;
        if (q->acc_share[i] != first->acc_share[i] || q->jerk_share[i] != first->jerk_share[i]) return false;
        if (fabs(q->d1[0][i] - first->d1[0][i]) > SAME || fabs(q->d1[1][i] - first->d1[0][i]) > SAME) return false;
    }
    return true;
}

/* Length of the line ahead, to where the axes must stand; 0: something else is ahead. */
static double line_ahead(const jerk_planner *p, uint64_t *end) {
    const jerk_interval *first = ring_at(p, p->head);
    double length = 0.0, speed = asked_speed(p, first);
    int blocks = 0;
    for (uint64_t i = p->head; i != p->tail; i++) {
        const jerk_interval *q = ring_at(p, i);
        blocks += (int)q->blocks;
        if (!straight(p, q, first) || asked_speed(p, q) != speed || q->v_hard != first->v_hard || blocks > p->cfg.window_blocks) return 0.0;
        length += q->length;
        *end = i + 1;
        if (q->flags & JERK_STAND) return length;
    }
    return p->finished ? length : 0.0;
}

static line_limits limits_along(const jerk_planner *p, const jerk_interval *q) {
    line_limits m = {asked_speed(p, q), 1e30, 1e30};
    if (q->v_hard > 0.0) m.v = fmin(m.v, q->v_hard);
    for (int i = 0; i < p->cfg.axes; i++) {
        double share = fmax(fabs(q->d1[0][i]), 1e-12);
        m.v = fmin(m.v, p->cfg.v_max[i] / share);
        m.a = fmin(m.a, acc_max(p, q, i) / share);
        m.j = fmin(m.j, jerk_max(p, q, i) / share);
    }
    return (line_limits){m.v, m.a * ACC_USABLE, m.j * JERK_USABLE};
}

typedef struct profile {
    double ramp, hold, cruise; /* s: times of jerk, of constant acceleration, of constant speed */
} profile;

static profile fastest(line_limits m, double length) {
    double full = m.a / m.j; /* time to full acceleration */
    profile t = {0};
    if (m.v * m.j >= m.a * m.a) t = (profile){.ramp = full, .hold = m.v / m.a - full};
    else t.ramp = sqrt(m.v / m.j);
    double way = m.v * (2.0 * t.ramp + t.hold);
    if (way <= length) {
        t.cruise = (length - way) / m.v;
        return t;
    }
    double v = 0.5 * m.a * (sqrt(full * full + 4.0 * length / m.a) - full);
    if (v >= m.a * full) return (profile){.ramp = full, .hold = v / m.a - full};
    return (profile){.ramp = cbrt(0.5 * length / m.j)};
}

/* Time from rest to rest over a line of this direction at this speed at most, s. */
double jerk_line_time(const jerk_planner *p, const double *direction, double length, double speed) {
    line_limits m = {speed, 1e30, 1e30};
    for (int i = 0; i < p->cfg.axes; i++) {
        double share = fmax(fabs(direction[i]), 1e-12);
        m.v = fmin(m.v, p->cfg.v_max[i] / share);
        m.a = fmin(m.a, p->cfg.a_max[i] / share);
        m.j = fmin(m.j, p->cfg.j_max[i] / share);
    }
    profile t = fastest((line_limits){m.v * VEL_USABLE, m.a * ACC_USABLE, m.j * JERK_USABLE}, length);
    return 4.0 * t.ramp + 2.0 * t.hold + t.cruise;
}

typedef struct pen {
    jerk_planner *p;
    uint64_t i;        /* ring interval, and */
    double at;         /* where in it */
    double v, a;
    bool fits;
} pen;

static double time_over(const jerk_law *law, double h) {
    double low = 0.0, high = law->time, t = fmin(high, 2.0 * h / fmax(1e-9, 2.0 * law->v0 + law->a0 * high));
    for (int k = 0; k < 80; k++) {
        jerk_state at;
        jerk_at(law, t, &at);
        if (at.s >= h) high = t;
        else low = t;
        double next = at.v > 0.0 ? t + (h - at.s) / at.v : 0.5 * (low + high);
        if (!(next > low && next < high)) next = 0.5 * (low + high);
        if (fabs(next - t) <= 1e-15) break;
        t = next;
    }
    return t;
}

/* One entry of the plan: `time` of constant jerk over `h` mm. */
static void put(pen *w, double jerk, double time, double h, bool whole) {
    jerk_planner *p = w->p;
    plan *pl = &p->plan;
    const jerk_interval *q = ring_at(p, w->i);
    double f2 = p->scale * p->scale;
    if (pl->n >= p->capacity) {
        w->fits = false;
        return;
    }
    int k = pl->n++;
    pl->h[k] = h;
    pl->x[k] = w->v * w->v / f2;
    pl->u[k] = w->a / f2;
    pl->jerk[k] = jerk;
    pl->snap[k] = pl->crackle[k] = pl->pop[k] = 0.0;
    pl->time[k] = time;
    pl->tag[k] = q->tag;
    pl->offset[k] = q->offset + w->at;
    pl->last[k] = (uint8_t)(whole + 2 * (whole && q->blocks > 0));
}

/* A phase of the profile, cut where the pushed intervals end. */
static void phase(pen *w, double jerk, double time, bool ends) {
    while (time > LEAST_TIME && w->fits) {
        const jerk_interval *q = ring_at(w->p, w->i);
        jerk_law law = {.v0 = w->v, .a0 = w->a, .jerk = jerk, .time = time};
        jerk_state end;
        jerk_at(&law, time, &end);
        double left = q->length - w->at, part = time, h = end.s;
        bool final = ends && w->i + 1 == w->p->plan.end;
        bool whole = final || h >= left - 1e-12;
        if (whole) h = left;
        if (!final && h < end.s) {
            part = time_over(&law, h);
            jerk_at(&law, part, &end);
        }
        put(w, jerk, part, h, whole);
        w->v = end.v;
        w->a = end.a;
        w->at += h;
        time = final ? 0.0 : time - part;
        if (whole && w->i + 1 < w->p->plan.end) {
            w->i++;
            w->at = 0.0;
        }
    }
}

/* Plan from rest to the next stand if a straight line leads there. */
bool plan_straight(jerk_planner *p) {
    uint64_t end = p->head;
    double length = p->at_rest && p->head != p->tail ? line_ahead(p, &end) : 0.0;
    if (!(length > 0.0)) return false;
    line_limits m = limits_along(p, ring_at(p, p->head));
    if (!(m.v > 0.0)) return false;
    profile t = fastest(m, length);
    plan *pl = &p->plan;
    pl->n = pl->next = pl->since = 0;
    pl->edition++;
    p->was = speeds_now(p);
    pl->end = end;
    pl->rest_start = pl->final = pl->stands = true;
    pl->length = length;
    pl->lasts = 0.0;
    pen w = {.p = p, .i = p->head, .fits = true};
    phase(&w, m.j, t.ramp, false);
    w.a = m.j * t.ramp;
    phase(&w, 0.0, t.hold, false);
    phase(&w, -m.j, t.ramp, false);
    w.a = 0.0;
    phase(&w, 0.0, t.cruise, false);
    phase(&w, -m.j, t.ramp, false);
    w.a = -m.j * t.ramp;
    phase(&w, 0.0, t.hold, false);
    phase(&w, m.j, t.ramp, true);
    if (!w.fits || pl->n == 0) {
        pl->n = 0;
        return false;
    }
    pl->x[pl->n] = pl->u[pl->n] = 0.0;
    p->stats.straight++;
    return true;
}
