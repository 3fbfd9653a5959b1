/* Rows that the engine refuses: no numbers, unknown types, geometry that does
 * not fit. */
#ifndef ENGINE_STORE_ROW_CHECK_H
#define ENGINE_STORE_ROW_CHECK_H
#include "engine/state/state.h"
#include "rows/nc_block.h"

bool row_is_finite(const engine_config *cfg, const nc_block *row);
bool row_is_supported(struct engine *engine,
                      const nc_block *row,
                      const double *pool,
                      int64_t pool_n);
#endif
