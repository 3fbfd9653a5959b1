/* Conditions that the plan is made under, and the window they leave. */
#ifndef ENGINE_ACCEL_CONDITIONS_H
#define ENGINE_ACCEL_CONDITIONS_H
#include "engine/state/state.h"

bool state_feasible(struct engine *engine, uint64_t end, double curved);
bool conditions_hold(struct engine *engine);
uint64_t choose_window(struct engine *engine);
#endif
