/* What the parts of the feeder share: dispatch.c, inserted_stop.c (inserted stops), standstill_jobs.c (jobs at standstill). */
#ifndef FEED_INTERNAL_H
#define FEED_INTERNAL_H
#include "engine/state/state.h"

piece *feed_copy(engine *e, const piece *from);
void feed_publish(engine *e);
void feed_motion(engine *e, const piece *from);
void feed_event(engine *e, const piece *from);
void feed_function(engine *e, const piece *from, uint32_t synch);
void feed_shorten(engine *e, piece *p, double s);
void feed_cut(engine *e, uint64_t head);
uint64_t feed_first_free(engine *e);
uint64_t feed_oldest(engine *e);

double feed_stop_in(engine *e, const piece *p, double begin);
void feed_stop(engine *e, const piece *before);
void feed_stop_at_end(engine *e);
void feed_take_insert(engine *e);
#endif
