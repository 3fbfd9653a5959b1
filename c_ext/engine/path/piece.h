/* Geometry of one piece: where it is and where it points at path length s. */
#ifndef ENGINE_PATH_PIECE_H
#define ENGINE_PATH_PIECE_H
#include "engine/state/state.h"
#include "rows/nc_block.h"

void piece_build(struct engine *engine,
                 struct piece *piece,
                 const nc_block *row);
void piece_position(const struct engine *engine,
                    const struct piece *piece,
                    double s,
                    double *q);
void piece_cut(const struct engine *engine,
               struct piece *piece,
               double u0,
               double u1);
void piece_shortcut(const struct engine *engine,
                    struct piece *piece,
                    const double *q,
                    double path,
                    double dist);
void piece_tangent(const struct engine *engine,
                   const struct piece *piece,
                   double s,
                   double *u);
double angle_between(const double *a, const double *b);
#endif
