/* Elements: the facts of the programmed motions that the PLC sees. */
#ifndef ENGINE_STORE_ELEMENTS_H
#define ENGINE_STORE_ELEMENTS_H
#include "engine/state/state.h"
#include "rows/nc_block.h"

/* What the PLC sees of a programmed motion, from its row alone. */
void push_element(struct engine *engine, const nc_block *row);
#endif
