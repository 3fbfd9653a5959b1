/* Tuning constants of the contouring stage, in one table.
 *
 * Each entry says what the constant does, in which unit, and what shows its
 * effect (a test by its name, or a bench). */
#ifndef CONTOUR_TUNING_H
#define CONTOUR_TUNING_H

/* Shorter blocks are not rounded: message 120216 of ISG. Unit: mm. Evidence:
 * test_contouring. */
#define SHORTEST 0.032

/* With less left of a block the next curve begins where the one before ends.
 * Unit: mm. Evidence: test_rounded_in_time. */
#define NOTHING 1e-7

/* Smaller turns need no rounding. Unit: rad. Evidence: test_contouring. */
#define TANGENTIAL 1e-6

/* Nearer to a reversal nothing is rounded. Unit: rad. Evidence:
 * test_contouring. */
#define REVERSAL 3.09

/* Of each quartic, at which deviation and curvature are taken. Unit: points.
 * Evidence: test_contouring. */
#define SAMPLES 8

/* To the largest corner distance that is allowed. Unit: halvings. Evidence:
 * test_contouring. */
#define STEPS 48

/* Of the allowed deviation, that is aimed at. Unit: share. Evidence:
 * test_contouring. */
#define TARGET 0.9999

/* Shorter corner distances are none. Unit: mm. Evidence: rounding. */
#define KEPT 1e-6

#endif
