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

/* A banded system of its own, lost afterwards: rows ORDER.. of `band` and
 * `right`, zeros before and behind them. The solution is in `right`. */
void spline_band_solve(double (*band)[ORDER], pair *right, int count);

/* Control points that minimise the roughness at the speed of the law, with
 * walls, axis by axis; bits of `rotary`: axes. */
void spline_solve_timed(struct window *window, uint32_t rotary);

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

/* law.c */
/* A law for the curve found so far, nearly the fastest; false: there is none.
 * `end`: node where the window ends, `final`: and the section. */
bool law_begin(nc_smooth *smooth, int end, bool final);

/* What a kept control point has of the window before: 1, then less and less. */
double kept_share(const struct window *window, int control);

/* A step towards the fastest law for the present curve, or a part of it; false:
 * nothing is gained. `cost`: law_cost before and after. */
bool law_step(nc_smooth *smooth, double *cost);

/* The control points of the law are other ones. */
void law_changed(nc_smooth *smooth);

/* The curve is another one. */
void curve_changed(nc_smooth *smooth);

/* Places and axes whose jerk is above its limit cost more from now on, others
 * less. Takes and returns law_cost. */
double law_reweigh(nc_smooth *smooth, double cost);

/* What the motion costs: its time, s, and a part for its jerk. */
double law_cost(const nc_smooth *smooth);

/* The cost as a square around the present curve, for the next solution. */
void law_roughness(nc_smooth *smooth);
#endif
