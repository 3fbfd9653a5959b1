/* Stops and functions that the PLC inserts (insert_cmd, hli_reference 5.3):
 * where they lie, and how the path is cut there. */
#ifndef ENGINE_RUN_INSERTED_STOP_H
#define ENGINE_RUN_INSERTED_STOP_H
#include "engine/state/state.h"

/* Where in a piece, as it is driven, the inserted stop lies, behind `begin`; -1
 * if not there. */
double inserted_stop_in(struct engine *engine,
                        const struct piece *piece,
                        double begin);

/* The stop stands behind the piece `before`. */
void insert_stop(struct engine *engine, const struct piece *before);

/* The program ends ahead of an inserted stop: it stands at the end. */
void insert_stop_at_end(struct engine *engine);

/* A new insert_cmd: what has been fed is fed again from where that is free, so
 * that the stop finds its place. */
void take_insert(struct engine *engine);
#endif
