/* Preparation's end of the store: prepared rows become elements (HLI facts) and
 * pieces (axis-space geometry). */
#ifndef ENGINE_STORE_PUSH_H
#define ENGINE_STORE_PUSH_H
#include "engine/state/state.h"

bool store_has_room(struct engine *engine);
void engine_expect_drain(struct engine *engine);
#endif
