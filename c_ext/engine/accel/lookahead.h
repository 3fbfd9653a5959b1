/* Look-ahead: how fast everything ahead can still be met, backward from the end
 * of the window. */
#ifndef ENGINE_ACCEL_LOOKAHEAD_H
#define ENGINE_ACCEL_LOOKAHEAD_H
#include "engine/state/state.h"

uint64_t window_end(struct engine *engine);
void settle_spans(struct engine *engine, uint64_t i, double controllable_v2);
bool needs_hold(const struct engine *engine);
void backward_pass(struct engine *engine, uint64_t end);
#endif
