/* Tuning constants of curves, in one table.
 *
 * Each entry says what the constant does, in which unit, and what shows its
 * effect (a test by its name, or a bench). */
#ifndef CURVE_TUNING_H
#define CURVE_TUNING_H

/* A cell's length may change by so much when it is halved. Unit: mm, and
 * share of the length. Evidence: test_curve_derivatives. */
#define QUADRATURE 1e-11

/* Of largest to smallest speed in a cell, so that the inversion converges.
 * Unit: factor. Evidence: test_curve_derivatives. */
#define SPEED_RATIO 3.0

/* The parameter at a length may be off by about so much: axes that outrun the
 * path a thousandfold show it as jerk. Unit: mm of the path. Evidence:
 * test_axes_that_outrun_a_curve. */
#define INVERSION 1e-14

/* Turn that a cell should not exceed: limits are constant per cell. Unit:
 * rad. Evidence: bench/planner_programs.py. */
#define CELL_TURN 0.35

/* Change that a cell should not exceed. Unit: share of the largest curvature.
 * Evidence: bench/planner_programs.py. */
#define CELL_BEND 0.3

/* Shorter cells are not cut for the sake of limits. Unit: mm. Evidence:
 * bench/planner_programs.py. */
#define SHORT_CELL 0.01

/* Cut for the sake of limits. Unit: cells. Evidence:
 * bench/planner_programs.py. */
#define LIMIT_CELLS 12

/* An axis that rests moves no more. Unit: mm or degrees. Evidence: rounding. */
#define STANDS 1e-9

/* Of the metric in the middle, that must be left as its lower bound. Unit:
 * share. Evidence: test_curve_derivatives. */
#define SHARE_LEFT 0.3

#endif
