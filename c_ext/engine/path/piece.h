/* Geometry of one piece: where it is and where it points at path length s. */
#ifndef ENGINE_PATH_PIECE_H
#define ENGINE_PATH_PIECE_H
#include "engine/state/state.h"
#include "rows/nc_block.h"

/* Fill the geometry of p from a motion row; p->start is set already. */
void piece_build(struct engine *engine,
                 struct piece *piece,
                 const nc_block *row);
void piece_position(const struct engine *engine,
                    const struct piece *piece,
                    double s,
                    double *q);

/* Only the part of a whole piece from u0 to u1 is driven; u0 > u1: backward. */
void piece_cut(const struct engine *engine,
               struct piece *piece,
               double u0,
               double u1);

/* A straight line from q to the end of p takes its place. The path counts on to
 * where it is at that end. */
void piece_shortcut(const struct engine *engine,
                    struct piece *piece,
                    const double *q,
                    double path,
                    double dist);

/* dq/ds of all axes. */
void piece_tangent(const struct engine *engine,
                   const struct piece *piece,
                   double s,
                   double *u);

/* Angle between two unit vectors, exact near 0 and pi. */
double angle_between(const double *a, const double *b);
#endif
