/* What a request of the look-ahead is answered with: entries of the marked log,
 * or elements of the contour, which may go on behind the present epoch.
 *
 * The answer's memory is the PLC's to scribble on: it is written, never read.
 */
#include <math.h>
#include <string.h>
#include "engine/lookahead/answer.h"
#include "engine/lookahead/details.h"
#include "engine/lookahead/window.h"
#include "engine/state/state.h"
#include "engine/store/marked_log.h"
#include "hli/sync.h"

/* An answer while it is made. */
typedef struct answer {
    struct engine *engine;
    const struct question *question;
    HLI_CONTOUR_LOOKAHEAD_BLOCK *out;
    HLI_AHEAD_DETAIL *details;
    struct range range;
    double origin; /* zero of the epoch that the request counts in */
    struct detail_maker maker;
    uint64_t event; /* looked at next */
    uint32_t count, elements;
    bool more;
} answer;

static void answer_index(struct engine *engine,
                         const struct question *question,
                         HLI_CONTOUR_LOOKAHEAD_BLOCK *out,
                         HLI_AHEAD_ANSWER *facts) {
    double i = trunc(question->start);
    if (!log_available(&engine->cfg)) {
        facts->empty = HLI_AHEAD_EMPTY_DISABLED;
        return;
    }
    if (i < 0) {
        facts->empty = HLI_AHEAD_EMPTY_BAD_START;
        return;
    }
    for (;;) {
        bool finished = ATOMIC_GET(engine->program.finished) != 0;
        uint64_t generation = ATOMIC_GET(engine->log.generation);
        bool active = ATOMIC_GET(engine->log.active) != 0;
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
            facts->count = number;
            facts->more = i + number < count;
            facts->end = count > 0 && !active ? HLI_AHEAD_END_LOG
                         : finished           ? HLI_AHEAD_END_PROGRAM
                                              : HLI_AHEAD_END_OPEN;
            facts->empty = number ? HLI_AHEAD_NOT_EMPTY
                           : facts->end == HLI_AHEAD_END_OPEN
                               ? HLI_AHEAD_EMPTY_NOT_KNOWN
                               : HLI_AHEAD_EMPTY_BEHIND_END;
            return;
        }
        cpu_pause();
    }
}

/* False: the answer is full. */
static bool put(struct answer *answer,
                const HLI_CONTOUR_LOOKAHEAD_BLOCK *block) {
    if (answer->count == ANSWER_MAX) {
        answer->more = true;
        return false;
    }
    answer->out[answer->count++] = *block;
    return true;
}

/* Whether a place of the stretch is in the range that was asked for. */
static bool inside(const struct answer *answer,
                   const struct stretch *stretch,
                   double distance) {
    double at = distance + stretch->shift + stretch->zero - answer->origin;
    return at >= answer->question->start
           && at < answer->question->start + answer->question->length;
}

/* The functions in front of element i. */
static bool put_events(struct answer *answer,
                       const struct stretch *stretch,
                       uint64_t i) {
    const struct piece_store *store = &answer->engine->store;
    uint64_t head = ATOMIC_GET(store->event_head);
    for (; answer->event < head; answer->event++) {
        const struct ahead_event event = *ahead_event_at(store, answer->event);
        if (event.element > i
            || (event.element == i && event.epoch > stretch->last)) {
            return true;
        }
        if (event.element < i || event.epoch < stretch->epoch
            || !inside(answer, stretch, event.distance)) {
            continue;
        }
        HLI_CONTOUR_LOOKAHEAD_BLOCK block = {
            .block_type = event.block_type,
            .block_number = event.n,
            .block_count_r = event.count,
            .start_position = event.distance + stretch->shift};
        if (answer->details && answer->count < ANSWER_MAX) {
            detail_of_event(&answer->maker,
                            &event,
                            stretch,
                            &answer->details[answer->count]);
        }
        if (!put(answer, &block)) {
            return false;
        }
    }
    return true;
}

static bool noted(const uint64_t *bits, uint32_t loop) {
    return ATOMIC_GET(*bits) >> (loop & 63u) & 1u;
}

/* What the element follows depends on how its real-time loop is driven. */
static void see_loop(const struct geo *geo,
                     const struct element *el,
                     HLI_CONTOUR_LOOKAHEAD_BLOCK *block) {
    if (el->role == LOOP_NONE) {
        return;
    }
    bool repeated = noted(&geo->loops_repeated, el->loop);
    if (el->role != LOOP_BEHIND) {
        block->rt_loop_pass =
            repeated ? HLI_CLAH_PASS_LOOP : HLI_CLAH_PASS_ENTRY;
    }
    if ((el->role == LOOP_FIRST && repeated)
        || (el->role == LOOP_BEHIND && noted(&geo->loops_left_out, el->loop))) {
        block->tangent_variation = el->other_variation;
    }
}

static bool put_element(struct answer *answer,
                        const struct stretch *stretch,
                        uint64_t i) {
    const struct element *element = element_at(&answer->engine->store, i);
    HLI_CONTOUR_LOOKAHEAD_BLOCK block = element->facts;
    block.start_position += stretch->shift;
    see_loop(&answer->engine->geo, element, &block);
    if (answer->details && answer->count < ANSWER_MAX) {
        detail_of_element(&answer->maker,
                          i,
                          stretch,
                          &answer->details[answer->count]);
    }
    return put(answer, &block);
}

/* False: nothing behind this stretch is wanted. */
static bool put_stretch(struct answer *answer, const struct stretch *stretch) {
    const struct piece_store *store = &answer->engine->store;
    const struct question *question = answer->question;
    bool events = question->flags & HLI_AHEAD_EVENTS;
    double rel = stretch->zero + stretch->shift - answer->origin,
           end = question->start + question->length;
    uint64_t i = first_behind(store, stretch, question->start - rel);
    for (; i < stretch->end; i++) {
        if (element_at(store, i)->facts.start_position + rel >= end) {
            return false;
        }
        if (events && !put_events(answer, stretch, i)) {
            return false;
        }
        if (!put_element(answer, stretch, i)) {
            return false;
        }
        answer->elements = answer->count;
    }
    uint32_t ends = stretch_end(store, &answer->range, stretch);
    return !events || ends == HLI_AHEAD_END_OPEN
           || put_events(answer, stretch, stretch->end);
}

/* The first event that may be in front of an element of the range. */
static uint64_t first_event(const struct piece_store *store, uint64_t element) {
    uint64_t hi = ATOMIC_GET(store->event_head),
             lo = hi > store->element_mask ? hi - store->element_mask : 0;
    while (lo < hi) {
        uint64_t mid = lo + (hi - lo) / 2;
        if (ahead_event_at(store, mid)->element < element) {
            lo = mid + 1;
        } else {
            hi = mid;
        }
    }
    return lo;
}

static uint32_t why_empty(const struct answer *answer,
                          const struct stretch *stretch,
                          uint32_t end) {
    const struct piece_store *store = &answer->engine->store;
    double start = answer->question->start;
    bool here = stretch->end > stretch->first;
    if (here && !(start < 0.0 && start + answer->question->length <= 0.0)) {
        const HLI_CONTOUR_LOOKAHEAD_BLOCK *first =
            &element_at(store, stretch->first)->facts;
        here = start + answer->question->length
               <= first->start_position + stretch->shift;
    }
    if (here) {
        return HLI_AHEAD_EMPTY_DROPPED;
    }
    return end == HLI_AHEAD_END_OPEN      ? HLI_AHEAD_EMPTY_NOT_KNOWN
           : end == HLI_AHEAD_END_PROGRAM ? HLI_AHEAD_EMPTY_BEHIND_END
                                          : HLI_AHEAD_EMPTY_BEFORE_RESET;
}

/* The stretch that the request counts in; false: there is none (yet). */
static bool find_stretch(struct answer *answer,
                         struct stretch *stretch,
                         HLI_AHEAD_ANSWER *facts) {
    const struct piece_store *store = &answer->engine->store;
    uint32_t wanted = answer->question->epoch;
    *stretch = stretch_now(&answer->range);
    facts->epoch = epoch_shown(stretch->epoch);
    while (wanted && epoch_shown(stretch->last) < wanted
           && stretch_next(store, &answer->range, stretch)) {
    }
    answer->origin = stretch->zero;
    if (!wanted
        || (epoch_shown(stretch->epoch) <= wanted
            && wanted <= epoch_shown(stretch->last))) {
        return true;
    }
    uint32_t end = stretch_end(store, &answer->range, stretch);
    facts->end = end;
    facts->empty = epoch_shown(stretch->epoch) > wanted
                       ? HLI_AHEAD_EMPTY_DROPPED
                   : end == HLI_AHEAD_END_PROGRAM ? HLI_AHEAD_EMPTY_BEHIND_END
                                                  : HLI_AHEAD_EMPTY_NOT_KNOWN;
    return false;
}

static void answer_range(struct answer *answer, HLI_AHEAD_ANSWER *facts) {
    const struct piece_store *store = &answer->engine->store;
    struct stretch stretch;
    if (!find_stretch(answer, &stretch, facts)) {
        return;
    }
    const struct stretch asked = stretch;
    bool beyond = answer->question->flags & HLI_AHEAD_BEYOND;
    if (answer->question->flags & HLI_AHEAD_EVENTS) {
        answer->event = first_event(store, stretch.first);
    }
    while (put_stretch(answer, &stretch) && beyond
           && stretch_next(store, &answer->range, &stretch)) {
    }
    if (answer->more && answer->elements) {
        answer->count = answer->elements; /* functions stay with the element
                                             behind them */
    }
    facts->count = answer->count;
    facts->more = answer->more;
    facts->end = stretch_end(store, &answer->range, &stretch);
    if (!answer->count) {
        facts->empty = why_empty(answer, &asked, facts->end);
    }
}

static void answer_distance(struct engine *engine,
                            const struct question *question,
                            HLI_CONTOUR_LOOKAHEAD_BLOCK *out,
                            HLI_AHEAD_DETAIL *details,
                            HLI_AHEAD_ANSWER *facts) {
    if (!mode2_available(&engine->cfg)) {
        facts->empty = HLI_AHEAD_EMPTY_DISABLED;
        return;
    }
    const HLI_AHEAD_ANSWER before = *facts;
    struct answer answer;
    do {
        *facts = before;
        answer.engine = engine;
        answer.question = question;
        answer.out = out;
        answer.details = details;
        answer.range = window_range(engine);
        answer.count = answer.elements = 0;
        answer.more = false;
        if (details) {
            detail_begin(engine, &answer.range, &answer.maker);
        }
        answer_range(&answer, facts);
    } while (!range_holds(engine, &answer.range));
}

/* A field that is not usable. */
static uint32_t bad_field(const struct question *question) {
    const uint32_t flags =
        HLI_AHEAD_BEYOND | HLI_AHEAD_EVENTS | HLI_AHEAD_DETAILS;
    bool log = question->mode == HLI_AHEAD_MODE_LOG;
    if (!log && question->mode != HLI_AHEAD_MODE_CONTOUR) {
        return HLI_AHEAD_EMPTY_BAD_MODE;
    }
    if (!isfinite(question->start)) {
        return HLI_AHEAD_EMPTY_BAD_START;
    }
    if (log ? question->length != 0.0
            : !isfinite(question->length) || question->length <= 0.0) {
        return HLI_AHEAD_EMPTY_BAD_LENGTH;
    }
    if (log && question->epoch) {
        return HLI_AHEAD_EMPTY_BAD_EPOCH;
    }
    return question->flags & ~(log ? 0u : flags) ? HLI_AHEAD_EMPTY_BAD_FLAGS
                                                 : HLI_AHEAD_NOT_EMPTY;
}

void answer_question(struct engine *engine,
                     const struct question *question,
                     HLI_CONTOUR_LOOKAHEAD_BLOCK *out,
                     HLI_AHEAD_DETAIL *details,
                     HLI_AHEAD_ANSWER *facts) {
    *facts = (HLI_AHEAD_ANSWER){.mode = question->mode,
                                .start_position = question->start,
                                .length = question->length,
                                .empty = bad_field(question)};
    __atomic_load(&engine->geo.shown_dist,
                  &facts->dist_prog_start,
                  __ATOMIC_ACQUIRE);
    if (facts->empty) {
        return;
    }
    if (question->mode == HLI_AHEAD_MODE_LOG) {
        answer_index(engine, question, out, facts);
    } else {
        answer_distance(engine, question, out, details, facts);
    }
}
