/* GEO: evaluates committed phases once a cycle. */
#ifndef ENGINE_GEO_INTERPOLATE_H
#define ENGINE_GEO_INTERPOLATE_H
#include "engine/state/state.h"

double geo_path_speed(const struct engine *engine);
void geo_begin_distance(struct engine *engine);
void end_phase_at(struct geo *geo, double t);
void geo_advance(struct engine *engine, double dt);
void geo_evaluate(struct engine *engine);
bool geo_drained(struct engine *engine);
#endif
