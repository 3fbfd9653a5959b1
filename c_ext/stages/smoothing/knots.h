/* Knots of a window, by the span lengths that its nodes want. */
#ifndef SMOOTH_KNOTS_H
#define SMOOTH_KNOTS_H
#include "stages/smoothing/state.h"

/* Append knots behind tau[count - 1] up to nodes[end], or as far as there is
 * room; returns the node reached. */
int make_knots(nc_smooth *smooth, double *tau, int *count, int room, int end);
#endif
