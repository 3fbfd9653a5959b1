/* Rows of the axes' jerks and accelerations. */
#ifndef JERK_AXIS_ROWS_H
#define JERK_AXIS_ROWS_H
#include "jerk/state/state.h"

/* Writes them over a grid, and which there are; `on` is 1 where a stage has
 * some.  The coefficients must be 0 before. */
typedef void row_writer(const jerk_planner *planner,
                        const struct grid *grid,
                        struct problem *problem);
row_writer axis_rows, axis_rows_base, axis_rows_avx2;
#endif
