/* Phases without jerk: forward through the window, phase by phase, some
 * milliseconds ahead of the interpolator. */
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

/* The stretch of piece i that holds s, s < length; its needs are those of the
 * last backward pass. */
stretch stretch_at(struct engine *engine, uint64_t i, uint64_t end, double s);

/* Whether everything ahead can be met from v at s of piece i. */
bool meets_all(struct engine *engine,
               uint64_t i,
               uint64_t end,
               double s,
               double v,
               double curved);
void brake_to(struct writer *writer, const stretch *st, double v1, bool ends);

/* One step over a curved stretch with constant acceleration along the path, cut
 * at the budget. */
void drive_curved(struct writer *writer,
                  const stretch *st,
                  bool ends,
                  bool brake);

/* A standstill or a corner passed too fast: where it is committed it is
 * counted, and a test holds that at 0. What is more than rounding is not
 * committed: a path that is fed anew (an inserted stop, a loop that ends) may
 * have other stretches than the plan has met. */
void leave_motion(struct writer *writer, uint64_t end);

/* The phase that the end of the last commit has cut. */
void run_on(struct writer *writer, uint64_t end);

/* Forward until the budget is used up, the window ends or the path stands
 * (hold, override 0). */
void drive_window(struct writer *writer, uint64_t end);
#endif
