/* Stops and functions that the PLC inserts (insert_cmd, hli_reference 5.3):
 * where they lie, and how the path is cut there. */
#ifndef ENGINE_RUN_INSERTED_STOP_H
#define ENGINE_RUN_INSERTED_STOP_H
#include "engine/state/state.h"

double inserted_stop_in(struct engine *engine,
                        const struct piece *piece,
                        double begin);
void insert_stop(struct engine *engine, const struct piece *before);
void insert_stop_at_end(struct engine *engine);
void take_insert(struct engine *engine);
#endif
