/* Points of the contour between rows and sections. */
#ifndef SMOOTH_NODES_H
#define SMOOTH_NODES_H
#include "stages/smoothing/state.h"

/* The node read last. */
struct node *last_node(nc_smooth *smooth);

/* So many nodes from the front are written. */
void drop_nodes(nc_smooth *smooth, int count);

/* Distance of two points, scaled. */
double scaled_distance(const nc_smooth *smooth,
                       const double *from,
                       const double *to);

/* Position on the chord behind node i at the contour parameter t. */
void on_chord(const nc_smooth *smooth, int i, double t, double *position);
#endif
