/* Laws of the plan that are not handed out yet. */
#ifndef JERK_PLAN_LAW_H
#define JERK_PLAN_LAW_H
#include "jerk/state/state.h"

/* The law of segment k of the plan; it is kept there, for tails are asked for
 * again and again. */
void plan_law(const jerk_planner *planner, int k, jerk_law *law);

/* A place of the stored tail: its segment, and where that begins, mm from the
 * head. */
typedef struct tail_walk {
    int next;
    double at;
} tail_walk;

/* The largest x (scaled) that the tail drives from the place up to `end` mm
 * from the head, where the walk goes on; 0: it has ended. */
double tail_most(const jerk_planner *planner, tail_walk *walk, double end);
#endif
