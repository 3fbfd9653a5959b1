/* Quintic B-splines: the basis of a span in all its forms, and the banded
 * system. */
#ifndef SMOOTH_SPLINE_FIT_H
#define SMOOTH_SPLINE_FIT_H
#include "stages/smoothing/state.h"

/* Everything about a span that its knots say. */
void spline_span(struct window *window, int span);

/* Values of a span's basis functions at x = 0..1. */
void spline_basis_at(const double basis[ORDER][ORDER],
                     double x,
                     double out[ORDER]);

/* Control points that minimise the weighted fairness and residuals. */
void spline_solve(struct window *window, int axes);

/* Inverse of the system that was solved last, within its band. */
void spline_invert(struct window *window);

/* How far the curve gives way to a force of 1 at a point, after spline_invert.
 */
double spline_give(const struct window *window, const struct site *site);

/* Coefficients of the curve on one span, over x = 0..1. */
void spline_piece(const struct window *window,
                  int span,
                  int axes,
                  double out[][ORDER]);

/* Its Bernstein coefficients. */
void spline_hull(const struct window *window,
                 int span,
                 int axes,
                 double out[][ORDER]);
#endif
