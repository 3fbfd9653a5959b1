/* From pieces to elements where they are not the same: a smoothed piece covers
 * a stretch of the programmed contour. */
#ifndef ENGINE_STORE_ELEMENT_MAP_H
#define ENGINE_STORE_ELEMENT_MAP_H
#include "engine/state/state.h"

void element_map_behind(struct engine *engine);
void element_map_piece(struct engine *engine,
                       struct piece *piece,
                       double programmed);
void element_map_position(struct engine *engine, const struct piece *piece);
#endif
