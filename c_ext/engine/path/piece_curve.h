/* A polynomial as a piece of the engine: checks, evaluation, limits. */
#ifndef ENGINE_PATH_PIECE_CURVE_H
#define ENGINE_PATH_PIECE_CURVE_H
#include "curve/curve.h"
#include "engine/state/state.h"
#include "rows/nc_block.h"

/* The row's coefficients, checked and kept for the piece that is pushed next.
 */
bool curve_row_check(struct engine *engine,
                     const nc_block *row,
                     const double *pool,
                     int64_t pool_n);

/* Fill p from the coefficients kept by curve_row_check; length, end and feed
 * are set. */
void curve_piece_build(struct engine *engine, struct piece *piece);

/* Position at u of the whole piece. */
void curve_piece_position(const struct piece_store *store,
                          const struct piece *piece,
                          double u,
                          double *q);
void curve_piece_tangent(const struct piece_store *store,
                         const struct piece *piece,
                         double s,
                         double *u);

/* Derivatives by length at s of the piece as it is driven. */
void curve_piece_derivatives(const struct piece_store *store,
                             const struct piece *piece,
                             double s,
                             double *d1,
                             double *d2,
                             double *d3);

/* Bit of each axis whose way is that of the path: the main ones, all others
 * where those rest. */
uint16_t path_axes(const struct engine *engine, const struct piece *piece);

/* Their speed over that of the parameter. */
double curve_piece_main_rate(const struct engine *engine,
                             const struct piece *piece,
                             double s);

/* Next end of a cell behind s, mm of the piece as it is driven. */
double curve_piece_cell_end(const struct piece_store *store,
                            const struct piece *piece,
                            double s);

/* Constant bounds over `length` mm of a cell. */
void curve_cell_span(const struct engine *engine,
                     const struct piece *piece,
                     int cell,
                     const double *reserve,
                     double length,
                     struct span *out);

/* Where the cell ends that lies behind s, mm of the piece as it is driven;
 * NEVER: the last one. */
double curve_cell_behind(const struct curve *curve,
                         const struct piece *piece,
                         double s,
                         int *cell);
#endif
