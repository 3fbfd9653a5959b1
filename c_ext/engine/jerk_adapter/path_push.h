/* Path for the jerk-limited planner: pieces of the run ring become intervals,
 * stands their flags. */
#ifndef ENGINE_JERK_ADAPTER_PATH_PUSH_H
#define ENGINE_JERK_ADAPTER_PATH_PUSH_H
#include "engine/state/state.h"
#include "jerk/planner.h"

bool adapter_stands_behind(struct engine *engine, uint64_t i);
void push_path(struct engine *engine);
void adapter_restart(struct engine *engine);
void adapter_cut(struct engine *engine, uint64_t head);
void adapter_shorten(struct engine *engine, uint64_t i, double s);
void update_stands(struct engine *engine);
void forget_missed_stands(jerk_planner *planner);
#endif
