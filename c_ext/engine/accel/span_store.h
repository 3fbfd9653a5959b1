/* Memory for the stretches of pieces: a shared share for a few, room of their
 * own for many. */
#ifndef ENGINE_ACCEL_SPAN_STORE_H
#define ENGINE_ACCEL_SPAN_STORE_H
#include "engine/state/state.h"

/* Without memory it stays as it is. */
void room_for(span_room *room, uint32_t count, uint32_t numbers);

/* The share of a room that there is at first, whatever pieces before have
 * needed. */
span_room spans_first(const engine_config *cfg, const span_room *room);
bool spans_new(struct engine *engine);
void spans_free(struct accel_state *accel);

/* Room for `count` stretches of so many rows per axis, or as many as a piece
 * may have; what was in it is lost. */
void spans_grow(const engine_config *cfg,
                span_room *room,
                double count,
                uint32_t per_axis);

/* The room of a piece that comes soon has not been touched for a long time. */
void spans_prefetch(const struct accel_state *accel, uint64_t i);

/* The stretches of piece i are those in the room it shares with others. */
bool spans_known(const struct engine *engine, uint64_t i);
#endif
