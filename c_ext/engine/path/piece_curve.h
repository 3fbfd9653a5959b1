/* A polynomial as a piece of the engine: checks, evaluation, limits. */
#ifndef ENGINE_PATH_PIECE_CURVE_H
#define ENGINE_PATH_PIECE_CURVE_H
#include "curve/curve.h"
#include "engine/state/state.h"
#include "rows/nc_block.h"

bool curve_row_check(struct engine *engine,
                     const nc_block *row,
                     const double *pool,
                     int64_t pool_n);
void curve_piece_build(struct engine *engine, struct piece *piece);
void curve_piece_position(const struct piece_store *store,
                          const struct piece *piece,
                          double u,
                          double *q);
void curve_piece_tangent(const struct piece_store *store,
                         const struct piece *piece,
                         double s,
                         double *u);
void curve_piece_derivatives(const struct piece_store *store,
                             const struct piece *piece,
                             double s,
                             double *d1,
                             double *d2,
                             double *d3);
double curve_piece_main_rate(const struct engine *engine,
                             const struct piece *piece,
                             double s);
double curve_piece_cell_end(const struct piece_store *store,
                            const struct piece *piece,
                            double s);
void curve_cell_span(const struct engine *engine,
                     const struct piece *piece,
                     int cell,
                     const double *reserve,
                     double length,
                     struct span *out);
double curve_cell_behind(const struct curve *curve,
                         const struct piece *piece,
                         double s,
                         int *cell);
#endif
