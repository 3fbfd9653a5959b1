/* Contour look-ahead service (FCT-C40 section 5.2): one function for the cyclic and the immediate mode.
 *
 * The PLC's numbers are copied once and checked before use. What is read of the ring may be dropped by GEO and
 * overwritten by SDA meanwhile when a thread of its own serves; the copy is repeated then.
 */
#include <math.h>
#include <time.h>
#include "engine/state/state.h"

#define ANSWER_MAX (HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX + 1)

typedef struct range {
    uint64_t first, end; /* element ids */
    double shift;        /* 0.1 um: what passes of real-time loops have added to the distances */
} range;

static uint64_t min64(uint64_t a, uint64_t b) { return a < b ? a : b; }

static uint64_t ring_log_max(const engine *e) { return min64(e->cfg.log_max, 65536u); }

/* Elements of mode 2: the window from the active element on, and as many behind it; the present distance epoch only. */
static range range_now(engine *e) {
    uint64_t active = ATOMIC_GET(e->geo.active), head = ATOMIC_GET(e->element_head);
    uint64_t behind = ring_log_max(e), first = active > behind ? active - behind : 0, epoch_first = ATOMIC_GET(e->geo.epoch_first);
    uint32_t epoch = ATOMIC_GET(e->geo.epoch);
    range r = {.first = first > epoch_first ? first : epoch_first};
    uint64_t from = active > epoch_first ? active : epoch_first;
    __atomic_load(&e->geo.dist_shift, &r.shift, __ATOMIC_ACQUIRE);
    r.shift *= TENTH_UM;
    r.end = min64(head, from + 1 + min64(e->cfg.window, ring_log_max(e)));
    if (r.end < r.first) r.end = r.first;
    uint64_t lo = r.first, hi = r.end; /* elements behind a pending reset or the end of a loop come later */
    while (lo < hi) {
        uint64_t mid = lo + (hi - lo) / 2;
        if (element_at(e, mid)->epoch > epoch) hi = mid;
        else lo = mid + 1;
    }
    r.end = lo;
    return r;
}

static range window_range(engine *e) {
    for (;;) {
        uint32_t marks = ATOMIC_GET(e->geo.marks);
        range r = range_now(e);
        __atomic_thread_fence(__ATOMIC_ACQUIRE);
        if (!(marks & 1) && ATOMIC_GET(e->geo.marks) == marks) return r;
        cpu_pause();
    }
}

static bool mode2_available(const engine *e) { return (e->cfg.functions & ENGINE_FCT_CONTOUR_LAH) && e->cfg.log_max > 0; }

double max_dist_prog_start(engine *e) {
    if (!mode2_available(e)) return 0.0;
    range r = window_range(e);
    if (r.end == r.first) return 0.0;
    const HLI_CONTOUR_LOOKAHEAD_BLOCK *f = &element_at(e, r.end - 1)->facts;
    return f->start_position + f->length + r.shift;
}

/* First element of r that ends behind `start`. */
static uint64_t first_behind(engine *e, range r, double start) {
    while (r.first < r.end) {
        uint64_t mid = r.first + (r.end - r.first) / 2;
        const HLI_CONTOUR_LOOKAHEAD_BLOCK *f = &element_at(e, mid)->facts;
        if (f->start_position + f->length > start) r.end = mid;
        else r.first = mid + 1;
    }
    return r.first;
}

static uint32_t answer_distance(engine *e, double start, double length, HLI_CONTOUR_LOOKAHEAD_BLOCK *out) {
    if (!mode2_available(e) || !(length > 0)) return 0;
    for (;;) {
        range r = window_range(e);
        uint64_t i = first_behind(e, r, start - r.shift);
        uint32_t n = 0;
        for (; i < r.end && n < ANSWER_MAX; i++) {
            const HLI_CONTOUR_LOOKAHEAD_BLOCK *f = &element_at(e, i)->facts;
            if (f->start_position + r.shift >= start + length) break;
            HLI_CONTOUR_LOOKAHEAD_BLOCK block = *f; /* `out` is the PLC's to scribble on: written, never read */
            block.start_position += r.shift;
            out[n++] = block;
        }
        __atomic_thread_fence(__ATOMIC_ACQUIRE);
        if (ATOMIC_GET(e->element_head) < r.first + e->element_mask + 1) return n; /* no slot was used again */
    }
}

static uint32_t answer_index(engine *e, double index, HLI_CONTOUR_LOOKAHEAD_BLOCK *out) {
    double i = trunc(index);
    if (!log_available(e) || i < 0) return 0;
    for (;;) {
        uint64_t generation = ATOMIC_GET(e->log.generation);
        uint32_t count = ATOMIC_GET(e->log.count), n = 0;
        if (i < count) {
            uint32_t from = (uint32_t)i;
            n = count - from < ANSWER_MAX ? count - from : ANSWER_MAX;
            for (uint32_t k = 0; k < n; k++) out[k] = *log_entry(e, from + k);
        }
        __atomic_thread_fence(__ATOMIC_ACQUIRE);
        if (!(generation & 1) && ATOMIC_GET(e->log.generation) == generation) return n;
        cpu_pause();
    }
}

/* block_type 0 behind the last element: only what the answer before had filled. */
static void close_answer(engine *e, HLI_CONTOUR_LOOKAHEAD_BLOCK *out, uint32_t n) {
    for (uint32_t k = n; k < ANSWER_MAX && (k <= n || k < e->answered); k++) memset(&out[k], 0, sizeof out[k]);
    e->answered = n;
}

static void count_up(uint64_t *counter) { ATOMIC_SET(*counter, *counter + 1); }

static uint32_t answer(engine *e, double start, double length, HLI_CONTOUR_LOOKAHEAD_BLOCK *out) {
    if (!isfinite(start) || !isfinite(length)) {
        count_up(&e->requests_bad);
        return 0;
    }
    if (length == 0.0) {
        count_up(&e->requests_mode1);
        return answer_index(e, start, out);
    }
    count_up(&e->requests_mode2);
    return answer_distance(e, start, length, out);
}

static void post_answer(engine *e) {
    HLI_SIDE_WORD *w = &e->side->clah_answer;
    hs_word_post(w, load_u32_relaxed(&w->word) + 1);
}

/* Serve a pending request; returns 1 if there was one. */
int serve_request(engine *e) {
    HLI_CONTOUR_LOOKAHEAD *u = &e->channel->contour_lookahead;
    if (!load_u8_acquire(&u->semaphor_rw)) return 0;
    double start = load_f64_relaxed(&u->request.start_position), length = load_f64_relaxed(&u->request.length);
    uint32_t n = answer(e, start, length, u->response.block);
    close_answer(e, u->response.block, n);
    store_u8_release(&u->semaphor_rw, 0);
    post_answer(e);
    return 1;
}
