/* The output: pieces, and the programmed rows among them in program order. */
#ifndef SMOOTH_EMIT_H
#define SMOOTH_EMIT_H
#include "stages/smoothing/state.h"

/* A programmed row that is written when the contour has got to t. */
void emit_hold(nc_smooth *smooth, const nc_block *row, double t, bool motion);

/* The chord between contour parameters t0 and t1, exactly. */
void emit_line(nc_smooth *smooth,
               const struct node *from,
               const struct node *to,
               double t0,
               double t1);

/* A smooth piece over t0..t1, cut where rows or feeds change; `at`: first node
 * behind t0. */
void emit_curve(nc_smooth *smooth,
                double coef[][ORDER],
                double t0,
                double t1,
                const struct node *at);

/* The section is written: pending line and all rows. */
void emit_flush(nc_smooth *smooth);

/* One row, as it is. */
void emit_row(nc_smooth *smooth, const nc_block *row);

/* Coefficients into the pool; where they begin. */
uint32_t emit_pool(nc_smooth *smooth, const double *values, size_t count);

/* corner.c */
/* The exact chords from nodes[0] (from contour parameter out_t on) to
 * nodes[end] with blends at the corners between. */
void corner_path(nc_smooth *smooth, int end);
/* Distance from the corner at which a blend begins that uses up the tolerance.
 */
double corner_distance(const nc_smooth *smooth, double turn);
#endif
