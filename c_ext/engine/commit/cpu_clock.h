/* CPU time of the planner's pumps, without changing what is measured. */
#ifndef ENGINE_COMMIT_CPU_CLOCK_H
#define ENGINE_COMMIT_CPU_CLOCK_H
#include "engine/state/state.h"

void watch_start(struct engine *engine);

/* The window is moved on, which is rare and takes long: from here to the end
 * this pump is timed whether it was to be or not. */
void watch_window(struct engine *engine);
void watch_stop(struct engine *engine);
#endif
