/* Stretches of a polynomial: gentle ones whole, the others in parts
 * (curve_parts.c). */
#ifndef ENGINE_ACCEL_CURVE_SPANS_H
#define ENGINE_ACCEL_CURVE_SPANS_H
#include "engine/state/state.h"

/* A stretch of a piece with the acceleration that jumps use up on it. */
typedef struct strip {
    double length;
    const double *reserve;
} strip;

/* A speed squared that all limits let be kept all over the piece, `wanted` or
 * more if that can be shown. In more parts the certificates are sharper. */
double curve_cruise2(struct engine *engine,
                     struct piece *piece,
                     const double *reserve,
                     double wanted);

/* Stretches of p, cut where the strips (zones of jumps) begin and end.
 * `stands`: at both ends, and only there. */
void curve_piece_spans(struct engine *engine,
                       struct piece *piece,
                       span_room *has,
                       const strip *strips,
                       int count,
                       bool stands);

/* Of the curve of piece i, if it is one, what is looked at first: it has not
 * been touched for a long time. */
void curve_prefetch(const struct engine *engine, uint64_t i);
#endif
