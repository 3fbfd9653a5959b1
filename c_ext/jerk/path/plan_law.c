/* Laws of the plan, from its states and inputs. */
#include "jerk/path/motion_law.h"
#include "jerk/path/plan_law.h"
#include "maths/order.h"

void plan_law(const jerk_planner *planner, int k, jerk_law *law) {
    const plan *pl = &planner->plan;
    bool end = k + 1 == pl->count;
    law->tag = pl->tag[k];
    law->s0 = pl->offset[k];
    law->flags = end ? JERK_STAND : 0;
    law->last = pl->last[k];
    if (pl->time[k] > 0.0) {
        law->length = pl->lengths[k];
        law->v0 = planner->scale * sqrt(pl->x[k]);
        law->a0 = planner->scale * planner->scale * pl->accel[k];
        law->jerk = pl->jerk[k];
        law->snap = pl->snap[k];
        law->crackle = pl->crackle[k];
        law->pop = pl->pop[k];
        law->time = pl->time[k];
        return;
    }
    double input[2];
    input[0] = pl->input[0][k];
    input[1] = pl->input[1][k];
    motion_law_from(law,
                    pl->lengths[k],
                    pl->x[k],
                    pl->accel[k],
                    end ? 0.0 : pl->x[k + 1],
                    end ? 0.0 : pl->accel[k + 1],
                    input,
                    planner->scale);
    if (end) { /* speed and way alone say how it comes to rest */
        pl->accel[k] = law->a0 / (planner->scale * planner->scale);
    }
    pl->time[k] = law->time;
    pl->jerk[k] = law->jerk;
    pl->snap[k] = law->snap;
    pl->crackle[k] = law->crackle;
    pl->pop[k] = law->pop;
}

double tail_most(const jerk_planner *planner, tail_walk *walk, double end) {
    const plan *pl = &planner->plan;
    double most = 0.0;
    while (walk->next < pl->count
           && walk->at < end - 1e-9) { /* what begins where the walk ends is not
                                          of it */
        int i = walk->next;
        most = greater(most, greater(pl->x[i], pl->x[i + 1]));
        if (walk->at + pl->lengths[i] > end + 1e-9) {
            break;
        }
        walk->at += pl->lengths[i];
        walk->next++;
    }
    return most;
}
