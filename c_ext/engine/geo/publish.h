/* GEO's side of the HLI: the channel's status, shown once a cycle. */
#ifndef ENGINE_GEO_PUBLISH_H
#define ENGINE_GEO_PUBLISH_H
#include "engine/state/state.h"

void publish(struct engine *engine);

/* Distance to go is to be deleted, or the line to the next end is driven. */
bool deletes_distance(const struct engine *engine);

/* The cell's cycle and counters, behind the last channel. */
void publish_cell(struct engine *engine);

/* Between two cycles: the channel's state once more. */
void publish_again(struct engine *engine);

/* Power-up state, before the first cycle. */
void publish_initial(struct engine *engine);
#endif
