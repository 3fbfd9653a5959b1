/* What preparation or the cell has to know, in order of urgency. */
#ifndef ENGINE_EVENTS_H
#define ENGINE_EVENTS_H
#include "engine/state/state.h"

bool plc_finished(const struct engine *engine);

/* What preparation or the cell has to know, in order of urgency; -1 if nothing.
 */
int pending_event(struct engine *engine);
#endif
