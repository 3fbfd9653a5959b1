/* Motions too short to be driven: nothing jumps for them, and nothing stands at
 * their corners. */
#ifndef ENGINE_STORE_SHORT_MOTIONS_H
#define ENGINE_STORE_SHORT_MOTIONS_H
#include "engine/state/state.h"
#include "rows/nc_block.h"

bool carry_row(struct engine *e, const nc_block *row);
void carry_flush(struct engine *engine);
#endif
