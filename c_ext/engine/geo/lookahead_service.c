/* Contour look-ahead service (FCT-C40 section 5.2): one function for the cyclic
 * and the immediate mode.
 *
 * The PLC's numbers are copied once and checked before use. What is read of the
 * ring may be dropped by GEO and overwritten by SDA meanwhile when a thread of
 * its own serves; the copy is repeated then.
 */
#include <math.h>
#include <string.h>
#include "engine/geo/lookahead_service.h"
#include "engine/state/record_ring.h"
#include "engine/state/state.h"
#include "engine/store/marked_log.h"
#include "hli/sync.h"

#define ANSWER_MAX (HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX + 1)

typedef struct range {
    uint64_t first, end; /* element ids */
    double shift; /* 0.1 um: what passes of real-time loops have added to the
                     distances */
} range;

static uint64_t min64(uint64_t a, uint64_t b) {
    return a < b ? a : b;
}

static uint64_t ring_log_max(const engine_config *cfg) {
    return min64(cfg->log_max, 65536u);
}

/* Elements of mode 2: the window from the active element on, and as many behind
 * it; the present distance epoch only. */
static struct range range_now(struct engine *engine) {
    uint64_t active = ATOMIC_GET(engine->geo.active),
             head = ATOMIC_GET(engine->store.element_head);
    uint64_t behind = ring_log_max(&engine->cfg),
             first = active > behind ? active - behind : 0,
             epoch_first = ATOMIC_GET(engine->geo.epoch_first);
    uint32_t epoch = ATOMIC_GET(engine->geo.epoch);
    struct range range = {.first = first > epoch_first ? first : epoch_first};
    uint64_t from = active > epoch_first ? active : epoch_first;
    __atomic_load(&engine->geo.dist_shift, &range.shift, __ATOMIC_ACQUIRE);
    range.shift *= TENTH_UM;
    range.end =
        min64(head,
              from + 1 + min64(engine->cfg.window, ring_log_max(&engine->cfg)));
    if (range.end < range.first) {
        range.end = range.first;
    }
    uint64_t lo = range.first,
             hi = range.end; /* elements behind a pending reset or the end of a
                                loop come later */
    while (lo < hi) {
        uint64_t mid = lo + (hi - lo) / 2;
        if (element_at(&engine->store, mid)->epoch > epoch) {
            hi = mid;
        } else {
            lo = mid + 1;
        }
    }
    range.end = lo;
    return range;
}

static struct range window_range(struct engine *engine) {
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

static bool mode2_available(const engine_config *cfg) {
    return (cfg->functions & ENGINE_FCT_CONTOUR_LAH) && cfg->log_max > 0;
}

double max_dist_prog_start(struct engine *engine) {
    if (!mode2_available(&engine->cfg)) {
        return 0.0;
    }
    struct range range = window_range(engine);
    if (range.end == range.first) {
        return 0.0;
    }
    const HLI_CONTOUR_LOOKAHEAD_BLOCK *facts =
        &element_at(&engine->store, range.end - 1)->facts;
    return facts->start_position + facts->length + range.shift;
}

/* First element of r that ends behind `start`. */
static uint64_t first_behind(struct piece_store *store,
                             struct range range,
                             double start) {
    while (range.first < range.end) {
        uint64_t mid = range.first + (range.end - range.first) / 2;
        const HLI_CONTOUR_LOOKAHEAD_BLOCK *facts =
            &element_at(store, mid)->facts;
        if (facts->start_position + facts->length > start) {
            range.end = mid;
        } else {
            range.first = mid + 1;
        }
    }
    return range.first;
}

static uint32_t answer_distance(struct engine *engine,
                                double start,
                                double length,
                                HLI_CONTOUR_LOOKAHEAD_BLOCK *out) {
    if (!mode2_available(&engine->cfg) || !(length > 0)) {
        return 0;
    }
    for (;;) {
        struct range range = window_range(engine);
        uint64_t i = first_behind(&engine->store, range, start - range.shift);
        uint32_t count = 0;
        for (; i < range.end && count < ANSWER_MAX; i++) {
            const HLI_CONTOUR_LOOKAHEAD_BLOCK *facts =
                &element_at(&engine->store, i)->facts;
            if (facts->start_position + range.shift >= start + length) {
                break;
            }
            HLI_CONTOUR_LOOKAHEAD_BLOCK block =
                *facts; /* `out` is the PLC's to scribble on: written, never
                           read */
            block.start_position += range.shift;
            out[count++] = block;
        }
        __atomic_thread_fence(__ATOMIC_ACQUIRE);
        if (ATOMIC_GET(engine->store.element_head)
            < range.first + engine->store.element_mask + 1) {
            return count; /* no slot was used again */
        }
    }
}

static uint32_t answer_index(struct engine *engine,
                             double index,
                             HLI_CONTOUR_LOOKAHEAD_BLOCK *out) {
    double i = trunc(index);
    if (!log_available(&engine->cfg) || i < 0) {
        return 0;
    }
    for (;;) {
        uint64_t generation = ATOMIC_GET(engine->log.generation);
        uint32_t count = ATOMIC_GET(engine->log.count), number = 0;
        if (i < count) {
            uint32_t from = (uint32_t)i;
            number = count - from < ANSWER_MAX ? count - from : ANSWER_MAX;
            for (uint32_t k = 0; k < number; k++) {
                out[k] = *log_entry(&engine->log, from + k);
            }
        }
        __atomic_thread_fence(__ATOMIC_ACQUIRE);
        if (!(generation & 1)
            && ATOMIC_GET(engine->log.generation) == generation) {
            return number;
        }
        cpu_pause();
    }
}

/* block_type 0 behind the last element: only what the answer before had filled.
 */
static void close_answer(struct lookahead_service *service,
                         HLI_CONTOUR_LOOKAHEAD_BLOCK *out,
                         uint32_t count) {
    for (uint32_t k = count;
         k < ANSWER_MAX && (k <= count || k < service->answered);
         k++) {
        memset(&out[k], 0, sizeof out[k]);
    }
    service->answered = count;
}

static void count_up(uint64_t *counter) {
    ATOMIC_SET(*counter, *counter + 1);
}

static uint32_t answer(struct engine *engine,
                       double start,
                       double length,
                       HLI_CONTOUR_LOOKAHEAD_BLOCK *out) {
    if (!isfinite(start) || !isfinite(length)) {
        count_up(&engine->service.requests_bad);
        return 0;
    }
    if (length == 0.0) {
        count_up(&engine->service.requests_mode1);
        return answer_index(engine, start, out);
    }
    count_up(&engine->service.requests_mode2);
    return answer_distance(engine, start, length, out);
}

static uint32_t mode_of(double start, double length) {
    return !isfinite(start) || !isfinite(length) ? 0u : length == 0.0 ? 1u : 2u;
}

static void post_answer(struct shared_areas *hli) {
    HLI_SIDE_WORD *side_word = &hli->side->clah_answer;
    hs_word_post(side_word, load_u32_relaxed(&side_word->word) + 1);
}

int serve_request(struct engine *engine) {
    HLI_CONTOUR_LOOKAHEAD *contour_lookahead =
        &engine->hli.channel->contour_lookahead;
    if (!load_u8_acquire(&contour_lookahead->semaphor_rw)) {
        return 0;
    }
    double start = load_f64_relaxed(&contour_lookahead->request.start_position),
           length = load_f64_relaxed(&contour_lookahead->request.length);
    struct engine_request *recorded = record_next(&engine->recording.requests);
    int64_t began = recorded ? hs_monotonic_ns() : 0;
    uint64_t cycle = ATOMIC_GET(engine->geo.cycle);
    uint32_t count =
        answer(engine, start, length, contour_lookahead->response.block);
    close_answer(&engine->service, contour_lookahead->response.block, count);
    store_u8_release(&contour_lookahead->semaphor_rw, 0);
    post_answer(&engine->hli);
    if (recorded) {
        *recorded = (struct engine_request){
            .cycle = cycle,
            .start = start,
            .length = length,
            .mode = mode_of(start, length),
            .elements = count,
            .answer_ns = (uint64_t)(hs_monotonic_ns() - began),
        };
        record_put(&engine->recording.requests);
    }
    return 1;
}
