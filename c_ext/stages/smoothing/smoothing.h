/* Smoothing of micro-segments and corners within a tolerance.
 *
 * Programmed rows go in, element rows and pieces come out.
 * cnc_core/geometry/stages/smoothing.py is the stage around it;
 * docs/explanation/smoothing.md has the mathematics.  From top to bottom:
 *
 * smoothing.c: rows to points of the contour.
 * bends.c: chords that stand for a piece of a curve.
 * sections.c: points to sections, which end at corners and on long lines.
 * window.c: one section through a sliding window, and its fallback.
 * knots.c, sites.c, iterate.c: knots, points that pull, weights of a window.
 * refine.c, law.c: a coarse curve made faster at its own speed.
 * spline_fit.c: quintic B-splines and their banded system.
 * corner.c, emit.c: blends at corners, and the output in program order.
 * certify.c: a polynomial against the programmed contour.
 * nodes.c: the points of the section in work, as the machine's axes drive them.
 *
 * The constants of state.h and tuning.h bound the memory.
 */
#ifndef SMOOTH_H
#define SMOOTH_H
#include <stddef.h>
#include <stdint.h>
#include "rows/nc_block.h"

/* cdef begin */
typedef struct nc_smooth_config {
    int32_t axes;
    int32_t main_axis[3];
    uint32_t rotary;     /* bit i: axis i is a rotary axis */
    double accel;        /* mm/s2: what limits the speed in curves; shapes the
                            fairness only */
    double axis_feed[9]; /* NC_AXES; mm/s of linear axes: what is fast; the
                            same; 0: not looked at */
    double jerk; /* mm/s3, of the slowest axis; shapes coarse curves; 0: no
                    limit */
    double axis_jerk[9]; /* NC_AXES; mm/s3 or degrees/s3; 0: no limit */
    double tolerance; /* mm; 0: rows pass unchanged until an NC_SMOOTHING row */
    double rotary_tolerance; /* degrees */
    double turn_max;         /* rad; a larger turn stays an exact corner */
} nc_smooth_config;

typedef struct nc_smooth_stats {
    uint64_t rows, pieces, curves, corners, windows, solves, fallbacks;
    uint64_t irregular; /* pieces that the engine will refuse; must stay 0 */
    double deviation, rotary_deviation; /* largest certified, mm and degrees */
    double left_out; /* mm: farthest from its neighbour that a point was left
                        out */
} nc_smooth_stats;

typedef struct nc_smooth nc_smooth;

/* `start`: position before the first row. NULL: no memory. */
nc_smooth *nc_smooth_new(const nc_smooth_config *config, const double *start);
void nc_smooth_free(nc_smooth *smooth);
void nc_smooth_resync(nc_smooth *smooth, const double *position);
/* From the next resync on the stages behind turn the path: 3 x 3 by rows, of
 * the main axes, from programmed coordinates to those of the axes. */
void nc_smooth_turn(nc_smooth *smooth, const double *rotation);
/* Take rows until the output is half full; returns how many were taken, or -1:
 * no memory, or -2: coefficients outside the pool, or a plane that the channel
 * lacks. */
int64_t nc_smooth_push(nc_smooth *smooth,
                       const nc_block *rows,
                       int64_t count,
                       const double *pool,
                       int64_t pool_n);
/* Everything held back becomes final; 0, or -1: no memory. */
int nc_smooth_drain(nc_smooth *smooth);
/* What is final: numbers of rows and coefficients, then the data; taking
 * empties the output. */
int64_t nc_smooth_rows(const nc_smooth *smooth);
int64_t nc_smooth_coefficients(const nc_smooth *smooth);
void nc_smooth_take(nc_smooth *smooth, nc_block *rows, double *pool);
void nc_smooth_get_stats(const nc_smooth *smooth, nc_smooth_stats *out);
/* cdef end */
#endif
