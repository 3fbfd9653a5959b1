/* What the parts of the feeder share: dispatch.c, inserted_stop.c (inserted
 * stops), standstill_jobs.c (jobs at standstill). */
#ifndef FEED_INTERNAL_H
#define FEED_INTERNAL_H
#include "engine/state/state.h"

struct piece *feed_copy(struct engine *engine, const struct piece *from);
void feed_publish(struct engine *engine);
void feed_motion(struct engine *engine, const struct piece *from);
void feed_event(struct engine *engine, const struct piece *from);
void feed_function(struct engine *engine,
                   const struct piece *from,
                   uint32_t synch);
void feed_shorten(struct engine *engine, struct piece *piece, double s);
void feed_cut(struct engine *engine, uint64_t head);
uint64_t feed_first_free(struct engine *engine);
uint64_t feed_oldest(struct engine *engine);

double feed_stop_in(struct engine *engine,
                    const struct piece *piece,
                    double begin);
void feed_stop(struct engine *engine, const struct piece *before);
void feed_stop_at_end(struct engine *engine);
void feed_take_insert(struct engine *engine);
#endif
