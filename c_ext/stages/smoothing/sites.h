/* Points of the contour that pull the curve of a window. */
#ifndef SMOOTH_SITES_H
#define SMOOTH_SITES_H
#include "stages/smoothing/state.h"

/* One point at t on a span, with its target and what is allowed. */
void site_add(struct window *window,
              const double *position,
              double t,
              double target,
              double allowed,
              int span,
              int axes);

/* Nodes, and the middle of every span that holds none. */
void lay_sites(nc_smooth *smooth, int end);

/* knots.c */
/* Append knots behind tau[count - 1] up to nodes[end], or as far as there is
 * room; returns the node reached. */
int make_knots(nc_smooth *smooth, double *tau, int *count, int room, int end);
#endif
