/* Weights of a window, until its curve is within the tolerance. */
#ifndef SMOOTH_ITERATE_H
#define SMOOTH_ITERATE_H
#include "stages/smoothing/state.h"

/* False: it is not. `deviation`: of each span, scaled. */
bool iterate(nc_smooth *smooth, int end, double *deviation);
#endif
