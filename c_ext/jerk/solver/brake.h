/* The fastest brake to rest, integrated in time. */
#ifndef JERK_BRAKE_H
#define JERK_BRAKE_H
#include "jerk/state/state.h"

/* Place, speed and acceleration at the steps of a brake: mm, mm/s, mm/s2. */
typedef struct brake_path {
    double s[BRAKE_STEPS + 2], v[BRAKE_STEPS + 2], a[BRAKE_STEPS + 2];
    int count;
    bool beyond; /* it has left the grid */
    bool torn;   /* its axes contradicted each other somewhere */
} brake_path;

/* Whether there is a brake: the path does not let it, it rests, or it does not
 * rest on the grid. */
enum brake_end {
    BRAKE_NONE,
    BRAKE_RESTS,
    BRAKE_BEYOND
};

/* From the head over the grid, in `longest` s at the most. */
enum brake_end brake_to_rest(const jerk_planner *planner,
                             const struct grid *grid,
                             double longest,
                             brake_path *out);

/* Its squared speeds (scaled) at the knots of a grid that ends at rest, at the
 * same shares of the way. */
void brake_speeds(const jerk_planner *planner,
                  const struct grid *grid,
                  const brake_path *path,
                  double *x);
#endif
