/* Conditions that the plan is made under, and the window they leave. */
#ifndef ENGINE_ACCEL_CONDITIONS_H
#define ENGINE_ACCEL_CONDITIONS_H
#include "engine/state/state.h"

bool state_feasible(struct engine *engine, uint64_t end, double curved);

/* The last plan was made under the present conditions. */
bool conditions_hold(struct engine *engine);

/* The window's end; where corner limits need more of the path than is fed, more
 * is fed. */
uint64_t choose_window(struct engine *engine);
#endif
