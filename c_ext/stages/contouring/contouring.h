/* Contouring: corners are replaced by two polynomials of degree 4 per axis.
 *
 * cnc_core/geometry/stages/contouring.py is the stage around it;
 * docs/explanation/contouring.md has the mathematics.  From top to bottom:
 *
 * contouring.c: which blocks meet in a corner, and the rows between them.
 * corner.c: corner distances, curve and deviation of one corner.
 * leg.c: one block of a corner.
 *
 * One motion is held until the next one is known, with the rows between them.
 */
#ifndef CONTOUR_H
#define CONTOUR_H
#include <stddef.h>
#include <stdint.h>
#include "rows/nc_block.h"

/* cdef begin */
#define NC_CONTOUR_SHORT 64 /* short blocks kept for the message */

typedef struct nc_contour_config {
    int32_t axes;
    int32_t main_axis[3];
    /* What a curve may use where its mode asks for it, mm/s2, mm/s3; no jerk
     * limit: 0. */
    double accel, jerk;
    double rapid; /* mm/s: speed of G00 where a mode asks for it */
} nc_contour_config;

typedef struct nc_contour_stats {
    uint64_t corners, skipped, irregular;
    double deviation; /* mm, largest distance of a curve from the programmed
                         contour and of a corner from its curve */
} nc_contour_stats;

/* A block too short to be rounded (message 120216). */
typedef struct nc_contour_short {
    double length;
    uint32_t line;
    uint16_t file, fill;
} nc_contour_short;

typedef struct nc_contour nc_contour;

/* `start`: position before the first row. NULL: no memory. */
nc_contour *nc_contour_new(const nc_contour_config *config,
                           const double *start);
void nc_contour_free(nc_contour *contour);
void nc_contour_resync(nc_contour *contour, const double *position);
/* Function `code` of row type `kind` makes the channel stand: 1 ahead of its
 * block's motion, 2 behind it; 0: it does not. */
void nc_contour_set_wait(nc_contour *contour, int kind, int code, int how);
/* 0, or -1: no memory, or -2: coefficients outside the pool, or a plane that
 * the channel lacks. */
int nc_contour_push(nc_contour *contour,
                    const nc_block *rows,
                    int64_t count,
                    const double *pool,
                    int64_t pool_n);
int nc_contour_drain(nc_contour *contour);
/* Neither on nor holding anything: rows would pass unchanged. */
int nc_contour_idle(const nc_contour *contour);
int64_t nc_contour_rows(const nc_contour *contour);
int64_t nc_contour_coefficients(const nc_contour *contour);
/* What is final; taking empties the output. */
void nc_contour_take(nc_contour *contour, nc_block *rows, double *pool);
void nc_contour_get_stats(const nc_contour *contour, nc_contour_stats *out);
/* Short blocks since the last call, at most NC_CONTOUR_SHORT. */
int nc_contour_take_short(nc_contour *contour, nc_contour_short *out);
/* cdef end */
#endif
