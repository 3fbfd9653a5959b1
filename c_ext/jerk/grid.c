/* The planner's grid: pushed intervals, subdivided where they are long or near a standstill, with their caps. */
#include <math.h>
#include <string.h>
#include "jerk/state.h"

#define GRADING 0.25     /* growth of the spacing with the distance from a standstill, ... */
#define REST_GRADING 0.1 /* ... and on curves, ... */
#define RAMP_STEPS 6.0   /* ... over so many of the longest steps: the ramp to full acceleration */
#define REST_SHARE (1.0 / 20.0) /* of a line, that one interval from rest may take: half of the way is four ramps of jerk */
#define REST_FEED (1.0 / 12.0)  /* of the way in which jerk changes the feed: half of the ramp to half of it */
#define REST_MOST (1.0 / 3.0) /* of the pushed interval, that it may take in any case */
#define BEHIND_REST 0.2  /* step behind such an interval, over its length */
#define STOP_STEPS 60    /* of a stop at least */
#define BEND_STEP 0.5    /* change of the third derivatives in one planner interval, of the largest ... */
#define BEND_MATTERS 40.0 /* ... where at full feed it would take so many times the jerk limit */
#define BEND_DECIDES 200.0 /* where it would take so many times and the pushed interval turns next to not at all, as in blends of small angles: */
#define BEND_FINER 0.2
#define JUMP_SHARE 0.5   /* share of the jerk limit that jumps of derivatives may use */
#define ACC_SHARE 0.012  /* share of the acceleration limit that a jump of the direction may use: nothing is set aside for it */
#define STEP_SEEN 0.75   /* an acceleration step da shows as a jerk of at most 0.75 da / cycle in samples */
#define SLOW 0.5         /* grid step over the length in which jerk changes a low speed */
#define SLOWEST_STEP 0.1 /* of the step at a standstill: the finest where the path goes on slowly, ... */
#define SLOWEST_KNOT 2e-3 /* ... and at knots that are passed slowly, between which it grows again */
#define SLOW_FEED 1.0    /* the same for a low feed: of the speed that counts */
#define SLOW_TAIL 0.6    /* and at the end of the window, where the plan comes to rest */
#define LEAST_SHARE 0.25 /* of the jerk limit that the continuous motion keeps */
#define SMALL_JUMP 1e-3  /* jumps below this share of the limit at the present cap need no reserve */

/* Largest path jerk (scaled) over the rest interval s: at distance d from the standstill x ~ d^(4/3), and every axis
 * jerk is jerk * |q' +- 9 d q'' + 4.5 d^2 q'''| (minus where the interval ends at rest). */
static double rest_jerk(const jerk_planner *p, const segment *s, int at_end) {
    jerk_interval half;
    double most = 0.0, h = s->h, sign = at_end ? -1.0 : 1.0;
    interval_part(s->q, 0.0, 0.5 * h, p->cfg.axes, &half);
    for (int a = 0; a < p->cfg.axes; a++) {
        const jerk_interval *q = s->q;
        int far = !at_end;
        double near = q->d1[at_end][a], d = 0.5 * h;
        double mid = half.d1[1][a] + sign * 9.0 * d * half.d2[1][a] + 4.5 * d * d * half.d3[1][a];
        double end = q->d1[far][a] + sign * 9.0 * h * q->d2[far][a] + 4.5 * h * h * q->d3[far][a];
        double value = fmax(fabs(near), fmax(fabs(mid), fabs(end)));
        most = fmax(most, value / (s->share * JERK_USABLE * jerk_max(p, q, a)));
    }
    return most > 0.0 ? 1.0 / (most * p->scale * p->scale * p->scale) : 1e30;
}

static double velocity_cap(const jerk_planner *p, const jerk_interval *q) {
    double v = q->v_hard > 0 ? q->v_hard : 1e30;
    for (int a = 0; a < p->cfg.axes; a++) {
        double h = q->length, mid = 0.5 * (q->d1[0][a] + q->d1[1][a]) + 0.125 * h * (q->d2[0][a] - q->d2[1][a]);
        double most = fmax(fabs(mid), fmax(fabs(q->d1[0][a]), fabs(q->d1[1][a])));
        if (most * v > p->cfg.v_max[a]) v = p->cfg.v_max[a] / most;
    }
    v = fmin(v * VEL_USABLE, 10.0 * p->scale) / p->scale;
    return v * v;
}

/* Where the path bends so little that no row bounds it, the tangent terms still do; a cap keeps x bounded. */
void segment_limits(const jerk_planner *p, segment *s) {
    const jerk_interval *q = s->q;
    double feed = fmin(1e15, asked_speed(p, q) * VEL_USABLE / p->scale);
    s->h = q->length;
    s->jump = s->share = 1.0;
    for (int a = 0; a < p->cfg.axes; a++) s->acc[a] = 1.0;
    s->excess = s->fast = s->leave = 0.0;
    s->cap = velocity_cap(p, q);
    s->soft = fmin(s->cap, feed * feed);
    s->slower = 1.0;
}

/* Share of the jerk limit that jumps of q' and q'' take when they are passed with x. */
static double jump_used(const jerk_planner *p, const jerk_interval *left, const jerk_interval *right, double x) {
    double dt = p->cfg.cycle_s, f = p->scale, used = 0.0;
    for (int a = 0; a < p->cfg.axes; a++) {
        double bend = STEP_SEEN * f * f * fabs(right->d2[0][a] - left->d2[1][a]);
        double corner = f / dt * fabs(right->d1[0][a] - left->d1[1][a]);
        used = fmax(used, (bend * x + corner * sqrt(x)) / (fmin(jerk_max(p, left, a), jerk_max(p, right, a)) * dt));
    }
    return used;
}

/* Largest x <= cap at which the jumps take no more than their share. */
static double jump_cap(const jerk_planner *p, const jerk_interval *left, const jerk_interval *right, double cap) {
    double dt = p->cfg.cycle_s, f = p->scale;
    for (int a = 0; a < p->cfg.axes; a++) {
        double room = JUMP_SHARE * fmin(jerk_max(p, left, a), jerk_max(p, right, a)) * dt;
        double bend = STEP_SEEN * f * f * fabs(right->d2[0][a] - left->d2[1][a]);
        double corner = f / dt * fabs(right->d1[0][a] - left->d1[1][a]);
        double v = 2.0 * room / (corner + sqrt(corner * corner + 4.0 * bend * room) + 1e-300);
        double acc = ACC_SHARE * fmin(acc_max(p, left, a), acc_max(p, right, a));
        if (corner * v > acc) v = acc / corner;
        cap = fmin(cap, v * v); /* bend x + corner sqrt(x) <= room */
    }
    return cap;
}

/* A jump shows in samples up to one and a half cycles away; the speed may rise from x as fast as the path allows. */
static double jump_reach(const jerk_planner *p, const jerk_interval *left, const jerk_interval *right, double x) {
    double jerk = 1e30, t = 1.5 * p->cfg.cycle_s;
    for (int a = 0; a < p->cfg.axes; a++) {
        double along = fmax(fabs(left->d1[1][a]), fabs(right->d1[0][a]));
        jerk = fmin(jerk, fmax(jerk_max(p, left, a), jerk_max(p, right, a)) / fmax(1e-9, along));
    }
    return t * (sqrt(x) * p->scale + jerk * t * t / 6.0) + 1e-9;
}

/* The jump between two intervals that is passed at the head: it still shows in what comes next. */
void jump_passed(jerk_planner *p, const jerk_interval *left, const jerk_interval *right) {
    double used = jump_used(p, left, right, p->x);
    turn_passed(p, left, right);
    if (used < SMALL_JUMP) return;
    p->behind_share = fmax(1.0 - used, LEAST_SHARE);
    p->behind_mm = jump_reach(p, left, right, p->x);
}

/* Jumps within reach of each other add up in the samples. */
static void take_share(segment *s, double used) { s->jump = fmax(s->jump - used, LEAST_SHARE); }

/* Cap at knot k, and what is left of the jerk limit around it. */
static void knot_jump(const jerk_planner *p, grid *g, int k) {
    const jerk_interval *left = g->seg[k - 1].q, *right = g->seg[k].q;
    if (!g->seg[k - 1].last) return;
    g->knot_cap[k] = jump_cap(p, left, right, g->knot_cap[k]);
    double used = jump_used(p, left, right, g->knot_cap[k]);
    if (used < SMALL_JUMP) return;
    double reach = jump_reach(p, left, right, g->knot_cap[k]);
    for (int i = k - 1; i >= 0 && g->from_start[k] - g->from_start[i + 1] < reach; i--) take_share(&g->seg[i], used);
    for (int i = k; i < g->n && g->from_start[i] - g->from_start[k] < reach; i++) take_share(&g->seg[i], used);
}

void knot_caps(const jerk_planner *p, grid *g) {
    g->from_start[0] = 0.0;
    for (int k = 0; k <= g->n; k++) {
        double left = k > 0 ? g->seg[k - 1].cap : 1e30, right = k < g->n ? g->seg[k].cap : 1e30;
        g->knot_cap[k] = fmin(left, right);
        if (k < g->n) g->from_start[k + 1] = g->from_start[k] + g->seg[k].h;
    }
    for (int k = 1; k < g->n; k++) knot_jump(p, g, k);
    turn_caps(p, g);
    for (int k = 0; k < g->n; k++) {
        if (g->from_start[k] < p->behind_mm) take_share(&g->seg[k], 1.0 - p->behind_share);
        g->seg[k].share = g->seg[k].jump * *g->seg[k].tight;
    }
    for (int k = 0; k < g->n; k++) {
        g->seg[k].jerk_up = k == 0 ? rest_jerk(p, &g->seg[k], 0) : 0.0;
        g->seg[k].jerk_down = k == g->n - 1 ? rest_jerk(p, &g->seg[k], 1) : 0.0;
    }
}

static bool straight(const jerk_planner *p, const jerk_interval *q) {
    for (int a = 0; a < p->cfg.axes; a++)
        if (q->d2[0][a] != 0.0 || q->d2[1][a] != 0.0) return false;
    return true;
}

static bool add_segment(const jerk_planner *p, grid *g, const jerk_interval *q, uint64_t i, bool last) {
    if (g->n >= g->max) return false;
    segment *s = &g->seg[g->n++];
    s->q = q;
    s->last = last;
    s->at = i;
    s->own = s->bulge = 1.0;
    s->tight = straight(p, q) ? &s->own : &p->tight[i & p->mask];
    s->before = *s->tight;
    segment_limits(p, s);
    return true;
}

typedef struct extent {
    uint64_t end;      /* ring index behind the window */
    double length;
    bool stands;       /* ends where the axes must stand, or where the path is known to end */
} extent;

/* How far the window reaches: by blocks, by knots, to a stand or to the end of what was pushed. */
static extent window_extent(const jerk_planner *p) {
    extent e = {p->head, 0.0, false};
    double knots = 0.0;
    int blocks = 0;
    while (e.end != p->tail) {
        const jerk_interval *q = ring_at(p, e.end);
        if (e.end != p->head && asked_speed(p, q) <= 0.0) return e; /* an override of zero begins here */
        e.end++;
        e.length += q->length;
        knots += knots_at(p, e.end - 1);
        blocks += (int)q->blocks;
        if (q->flags & JERK_STAND) {
            e.stands = true;
            return e;
        }
        if (knots >= p->cfg.window_knots || blocks >= p->cfg.window_blocks) return e;
    }
    e.stands = p->finished;
    return e;
}

/* Step at a standstill on interval i of the ring. */
static double finest_at(const jerk_planner *p, const grid *g, uint64_t i) { return fmin(steps_at(p, i)->finest, g->finest); }

/* Jerk along the path at the start of q that all axes can follow. */
static double path_jerk(const jerk_planner *p, const jerk_interval *q) {
    double jerk = 1e30;
    for (int a = 0; a < p->cfg.axes; a++) jerk = fmin(jerk, jerk_max(p, q, a) / fmax(1e-9, fabs(q->d1[0][a])));
    return jerk;
}

/* Length over which the speed v can change much under the path jerk on interval i: the grid must resolve it, down to a share `least`
 * of the step at a standstill. */
static double slow_length(const jerk_planner *p, const grid *g, uint64_t i, double v, double least) {
    return fmin(steps_at(p, i)->longest, fmax(least * finest_at(p, g, i), SLOW * v * sqrt(v / path_jerk(p, ring_at(p, i)))));
}

/* Cap on x (scaled) over an interval by feed and machine. */
static double feed_cap(const jerk_planner *p, const jerk_interval *q) {
    segment s = {.q = q};
    segment_limits(p, &s);
    return s.soft;
}

/* The part of the way from rest to the feed of q that one interval may take. */
static double feed_part(const jerk_planner *p, const jerk_interval *q) {
    double v = p->scale * sqrt(feed_cap(p, q));
    return REST_FEED * v * sqrt(v / path_jerk(p, q));
}

/* How long the interval from or to rest is on the first or last `len` mm of interval i: constant jerk is exact there on a line.
 * Behind it the speed multiplies from knot to knot, so the steps are short at first. */
static double rest_length(const jerk_planner *p, const grid *g, uint64_t i, double len) {
    const jerk_interval *q = ring_at(p, i);
    double finest = finest_at(p, g, i), feed = feed_part(p, q);
    double least = fmin(REST_MOST * len, fmin(finest, fmax(SLOWEST_KNOT * finest, feed)));
    if (!straight(p, q)) return fmin(least, steps_at(p, i)->bent_rest);
    return fmax(least, fmin(steps_at(p, i)->rest, fmin(REST_SHARE * len, feed)));
}

/* Step at the knot ahead of interval i: fine where it must be passed slowly or the feed changes. */
static double knot_step(const jerk_planner *p, const grid *g, uint64_t i) {
    const jerk_interval *left = ring_at(p, i - 1), *right = ring_at(p, i);
    double before = feed_cap(p, left), after = feed_cap(p, right), open = fmin(before, after);
    double cap = jump_cap(p, left, right, open), longest = fmax(steps_at(p, i - 1)->longest, steps_at(p, i)->longest);
    if (cap > 0.8 * open && open > 0.6 * fmax(before, after)) return longest;
    return slow_length(p, g, i, p->scale * sqrt(cap), SLOWEST_KNOT);
}

/* Longest interval on interval i of the ring at the speed v: where the curvature changes so that jerk bounds the speed below v the path jerk is
 * constant over it, what the axes need to follow the bend is not. */
static double bend_length(const jerk_planner *p, uint64_t i, double v) {
    const steps *s = steps_at(p, i);
    double times = s->bend * v * v * v, part = times > BEND_DECIDES && s->little ? BEND_FINER : BEND_STEP;
    return times < BEND_MATTERS ? s->turn : fmin(s->turn, part * s->even);
}

/* Growth of the spacing over interval i, which begins `at` mm from a standstill on a curve: near it the speed multiplies from knot to
 * knot, and rows hold the jerk at the faster one. */
static double grading_at(const jerk_planner *p, uint64_t i, double at) {
    return at < RAMP_STEPS * steps_at(p, i)->longest ? REST_GRADING : GRADING;
}

/* Steps at the knots of the pushed intervals head .. head + n - 1 (n + 1 values). */
static void knot_steps(const jerk_planner *p, grid *g, int n, bool stands, const double *rest) {
    double *step = g->step;
    uint64_t head = p->head, end = head + (uint64_t)n - 1;
    step[0] = p->at_rest ? BEHIND_REST * rest[0] : slow_length(p, g, head, p->scale * sqrt(p->x), SLOWEST_KNOT);
    step[n] = stands ? BEHIND_REST * rest[1] : slow_length(p, g, end, p->scale * sqrt(feed_cap(p, ring_at(p, end))) * SLOW_TAIL, SLOWEST_STEP);
    for (int i = 1; i < n; i++) {
        step[i] = fmin(knot_step(p, g, head + i), 2.0 * fmin(steps_at(p, head + i - 1)->turn, steps_at(p, head + i)->turn));
    }
    double at = p->at_rest && !straight(p, ring_at(p, head)) ? 0.0 : INFINITY, to = stands && !straight(p, ring_at(p, end)) ? 0.0 : INFINITY;
    for (int i = 1; i <= n; at += ring_at(p, head + i - 1)->length, i++) {
        g->grade[i - 1] = grading_at(p, head + i - 1, at);
        step[i] = fmin(step[i], step[i - 1] + g->grade[i - 1] * ring_at(p, head + i - 1)->length);
    }
    for (int i = n - 1; i >= 0; to += ring_at(p, head + i)->length, i--) {
        g->grade[i] = fmin(g->grade[i], grading_at(p, head + i, to));
        step[i] = fmin(step[i], step[i + 1] + g->grade[i] * ring_at(p, head + i)->length);
    }
}

/* Length of the next planner interval, `d0` behind a knot with the step s0 and `d1` ahead of one with s1. */
static double step_at(double longest, double grading, double d0, double s0, double d1, double s1) {
    double behind = s0 + grading * d0, ahead = fmax(s1, (s1 + grading * d1) / (1.0 + grading));
    return fmin(longest, fmin(behind, ahead));
}

static bool add_part(const jerk_planner *p, grid *g, uint64_t i, double from, double to) {
    const jerk_interval *q = ring_at(p, i);
    if (from <= 0.0 && to >= q->length) return add_segment(p, g, q, i, true);
    if (g->n >= g->max) return false;
    jerk_interval *part = &g->parts[g->used++];
    interval_part(q, from, to, p->cfg.axes, part);
    return add_segment(p, g, part, i, to >= q->length);
}

/* Lay the grid over one pushed interval, or the first `len` mm of it, with such intervals from and to rest in it. */
static bool fill_interval(jerk_planner *p, grid *g, int i, double len, double rest_from, double rest_to) {
    const uint64_t at = p->head + (uint64_t)i;
    const jerk_interval *q = ring_at(p, at);
    double v = p->scale * sqrt(feed_cap(p, q)), slow = fmax(slow_length(p, g, at, v * SLOW_FEED, SLOWEST_STEP), fmin(steps_at(p, at)->least, SLOW_TIME * v));
    double turn = fmin(bend_length(p, at, v), slow), end = len - rest_to;
    if (rest_from > 0.0 && !add_part(p, g, at, 0.0, rest_from)) return false;
    for (double done = rest_from; done < end;) {
        double left = end - done, step = g->finer * fmin(turn, step_at(steps_at(p, at)->longest, g->grade[i], done, g->step[i], len - done, g->step[i + 1]));
        double parts = ceil(left / step - 1e-6), next = parts <= 1.0 ? end : done + left / parts;
        if (!add_part(p, g, at, done, next)) return false;
        done = next;
    }
    return !(rest_to > 0.0) || add_part(p, g, at, end, len);
}

/* Lay the grid over the path up to `to` mm ahead; false if it does not fit. */
static bool grid_fill(jerk_planner *p, grid *g, const extent *e, double to) {
    int n = (int)(e->end - p->head);
    g->n = g->used = 0;
    g->rest_start = p->at_rest;
    g->stands = e->stands;
    g->land_from = g->land_to = -1.0;
    g->finest = e->length / 24.0;
    if (n > g->max) return false;
    double ahead = to, rest[2] = {0.0, 0.0};
    for (int i = 0; i < n - 1; i++) ahead -= ring_at(p, p->head + (uint64_t)i)->length;
    if (n > 0 && p->at_rest) rest[0] = rest_length(p, g, p->head, fmin(to, ring_at(p, p->head)->length));
    if (n > 0 && e->stands) rest[1] = rest_length(p, g, e->end - 1, fmin(ahead, ring_at(p, e->end - 1)->length));
    knot_steps(p, g, n, e->stands, rest);
    double at = 0.0;
    for (int i = 0; i < n && to - at > 1e-9; i++) {
        double whole = ring_at(p, p->head + (uint64_t)i)->length, len = to - at > whole - 1e-9 ? whole : to - at;
        if (!fill_interval(p, g, i, len, i == 0 ? rest[0] : 0.0, i == n - 1 ? rest[1] : 0.0)) return false;
        at += len;
    }
    return true;
}

/* The path ahead up to a distance. */
static extent extent_to(const jerk_planner *p, double distance) {
    extent e = {p->head, 0.0, true};
    while (e.end != p->tail && e.length < distance) e.length += ring_at(p, e.end++)->length;
    e.length = fmin(e.length, distance);
    return e;
}

/* The window of the next plan, or the first `reach` mm of it. */
void grid_window(jerk_planner *p, grid *g, double reach) {
    extent e = window_extent(p);
    bool whole = e.length <= reach;
    g->finer = 1.0;
    if (!whole) e = extent_to(p, reach);
    if (!grid_fill(p, g, &e, whole ? 1e30 : reach)) g->stands = false;
    if (!whole) g->stands = false; /* it ends at rest where the axes need not stand */
    knot_caps(p, g);
}

/* A grid that ends at rest `distance` mm ahead; false if it does not fit. */
bool grid_to(jerk_planner *p, grid *g, double distance) {
    extent e = extent_to(p, distance);
    if (e.length < distance - 1e-9) return false;
    g->finer = 1.0;
    bool fits = grid_fill(p, g, &e, distance);
    if (fits && g->n < STOP_STEPS) {
        g->finer = (double)g->n / STOP_STEPS;
        fits = grid_fill(p, g, &e, distance);
    }
    knot_caps(p, g);
    return fits;
}
