/* The grid over the path ahead, with its caps. */
#ifndef JERK_GRID_H
#define JERK_GRID_H
#include "jerk/state/state.h"

/* The window of the next plan, or the first `reach` mm of it, with steps that
 * are fine enough for squared speeds (scaled) from `lowest` on. */
void grid_window(jerk_planner *planner,
                 struct grid *grid,
                 double reach,
                 double lowest);

/* A grid that ends at rest `distance` mm ahead; false if it does not fit. */
bool grid_to(jerk_planner *planner, struct grid *grid, double distance);

/* Squared speed and acceleration (scaled) at the knots of a grid. */
typedef struct states {
    double *x, *accel;
} states;

/* What the present plan has not handed out, while it moves, with the states at
 * the knots; false if it does not fit. */
bool grid_of_plan(jerk_planner *planner,
                  struct grid *grid,
                  struct states *states);
#endif
