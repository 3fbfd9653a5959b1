/* External variables (V.E): the program reads what the last cycle has latched
 * and writes for the next one. */
#ifndef ENGINE_GEO_EXTERNAL_H
#define ENGINE_GEO_EXTERNAL_H
#include "engine/state/state.h"

/* The path has passed a command: its number, then the count. */
void external_command(struct engine *engine, double value);
void external_free(struct engine *engine);

/* Once a cycle: the program's writes go out, then everything is latched. */
void external_cycle(struct engine *engine);
#endif
