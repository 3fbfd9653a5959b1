/* The plan that the stored tail is of is kept while another one is made and
 * handed out: what is made of the new one may come too late. */
#include <string.h>
#include "jerk/keep.h"
#include "jerk/state/state.h"

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
