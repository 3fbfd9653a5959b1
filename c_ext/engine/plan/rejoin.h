/* GEO drives the stored tail, because the planner was late. */
#ifndef ENGINE_PLAN_REJOIN_H
#define ENGINE_PLAN_REJOIN_H
#include "engine/state/state.h"

/* GEO drives the tail, and the planner is where that begins. */
bool rejoin_possible(struct engine *engine);

/* Motion from a place on the tail on. If there is none the tail is driven to
 * its end. */
void rejoin_offer(struct engine *engine);

/* No offer is out, and GEO has left the tail. */
bool rejoin_settled(struct engine *engine);
#endif
