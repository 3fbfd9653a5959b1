/* From pieces to elements where they are not the same: a smoothed piece covers
 * a stretch of the programmed contour. */
#ifndef ENGINE_STORE_ELEMENT_MAP_H
#define ENGINE_STORE_ELEMENT_MAP_H
#include "engine/state/state.h"

void map_behind_element(struct engine *engine);
void map_piece(struct engine *engine, struct piece *piece, double programmed);
void map_position(struct engine *engine, const struct piece *piece);
#endif
