/* Stretches of a piece for the acceleration-limited planner: lines whole, arcs
 * between knots (curved_span.c), polynomials between certified ones
 * (curve_spans.c); cut where the zones begin in which the jumps of a corner use
 * up acceleration (lookahead.c). */
#ifndef ENGINE_ACCEL_SPANS_H
#define ENGINE_ACCEL_SPANS_H
#include "engine/state/state.h"

bool can_cruise(struct engine *engine,
                struct piece *piece,
                const struct piece *next,
                bool known,
                double speed,
                double end2);
void piece_spans(struct engine *engine, uint64_t i, const struct piece *next);
#endif
