/* Curved stretches for the acceleration-limited planner: limits as rows over
 * (x, u), x = v^2, u = dv/dt along the path. */
#ifndef ENGINE_ACCEL_CURVED_SPAN_H
#define ENGINE_ACCEL_CURVED_SPAN_H
#include "engine/state/state.h"
#include "rows/nc_block.h"

/* curved_span.c */
/* What is driven over a stretch may differ from the chord of its rows: q' of an
 * axis by `above`, its acceleration by u |u| + x x. */
typedef struct chord_loss {
    double above[NC_AXES], u[NC_AXES], x[NC_AXES];
} chord_loss;

/* `room`: acceleration of every axis that is left; `lost`: what is certified,
 * NULL: nothing. Per axis: the rows at both knots, then their bounds. */
uint32_t curved_rows(const engine_config *cfg,
                     const struct piece *piece,
                     const struct knot *knot,
                     const struct knot *knot_b,
                     const double *room,
                     const chord_loss *lost,
                     struct span *out,
                     double *rows);

/* Largest x at s of the stretch from which `next` can be met at its end. */
double curved_controllable_v2(const struct span *sp,
                              double s,
                              double soft2,
                              double next);

/* From x at s of the stretch: as fast as `next` allows at its end, or as hard
 * down as the limits allow. */
curved_step curved_forward(const struct span *sp,
                           double s,
                           double x,
                           double soft2,
                           double next,
                           bool braking);
#endif
