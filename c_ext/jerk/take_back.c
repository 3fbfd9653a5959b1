/* Laws that were handed out and are not driven after all: they become the beginning of the plan again. */
#include <string.h>
#include "jerk/state.h"

#define LEAST_TIME 1e-9 /* s */

static handed *handed_at(const jerk_planner *p, uint64_t i) { return &p->handed[i % HANDED_MAX]; }

/* Segment k of the plan is about to be handed out, as a whole or its beginning: the law. */
void remember_law(jerk_planner *p, int k, const jerk_law *law, bool whole) {
    const plan *pl = &p->plan;
    handed *h = handed_at(p, p->handed_count++);
    h->interval = *ring_at(p, p->head);
    h->head = p->head;
    h->x = pl->x[k];
    h->u = pl->u[k];
    h->at_x = p->x;
    h->at_u = p->u;
    h->behind_mm = p->behind_mm;
    h->behind_share = p->behind_share;
    h->driven = p->driven;
    h->at_rest = p->at_rest;
    h->rest_start = pl->rest_start && k == 0;
    h->tag = law->tag;
    h->offset = law->s0;
    h->length = law->length;
    h->time = law->time;
    h->jerk = law->jerk;
    h->snap = law->snap;
    h->crackle = law->crackle;
    h->pop = law->pop;
    for (int i = 0; i < 2; i++) h->c[i] = pl->c[i][k];
    h->last = whole ? pl->last[k] : 0;
}

void forget_laws(jerk_planner *p) { p->handed_count = 0; }

/* The plan moves `by` places up in its arrays. */
static void shift_plan(plan *pl, int by) {
    size_t n = (size_t)(pl->n - pl->next);
    double *knots[] = {pl->x, pl->u}, *segments[] = {pl->h, pl->time, pl->jerk, pl->snap, pl->crackle, pl->pop, pl->c[0], pl->c[1], pl->offset};
    int from = pl->next, to = from + by;
    for (size_t i = 0; i < sizeof knots / sizeof *knots; i++) memmove(knots[i] + to, knots[i] + from, sizeof(double) * (n + 1));
    for (size_t i = 0; i < sizeof segments / sizeof *segments; i++) memmove(segments[i] + to, segments[i] + from, sizeof(double) * n);
    memmove(pl->tag + to, pl->tag + from, sizeof *pl->tag * n);
    memmove(pl->last + to, pl->last + from, n);
    pl->next += by;
    pl->n += by;
}

static void put_back(jerk_planner *p, const handed *h) {
    plan *pl = &p->plan;
    int k = --pl->next;
    pl->x[k] = h->x;
    pl->u[k] = h->u;
    pl->h[k] = h->length;
    pl->offset[k] = h->offset;
    pl->tag[k] = h->tag;
    pl->last[k] = h->last;
    pl->time[k] = h->time;
    pl->jerk[k] = h->jerk;
    pl->snap[k] = h->snap;
    pl->crackle[k] = h->crackle;
    pl->pop[k] = h->pop;
    for (int i = 0; i < 2; i++) pl->c[i][k] = h->c[i];
    pl->length += h->length;
    pl->rest_start = k == 0 && h->rest_start;
    jerk_interval *q = &p->ring[h->head & p->mask];
    uint32_t stand = h->head == p->head ? q->flags & JERK_STAND : h->interval.flags & JERK_STAND; /* it may have come or gone since */
    *q = h->interval;
    q->flags = (q->flags & ~JERK_STAND) | stand;
    p->head = h->head;
    p->x = h->at_x;
    p->u = h->at_u;
    p->behind_mm = h->behind_mm;
    p->behind_share = h->behind_share;
    turns_back(p, h->driven);
    p->at_rest = h->at_rest;
}

/* Law h has come to rest, so the plan that it was of ended behind it: it ends there again. */
static void end_plan(jerk_planner *p, const handed *h) {
    plan *pl = &p->plan;
    pl->n = pl->next;
    pl->x[pl->n] = pl->u[pl->n] = pl->length = 0.0;
    pl->end = p->head;
    pl->stands = pl->final = h->last && (h->interval.flags & JERK_STAND);
}

int64_t jerk_laws_kept(void) { return HANDED_MAX; }

double jerk_take_back(jerk_planner *p, double seconds) {
    plan *pl = &p->plan;
    double t = 0.0;
    uint64_t n = 0;
    for (; t < seconds - LEAST_TIME; n++) {
        if (n >= p->handed_count || n >= HANDED_MAX) return 0.0;
        t += handed_at(p, p->handed_count - 1 - n)->time;
    }
    if ((uint64_t)pl->next < n) {
        int by = (int)n - pl->next;
        if (pl->n + by > p->capacity + HANDED_MAX) return 0.0;
        shift_plan(pl, by);
    }
    pl->edition++;
    for (uint64_t i = 0; i < n; i++) {
        const handed *h = handed_at(p, --p->handed_count);
        if (p->at_rest) end_plan(p, h);
        put_back(p, h);
    }
    pl->since = pl->since > (int)n ? pl->since - (int)n : 0;
    return t - seconds > LEAST_TIME ? t - hand_out_again(p, t - seconds) : t;
}
