/* From pieces to elements where they are not the same: a smoothed piece covers
 * a stretch of the programmed contour. */
#ifndef ENGINE_STORE_ELEMENT_MAP_H
#define ENGINE_STORE_ELEMENT_MAP_H
#include "engine/state/state.h"

/* The motion behind the element pushed last: pieces that follow begin there. */
void element_map_behind(struct engine *engine);

/* SDA: a piece that covers `programmed` mm of the elements from where the piece
 * before ended. */
void element_map_piece(struct engine *engine,
                       struct piece *piece,
                       double programmed);

/* GEO: the element under the tool, by the displayed distance. */
void element_map_position(struct engine *engine, const struct piece *piece);
#endif
