/* Memory ordering for the HLI, in tiny named functions. Python never orders
 * memory itself.
 *
 * Everything that is shared between the two processes is read and written
 * through these.
 */
#ifndef HLI_SYNC_H
#define HLI_SYNC_H
#include <stddef.h>
#include <stdint.h>
#include <string.h>

static inline uint8_t load_u8_acquire(const volatile void *word) {
    return __atomic_load_n((const volatile uint8_t *)word, __ATOMIC_ACQUIRE);
}
static inline void store_u8_release(volatile void *word, uint8_t v) {
    __atomic_store_n((volatile uint8_t *)word, v, __ATOMIC_RELEASE);
}
static inline uint16_t load_u16_relaxed(const volatile void *word) {
    return __atomic_load_n((const volatile uint16_t *)word, __ATOMIC_RELAXED);
}
static inline void store_u16_relaxed(volatile void *word, uint16_t v) {
    __atomic_store_n((volatile uint16_t *)word, v, __ATOMIC_RELAXED);
}
static inline uint32_t load_u32_relaxed(const volatile void *word) {
    return __atomic_load_n((const volatile uint32_t *)word, __ATOMIC_RELAXED);
}
static inline void store_u32_relaxed(volatile void *word, uint32_t v) {
    __atomic_store_n((volatile uint32_t *)word, v, __ATOMIC_RELAXED);
}
static inline uint32_t load_u32_acquire(const volatile void *word) {
    return __atomic_load_n((const volatile uint32_t *)word, __ATOMIC_ACQUIRE);
}
static inline void store_u32_release(volatile void *word, uint32_t v) {
    __atomic_store_n((volatile uint32_t *)word, v, __ATOMIC_RELEASE);
}
static inline uint64_t load_u64_acquire(const volatile void *word) {
    return __atomic_load_n((const volatile uint64_t *)word, __ATOMIC_ACQUIRE);
}
static inline void store_u64_release(volatile void *word, uint64_t v) {
    __atomic_store_n((volatile uint64_t *)word, v, __ATOMIC_RELEASE);
}
static inline uint64_t load_u64_relaxed(const volatile void *word) {
    return __atomic_load_n((const volatile uint64_t *)word, __ATOMIC_RELAXED);
}
static inline void store_u64_relaxed(volatile void *word, uint64_t v) {
    __atomic_store_n((volatile uint64_t *)word, v, __ATOMIC_RELAXED);
}
/* The bits of a double move as one 64-bit word: a single member is never torn.
 */
static inline double load_f64_relaxed(const volatile void *word) {
    uint64_t bits =
        __atomic_load_n((const volatile uint64_t *)word, __ATOMIC_RELAXED);
    double v;
    memcpy(&v, &bits, sizeof v);
    return v;
}
static inline void store_f64_relaxed(volatile void *word, double v) {
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    __atomic_store_n((volatile uint64_t *)word, bits, __ATOMIC_RELAXED);
}
static inline double load_f64_acquire(const volatile void *word) {
    uint64_t bits = load_u64_acquire(word);
    double v;
    memcpy(&v, &bits, sizeof v);
    return v;
}
static inline void store_f64_release(volatile void *word, double v) {
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits);
    store_u64_release(word, bits);
}
/* What is shown every cycle mostly stays as it is: stored only where it
 * differs, so that a cache line that did not change need not travel between the
 * two cores. Behind it the memory holds the value in either case. */
static inline void show_u8(volatile void *word, uint8_t v) {
    if (__atomic_load_n((volatile uint8_t *)word, __ATOMIC_RELAXED) != v) {
        store_u8_release(word, v);
    }
}
static inline void show_u16(volatile void *word, uint16_t v) {
    if (load_u16_relaxed(word) != v) {
        store_u16_relaxed(word, v);
    }
}
static inline void show_u32(volatile void *word, uint32_t v) {
    if (load_u32_relaxed(word) != v) {
        store_u32_release(word, v);
    }
}
static inline void show_f64(volatile void *word, double v) {
    uint64_t bits;
    memcpy(&bits, &v, sizeof bits); /* bits, not values: 0.0 and -0.0 differ, a
                                       NaN equals itself */
    if (load_u64_relaxed(word) != bits) {
        store_u64_relaxed(word, bits);
    }
}
static inline void cpu_pause(void) {
#if defined(__x86_64__) || defined(__i386__)
    __builtin_ia32_pause();
#else
    __asm__ __volatile__("" ::: "memory");
#endif
}

/* Seqlock: odd while the one writer writes. */
static inline void seq_begin(volatile void *gen) {
    uint32_t generation = load_u32_relaxed(gen);
    store_u32_relaxed(gen, generation | 1u);
    __atomic_thread_fence(__ATOMIC_RELEASE);
}
static inline void seq_end(volatile void *gen) {
    store_u32_release(gen, (load_u32_relaxed(gen) | 1u) + 1u);
}

/* bits of HLI_SIDE_TECHNO.shown and .again: the first of each array's units */
#define TECHNO_BIT_STD 0u
#define TECHNO_BIT_LATE 20u

/* cdef begin */
/* Wait results */
#define HS_OK 0
#define HS_TIMEOUT -1
#define HS_GONE -2
#define HS_SHUTDOWN -3
#define HS_BUSY -4
#define HS_REFUSED -5

/* Waits end early, with the result of a timeout, when a signal arrived: the
 * caller looks at its clock and calls again. No wait sleeps longer than 100 ms
 * without looking at the memory itself, so a side that never wakes is served
 * too. */

uint8_t hs_load_u8(const void *word);
void hs_store_u8(void *word, uint8_t v);
uint32_t hs_load_u32(const void *word);
void hs_store_u32(void *word, uint32_t v);
uint64_t hs_load_u64(const void *word);
void hs_store_u64(void *word, uint64_t v);

int64_t hs_monotonic_ns(void);
/* Sleep until the absolute CLOCK_MONOTONIC time `deadline_ns`; HS_OK, or
 * HS_TIMEOUT when a signal came first. */
int hs_sleep_until(int64_t deadline_ns);
/* Start time of a process in clock ticks since boot (/proc/PID/stat field 22),
 * 0 if there is none. */
uint64_t hs_process_start(int64_t pid);
/* 1 if the process (pid, start) runs and is no zombie. */
int hs_process_alive(int64_t pid, uint64_t start);
/* The calling process gets `signal` when its parent dies; returns 0, or -1 if
 * the parent is gone already. */
int hs_die_with_parent(int signal, int64_t parent_pid);

/* Seqlock of the one writer, for writers in Python (tests); C writers use
 * seq_begin and seq_end. */
void hs_seq_begin(void *gen);
void hs_seq_end(void *gen);
/* Consistent copy of n bytes under the seqlock `gen`; HS_OK, or HS_TIMEOUT
 * after `tries` disturbed copies. */
int hs_snapshot(const void *gen,
                const void *src,
                void *dst,
                size_t count,
                uint32_t tries);

/* One stretch of the memory and where its private copy stands. */
typedef struct hs_copy {
    const void *source;
    void *target;
    size_t size;
} hs_copy;
/* What a PLC latches once per scan: `together` belongs to one cycle of the
 * seqlock `seq`, `single` is copied as it is. The last three members are
 * results: cell time and phase from before the copies, completed cycles. */
typedef struct hs_image {
    const void *seq, *cycle_at, *cell_time_at, *phase_at;
    const hs_copy *together, *single;
    uint32_t together_count, single_count;
    uint64_t cycle, cell_time_ns;
    uint32_t phase;
} hs_image;
/* Latch everything once; HS_OK, or HS_TIMEOUT after `tries` disturbed copies of
 * what belongs together. */
int hs_image_latch(hs_image *image, uint32_t tries);

/* Side words (HLI_SIDE_WORD): store with release and wake; wait (spin, then
 * futex) until the word has reached `target` (signed 32-bit distance) or
 * `timeout_ns` passed. */
void hs_word_post(void *side_word, uint32_t value);
int hs_word_wait(void *side_word,
                 uint32_t target,
                 int64_t spin_ns,
                 int64_t timeout_ns);
/* Both: post `value` on `mine`, then wait until `others` has reached it (a turn
 * of the PLC in lockstep). */
int hs_word_turn(void *mine,
                 void *others,
                 uint32_t value,
                 int64_t spin_ns,
                 int64_t timeout_ns);

/* Contour look-ahead, PLC side: one fused exchange. Waits for semaphor_rw
 * FALSE, writes the request, sets it TRUE, rings the bell, waits for FALSE
 * (spin, then futex on `answer`), copies the answer up to its end into `blocks`
 * (128 rows). Returns the number of elements (0..128), or HS_TIMEOUT / HS_BUSY
 * (semaphore never free). */
int hs_clah_call(void *unit,
                 void *bell,
                 void *answer,
                 double start_position,
                 double length,
                 void *blocks,
                 int64_t timeout_ns);
/* The second half of hs_clah_call after its HS_TIMEOUT: wait on for the answer
 * that is still pending. */
int hs_clah_await(void *unit, void *answer, void *blocks, int64_t timeout_ns);
/* The same in two halves, for a scan cycle: returns 1 if the request was
 * placed, 0 if the semaphore is TRUE. */
int hs_clah_request(void *unit,
                    void *bell,
                    double start_position,
                    double length);
/* Number of elements copied, or HS_BUSY while the semaphore is TRUE. */
int hs_clah_take(const void *unit, void *blocks);
/* A unit of which one function block asks in every scan. */
typedef struct hs_clah_port {
    void *unit, *bell;
    void *blocks; /* the next answer is copied there: room for all elements */
    const void *facts_from; /* where the extension has an answer's facts */
    void *facts;
    int64_t asked_ns; /* when the pending request was placed */
    int64_t took_ns;  /* of the last answer: until it was taken */
} hs_clah_port;
/* One call of a cyclic function block that owns the unit: take the answer, then
 * place the next request. Of an answer that is empty or full, the facts
 * (HLI_AHEAD_ANSWER) are copied too. `blocks` moves behind the elements. Number
 * of elements copied; nothing is done and the result is HS_BUSY while the
 * semaphore is TRUE, HS_REFUSED for a request that is not finite. */
int hs_clah_next(hs_clah_port *port, double start_position, double length);
/* CNC side, for servers written in Python (tests, benchmarks): wait for a
 * request; answer it with n elements. */
int hs_clah_wait_request(void *unit,
                         void *bell,
                         double *request,
                         int64_t timeout_ns);
void hs_clah_answer(void *unit,
                    void *answer,
                    const void *blocks,
                    uint32_t count);
/* Both in one call, for a server loop: answer, then wait for the next request.
 */
int hs_clah_serve(void *unit,
                  void *bell,
                  void *answer,
                  const void *blocks,
                  uint32_t count,
                  double *request,
                  int64_t timeout_ns);

/* Count a bell up and wake who sleeps on it. */
void hs_ring(void *side_word);

/* The queue of the extension (HLI_AHEAD): a word a slot, of which the low byte
 * is its phase and the rest the generation of the PLC that has claimed it. A
 * slot that a PLC before has claimed, or whose answer it has not taken, is free
 * for the next PLC; one that it has asked is free once it is answered. */
#define HS_SLOT_PHASE 0xFF
/* Claim a slot: its index, or HS_BUSY. From then on its request is ours. */
int hs_ahead_claim(void *area, uint32_t generation);
/* The request of the slot is written: ask, and ring the bell. */
void hs_ahead_ask(void *area, void *bell, uint32_t slot, uint32_t generation);
/* Number of elements of the answer, copied with `details` (may be NULL) and the
 * facts, or HS_BUSY; HS_GONE: the slot is not ours any more. The slot is free
 * behind it. */
int hs_ahead_take(void *area,
                  uint32_t slot,
                  uint32_t generation,
                  void *blocks,
                  void *details,
                  void *facts);
/* CNC side, for servers written in Python: the next slot from `from` on that is
 * asked, or HS_BUSY; answer it (its elements and facts are written). */
int hs_ahead_asked(const void *area, uint32_t from);
void hs_ahead_answer(void *area, void *answer, uint32_t slot);

/* Technology units (TECHNO_UNIT_CH, TECHNO_UNIT_AX): index >= `from` of the
 * next unit of the array with please_rw TRUE, or -1; copy one unit (48 bytes)
 * and set please_rw FALSE (fetched); set done_w TRUE (acknowledged). */
int hs_techno_next(const void *units, uint32_t count, uint32_t from);
/* Whether a unit of any of the arrays has please_rw TRUE. */
typedef struct hs_units {
    void *units;
    uint32_t count;
} hs_units;
int hs_techno_any(const hs_units *tables, uint32_t count);
void hs_techno_fetch(void *unit, void *copy);
void hs_techno_done(void *unit);
/* Fetched and acknowledged at once: copy, done_w TRUE, please_rw FALSE. A unit
 * nobody waits for (MOS) is free as soon as please_rw is FALSE; a done_w behind
 * that would acknowledge the next function in it
 * (docs/explanation/model/techno.pml). */
void hs_techno_take(void *unit, void *copy);

/* A PLC takes its place: a new generation, the technology units that show a
 * function, `attached` last. Functions of other units were fetched by a PLC
 * that was here before; the CNC offers them again. */
void hs_plc_register(void *segment);
/* cdef end */
#endif
