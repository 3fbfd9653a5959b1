/* The jerk-limited planner behind the engine: pieces of the run ring become
 * intervals of its path, its time laws become phases, what is left of its plan
 * becomes the stopping tail. */
#ifndef ENGINE_JERK_ADAPTER_ADAPTER_H
#define ENGINE_JERK_ADAPTER_ADAPTER_H
#include "engine/commit/planner.h"
#include "engine/state/state.h"

bool jerk_adapter_wanted(const engine_config *cfg);
bool jerk_adapter_new(struct engine *engine);
void jerk_adapter_free(struct engine *engine);
/* The axes have other limits: a planner for these. The path stands, no thread
 * runs. False: no memory. */
bool jerk_adapter_renew(struct engine *engine);

extern const struct planner_ops jerk_limited_planner;
#endif
