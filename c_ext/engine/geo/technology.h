/* M, H and T functions to the PLC: technology units with two flags
 * (hli_reference section 6). */
#ifndef ENGINE_GEO_TECHNOLOGY_H
#define ENGINE_GEO_TECHNOLOGY_H
#include "engine/state/state.h"

/* An event that cannot be run yet: a gate that is not open, a repeated function
 * without a free unit. */
bool techno_blocked(struct engine *engine, const struct piece *piece);
void techno_output(struct engine *engine, struct piece *piece);

/* Once a cycle: what the PLC fetched and acknowledged; early outputs that are
 * due. */
void techno_cycle(struct engine *engine);
void technology_clear(struct technology_state *technology);
#endif
