/* Real-time cycles: small programs that GEO runs in every cycle, beside the
 * path (#RT CYCLE .. #RT CYCLE END). */
#ifndef ENGINE_GEO_RT_CYCLE_H
#define ENGINE_GEO_RT_CYCLE_H
#include "engine/state/state.h"

void rt_cycles_free(struct engine *engine);

/* A program begins: cycles of the one before are gone. No thread may run. */
void rt_cycles_begin_program(struct engine *engine);

/* Once a cycle, behind the external variables: what preparation has asked for
 * is taken, then every cycle that is started runs through. */
void rt_cycles_run(struct engine *engine);
#endif
