/* Which elements the look-ahead shows at present: the window from the active
 * element on and as many behind it, epoch by epoch. An epoch ends where
 * distances change their meaning: at a distance reset, at either end of a
 * real-time loop.
 */
#include "engine/lookahead/window.h"
#include "engine/state/state.h"
#include "hli/sync.h"

static uint64_t min64(uint64_t a, uint64_t b) {
    return a < b ? a : b;
}

static uint64_t ring_log_max(const engine_config *cfg) {
    return min64(cfg->log_max, 65536u);
}

/* First element from `lo` to before `hi` of a later epoch. */
static uint64_t epoch_end(const struct piece_store *store,
                          uint64_t lo,
                          uint64_t hi,
                          uint32_t epoch) {
    while (lo < hi) {
        uint64_t mid = lo + (hi - lo) / 2;
        if (element_at(store, mid)->epoch > epoch) {
            hi = mid;
        } else {
            lo = mid + 1;
        }
    }
    return lo;
}

bool left_out(const struct program_state *program) {
    return ATOMIC_GET(program->abort) == ABORT_DONE;
}

/* The present epoch, and the loop behind it if it will be entered. */
static void end_range(struct engine *engine, struct range *range) {
    const struct piece_store *store = &engine->store;
    range->last = range->epoch;
    range->end = epoch_end(store, range->first, range->window, range->last);
    if (range->end < range->window && ATOMIC_GET(engine->orders.rt_loop)
        && element_at(store, range->end)->role == LOOP_FIRST) {
        range->last++;
        range->end = epoch_end(store, range->first, range->window, range->last);
    }
}

static struct range range_now(struct engine *engine) {
    bool finished = ATOMIC_GET(engine->program.finished) != 0;
    uint64_t active = ATOMIC_GET(engine->geo.active),
             head = ATOMIC_GET(engine->store.element_head);
    uint64_t behind = ring_log_max(&engine->cfg),
             first = active > behind ? active - behind : 0,
             epoch_first = ATOMIC_GET(engine->geo.epoch_first);
    struct range range = {.first = first > epoch_first ? first : epoch_first,
                          .head = head,
                          .epoch = ATOMIC_GET(engine->geo.epoch),
                          .resets = ATOMIC_GET(engine->geo.resets),
                          .finished = finished};
    uint64_t from = active > epoch_first ? active : epoch_first;
    __atomic_load(&engine->geo.dist_shift, &range.shift, __ATOMIC_ACQUIRE);
    range.shift *= TENTH_UM;
    range.window =
        min64(head,
              from + 1 + min64(engine->cfg.window, ring_log_max(&engine->cfg)));
    if (left_out(&engine->program)) {
        range.window = min64(range.window, active + 1);
    }
    if (range.window < range.first) {
        range.window = range.first;
    }
    end_range(engine, &range);
    return range;
}

struct range window_range(struct engine *engine) {
    for (;;) {
        uint32_t marks = ATOMIC_GET(engine->geo.marks);
        struct range range = range_now(engine);
        __atomic_thread_fence(__ATOMIC_ACQUIRE);
        if (!(marks & 1) && ATOMIC_GET(engine->geo.marks) == marks) {
            return range;
        }
        cpu_pause();
    }
}

bool range_holds(struct engine *engine, const struct range *range) {
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    return ATOMIC_GET(engine->store.element_head)
           < range->first + engine->store.element_mask + 1;
}

double displayed_distance(const struct geo *geo) {
    return (geo->dist_shift + geo->dist) * TENTH_UM;
}

bool mode2_available(const engine_config *cfg) {
    return (cfg->functions & ENGINE_FCT_CONTOUR_LAH) && cfg->log_max > 0;
}

struct stretch stretch_now(const struct range *range) {
    return (struct stretch){.first = range->first,
                            .end = range->end,
                            .shift = range->shift,
                            .epoch = range->epoch,
                            .last = range->last};
}

bool stretch_next(const struct piece_store *store,
                  const struct range *range,
                  struct stretch *stretch) {
    if (stretch->end >= range->window) {
        return false;
    }
    const struct element *next = element_at(store, stretch->end);
    bool here = stretch->end > stretch->first;
    const struct element *last =
        here ? element_at(store, stretch->end - 1) : NULL;
    bool reset = next->resets != (here ? last->resets : range->resets);
    if (reset && here) {
        stretch->zero +=
            last->facts.start_position + last->facts.length + stretch->shift;
    }
    if (reset) {
        stretch->shift = 0.0;
    }
    stretch->epoch = stretch->last = next->epoch;
    stretch->first = stretch->end;
    stretch->end =
        epoch_end(store, stretch->first, range->window, stretch->epoch);
    return true;
}

uint64_t first_behind(const struct piece_store *store,
                      const struct stretch *stretch,
                      double start) {
    uint64_t lo = stretch->first, hi = stretch->end;
    while (lo < hi) {
        uint64_t mid = lo + (hi - lo) / 2;
        const HLI_CONTOUR_LOOKAHEAD_BLOCK *facts =
            &element_at(store, mid)->facts;
        if (facts->start_position + facts->length > start) {
            hi = mid;
        } else {
            lo = mid + 1;
        }
    }
    return lo;
}

uint32_t stretch_end(const struct piece_store *store,
                     const struct range *range,
                     const struct stretch *stretch) {
    if (stretch->end < range->window) {
        bool here = stretch->end > stretch->first;
        uint32_t resets =
            here ? element_at(store, stretch->end - 1)->resets : range->resets;
        return element_at(store, stretch->end)->resets != resets
                   ? HLI_AHEAD_END_RESET
                   : HLI_AHEAD_END_LOOP;
    }
    return range->finished && range->window == range->head
               ? HLI_AHEAD_END_PROGRAM
               : HLI_AHEAD_END_OPEN;
}
