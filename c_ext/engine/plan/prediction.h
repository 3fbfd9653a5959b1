/* What lies ahead in time: the way to the next feed block, the place where the
 * path would come to a standstill, speeds to come. */
#ifndef ENGINE_PLAN_PREDICTION_H
#define ENGINE_PLAN_PREDICTION_H
#include "engine/state/state.h"
#include "rows/nc_block.h"

#define MARKS_MAX 4 /* feed blocks looked ahead to */

typedef struct place_of_standstill {
    bool moving; /* there is one ahead of the commit's end, ... */
    double way;  /* ... mm from there */
    double q[NC_AXES];
} place_of_standstill;

typedef struct forecast {
    double begin_s; /* motion time at which the first phase begins */
    uint32_t count, mark_count;
    bool complete;           /* at rest at its end, and nothing comes behind */
    bool stands;             /* at rest at its end, whatever comes behind */
    double marks[MARKS_MAX]; /* motion times at which feed blocks begin behind
                                rapid motion */
    uint64_t piece;          /* the commit's end ... */
    double s;
    struct place_of_standstill
        standstill[2]; /* of a hold that comes now; that comes so late that more
                    is committed before it acts */
    phase *phases;
    struct timetable timetable;
} forecast;

bool prediction_new(struct engine *engine);
void prediction_begin_program(struct engine *engine);

/* #CHANNEL SET [ESA_TIMEi]; any other index: not of this function. */
void prediction_time(struct engine *engine, int index, double seconds);
/* As jerk_adapter_renew(). */
bool prediction_renew(struct engine *engine);
void prediction_free(struct engine *engine);

/* Behind a turn of the planner. */
void prediction_plan(struct engine *engine, bool pumped);

/* In each cycle, inside the seqlock. */
void prediction_publish(struct engine *engine);
#endif
