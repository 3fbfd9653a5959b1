/* Path for the jerk-limited planner: pieces of the run ring become intervals,
 * stands their flags. */
#ifndef ENGINE_JERK_ADAPTER_PATH_PUSH_H
#define ENGINE_JERK_ADAPTER_PATH_PUSH_H
#include "engine/state/state.h"
#include "jerk/state/api.h"

bool adapter_stands_behind(struct engine *engine, uint64_t i);

/* Push path until the planner's look-ahead is full, or there is no more. */
void push_path(struct engine *engine);

/* The path stands where the planner of the engine says: everything is pushed
 * anew. */
void adapter_restart(struct engine *engine);

/* The run ring is fed anew from `head` on. */
void adapter_cut(struct engine *engine, uint64_t head);

/* Piece i ends at s now. */
void adapter_shorten(struct engine *engine, uint64_t i, double s);

/* Stands that the present conditions ask for, as far as they can still be met.
 */
void update_stands(struct engine *engine);

/* A plan that runs over a stand: there was none that meets it. */
void forget_missed_stands(jerk_planner *planner);
#endif
