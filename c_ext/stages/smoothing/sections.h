/* Nodes to sections: what is driven exactly, as corner or as one smooth curve.
 */
#ifndef SMOOTH_SECTIONS_H
#define SMOOTH_SECTIONS_H
#include "stages/smoothing/state.h"

/* A point of the contour, at the programmed position; `slack`: deviation used
 * up on the way to it. */
void section_point(nc_smooth *smooth, const nc_block *row, double slack);

/* The last chord grows no more: the node ahead of it is final. */
void section_complete(nc_smooth *smooth);

/* The chord that ends at node i: a long one is driven exactly in its middle. */
void section_split(nc_smooth *smooth, int i, double beside_next);

/* Sections that end before node `known` are written as far as they are known.
 */
void section_work(nc_smooth *smooth, int known);
#endif
