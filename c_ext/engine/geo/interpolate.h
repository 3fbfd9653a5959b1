/* GEO: evaluates committed phases once a cycle. */
#ifndef ENGINE_GEO_INTERPOLATE_H
#define ENGINE_GEO_INTERPOLATE_H
#include "engine/state/state.h"

/* Speed along the path, mm/s; of a polynomial that runs with its parameter not
 * the speed of that. */
double geo_path_speed(const struct engine *engine);

/* A program begins: its first element begins the distance. */
void geo_begin_distance(struct engine *engine);

/* The path goes on behind rows that were left out: the distance stays. */
void geo_go_on(struct engine *engine);

/* The present phase is driven for t seconds only; its piece goes on. */
void end_phase_at(struct geo *geo, double t);

/* Consume dt of committed motion. */
void geo_advance(struct engine *engine, double dt);
void geo_evaluate(struct engine *engine);

/* Everything pushed up to now has been executed and the axes stand. */
bool geo_drained(struct engine *engine);
#endif
