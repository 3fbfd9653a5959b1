/* One turn of the planner's thread: tails, jobs at standstill, recall, then a
 * commit. */
#ifndef ENGINE_PLAN_PUMP_H
#define ENGINE_PLAN_PUMP_H
#include "engine/state/state.h"

/* Commit more motion if too little is ahead; returns 1 if phases were added. */
int planner_pump(struct engine *engine);
#endif
