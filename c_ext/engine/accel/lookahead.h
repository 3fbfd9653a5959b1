/* Look-ahead: how fast everything ahead can still be met, backward from the end
 * of the window. */
#ifndef ENGINE_ACCEL_LOOKAHEAD_H
#define ENGINE_ACCEL_LOOKAHEAD_H
#include "engine/state/state.h"

/* First piece behind the window: N motion pieces after the one where committed
 * motion ends, or what is known. Counted on from where it was counted to. */
uint64_t window_end(struct engine *engine);

/* The stretches of a piece over which feed is not kept after all;
 * `controllable_v2`: to be met at its end. */
void settle_spans(struct engine *engine, uint64_t i, double controllable_v2);

/* Whether what the last pass has found holds on: nothing that it depends on has
 * changed but what lies behind its window. */
bool needs_hold(const struct engine *engine);

/* controllable_v2 of every piece from `end` back to where committed motion
 * ends; the window ends at standstill. Where a piece comes to the value it has
 * had, all those ahead of it keep theirs: so the cost for a block does not grow
 * with the window. */
void backward_pass(struct engine *engine, uint64_t end);
#endif
