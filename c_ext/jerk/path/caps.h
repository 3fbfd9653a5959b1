/* Caps of speed on segments and at knots, and what jumps of derivatives leave.
 */
#ifndef JERK_CAPS_H
#define JERK_CAPS_H
#include "jerk/state/state.h"

/* Length, caps and shares of a segment by its interval, without its neighbours.
 */
void segment_limits(const jerk_planner *planner, struct segment *segment);

/* Largest x <= cap at which the jumps between two intervals take their share.
 */
double jump_cap(const jerk_planner *planner,
                const jerk_interval *left,
                const jerk_interval *right,
                double cap);

/* The jump between two intervals is passed at the head and still shows behind
 * it. */
void jump_passed(jerk_planner *planner,
                 const jerk_interval *left,
                 const jerk_interval *right);

/* Caps at all knots of a grid, and what is left of the limits around jumps. */
void knot_caps(const jerk_planner *planner, struct grid *grid);
#endif
