/* Stretches of a piece for the acceleration-limited planner: lines whole, arcs
 * between knots (curved_span.c), polynomials between certified ones
 * (curve_spans.c); cut where the zones begin in which the jumps of a corner use
 * up acceleration (lookahead.c). */
#ifndef ENGINE_ACCEL_SPANS_H
#define ENGINE_ACCEL_SPANS_H
#include "engine/state/state.h"

/* Whether the speed can be kept all over the piece and be brought to `end2`
 * (squared) at its end: whatever its stretches are, the largest speed at its
 * start is that one then. `next`: the motion behind it, NULL where that ends in
 * a standstill; `known`: all corners are that use up acceleration on it. */
bool can_cruise(struct engine *engine,
                struct piece *piece,
                const struct piece *next,
                bool known,
                double speed,
                double end2);

/* Stretches of piece i: a zone at either end where jumps use up acceleration,
 * and the rest. `next`: the motion behind it, NULL where it ends in a
 * standstill or is not known. */
void piece_spans(struct engine *engine, uint64_t i, const struct piece *next);
#endif
