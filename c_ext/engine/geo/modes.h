/* Operation modes, watchdogs and error records (hli_reference 3, 5.4, 7.2). */
#ifndef ENGINE_GEO_MODES_H
#define ENGINE_GEO_MODES_H
#include "engine/state/state.h"

void mode_publish_state(struct engine *engine);
void mode_publish_errors(struct engine *engine);
void mode_cycle(struct engine *engine, bool present);
#endif
