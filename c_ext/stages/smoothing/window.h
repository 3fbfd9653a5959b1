/* A smooth section, solved window by window. */
#ifndef SMOOTH_WINDOW_H
#define SMOOTH_WINDOW_H
#include "stages/smoothing/state.h"

/* The section from what is written up to nodes[end]; not final: more of it will
 * come. */
void window_advance(nc_smooth *smooth, int end, bool final);
#endif
