/* Corners between two chords, with a blend within the tolerance. */
#ifndef SMOOTH_CORNER_H
#define SMOOTH_CORNER_H
#include "stages/smoothing/state.h"

/* The exact chords from nodes[0] (from contour parameter out_t on) to
 * nodes[end] with blends at the corners between. */
void corner_path(nc_smooth *smooth, int end);
/* Distance from the corner at which a blend begins that uses up the tolerance.
 */
double corner_distance(const nc_smooth *smooth, double turn);
#endif
