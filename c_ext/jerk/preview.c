/* What a hold would do that comes later, tried on a copy of the planner. */
#include <math.h>
#include "jerk/memory.h"
#include "jerk/state/state.h"
#include "jerk/stop/stop.h"

static double follow(jerk_planner *planner, double seconds) {
    jerk_law law;
    double way = 0.0;
    for (double t = 0.0;
         t < seconds && jerk_next_within(planner, &law, seconds - t);
         t += law.time) {
        way += law.length;
    }
    return way;
}

/* What a hold would do that comes when `later` seconds more are handed out: as
 * it is driven, the plan is followed where no stop is found (planner.c).
 * `scratch`: made like p, its content is lost. */
void jerk_stop_preview(const jerk_planner *planner,
                       jerk_planner *scratch,
                       double later,
                       jerk_preview *out) {
    planner_copy(scratch, planner);
    *out = (jerk_preview){.before = follow(scratch, later),
                          .v = jerk_speed(scratch)};
    scratch->changed = false; /* what comes now is known */
    scratch->hold = true;
    for (double step = planner->hold ? planner->again_s : 0.0;
         !scratch->at_standstill;
         step = fmax(PREVIEW_STEP_S, PREVIEW_GROWS * step)) {
        out->way += follow(scratch, step);
        if (scratch->at_standstill || (planner->hold && !planner->changed)) {
            break;
        }
        if (plan_stop(scratch)) {
            break;
        }
    }
    for (int k = scratch->plan.next;
         k < scratch->plan.count && !scratch->at_standstill;
         k++) {
        out->way += scratch->plan.lengths[k];
    }
}
