/* The store's slots: pieces in program order. */
#ifndef ENGINE_STORE_STORE_H
#define ENGINE_STORE_STORE_H
#include "engine/state/state.h"
#include "rows/nc_block.h"

/* The next place of the store, cleared, with what every row has. */
struct piece *store_slot(struct engine *engine, const nc_block *row);
void store_publish(struct piece_store *store);
#endif
