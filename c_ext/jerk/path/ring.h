/* The pushed path: a ring of intervals, from the head on. */
#ifndef JERK_RING_H
#define JERK_RING_H
#include "jerk/state/state.h"

/* The part of an interval between two lengths of it, mm; `out` may be `in`. */
void interval_part(const jerk_interval *in,
                   double from,
                   double to,
                   int axes,
                   jerk_interval *out);

/* The window is full of what is ahead, or a stand is. */
bool ring_reaches(const jerk_planner *planner);

/* Which interval is the last that ends at a stand: one may have come or gone.
 */
void ring_find_stand(jerk_planner *planner);

/* So many mm at the head were handed out; `whole`: the head interval ends. */
void ring_consume(jerk_planner *planner, double length, bool whole);
#endif
