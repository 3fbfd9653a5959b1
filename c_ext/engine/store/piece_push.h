/* A motion row becomes a piece, with the displacement of short motions ahead of
 * it. */
#ifndef ENGINE_STORE_PIECE_PUSH_H
#define ENGINE_STORE_PIECE_PUSH_H
#include "engine/state/state.h"
#include "rows/nc_block.h"

/* What a motion row says of its piece, but for where that lies on the path. */
void push_piece(struct engine *engine,
                struct piece *piece,
                const nc_block *row);

/* Where the next row begins as it is programmed, whatever short motions are
 * carried. */
const double *push_begins(const struct push_state *push);
double axis_distance(const engine_config *cfg,
                     const double *from,
                     const double *to);
#endif
