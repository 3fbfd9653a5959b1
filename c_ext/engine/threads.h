/* Real time: planner, GEO and the immediate look-ahead service as threads of
 * their own. */
#ifndef ENGINE_THREADS_H
#define ENGINE_THREADS_H
#include "engine/state/state.h"

void engine_stop(struct engine *engine);
void engine_serve_stop(struct engine *engine);
#endif
