/* Where the time goes: each cycle counts for what limits the speed in it. */
#ifndef ENGINE_GEO_TIME_CAUSES_H
#define ENGINE_GEO_TIME_CAUSES_H
#include "engine/state/state.h"

/* A program begins: what has been counted stays. */
void time_causes_begin(struct time_causes *causes);

/* Once a cycle, behind the motion and ahead of the program's end. */
void count_time(struct engine *engine);

/* Seconds by cause (ENGINE_CAUSE_...), what is not decided yet included. */
void time_by_cause(const struct engine *engine, double *seconds);
#endif
