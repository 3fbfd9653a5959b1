/* Acceleration-limited path planning (TOPP2): controllable speeds backwards, as
 * fast as they allow forwards.
 *
 * The path comes in the intervals of planner.h and goes in its laws (c = jerk =
 * 0).  Between two knots the path acceleration is constant; every axis meets
 * its acceleration at both ends of every interval. docs/explanation/planner.md.
 */
#ifndef TOPP2_H
#define TOPP2_H
#include "jerk/state/api.h"

/* cdef begin */
typedef struct topp2 topp2;
topp2 *topp2_new(
    const jerk_config *config,
    int capacity); /* j_max is not read; NULL: no memory or bad limits */
void topp2_free(topp2 *topp);
int64_t topp2_room(const topp2 *topp);
int64_t topp2_push(topp2 *topp, const jerk_interval *intervals, int64_t count);
void topp2_override(topp2 *topp, double feed, double rapid);
void topp2_hold(topp2 *topp, int hold);
int64_t topp2_take(topp2 *topp, jerk_law *laws, int64_t max, double seconds);
int64_t topp2_tail(const topp2 *topp, jerk_law *laws, int64_t max);
uint64_t topp2_steps(const topp2 *topp); /* backward and forward steps done, for
                                            the argument about cost */
/* cdef end */
#endif
