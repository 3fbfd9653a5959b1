/* Real time: planner, GEO and the immediate look-ahead service as threads of
 * their own. */
#include <errno.h>
#include <pthread.h>
#include <sched.h>
#include <sys/mman.h>
#include <time.h>
#include "curve/curve.h"
#include "engine/commit/planner.h"
#include "engine/events.h"
#include "engine/geo/cycle.h"
#include "engine/geo/publish.h"
#include "engine/geo/record.h"
#include "engine/lookahead/service.h"
#include "engine/plan/prediction.h"
#include "engine/plan/pump.h"
#include "engine/state/state.h"
#include "engine/state/tuning.h"
#include "hli/sync.h"

#define NS 1000000000LL

/* Wakes come late by what the machine needs to leave its sleep. So GEO sleeps
 * less, by what mostly suffices, and waits for the rest with its eyes on the
 * clock. While others had the core its caches and branch predictors have
 * forgotten the cycle: it rehearses what changes nothing, so that the cycle
 * itself is short. */
typedef struct waker {
    int64_t early, most; /* ns that it sleeps less; at the most */
    int64_t rehearsal;   /* ns that are left for the rehearsal */
} waker;

typedef struct bare_loop {
    int64_t period, rows, *late;
} bare_loop;

static int64_t clock_ns(clockid_t clock) {
    struct timespec time;
    clock_gettime(clock, &time);
    return time.tv_sec * NS + time.tv_nsec;
}

static int64_t now_ns(void) {
    return clock_ns(CLOCK_MONOTONIC);
}

static void sleep_until(int64_t t) {
    struct timespec ts = {t / NS, t % NS};
    while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &ts, NULL)
           == EINTR) {
    }
}

static struct waker waker_of(int64_t cycle) {
    struct waker waker = {.most = cycle / EARLY_PART < EARLY_MAX_NS
                                      ? cycle / EARLY_PART
                                      : EARLY_MAX_NS};
    waker.early = waker.most;
    waker.rehearsal = cycle / REHEARSAL_PART < REHEARSAL_NS
                          ? cycle / REHEARSAL_PART
                          : REHEARSAL_NS;
    return waker;
}

/* A channel that is being stopped waits for the end of a round
 * (leave_rounds()). */
static void begin_round(struct engine *first) {
    __atomic_store_n(&first->threads.in_round, 1, __ATOMIC_SEQ_CST);
}

static void end_round(struct engine *first) {
    __atomic_store_n(&first->threads.in_round, 0, __ATOMIC_SEQ_CST);
}

static bool takes_part(const struct engine *engine) {
    return __atomic_load_n(&engine->threads.running, __ATOMIC_SEQ_CST);
}

static void rehearse_all(struct engine *first) {
    begin_round(first);
    for (uint32_t i = 0; i < first->group.count; i++) {
        if (takes_part(first->group.all[i])) {
            geo_rehearse(first->group.all[i]);
        }
    }
    end_round(first);
}

/* A channel whose program is being exchanged only grows older. */
static void cycle_of_all(struct engine *first) {
    begin_round(first);
    for (uint32_t i = 0; i < first->group.count; i++) {
        struct engine *engine = first->group.all[i];
        if (takes_part(engine)) {
            geo_cycle(engine);
            continue;
        }
        ATOMIC_SET(engine->geo.cycle, engine->geo.cycle + 1);
        record_standing(engine, engine->geo.cycle);
        if (i + 1 == first->group.count) {
            publish_cell(engine);
        }
    }
    end_round(first);
}

/* Returns what the rehearsal took, 0 if there was no time for one. */
static int64_t wake_at(struct engine *engine, struct waker *waker, int64_t t) {
    int64_t took = 0, ready = t - waker->rehearsal;
    sleep_until(t - waker->early);
    int64_t now = now_ns(),
            early = waker->early + (now > ready ? EARLIER_NS : -LATER_NS);
    waker->early = early < 0 ? 0 : early > waker->most ? waker->most : early;
    if (now <= ready) {
        rehearse_all(engine);
        took = now_ns() - now;
    }
    while (now_ns() < t) {
        cpu_pause();
    }
    return took;
}

/* Time that passed, and time of it that the thread has worked or slept. */
typedef struct turn {
    int64_t passed, used;
} turn;

static turn turn_now(int64_t slept) {
    return (turn){now_ns(), clock_ns(CLOCK_THREAD_CPUTIME_ID) + slept};
}

/* Between two turns nothing but work and sleep was wanted: the rest of the time
 * others had the processor. */
static void note_away(struct engine *engine, turn from, turn to) {
    int64_t ns = to.passed - from.passed - (to.used - from.used);
    if (ns > (int64_t)engine->lateness.away_ns) {
        ATOMIC_SET(engine->lateness.away_ns, (uint64_t)ns);
    }
}

static void *plan_main(void *arg) {
    struct engine *engine = arg;
    int64_t slept = 0;
    turn last = turn_now(slept);
    while (ATOMIC_GET(engine->threads.running)) {
        bool pumped = planner_pump(engine) != 0;
        prediction_plan(engine, pumped);
        if (!pumped) {
            sleep_until(now_ns() + PLANNER_IDLE_NS);
            slept += PLANNER_IDLE_NS;
        }
        turn now = turn_now(slept);
        note_away(engine, last, now);
        last = now;
    }
    return NULL;
}

static void timed_cycle(struct engine *engine,
                        int64_t late,
                        int64_t rehearsal) {
    if (engine->timing.done >= engine->timing.rows) {
        cycle_of_all(engine);
        return;
    }
    int64_t begin = now_ns();
    cycle_of_all(engine);
    engine->timing.cycle_ns[engine->timing.done] = now_ns() - begin;
    engine->timing.late_ns[engine->timing.done] = late;
    engine->timing.rehearsal_ns[engine->timing.done] = rehearsal;
    ATOMIC_SET(engine->timing.done, engine->timing.done + 1);
}

/* GEO of all channels.  Absolute deadlines; a deadline missed by a whole cycle
 * is an overrun and is not made up for. */
static void *geo_main(void *arg) {
    struct engine *engine = arg;
    int64_t cycle = (int64_t)(engine->cfg.cycle_s * 1e9 + 0.5),
            next = now_ns() + cycle;
    struct waker waker = waker_of(cycle);
    while (ATOMIC_GET(engine->threads.geo_running)) {
        int64_t rehearsal = wake_at(engine, &waker, next),
                late = now_ns() - next;
        if (late >= cycle) {
            engine->timing.overruns += (uint64_t)(late / cycle);
            next += late / cycle * cycle;
        }
        timed_cycle(engine, late, rehearsal);
        if (engine->hli.side) {
            hs_word_post(&engine->hli.side->cnc_turn,
                         (uint32_t)engine->geo.cycle);
        }
        next += cycle;
    }
    return NULL;
}

/* Priority 0: without SCHED_FIFO. */
static int start_thread(pthread_t *thread,
                        void *(*body)(void *),
                        void *arg,
                        int priority) {
    pthread_attr_t attr;
    struct sched_param param = {.sched_priority = priority};
    pthread_attr_init(&attr);
    if (priority) {
        pthread_attr_setinheritsched(&attr, PTHREAD_EXPLICIT_SCHED);
        pthread_attr_setschedpolicy(&attr, SCHED_FIFO);
        pthread_attr_setschedparam(&attr, &param);
    }
    int error = pthread_create(thread, &attr, body, arg);
    pthread_attr_destroy(&attr);
    if (error && priority) {
        return start_thread(thread, body, arg, 0) == 0 ? 1 : -1;
    }
    return error ? -1 : 0;
}

static void *bare_main(void *arg) {
    struct bare_loop *bare_loop = arg;
    int64_t next = now_ns() + bare_loop->period;
    for (int64_t i = 0; i < bare_loop->rows; i++, next += bare_loop->period) {
        sleep_until(next);
        bare_loop->late[i] = now_ns() - next;
        if (bare_loop->late[i] >= bare_loop->period) {
            next += bare_loop->late[i] / bare_loop->period * bare_loop->period;
        }
    }
    return NULL;
}

int engine_bare_loop(int64_t period_ns,
                     int64_t *late_ns,
                     int64_t rows,
                     int use_fifo) {
    struct bare_loop bare_loop = {period_ns, rows, late_ns};
    pthread_t thread;
    if (start_thread(&thread,
                     bare_main,
                     &bare_loop,
                     use_fifo ? GEO_PRIORITY : 0)
        < 0) {
        return -1;
    }
    pthread_join(thread, NULL);
    return 0;
}

static void lock_memory(struct engine *engine) {
    (void)!mlock(engine, sizeof *engine);
    (void)!mlock(engine->store.pieces,
                 (engine->store.mask + 1) * sizeof(struct piece));
    (void)!mlock(engine->run.pieces,
                 (engine->run.mask + 1) * sizeof(struct piece));
    (void)!mlock(engine->store.curves,
                 (engine->store.mask + 1) * sizeof(struct curve));
    (void)!mlock(engine->commit.ring, PHASE_RING * sizeof(phase));
    (void)!mlock(engine->store.elements,
                 (engine->store.element_mask + 1) * sizeof(struct element));
}

/* The thread that all channels share, with the first of them that starts. */
static int start_geo(struct engine *first, int use_fifo) {
    if (first->threads.geo_started) {
        return first->threads.fifo_result;
    }
    ATOMIC_SET(first->threads.geo_running, 1);
    int result = start_thread(&first->threads.geo,
                              geo_main,
                              first,
                              use_fifo ? GEO_PRIORITY : 0);
    if (result < 0) {
        ATOMIC_SET(first->threads.geo_running, 0);
        return -1;
    }
    first->threads.geo_started = true;
    first->threads.fifo_result = result;
    return result;
}

/* 0: running as asked, 1: running without SCHED_FIFO, -1: no thread could be
 * started. */
int engine_start(struct engine *engine, int use_fifo) {
    if (engine->threads.started) {
        return 0;
    }
    lock_memory(engine);
    planner_store_tail(engine);
    ATOMIC_SET(engine->threads.running, 1);
    if (start_thread(&engine->threads.planner,
                     plan_main,
                     engine,
                     use_fifo ? PLANNER_PRIORITY : 0)
        < 0) {
        ATOMIC_SET(engine->threads.running, 0);
        return -1;
    }
    int result = start_geo(first_channel(engine), use_fifo);
    if (result < 0) {
        ATOMIC_SET(engine->threads.running, 0);
        pthread_join(engine->threads.planner, NULL);
        return -1;
    }
    engine->threads.started = true;
    return result;
}

/* Polls, so that GEO neither locks nor wakes anybody. */
int engine_wait_all(struct engine *first, int64_t timeout_ns, uint32_t *who) {
    int64_t until = now_ns() + timeout_ns;
    for (;;) {
        for (*who = 0; *who < first->group.count; (*who)++) {
            int event = pending_event(first->group.all[*who]);
            if (event >= 0) {
                return event;
            }
        }
        *who = 0;
        if (now_ns() >= until) {
            return ENGINE_DONE;
        }
        sleep_until(now_ns() + EVENT_POLL_NS);
    }
}

int engine_wait(struct engine *engine, int64_t timeout_ns) {
    uint32_t who;
    return engine_wait_all(engine, timeout_ns, &who);
}

static bool others_run(const struct engine *engine) {
    bool run = false;
    for (uint32_t i = 0; i < engine->group.count; i++) {
        const struct engine *other = engine->group.all[i];
        run |= other != engine && other->threads.started;
    }
    return run;
}

/* Behind it GEO touches this channel no more; the last one ends GEO. */
static void leave_rounds(struct engine *engine) {
    struct engine *first = first_channel(engine);
    if (!others_run(engine)) {
        /* its last cycle is one like all others, and recorded */
        ATOMIC_SET(first->threads.geo_running, 0);
        pthread_join(first->threads.geo, NULL);
        first->threads.geo_started = false;
        ATOMIC_SET(engine->threads.running, 0);
        return;
    }
    __atomic_store_n(&engine->threads.running, 0, __ATOMIC_SEQ_CST);
    while (__atomic_load_n(&first->threads.in_round, __ATOMIC_SEQ_CST)) {
        sleep_until(now_ns() + ROUND_POLL_NS);
    }
}

void engine_stop(struct engine *engine) {
    if (!engine->threads.started) {
        return;
    }
    leave_rounds(engine);
    pthread_join(engine->threads.planner, NULL);
    engine->threads.started = false;
}

/* The channels that are answered at once. */
static int serve_all(struct engine *first) {
    int served = 0;
    for (uint32_t i = 0; i < first->group.count; i++) {
        struct engine *engine = first->group.all[i];
        if (first->group.count == 1
            || engine->cfg.service == HLI_SERVICE_IMMEDIATE) {
            served += serve_request(engine);
        }
    }
    return served;
}

/* Spins for a while after each request, then sleeps on the bell; a PLC that
 * only sets the byte is found by polling. */
static void *serve_main(void *arg) {
    struct engine *engine = arg;
    HLI_SIDE_WORD *bell = &engine->hli.side->clah_bell;
    int64_t last = now_ns();
    uint32_t rounds = 0;
    while (ATOMIC_GET(engine->service.running)) {
        uint32_t seen = load_u32_acquire(&bell->word);
        if (serve_all(engine)) {
            rounds = 0;
            continue;
        }
        cpu_pause();
        if (++rounds < 2000) {
            continue;
        }
        if (rounds == 2000) {
            last = now_ns();
        }
        if ((rounds & 1023) == 0 && now_ns() - last > SERVICE_SPIN_NS) {
            hs_word_wait(bell, seen + 1, 0, SERVICE_POLL_NS);
        }
    }
    return NULL;
}

int engine_serve_start(struct engine *engine) {
    if (engine->service.started || !engine->hli.side) {
        return engine->hli.side ? 0 : -1;
    }
    if (engine->cfg.clock == HLI_CLOCK_LOCKSTEP) {
        return 0; /* engine_run() serves between the PLC's scans */
    }
    ATOMIC_SET(engine->service.running, 1);
    if (pthread_create(&engine->service.thread, NULL, serve_main, engine)) {
        return -1;
    }
    engine->service.started = true;
    return 0;
}

void engine_serve_stop(struct engine *engine) {
    if (!engine->service.started) {
        return;
    }
    ATOMIC_SET(engine->service.running, 0);
    pthread_join(engine->service.thread, NULL);
    engine->service.started = false;
}
