/* Stops and functions that the PLC inserts (insert_cmd, hli_reference 5.3):
 * where they lie, and how the path is cut there. */
#ifndef ENGINE_RUN_INSERTED_STOP_H
#define ENGINE_RUN_INSERTED_STOP_H
#include "engine/state/state.h"

double feed_stop_in(struct engine *engine,
                    const struct piece *piece,
                    double begin);
void feed_stop(struct engine *engine, const struct piece *before);
void feed_stop_at_end(struct engine *engine);
void feed_take_insert(struct engine *engine);
#endif
