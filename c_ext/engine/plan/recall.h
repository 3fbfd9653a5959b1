/* Feed hold, and other orders behind a far commit (orders_seen.h): what is
 * committed but not begun is taken back, so that they act from the next cycle
 * on and not behind the motion that was committed ahead. */
#ifndef ENGINE_PLAN_RECALL_H
#define ENGINE_PLAN_RECALL_H
#include "engine/state/state.h"

void recall_commit(struct engine *engine);
#endif
