/* What the PLC commands the channel, once a cycle: levels, overrides,
 * shortcuts, inserted stops. */
#ifndef ENGINE_GEO_COMMANDS_H
#define ENGINE_GEO_COMMANDS_H
#include "engine/state/state.h"

void take_commands(struct engine *engine);
#endif
