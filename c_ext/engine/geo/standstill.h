/* Why the path stands, and where the time goes (standstill.c, time_causes.c).
 */
#ifndef ENGINE_GEO_STANDSTILL_H
#define ENGINE_GEO_STANDSTILL_H
#include "engine/state/state.h"

/* Bits of stop_condition_r; 0 while the path moves. */
uint32_t stop_conditions(struct engine *engine);

/* Once a cycle, behind the motion. */
void note_standstill(struct engine *engine);

/* A program begins: what has been counted stays. */
void time_causes_begin(struct time_causes *causes);

/* Once a cycle, behind the motion and ahead of the program's end. */
void count_time(struct engine *engine);

/* Seconds by cause (ENGINE_CAUSE_...), what is not decided yet included. */
void time_by_cause(const struct engine *engine, double *seconds);
#endif
