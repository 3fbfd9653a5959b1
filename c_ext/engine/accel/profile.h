/* The planner: forward through the window, phase by phase, some milliseconds
 * ahead of the interpolator. */
#ifndef ENGINE_ACCEL_PROFILE_H
#define ENGINE_ACCEL_PROFILE_H
#include "engine/commit/commit.h"
#include "engine/state/state.h"

typedef struct stretch {
    const struct span *span;
    double from, to;  /* path length in the piece */
    double soft, cap; /* feed and override; straight: with the hard limit */
    double accel;     /* straight */
    double end2;      /* speed squared that must be met at `to` */
} stretch;

stretch stretch_at(struct engine *engine, uint64_t i, uint64_t end, double s);
bool meets_all(struct engine *engine,
               uint64_t i,
               uint64_t end,
               double s,
               double v,
               double curved);
void brake_to(struct writer *writer, const stretch *st, double v1, bool ends);
void drive_curved(struct writer *writer,
                  const stretch *st,
                  bool ends,
                  bool brake);
void leave_motion(struct writer *writer, uint64_t end);
void run_on(struct writer *writer, uint64_t end);
void drive_window(struct writer *writer, uint64_t end);
#endif
