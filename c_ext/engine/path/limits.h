/* Limits that a program sets for its motions (NC_DYNAMICS): G127-G134,
 * G230-G233, #VECTOR LIMIT, #SLOPE. */
#ifndef ENGINE_PATH_LIMITS_H
#define ENGINE_PATH_LIMITS_H
#include "engine/state/state.h"
#include "rows/nc_block.h"

void limits_reset(struct push_state *push);
bool limits_row_check(const engine_config *cfg, const nc_block *row);
void limits_set(struct engine *engine, const nc_block *row);
#endif
