/* External variables (V.E): the program reads what the last cycle has latched
 * and writes for the next one. */
#ifndef ENGINE_GEO_EXTERNAL_H
#define ENGINE_GEO_EXTERNAL_H
#include "engine/state/state.h"

/* The path has passed a command: its number, then the count. */
void external_command(struct engine *engine, double value);
void external_free(struct engine *engine);

/* Types of external numbers: `kind` of ENGINE_RT_EXTERNAL. */
enum {
    EXTERNAL_BOOLEAN,
    EXTERNAL_SGN08,
    EXTERNAL_UNS08,
    EXTERNAL_SGN16,
    EXTERNAL_UNS16,
    EXTERNAL_SGN32,
    EXTERNAL_UNS32,
    EXTERNAL_REAL64,
    EXTERNAL_TYPES
};

/* A number as this cycle has latched it, 0 if it is not finite; one that is put
 * out at once, limited to what its type holds. */
double external_number(const struct engine *engine, const engine_rt_op *op);
void external_set(struct engine *engine, const engine_rt_op *op, double value);

/* Once a cycle: the program's writes go out, then everything is latched. */
void external_cycle(struct engine *engine);
#endif
