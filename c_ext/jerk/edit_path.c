/* Changes of a path that has been pushed already: stands that come and go, a
 * path that ends earlier, another path. */
#include <math.h>
#include "jerk/window/history.h"
#include "jerk/path/ring.h"
#include "jerk/state/state.h"
#include "jerk/stop/stop.h"

int64_t jerk_ahead(const jerk_planner *planner) {
    return (int64_t)(planner->tail - planner->head);
}

const jerk_interval *jerk_path(const jerk_planner *planner, int64_t i) {
    return ring_at(planner, planner->head + (uint64_t)i);
}

/* Ring index of the interval at whose end, or inside which, the plan comes to
 * rest. */
static uint64_t plan_standstill(const jerk_planner *planner) {
    const plan *pl = &planner->plan;
    return pl->next < pl->count && pl->last[pl->count - 1] ? pl->end - 1
                                                           : pl->end;
}

int jerk_passes(const jerk_planner *planner, int64_t i) {
    return planner->plan.next < planner->plan.count
           && planner->head + (uint64_t)i < plan_standstill(planner);
}

/* A plan that passes a new stand is planned again at once; one that ends at a
 * stand that has gone, with the next law. */
void jerk_stand(jerk_planner *planner, int64_t i, int stand) {
    plan *pl = &planner->plan;
    uint64_t at = planner->head + (uint64_t)i;
    jerk_interval *interval = &planner->ring[at & planner->mask];
    if (!stand == !(interval->flags & JERK_STAND)) {
        return;
    }
    interval->flags ^= JERK_STAND;
    ring_find_stand(planner);
    if (stand && jerk_passes(planner, i)) {
        planner->changed = true;
        planner->hurried = false; /* no waiting: the stand comes nearer */
        planner->again_s = 0.0;
    }
    if (stand || pl->next >= pl->count || at + 1 < pl->end) {
        return;
    }
    pl->stands = false;
    pl->final = false;
    planner->wait = 0;
}

/* The path ends at so many mm of its last interval. */
static void shorten_last(jerk_planner *planner, double length) {
    uint64_t at = planner->tail - 1;
    jerk_interval *interval = &planner->ring[at & planner->mask];
    if (length >= interval->length) {
        interval->flags &= ~JERK_STAND;
        return;
    }
    jerk_interval whole = *interval;
    interval_part(&whole, 0.0, length, planner->axes, interval);
    interval->blocks = whole.blocks;
    struct steps *steps = &planner->steps[at & planner->mask];
    steps->knots = ceil(interval->length / steps->longest);
}

void jerk_cut(jerk_planner *planner, int64_t i, double length) {
    planner->tail = planner->head + (uint64_t)i;
    planner->finished = false;
    forget_laws(planner); /* they know the path as it was, ... */
    if (planner->at_standstill) {
        forget_plan(planner); /* ... and so does a plan that has not begun;
                                 another one ends ahead of the cut */
    }
    if (length > 0.0) {
        planner->tail++;
        shorten_last(planner, length);
    }
    ring_find_stand(planner);
}

void jerk_brake(jerk_planner *planner) {
    if (planner->at_standstill) {
        return;
    }
    plan_stop(planner);
    planner->changed = true; /* it is not what is wanted, only what is sure */
    planner->hurried = false;
    planner->again_s = 0.0;
}

void jerk_reset(jerk_planner *planner) {
    planner->tail = planner->head;
    planner->stand_end = 0;
    planner->finished = false;
    planner->changed = false;
    planner->at_standstill = true;
    planner->axes = planner->cfg.axes;
    planner->x = 0.0;
    planner->accel = 0.0;
    planner->behind_mm = 0.0;
    planner->driven = 0.0;
    planner->turned_count = 0;
    forget_laws(planner);
    forget_plan(planner);
}
