/* Laws that were handed out, and the state ahead of each.  And the plan that
 * the stored tail is of, while another one is made and handed out: what is made
 * of that may come too late. */
#include <string.h>
#include "jerk/window/history.h"
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

/* At a standstill: the plan that has not begun. The laws that led there can be
 * taken back still. */
void forget_plan(jerk_planner *planner) {
    planner->plan.count = 0;
    planner->plan.next = 0;
    planner->plan.edition++;
    planner->near = false;
    planner->wait = 0;
}

/* What is left of a plan; `to` has arrays of its own, and its edition stays. */
static void copy_plan(plan *to, const plan *from) {
    const plan arrays = *to;
    size_t next = (size_t)from->next;
    size_t count = (size_t)(from->count - from->next);
    *to = *from;
    to->edition = arrays.edition;
    to->count = (int)count;
    to->next = 0;
    to->from_standstill = from->from_standstill && next == 0;
    double **out[] = PLAN_ARRAYS(to);
    double *const *own[] = PLAN_ARRAYS(&arrays);
    double *const *in[] = PLAN_ARRAYS(from);
    for (size_t i = 0; i < sizeof in / sizeof *in; i++) {
        *out[i] = *own[i];
        memcpy(*out[i], *in[i] + next, sizeof(double) * (count + 1));
    }
    to->tag = arrays.tag;
    to->last = arrays.last;
    memcpy(to->tag, from->tag + next, sizeof *to->tag * count);
    memcpy(to->last, from->last + next, count);
}

void jerk_keep(jerk_planner *planner) {
    struct kept *kept = &planner->kept;
    kept->state = KEEP_WANTED;
    kept->edition = planner->plan.edition;
}

void keep_plan(jerk_planner *planner) {
    struct kept *kept = &planner->kept;
    if (kept->state != KEEP_WANTED || planner->plan.edition != kept->edition) {
        return;
    }
    copy_plan(&kept->plan, &planner->plan);
    kept->was = planner->was;
    kept->handed = planner->handed_count;
    kept->state = KEEP_DONE;
}

void kept_plan_follows(jerk_planner *planner) {
    const struct kept *kept = &planner->kept;
    planner->plan.edition++;
    copy_plan(&planner->plan, &kept->plan);
    planner->was = kept->was;
    planner->near = false;
    planner->wait = 0;
    planner->changed = true; /* what it was replaced for is asked for yet */
    planner->hurried = false;
    planner->again_s = 0.0;
}
