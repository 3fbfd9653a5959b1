/* Memory for the stretches of pieces: a shared share for a few, room of their
 * own for many. */
#ifndef ENGINE_ACCEL_SPAN_STORE_H
#define ENGINE_ACCEL_SPAN_STORE_H
#include "engine/state/state.h"

void room_for(span_room *room, uint32_t count, uint32_t numbers);
span_room spans_first(const engine_config *cfg, const span_room *room);
bool spans_new(struct engine *engine);
void spans_free(struct accel_state *accel);
void spans_grow(const engine_config *cfg,
                span_room *room,
                double count,
                uint32_t per_axis);
bool spans_known(const struct engine *engine, uint64_t i);
#endif
