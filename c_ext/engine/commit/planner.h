/* The common face of the two planners: the run ring, recall, rejoin, the pump
 * and the prediction know no other.
 *
 * One constant instance a planner: accel/accel_planner.c,
 * jerk_adapter/adapter.c. engine_new chooses. All functions run on the
 * planner's thread.
 */
#ifndef ENGINE_COMMIT_PLANNER_H
#define ENGINE_COMMIT_PLANNER_H
#include "engine/commit/commit.h"
#include "engine/state/state.h"
#include "jerk/state/api.h"

/* Where a hold would bring the path to rest; kept between two commits. */
typedef struct standstill_search {
    jerk_planner *scratch; /* a stop is tried in it */
    jerk_preview next;     /* of a hold behind the next commit, ... */
    double next_s;         /* ... which is expected to end there */
} standstill_search;

struct planner_ops {
    /* Commit motion from where committed motion ends. */
    void (*commit)(struct engine *engine);
    /* Motion from the writer's place on a stored tail on, `at_s` behind that
     * tail's beginning, and the new tail behind it. Committed motion ends there
     * then. False: not possible; the commit's end is undefined. */
    bool (*write)(struct engine *engine,
                  double at_s,
                  struct writer *writer,
                  struct tail *tail);
    /* Write the stored tail that is due. */
    void (*store_tail)(struct engine *engine);
    /* The run ring is fed anew from piece `head` on. */
    void (*cut)(struct engine *engine, uint64_t head);
    /* A new run begins where committed motion ends. */
    void (*begin_run)(struct engine *engine);
    /* Piece i ends at s now. */
    void (*shorten)(struct engine *engine, uint64_t i, double s);
    /* The stopping tail becomes the shortest one; false: not now. */
    bool (*shorten_tail)(struct engine *engine);
    /* The last `seconds` of motion are taken back, or a little less; returns
     * how much. */
    double (*take_back)(struct engine *engine, double seconds);
    /* Behind take_back: whether committed motion or its tail ends there. Else
     * the `seconds` are driven. */
    void (*taken_back)(struct engine *engine, bool follows, double seconds);
    /* The planner may be where committed motion does not end. */
    bool (*stands_elsewhere)(const struct engine *engine);
    void (*stand_elsewhere)(struct engine *engine);
    /* GEO drives the tail: whether going on from there may be tried, ... */
    bool (*may_rejoin)(const struct engine *engine);
    /* ... the planner follows its plan for `motion_s`, ... */
    bool (*follow)(struct engine *engine, double motion_s);
    /* ... and the tail is driven to its end. */
    void (*give_up_rejoin)(struct engine *engine);
    /* GEO has refused what was offered. */
    void (*refused)(struct engine *engine);
    /* The plan behind committed motion, into the writer. */
    void (*remainder_of_plan)(struct engine *engine, struct writer *writer);
    /* From the commit's end to where a hold brings the path to rest: one that
     * comes now, one that comes behind the next commit. */
    void (*ways_to_standstill)(struct engine *engine,
                               struct standstill_search *search,
                               double way[2]);
    /* A second planner to try stops in; NULL: none is needed. */
    jerk_planner *(*spare)(const struct engine *engine);
    /* Path behind the plan, estimated; NULL: the plan covers the window. */
    bool (*stands_behind)(struct engine *engine, uint64_t i);
    /* Whether the plan is made for the override and the speeds of now; NULL: it
     * always is. */
    bool (*as_wanted)(const struct engine *engine);
    double (*line_time)(const struct engine *engine,
                        const double *most,
                        double length,
                        double fastest);
    struct planner_traits traits;
};

/* The stored tail, where it is due, is written now. */
static inline void planner_store_tail(struct engine *engine) {
    if (engine->commit.tail_due) {
        engine->planner->store_tail(engine);
    }
}
#endif
