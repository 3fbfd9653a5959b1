/* Motions too short to be driven: nothing jumps for them, and nothing stands at
 * their corners. */
#ifndef ENGINE_STORE_SHORT_MOTIONS_H
#define ENGINE_STORE_SHORT_MOTIONS_H
#include "engine/state/state.h"
#include "rows/nc_block.h"

/* A motion row: true if it is carried. What cannot take the displacement with
 * it has it driven first. */
bool short_motions_row(struct engine *engine, const nc_block *row);

/* Something comes that is no motion: the displacement is driven ahead of it. */
void short_motions_flush(struct engine *engine);
#endif
