/* Changes of a path that has been pushed already: stands that come and go, a path that ends earlier, another path. */
#include <math.h>
#include "jerk/state.h"

/* At a standstill: the plan that has not begun, and the laws that could be taken back before it. */
void forget_plan(jerk_planner *p) {
    p->plan.n = p->plan.next = 0;
    p->plan.edition++;
    p->wait = 0;
    forget_laws(p);
}

int64_t jerk_ahead(const jerk_planner *p) { return (int64_t)(p->tail - p->head); }

const jerk_interval *jerk_path(const jerk_planner *p, int64_t i) { return ring_at(p, p->head + (uint64_t)i); }

/* Ring index of the interval at whose end, or inside which, the plan comes to rest. */
static uint64_t plan_rest(const jerk_planner *p) {
    const plan *pl = &p->plan;
    return pl->next < pl->n && pl->last[pl->n - 1] ? pl->end - 1 : pl->end;
}

int jerk_passes(const jerk_planner *p, int64_t i) {
    return p->plan.next < p->plan.n && p->head + (uint64_t)i < plan_rest(p);
}

/* A plan that passes a new stand is planned again at once; one that ends at a stand that has gone, with the next law. */
void jerk_stand(jerk_planner *p, int64_t i, int stand) {
    plan *pl = &p->plan;
    uint64_t at = p->head + (uint64_t)i;
    jerk_interval *q = &p->ring[at & p->mask];
    if (!stand == !(q->flags & JERK_STAND)) return;
    q->flags ^= JERK_STAND;
    if (stand && jerk_passes(p, i)) p->changed = true;
    if (stand || pl->next >= pl->n || at + 1 < pl->end) return;
    pl->stands = pl->final = false;
    p->wait = 0;
}

void jerk_cut(jerk_planner *p, int64_t i, double length) {
    uint64_t at = p->head + (uint64_t)i;
    jerk_interval *q = &p->ring[at & p->mask];
    p->tail = at;
    p->finished = false;
    forget_laws(p); /* they know the path as it was, ... */
    if (p->at_rest) forget_plan(p); /* ... and so does a plan that has not begun; another one ends ahead of the cut */
    if (!(length > 0.0)) return;
    p->tail++;
    if (length >= q->length) {
        q->flags &= ~JERK_STAND;
        return;
    }
    jerk_interval whole = *q;
    interval_part(&whole, 0.0, length, p->cfg.axes, q);
    q->blocks = whole.blocks;
    steps *t = &p->steps[at & p->mask];
    t->knots = ceil(q->length / t->longest);
}

void jerk_brake(jerk_planner *p) {
    if (p->at_rest) return;
    plan_stop(p);
    p->changed = true; /* it is not what is wanted, only what is sure */
}

void jerk_reset(jerk_planner *p) {
    p->tail = p->head;
    p->finished = p->changed = false;
    p->at_rest = true;
    p->x = p->u = p->behind_mm = p->driven = 0.0;
    p->turned_count = 0;
    forget_plan(p);
}

double jerk_speed(const jerk_planner *p) { return p->at_rest ? 0.0 : p->scale * sqrt(p->x); }

void jerk_command_speed(jerk_planner *p, double speed) {
    if (!isfinite(speed) || speed == p->command_speed || (speed < 0.0 && p->command_speed < 0.0)) return;
    p->command_speed = speed;
    p->changed = true;
}
