/* GEO's side of the HLI: take the PLC's level commands, publish status. */
#ifndef ENGINE_GEO_PUBLISH_H
#define ENGINE_GEO_PUBLISH_H
#include "engine/state/state.h"

void publish(struct engine *engine);
void publish_again(struct engine *engine);
void publish_initial(struct engine *engine);
#endif
