/* Operation modes, watchdogs and error records (hli_reference 3, 5.4, 7.2). */
#ifndef ENGINE_GEO_MODES_H
#define ENGINE_GEO_MODES_H
#include "engine/state/state.h"

/* States of a channel (hli_reference 3) that others look at. */
#define HOLD 5u
#define ABORTING 12u

void mode_publish_state(struct engine *engine);

/* CNC to PLC: the next record once the one before is taken; a PLC that does not
 * enable the unit is not waited for. Then the state: where it tells the outcome
 * of a command, the record of its refusal stands already. */
void mode_publish(struct engine *engine);

/* Once a cycle, ahead of the motion. */
void mode_cycle(struct engine *engine, bool present);
#endif
