/* What the cell does to an engine beside its rows: real-time cycles, external
 * variables, holds, modes, errors. */
#ifndef FUZZ_CELL_H
#define FUZZ_CELL_H
#include <stdbool.h>

#include "bytes.h"
#include "calls.h"

enum cell_wish {
    CELL_NOTHING,
    CELL_ABORT, /* the program ends, no row may come */
    CELL_DRAIN  /* no row before ENGINE_DRAINED */
};

/* External variables and types of functions, before the first row. */
void cell_start(struct bytes *bytes, struct engine *engine);
/* One act, as the bytes say. `alone`: there is no PLC. */
enum cell_wish cell_act(struct bytes *bytes,
                        struct engine *engine,
                        const engine_config *config,
                        bool alone);

#endif
