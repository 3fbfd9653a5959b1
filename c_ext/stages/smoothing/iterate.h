/* Weights of a window, until its curve is within the tolerance. */
#ifndef SMOOTH_ITERATE_H
#define SMOOTH_ITERATE_H
#include "stages/smoothing/state.h"

/* False: it is not. `deviation`: of each span, scaled. */
bool iterate(nc_smooth *smooth, int end, double *deviation);

/* refine.c */
/* The curve goes on as the window before has left it, and little by little as
 * it was found now; `kept` control points show that. False: that is not
 * certified up to nodes[end], and the curve is as it was. */
bool take_up(nc_smooth *smooth, int end, double *deviation);

/* The window's curve, certified up to nodes[end], gives way to a faster one
 * that is certified too. `join`: span at which the next window goes on, 0: the
 * section ends. `coarse`: much is gained in any case; else the curve stays as
 * it is where the first steps gain little. `deviation`: of each span. */
void refine_window(nc_smooth *smooth,
                   int end,
                   int join,
                   bool coarse,
                   double *deviation);
#endif
