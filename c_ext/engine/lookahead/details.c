/* What a request of the queue may ask for beside the elements' facts: where an
 * element lies, how long its driven path is, when it is reached and how fast.
 */
#include <string.h>
#include "engine/lookahead/details.h"
#include "engine/state/state.h"

#define UM_PER_MM 1000.0
/* mm: of pieces and elements, which add up in different order */
#define COVERED 1e-6
/* 0.1 um: what rounding leaves of a way that is driven */
#define REACHED 0.01

void detail_begin(struct engine *engine,
                  const struct range *range,
                  struct detail_maker *maker) {
    double seconds;
    maker->engine = engine;
    maker->range = range;
    __atomic_load(&engine->geo.shown_dist, &maker->now, __ATOMIC_ACQUIRE);
    __atomic_load(&engine->geo.consumed_s, &seconds, __ATOMIC_ACQUIRE);
    maker->time = seconds * TIMETABLE_US;
    maker->has_plan =
        timetable_copy(engine, &maker->plan) && timetable_forward(&maker->plan);
    if (maker->has_plan) {
        maker->planned = timetable_place(&maker->plan, maker->time).distance;
    }
}

/* Whether the way there is that of the plan. A loop that will be entered
 * belongs to it; what is behind its end may have to wait for another pass. */
static bool is_on_way(const struct detail_maker *maker,
                      uint32_t epoch,
                      uint32_t resets) {
    const struct range *range = maker->range;
    uint32_t ahead = epoch - range->epoch;
    return ahead <= range->last - range->epoch
           || ahead == resets - range->resets;
}

/* Time and speed at `way` from now, before or behind a standstill there. */
static bool plan_at(const struct detail_maker *maker,
                    double way,
                    bool behind,
                    double *time,
                    double *speed) {
    struct place_in_time place;
    if (!maker->has_plan || way < -REACHED
        || !timetable_reach(&maker->plan,
                            maker->planned + way,
                            behind,
                            &place)) {
        return false;
    }
    *time = greater(0.0, place.time - maker->time);
    *speed = place.speed;
    return true;
}

static void put_plan(const struct detail_maker *maker,
                     double length,
                     bool motion,
                     HLI_AHEAD_DETAIL *out) {
    if (plan_at(maker, out->way, motion, &out->time_start, &out->speed_start)) {
        out->flags |= HLI_AHEAD_HAS_START_PLAN;
    }
    if (motion
        && plan_at(maker,
                   out->way + length,
                   false,
                   &out->time_end,
                   &out->speed_end)) {
        out->flags |= HLI_AHEAD_HAS_END_PLAN;
    }
}

static void put_place(const struct engine *engine,
                      const struct element_more *more,
                      HLI_AHEAD_DETAIL *out) {
    for (int k = 0; k < engine->cfg.axis_count; k++) {
        out->start[k] = more->start[k] * TENTH_UM;
        out->end[k] = more->end[k] * TENTH_UM;
    }
    memcpy(out->direction_start, more->tangent_in, sizeof out->direction_start);
    memcpy(out->direction_end, more->tangent_out, sizeof out->direction_end);
    bool directed = false;
    for (int k = 0; k < 3; k++) {
        directed |= more->tangent_in[k] != 0.0 || more->tangent_out[k] != 0.0;
    }
    out->flags |= HLI_AHEAD_HAS_PLACE;
    if (directed) {
        out->flags |= HLI_AHEAD_HAS_DIRECTION;
    }
}

void detail_of_element(const struct detail_maker *maker,
                       uint64_t i,
                       const struct stretch *stretch,
                       HLI_AHEAD_DETAIL *out) {
    const struct piece_store *store = &maker->engine->store;
    const struct element *element = element_at(store, i);
    const struct element_more *more = more_at(store, i);
    const HLI_CONTOUR_LOOKAHEAD_BLOCK *facts = &element->facts;
    double covered, driven;
    __atomic_load(&more->covered, &covered, __ATOMIC_ACQUIRE);
    __atomic_load(&more->driven, &driven, __ATOMIC_ACQUIRE);
    HLI_AHEAD_DETAIL detail = {.epoch = epoch_shown(element->epoch),
                               .feed = more->feed * UM_PER_MM,
                               .flags = more->rapid ? HLI_AHEAD_RAPID : 0u};
    put_place(maker->engine, more, &detail);
    if (covered >= facts->length / TENTH_UM - COVERED) {
        detail.flags |= HLI_AHEAD_HAS_DRIVEN;
        detail.driven_length = driven * TENTH_UM;
    }
    if (is_on_way(maker, element->epoch, element->resets)) {
        detail.flags |= HLI_AHEAD_HAS_WAY;
        detail.way =
            facts->start_position + stretch->shift + stretch->zero - maker->now;
        put_plan(maker, facts->length, true, &detail);
    }
    *out = detail;
}

void detail_of_event(const struct detail_maker *maker,
                     const struct ahead_event *event,
                     const struct stretch *stretch,
                     HLI_AHEAD_DETAIL *out) {
    HLI_AHEAD_DETAIL detail = {.epoch = epoch_shown(event->epoch),
                               .code = event->code,
                               .value = event->value};
    if (is_on_way(maker, event->epoch, event->resets)) {
        detail.flags |= HLI_AHEAD_HAS_WAY;
        detail.way =
            event->distance + stretch->shift + stretch->zero - maker->now;
        put_plan(maker, 0.0, false, &detail);
    }
    *out = detail;
}
