/* The marked log (mode 1): entries between LOG ON and LOG OFF, written by SDA,
 * read by the service. */
#ifndef ENGINE_STORE_MARKED_LOG_H
#define ENGINE_STORE_MARKED_LOG_H
#include <math.h>
#include "engine/state/state.h"
#include "rows/nc_block.h"

bool log_available(const engine_config *cfg);
const HLI_CONTOUR_LOOKAHEAD_BLOCK *log_entry(const struct marked_log *log,
                                             uint32_t i);

/* Program start: the log is empty. */
void log_reset(struct marked_log *log);
void log_marker(struct engine *engine, const nc_block *row);
void log_element(struct engine *engine, const struct element *el);
void log_loop_begin(struct engine *engine);
void log_loop_end(struct engine *engine, double length);
void log_program_end(struct engine *engine);
#endif
