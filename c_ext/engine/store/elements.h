/* Elements: the facts of the programmed motions that the PLC sees. */
#ifndef ENGINE_STORE_ELEMENTS_H
#define ENGINE_STORE_ELEMENTS_H
#include "engine/state/state.h"
#include "rows/nc_block.h"

void push_element(struct engine *engine,
                  const struct piece *piece,
                  const nc_block *row);

/* A programmed motion that smoothed pieces execute: an element without a piece.
 */
void push_programmed(struct engine *engine, const nc_block *row);
#endif
