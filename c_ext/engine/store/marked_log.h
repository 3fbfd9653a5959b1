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
/* Behind a halt: the first piece that may be executed in another order than
 * the row that it is of. */
uint64_t first_of_block(const struct engine *engine);

/* Where smoothing holds motions back, a command of the log comes ahead of the
 * motions that it stands behind: it is not done before those are driven. */
bool log_marker_is_ahead(const struct engine *engine,
                         const struct piece *piece);
struct logged log_now(const struct engine *engine);

/* A halt has left out what lies behind the path's place, at push.distance: it
 * comes again, and is logged then. */
void log_left_out(struct engine *engine);
#endif
