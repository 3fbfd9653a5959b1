/* External variables (V.E): the program reads what the last cycle has latched
 * and writes for the next one. */
#ifndef ENGINE_GEO_EXTERNAL_H
#define ENGINE_GEO_EXTERNAL_H
#include "engine/state/state.h"

void external_command(struct engine *engine, double value);
void external_free(struct engine *engine);
void external_cycle(struct engine *engine);
#endif
