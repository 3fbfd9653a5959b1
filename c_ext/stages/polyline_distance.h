/* How far one polyline lies from another
 * (cnc_core/geometry/filters/run_filter.py, stages/deviation.py).
 *
 * A stretch of length L whose ends are d and e away holds no point farther than
 * (d + e + L) / 2, and none farther from one segment than the farther one of
 * its ends, for that distance is convex.  Stretches that may beat what has been
 * found are halved.  Boxes around groups of segments leave out what is too far
 * away to be the nearest.
 */
#ifndef POLYLINE_DISTANCE_H
#define POLYLINE_DISTANCE_H
#include <stdint.h>
#include "rows/nc_block.h"

/* cdef begin */
/* Largest distance of a point of the polyline `mine` (n x dim) from the
 * polyline `other` (m x dim), not below `known`, to `close`.  dim up to
 * NC_AXES, n and m from 1.  -1: no memory. */
double nc_farthest(const double *mine,
                   int64_t count,
                   const double *other,
                   int64_t others,
                   int32_t dim,
                   double known,
                   double close);
/* (n,) distances of points (n x dim) to a polyline (m x dim) into `out`; 0, or
 * -1: no memory. */
int nc_distances(const double *points,
                 int64_t count,
                 const double *other,
                 int64_t others,
                 int32_t dim,
                 double *out);
/* cdef end */
#endif
