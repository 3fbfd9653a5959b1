/* The acceleration-limited planner as the engine's planner. */
#ifndef ENGINE_ACCEL_ACCEL_PLANNER_H
#define ENGINE_ACCEL_ACCEL_PLANNER_H
#include "engine/commit/planner.h"
#include "engine/state/state.h"

extern const struct planner_ops accel_planner;
#endif
