/* Rows of technology functions become output and gate pieces of the store. */
#ifndef ENGINE_STORE_TECHNOLOGY_ROWS_H
#define ENGINE_STORE_TECHNOLOGY_ROWS_H
#include "engine/state/state.h"
#include "rows/nc_block.h"

void techno_block_end(struct engine *engine);
bool techno_has_room(const struct engine *engine);
void techno_spindle_word(struct engine *engine);
bool techno_push(struct engine *engine, const nc_block *row);
void techno_before_motion(struct engine *engine, const nc_block *row);
void techno_expl_syn(struct engine *engine, const nc_block *row);
#endif
