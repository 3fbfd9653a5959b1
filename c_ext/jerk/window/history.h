/* Laws that were handed out and can be taken back. */
#ifndef JERK_HISTORY_H
#define JERK_HISTORY_H
#include "jerk/state/state.h"

/* The law that was handed out as number i. */
struct handed *handed_at(const jerk_planner *planner, uint64_t i);

/* Segment k of the plan is about to be handed out, as a whole or its beginning.
 */
void remember_law(jerk_planner *planner,
                  int k,
                  const jerk_law *law,
                  bool whole);

/* The last laws become the beginning of the plan again; false: they cannot. */
bool take_back_laws(jerk_planner *planner, uint64_t count);

/* Nothing that was handed out can be taken back any more. */
void forget_laws(jerk_planner *planner);

/* At a standstill: a plan that has not begun is none. */
void forget_plan(jerk_planner *planner);

/* Another plan is about to take the place of the present one. */
void keep_plan(jerk_planner *planner);

/* The plan that was kept is the present one again. */
void kept_plan_follows(jerk_planner *planner);
#endif
