/* GEO drives the stored tail, because the planner was late. */
#ifndef ENGINE_PLAN_REJOIN_H
#define ENGINE_PLAN_REJOIN_H
#include "engine/state/state.h"

bool rejoin_possible(struct engine *engine);
void rejoin_offer(struct engine *engine);
bool rejoin_settled(struct engine *engine);
#endif
