/* Memory ordering and waiting for the HLI (see sync.h). */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include "hli/sync.h"

#include <errno.h>
#include <linux/futex.h>
#include <math.h>
#include <sched.h>
#include <stdbool.h>
#include <sys/syscall.h>
#include <time.h>
#include <unistd.h>

#include "hli/hli_layout.h"

#define NS_PER_S 1000000000LL
/* before a spin gives its core away in between */
#define PURE_SPIN_NS 10000LL
/* the same where a turn lasts as long as a scan: the partner may need this
 * very core */
#define TURN_SPIN_NS 1000LL
#define SPIN_NS 50000LL      /* before a wait goes to sleep */
#define SLICE_NS 100000000LL /* longest sleep without looking at the memory */
/* a server looks this often at a semaphore nobody rang for */
#define POLL_NS 1000000LL
/* looks at the memory between two looks at the clock */
#define LOOKS_PER_CLOCK 64

typedef int (*condition)(const void *what, uint32_t target);

uint8_t hs_load_u8(const void *word) {
    return load_u8_acquire(word);
}
void hs_store_u8(void *word, uint8_t v) {
    store_u8_release(word, v);
}
uint32_t hs_load_u32(const void *word) {
    return load_u32_acquire(word);
}
void hs_store_u32(void *word, uint32_t v) {
    store_u32_release(word, v);
}
uint64_t hs_load_u64(const void *word) {
    return load_u64_acquire(word);
}
void hs_store_u64(void *word, uint64_t v) {
    store_u64_release(word, v);
}
void hs_seq_begin(void *gen) {
    seq_begin(gen);
}
void hs_seq_end(void *gen) {
    seq_end(gen);
}

/* ------------------------------------------------------------------ clock */

int64_t hs_monotonic_ns(void) {
    struct timespec time;
    clock_gettime(CLOCK_MONOTONIC, &time);
    return (int64_t)time.tv_sec * NS_PER_S + time.tv_nsec;
}

static struct timespec to_timespec(int64_t ns) {
    struct timespec time = {.tv_sec = ns / NS_PER_S, .tv_nsec = ns % NS_PER_S};
    return time;
}

int hs_sleep_until(int64_t deadline_ns) {
    struct timespec time = to_timespec(deadline_ns > 0 ? deadline_ns : 0);
    return clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &time, NULL) == 0
               ? HS_OK
               : HS_TIMEOUT;
}

/* ------------------------------------------------------------------ seqlock */

static void copy_relaxed(void *dst, const void *src, size_t count) {
    size_t i = 0;
    if (((uintptr_t)src & 7u) == 0) {
        for (; i + 8 <= count; i += 8) {
            uint64_t word = __atomic_load_n(
                (const uint64_t *)(const void *)((const char *)src + i),
                __ATOMIC_RELAXED);
            memcpy((char *)dst + i, &word, 8);
        }
    }
    for (; i < count; i++) {
        ((uint8_t *)dst)[i] =
            __atomic_load_n((const uint8_t *)src + i, __ATOMIC_RELAXED);
    }
}

static void give_way(uint32_t turn) {
    if (turn % 64 == 63) {
        sched_yield(); /* the writer may have lost its core in the middle of a
                          write */
    } else {
        cpu_pause();
    }
}

int hs_snapshot(const void *gen,
                const void *src,
                void *dst,
                size_t count,
                uint32_t tries) {
    for (uint32_t i = 0; i < tries; i++) {
        uint32_t before = load_u32_acquire(gen);
        if ((before & 1u) == 0) {
            copy_relaxed(dst, src, count);
            __atomic_thread_fence(__ATOMIC_ACQUIRE);
            if (load_u32_relaxed(gen) == before) {
                return HS_OK;
            }
        }
        give_way(i);
    }
    return HS_TIMEOUT;
}

/* One try at the stretches of an image that belong to one cycle. */
static int copy_together(const hs_image *image) {
    uint32_t before = load_u32_acquire(image->seq);
    if (before & 1u) {
        return HS_BUSY;
    }
    for (uint32_t i = 0; i < image->together_count; i++) {
        copy_relaxed(image->together[i].target,
                     image->together[i].source,
                     image->together[i].size);
    }
    __atomic_thread_fence(__ATOMIC_ACQUIRE);
    return load_u32_relaxed(image->seq) == before ? HS_OK : HS_BUSY;
}

int hs_image_latch(hs_image *image, uint32_t tries) {
    image->cell_time_ns = load_u64_acquire(image->cell_time_at);
    image->cycle = load_u64_acquire(image->cycle_at);
    image->phase = load_u32_acquire(image->phase_at);
    for (uint32_t i = 0; copy_together(image) != HS_OK; i++) {
        if (i >= tries) {
            return HS_TIMEOUT;
        }
        give_way(i);
    }
    for (uint32_t i = 0; i < image->single_count; i++) {
        copy_relaxed(image->single[i].target,
                     image->single[i].source,
                     image->single[i].size);
    }
    return HS_OK;
}

/* ------------------------------------------------------------------ waiting */

static void futex_wake(void *word) {
    syscall(SYS_futex, word, FUTEX_WAKE, 0x7fffffff, NULL, NULL, 0);
}

/* 1 when a signal ended the sleep. */
static int futex_sleep(void *word, uint32_t seen, int64_t ns) {
    struct timespec time = to_timespec(ns);
    return syscall(SYS_futex, word, FUTEX_WAIT, seen, &time, NULL, 0) != 0
           && errno == EINTR;
}

/* The processor that this thread is on, from 1; 0: unknown. */
static uint32_t core_now(void) {
    int core = sched_getcpu();
    return core < 0 ? 0 : (uint32_t)core + 1;
}

/* Whoever rang last was on this very processor: while this thread spins there,
 * he cannot go on. */
static bool shares_core(const HLI_SIDE_WORD *side) {
    uint32_t core = load_u32_relaxed(&side->core);
    return core != 0 && core == core_now();
}

static void wake_waiters(HLI_SIDE_WORD *side) {
    __atomic_thread_fence(__ATOMIC_SEQ_CST); /* the store of the word before the
                                                load of the waiters */
    if (load_u32_relaxed(&side->waiters) != 0) {
        futex_wake(&side->word);
    }
}

void hs_ring(void *side_word) {
    HLI_SIDE_WORD *side = side_word;
    store_u32_relaxed(&side->core, core_now());
    __atomic_fetch_add(&side->word, 1u, __ATOMIC_RELEASE);
    wake_waiters(side);
}

void hs_word_post(void *side_word, uint32_t value) {
    HLI_SIDE_WORD *side = side_word;
    store_u32_relaxed(&side->core, core_now());
    store_u32_release(&side->word, value);
    wake_waiters(side);
}

static int spin_until(condition met,
                      const void *what,
                      uint32_t target,
                      int64_t yield_ns,
                      int64_t end_ns) {
    for (;;) {
        for (int i = 0; i < LOOKS_PER_CLOCK; i++) {
            if (met(what, target)) {
                return HS_OK;
            }
            cpu_pause();
        }
        int64_t now = hs_monotonic_ns();
        if (now >= end_ns) {
            return HS_TIMEOUT;
        }
        if (now >= yield_ns) {
            sched_yield(); /* the other side may wait for this very core */
        }
    }
}

/* One sleep on `side`, at most until `end_ns` and at most `slice_ns`; HS_BUSY:
 * look again. */
static int sleep_once(HLI_SIDE_WORD *side,
                      condition met,
                      const void *what,
                      uint32_t target,
                      int64_t end_ns,
                      int64_t slice_ns) {
    uint32_t seen = load_u32_acquire(&side->word);
    if (met(what, target)) {
        return HS_OK;
    }
    int64_t left = end_ns - hs_monotonic_ns();
    if (left <= 0) {
        return HS_TIMEOUT;
    }
    if (futex_sleep(&side->word, seen, left < slice_ns ? left : slice_ns)) {
        return met(what, target) ? HS_OK : HS_TIMEOUT;
    }
    return HS_BUSY;
}

/* Spin, then sleep on `side`, until the condition holds, the time is over or a
 * signal came; asleep at once where both share a processor. */
static int wait_until(HLI_SIDE_WORD *side,
                      condition met,
                      const void *what,
                      uint32_t target,
                      int64_t pure_ns,
                      int64_t spin_ns,
                      int64_t timeout_ns,
                      int64_t slice_ns) {
    if (met(what, target)) {
        return HS_OK;
    }
    if (timeout_ns <= 0) {
        return HS_TIMEOUT;
    }
    int64_t now = hs_monotonic_ns();
    int64_t end = timeout_ns > INT64_MAX - now ? INT64_MAX : now + timeout_ns;
    if (!shares_core(side)
        && spin_until(met,
                      what,
                      target,
                      now + pure_ns,
                      now + (spin_ns < timeout_ns ? spin_ns : timeout_ns))
               == HS_OK) {
        return HS_OK;
    }
    __atomic_fetch_add(&side->waiters, 1u, __ATOMIC_SEQ_CST);
    int rc = HS_BUSY;
    while (rc == HS_BUSY) {
        rc = sleep_once(side, met, what, target, end, slice_ns);
    }
    __atomic_fetch_sub(&side->waiters, 1u, __ATOMIC_RELAXED);
    return rc;
}

static int word_reached(const void *word, uint32_t target) {
    return (int32_t)(load_u32_acquire(word) - target) >= 0;
}
static int byte_equals(const void *byte, uint32_t target) {
    return (load_u8_acquire(byte) != 0) == (target != 0);
}

int hs_word_wait(void *side_word,
                 uint32_t target,
                 int64_t spin_ns,
                 int64_t timeout_ns) {
    HLI_SIDE_WORD *side = side_word;
    return wait_until(side,
                      word_reached,
                      &side->word,
                      target,
                      TURN_SPIN_NS,
                      spin_ns,
                      timeout_ns,
                      SLICE_NS);
}

int hs_word_turn(void *mine,
                 void *others,
                 uint32_t value,
                 int64_t spin_ns,
                 int64_t timeout_ns) {
    hs_word_post(mine, value);
    return hs_word_wait(others, value, spin_ns, timeout_ns);
}

/* ------------------------------------------------------------------ contour
 * look-ahead */

int hs_clah_request(void *unit,
                    void *bell,
                    double start_position,
                    double length) {
    HLI_CONTOUR_LOOKAHEAD *contour_lookahead = unit;
    if (load_u8_acquire(&contour_lookahead->semaphor_rw) != 0) {
        return 0;
    }
    store_f64_relaxed(&contour_lookahead->request.start_position,
                      start_position);
    store_f64_relaxed(&contour_lookahead->request.length, length);
    store_u8_release(&contour_lookahead->semaphor_rw, 1);
    hs_ring(bell);
    return 1;
}

/* Copy the answer up to its end; the acquire of the semaphore came before. */
static int copy_answer(const HLI_CONTOUR_LOOKAHEAD *contour_lookahead,
                       HLI_CONTOUR_LOOKAHEAD_BLOCK *blocks) {
    int count = 0;
    while (count <= HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX
           && contour_lookahead->response.block[count].block_type
                  != HLI_CLAH_NONE) {
        memcpy(&blocks[count],
               &contour_lookahead->response.block[count],
               sizeof blocks[count]);
        count++;
    }
    return count;
}

int hs_clah_take(const void *unit, void *blocks) {
    const HLI_CONTOUR_LOOKAHEAD *contour_lookahead = unit;
    return load_u8_acquire(&contour_lookahead->semaphor_rw) != 0
               ? HS_BUSY
               : copy_answer(contour_lookahead, blocks);
}

int hs_clah_next(hs_clah_port *port, double start_position, double length) {
    if (!isfinite(start_position) || !isfinite(length)) {
        return HS_REFUSED;
    }
    HLI_CONTOUR_LOOKAHEAD_BLOCK *blocks = port->blocks;
    int count = hs_clah_take(port->unit, blocks);
    if (count < 0) {
        return count;
    }
    if (count == 0 || count > HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX) {
        memcpy(port->facts, port->facts_from, sizeof(HLI_AHEAD_ANSWER));
    }
    port->blocks = blocks + count;
    int64_t now = hs_monotonic_ns();
    port->took_ns = now - port->asked_ns;
    port->asked_ns = now;
    hs_clah_request(port->unit, port->bell, start_position, length);
    return count;
}

int hs_clah_await(void *unit, void *answer, void *blocks, int64_t timeout_ns) {
    HLI_CONTOUR_LOOKAHEAD *contour_lookahead = unit;
    int rc = wait_until(answer,
                        byte_equals,
                        &contour_lookahead->semaphor_rw,
                        0,
                        PURE_SPIN_NS,
                        SPIN_NS,
                        timeout_ns,
                        SLICE_NS);
    return rc == HS_OK ? copy_answer(contour_lookahead, blocks) : rc;
}

int hs_clah_call(void *unit,
                 void *bell,
                 void *answer,
                 double start_position,
                 double length,
                 void *blocks,
                 int64_t timeout_ns) {
    HLI_CONTOUR_LOOKAHEAD *contour_lookahead = unit;
    if (wait_until(answer,
                   byte_equals,
                   &contour_lookahead->semaphor_rw,
                   0,
                   PURE_SPIN_NS,
                   SPIN_NS,
                   timeout_ns,
                   SLICE_NS)
        != HS_OK) {
        return HS_BUSY;
    }
    hs_clah_request(unit, bell, start_position, length);
    return hs_clah_await(unit, answer, blocks, timeout_ns);
}

int hs_clah_wait_request(void *unit,
                         void *bell,
                         double *request,
                         int64_t timeout_ns) {
    HLI_CONTOUR_LOOKAHEAD *contour_lookahead = unit;
    int rc = wait_until(bell,
                        byte_equals,
                        &contour_lookahead->semaphor_rw,
                        1,
                        PURE_SPIN_NS,
                        SPIN_NS,
                        timeout_ns,
                        POLL_NS);
    if (rc == HS_OK) {
        request[0] =
            load_f64_relaxed(&contour_lookahead->request.start_position);
        request[1] = load_f64_relaxed(&contour_lookahead->request.length);
    }
    return rc;
}

void hs_clah_answer(void *unit,
                    void *answer,
                    const void *blocks,
                    uint32_t count) {
    HLI_CONTOUR_LOOKAHEAD *contour_lookahead = unit;
    uint32_t rows = HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX + 1;
    count = count < rows ? count : rows;
    if (count > 0) {
        memcpy(contour_lookahead->response.block,
               blocks,
               count * sizeof contour_lookahead->response.block[0]);
    }
    /* rows behind the answer are empty; earlier answers left a full tail of
     * empty rows, so the first one ends it */
    for (uint32_t i = count;
         i < rows
         && contour_lookahead->response.block[i].block_type != HLI_CLAH_NONE;
         i++) {
        contour_lookahead->response.block[i].block_type = HLI_CLAH_NONE;
    }
    store_u8_release(&contour_lookahead->semaphor_rw, 0);
    hs_ring(answer);
}

int hs_clah_serve(void *unit,
                  void *bell,
                  void *answer,
                  const void *blocks,
                  uint32_t count,
                  double *request,
                  int64_t timeout_ns) {
    hs_clah_answer(unit, answer, blocks, count);
    return hs_clah_wait_request(unit, bell, request, timeout_ns);
}

/* ------------------------------------------------------------------ technology
 * units */

int hs_techno_next(const void *units, uint32_t count, uint32_t from) {
    const TECHNO_UNIT_CH *unit = units;
    for (uint32_t i = from; i < count; i++) {
        if (load_u8_acquire(&unit[i].please_rw) != 0) {
            return (int)i;
        }
    }
    return -1;
}

int hs_techno_any(const hs_units *tables, uint32_t count) {
    for (uint32_t i = 0; i < count; i++) {
        if (hs_techno_next(tables[i].units, tables[i].count, 0) >= 0) {
            return 1;
        }
    }
    return 0;
}

void hs_techno_fetch(void *unit, void *copy) {
    TECHNO_UNIT_CH *this_unit = unit;
    memcpy(copy, this_unit, sizeof *this_unit);
    store_u8_release(&this_unit->please_rw, 0);
}

void hs_techno_done(void *unit) {
    store_u8_release(&((TECHNO_UNIT_CH *)unit)->done_w, 1);
}

void hs_techno_take(void *unit, void *copy) {
    TECHNO_UNIT_CH *this_unit = unit;
    memcpy(copy, this_unit, sizeof *this_unit);
    store_u8_release(&this_unit->done_w, 1);
    store_u8_release(&this_unit->please_rw, 0);
}

static uint64_t shown(const TECHNO_UNIT_CH *units,
                      uint32_t count,
                      uint32_t first) {
    uint64_t found = 0;
    for (uint32_t i = 0; i < count; i++) {
        if (load_u8_acquire(&units[i].please_rw)) {
            found |= (uint64_t)1 << (first + i);
        }
    }
    return found;
}

/* Until the CNC is not putting a function out; false: it seems to stand. */
static bool await_quiet(const void *busy) {
    int64_t end = hs_monotonic_ns() + NS_PER_S;
    while (hs_load_u32(busy)) {
        if (hs_monotonic_ns() > end) {
            return false;
        }
        sched_yield();
    }
    return true;
}

static uint64_t shown_by_channel(const HLI_CHANNEL *channel) {
    return shown(channel->techno_unit_std_sync,
                 HLI_TU_CH_STD_SYNC_MAXIDX + 1u,
                 TECHNO_BIT_STD)
           | shown(channel->techno_unit_late_sync,
                   HLI_TU_CH_LATE_SYNC_MAXIDX + 1u,
                   TECHNO_BIT_LATE);
}

static uint8_t shown_by_axis(const HLI_AXIS *axis) {
    const void *units = axis->techno_unit_std_sync;
    return (uint8_t)shown(units, HLI_TU_AX_STD_SYNC_MAXIDX + 1u, 0);
}

void hs_plc_register(void *segment) {
    HLI_SEGMENT *memory = segment;
    HLI_SIDE_PLC *plc = &memory->sidecar.plc;
    HLI_SIDE_TECHNO *techno = &memory->sidecar.techno;
    hs_store_u32(&plc->generation, hs_load_u32(&plc->generation) + 1u);
    /* a function that the CNC puts out from here on is put out to this PLC */
    __atomic_thread_fence(__ATOMIC_SEQ_CST);
    bool quiet = await_quiet(&memory->sidecar.stats.techno_busy);
    for (uint32_t i = 0; i <= HLI_SYS_CH_MAXIDX; i++) {
        uint64_t found = shown_by_channel(&memory->channel[i]);
        hs_store_u64(&techno->shown[i], quiet ? found : UINT64_MAX);
    }
    for (uint32_t i = 0; i <= HLI_SYS_AX_MAXIDX; i++) {
        uint8_t found = shown_by_axis(&memory->axis[i]);
        hs_store_u8(&techno->axis_shown[i], quiet ? found : UINT8_MAX);
    }
    hs_store_u32(&plc->attached, 1);
}
