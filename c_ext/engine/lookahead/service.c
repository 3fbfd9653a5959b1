/* Contour look-ahead service (FCT-C40 section 5.2): one function for the cyclic
 * and the immediate mode.
 *
 * The PLC's numbers are copied once and checked before use. What is read of the
 * ring may be dropped by GEO and overwritten by SDA meanwhile when a thread of
 * its own serves; the copy is repeated then.
 */
#include <math.h>
#include <string.h>
#include "engine/lookahead/service.h"
#include "engine/lookahead/answer.h"
#include "engine/lookahead/window.h"
#include "engine/state/record_ring.h"
#include "engine/state/state.h"
#include "hli/sync.h"

double max_dist_prog_start(struct engine *engine) {
    if (!mode2_available(&engine->cfg)) {
        return 0.0;
    }
    if (left_out(&engine->program)) {
        return displayed_distance(&engine->geo);
    }
    struct range range = window_range(engine);
    if (range.end == range.first) {
        return 0.0;
    }
    const HLI_CONTOUR_LOOKAHEAD_BLOCK *facts =
        &element_at(&engine->store, range.end - 1)->facts;
    return facts->start_position + facts->length + range.shift;
}

/* block_type 0 behind the last element: only what the answer before had filled.
 */
static void close_answer(uint32_t *answered,
                         HLI_CONTOUR_LOOKAHEAD_BLOCK *out,
                         uint32_t count) {
    for (uint32_t k = count; k < ANSWER_MAX && (k <= count || k < *answered);
         k++) {
        memset(&out[k], 0, sizeof out[k]);
    }
    *answered = count;
}

static void count_up(uint64_t *counter) {
    ATOMIC_SET(*counter, *counter + 1);
}

/* What is no number counts as a bad request; a range without elements does not.
 */
static bool no_number(double start, double length) {
    return !isfinite(start) || !isfinite(length);
}

static void count_request(struct lookahead_service *service,
                          const HLI_AHEAD_ANSWER *facts) {
    bool bad = no_number(facts->start_position, facts->length);
    bool log = facts->mode == HLI_AHEAD_MODE_LOG;
    count_up(bad   ? &service->requests_bad
             : log ? &service->requests_mode1
                   : &service->requests_mode2);
}

/* A request as it is recorded; `row` NULL: it is not. */
typedef struct noted_request {
    struct engine_request *row;
    uint64_t cycle;
    int64_t began;
} noted_request;

static struct noted_request request_seen(struct engine *engine) {
    struct engine_request *row = record_next(&engine->recording.requests);
    return (struct noted_request){
        .row = row,
        .cycle = ATOMIC_GET(engine->geo.cycle),
        .began = row ? hs_monotonic_ns() : 0,
    };
}

static void request_answered(struct engine *engine,
                             const struct noted_request *noted,
                             const struct question *question,
                             const HLI_AHEAD_ANSWER *facts) {
    if (!noted->row) {
        return;
    }
    bool bad = no_number(question->start, question->length);
    *noted->row = (struct engine_request){
        .cycle = noted->cycle,
        .start = question->start,
        .length = question->length,
        .mode = bad ? 0u : question->mode,
        .elements = facts->count,
        .answer_ns = (uint64_t)(hs_monotonic_ns() - noted->began),
    };
    record_put(&engine->recording.requests);
}

static void post_answer(struct shared_areas *hli) {
    HLI_SIDE_WORD *side_word = &hli->side->clah_answer;
    hs_word_post(side_word, load_u32_relaxed(&side_word->word) + 1);
}

/* The manual's unit: length 0 is the log. */
static int serve_unit(struct engine *engine) {
    HLI_CONTOUR_LOOKAHEAD *contour_lookahead =
        &engine->hli.channel->contour_lookahead;
    if (!load_u8_acquire(&contour_lookahead->semaphor_rw)) {
        return 0;
    }
    struct question question = {
        .start = load_f64_relaxed(&contour_lookahead->request.start_position),
        .length = load_f64_relaxed(&contour_lookahead->request.length)};
    question.mode =
        question.length == 0.0 ? HLI_AHEAD_MODE_LOG : HLI_AHEAD_MODE_CONTOUR;
    struct noted_request noted = request_seen(engine);
    HLI_AHEAD_ANSWER facts;
    answer_question(engine,
                    &question,
                    contour_lookahead->response.block,
                    NULL,
                    &facts);
    count_request(&engine->service, &facts);
    close_answer(&engine->service.answered,
                 contour_lookahead->response.block,
                 facts.count);
    if (engine->hli.ahead) {
        engine->hli.ahead->answer = facts;
    }
    store_u8_release(&contour_lookahead->semaphor_rw, 0);
    post_answer(&engine->hli);
    request_answered(engine, &noted, &question, &facts);
    return 1;
}

static void serve_slot(struct engine *engine, uint32_t i) {
    HLI_AHEAD_SLOT *slot = &engine->hli.ahead->slot[i];
    struct question question = {
        .start = load_f64_relaxed(&slot->request.start_position),
        .length = load_f64_relaxed(&slot->request.length),
        .mode = load_u32_relaxed(&slot->request.mode),
        .flags = load_u32_relaxed(&slot->request.flags),
        .epoch = load_u32_relaxed(&slot->request.epoch)};
    struct noted_request noted = request_seen(engine);
    HLI_AHEAD_ANSWER facts;
    bool details = question.flags & HLI_AHEAD_DETAILS;
    answer_question(engine,
                    &question,
                    slot->block,
                    details ? slot->detail : NULL,
                    &facts);
    facts.tag = load_u32_relaxed(&slot->request.tag);
    count_request(&engine->service, &facts);
    close_answer(&engine->service.slot_answered[i], slot->block, facts.count);
    slot->answer = facts;
    request_answered(engine, &noted, &question, &facts);
}

/* The queue: its slots one after the other, all in the same cycle. */
static int serve_queue(struct engine *engine) {
    if (!engine->hli.ahead) {
        return 0;
    }
    int served = 0;
    for (uint32_t i = 0; i <= HLI_AHEAD_SLOT_MAXIDX; i++) {
        uint32_t *word = &engine->hli.ahead->slot_rw[i];
        uint32_t seen = load_u32_acquire(word);
        if ((seen & HS_SLOT_PHASE) != HLI_AHEAD_ASKED) {
            continue;
        }
        serve_slot(engine, i);
        store_u32_release(word,
                          (seen & ~(uint32_t)HS_SLOT_PHASE)
                              | HLI_AHEAD_ANSWERED);
        post_answer(&engine->hli);
        served++;
    }
    return served;
}

int serve_request(struct engine *engine) {
    int served = serve_unit(engine);
    return served + serve_queue(engine);
}
