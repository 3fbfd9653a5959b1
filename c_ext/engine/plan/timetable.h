/* The plan as a table of places and times: knots, between which the distance is
 * a cubic of the time. Distances run on over distance resets and real-time
 * loops; only their differences mean something.
 */
#ifndef ENGINE_PLAN_TIMETABLE_H
#define ENGINE_PLAN_TIMETABLE_H
#include "engine/state/state.h"

#define TIMETABLE_US 1e6 /* per second: times of the table are us */

typedef struct place_in_time {
    double time, distance, rate, speed; /* as HLI_AHEAD_KNOT */
} place_in_time;

/* Where the motion is at a time inside the table; the nearest end outside. */
struct place_in_time timetable_place(const struct timetable *table,
                                     double time);

/* When a distance is reached: the first time, or the last one if it is stood
 * there. False: the table does not reach so far. */
bool timetable_reach(const struct timetable *table,
                     double distance,
                     bool last,
                     struct place_in_time *place);

/* Whether it leads forward on the programmed path. */
bool timetable_forward(const struct timetable *table);

/* Behind a turn of the planner: what is committed, then what is planned behind
 * it. */
void timetable_begin(struct engine *engine, struct timetable *table);
void timetable_add(struct engine *engine,
                   struct timetable *table,
                   const phase *ph,
                   double begin_s);
/* `stands`: the axes stand at its end, which is then driven as it is. */
void timetable_end(struct timetable *table,
                   bool complete,
                   bool stands,
                   double override);

/* GEO: show another table from here on; none. */
void timetable_publish(struct engine *engine, const struct timetable *table);
void timetable_withdraw(struct engine *engine);

/* A copy of the one that is shown; false: there is none. */
bool timetable_copy(struct engine *engine, struct timetable *table);
#endif
