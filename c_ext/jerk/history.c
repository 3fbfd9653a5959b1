/* Laws that were handed out, and the state ahead of each. */
#include "jerk/history.h"
#include "jerk/state/state.h"

struct handed *handed_at(const jerk_planner *planner, uint64_t i) {
    return &planner->handed[i % HANDED_MAX];
}

/* Segment k of the plan is about to be handed out, as a whole or its beginning:
 * the law. */
void remember_law(jerk_planner *planner,
                  int k,
                  const jerk_law *law,
                  bool whole) {
    const plan *pl = &planner->plan;
    struct handed *handed = handed_at(planner, planner->handed_count++);
    handed->interval = *ring_at(planner, planner->head);
    handed->head = planner->head;
    handed->x = pl->x[k];
    handed->accel = pl->accel[k];
    handed->at_x = planner->x;
    handed->at_u = planner->accel;
    handed->behind_mm = planner->behind_mm;
    handed->behind_share = planner->behind_share;
    handed->driven = planner->driven;
    handed->at_standstill = planner->at_standstill;
    handed->from_standstill = pl->from_standstill && k == 0;
    handed->tag = law->tag;
    handed->offset = law->s0;
    handed->length = law->length;
    handed->time = law->time;
    handed->jerk = law->jerk;
    handed->snap = law->snap;
    handed->crackle = law->crackle;
    handed->pop = law->pop;
    for (int i = 0; i < 2; i++) {
        handed->input[i] = pl->input[i][k];
    }
    handed->last = whole ? pl->last[k] : 0;
    planner->driven_s += law->time;
}

void forget_laws(jerk_planner *planner) {
    planner->handed_count = 0;
}

int64_t jerk_laws_kept(void) {
    return HANDED_MAX;
}

/* At a standstill: the plan that has not begun, and the laws that could be
 * taken back before it. */
void forget_plan(jerk_planner *planner) {
    planner->plan.count = 0;
    planner->plan.next = 0;
    planner->plan.edition++;
    planner->near = false;
    planner->wait = 0;
    forget_laws(planner);
}
