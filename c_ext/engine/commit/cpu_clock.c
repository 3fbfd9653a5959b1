/* CPU time of the planner's pumps, without changing what is measured.
 *
 * Reading the thread's CPU clock asks the kernel: some 500 ns on virtual
 * machines, and as much again until the processor has found back into the
 * planner. Pumps of the acceleration-limited planner take less than that. So
 * beyond the first ones only one in sixteen is timed (and all in which the
 * window is moved on), by the clock of the passing time, which is read without
 * the kernel. What others take meanwhile does not count: such a pump takes at
 * most the CPU time since the end of the pump before it. The jerk-limited
 * planner is timed by its CPU clock always.
 */
#include <time.h>
#include "engine/commit/cpu_clock.h"
#include "engine/commit/pace.h"
#include "engine/state/state.h"
#include "engine/state/tuning.h"

static double seconds_of(clockid_t clock) {
    struct timespec time;
    clock_gettime(clock, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static double least_reading(clockid_t clock) {
    double least = 1.0;
    for (int i = 0; i < 32; i++) {
        double t = seconds_of(clock);
        least = lesser(least, seconds_of(clock) - t);
    }
    return least;
}

static bool by_cpu_clock(const struct engine *engine) {
    return engine->traits.uses_cpu_clock
           || engine->commit.watch.pumps <= EXACT_PUMPS;
}

/* Whether the next pump is timed. */
static void choose_next(struct engine *engine, struct stopwatch *stopwatch) {
    stopwatch->pumps++;
    stopwatch->chance =
        stopwatch->chance * 6364136223846793005u + 1442695040888963407u;
    stopwatch->weight = by_cpu_clock(engine) ? 1.0
                        : stopwatch->chance >> 33 & (TIMED_SHARE - 1)
                            ? 0.0
                            : TIMED_SHARE;
    if (stopwatch->weight > 0.0 && !by_cpu_clock(engine)) {
        stopwatch->cpu_before = seconds_of(CLOCK_THREAD_CPUTIME_ID);
    }
}

void watch_start(struct engine *engine) {
    struct stopwatch *stopwatch = &engine->commit.watch;
    if (!stopwatch->clock_s) {
        stopwatch->clock_s = least_reading(CLOCK_THREAD_CPUTIME_ID);
        stopwatch->passing_s = least_reading(CLOCK_MONOTONIC);
        choose_next(engine, stopwatch);
    }
    stopwatch->spent_s = 0.0;
    stopwatch->committed_s = engine->commit.committed_s;
    if (stopwatch->weight <= 0.0) {
        return;
    }
    if (by_cpu_clock(engine)) {
        stopwatch->cpu_before = seconds_of(CLOCK_THREAD_CPUTIME_ID);
    }
    stopwatch->from = seconds_of(CLOCK_MONOTONIC);
}

static void count(struct engine *engine, struct stopwatch *stopwatch) {
    double passed = greater(0.0,
                            seconds_of(CLOCK_MONOTONIC) - stopwatch->from
                                - stopwatch->passing_s);
    double cpu = greater(0.0,
                         seconds_of(CLOCK_THREAD_CPUTIME_ID)
                             - stopwatch->cpu_before - stopwatch->clock_s);
    double spent_s = by_cpu_clock(engine) ? cpu : lesser(passed, cpu);
    engine->commit.cpu_s += stopwatch->weight * spent_s;
    stopwatch->spent_s += spent_s;
}

void watch_window(struct engine *engine) {
    struct stopwatch *stopwatch = &engine->commit.watch;
    if (stopwatch->weight == 1.0) {
        return;
    }
    if (stopwatch->weight > 0.0) {
        count(engine, stopwatch);
    }
    stopwatch->weight = 1.0;
    stopwatch->cpu_before = seconds_of(CLOCK_THREAD_CPUTIME_ID);
    stopwatch->from = seconds_of(CLOCK_MONOTONIC);
}

void watch_stop(struct engine *engine) {
    struct stopwatch *stopwatch = &engine->commit.watch;
    if (stopwatch->weight > 0.0) {
        count(engine, stopwatch);
        note_pace(engine,
                  stopwatch->spent_s,
                  engine->commit.committed_s - stopwatch->committed_s);
    }
    choose_next(engine, stopwatch);
}
