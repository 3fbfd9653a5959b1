/* What a request of the queue may ask for beside the elements' facts. */
#ifndef ENGINE_LOOKAHEAD_DETAILS_H
#define ENGINE_LOOKAHEAD_DETAILS_H
#include "engine/lookahead/window.h"
#include "engine/plan/timetable.h"
#include "engine/state/state.h"

/* One state of plan and path for all details of an answer. */
typedef struct detail_maker {
    struct engine *engine;
    const struct range *range;
    double now;     /* dist_prog_start, 0.1 um */
    double planned; /* where the timetable says that the tool is */
    double time;    /* motion time, us */
    bool has_plan;
    struct timetable plan;
} detail_maker;

void detail_begin(struct engine *engine,
                  const struct range *range,
                  struct detail_maker *maker);
void detail_of_element(const struct detail_maker *maker,
                       uint64_t i,
                       const struct stretch *stretch,
                       HLI_AHEAD_DETAIL *out);
void detail_of_event(const struct detail_maker *maker,
                     const struct ahead_event *event,
                     const struct stretch *stretch,
                     HLI_AHEAD_DETAIL *out);
#endif
