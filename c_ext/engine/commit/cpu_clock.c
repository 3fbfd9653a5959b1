/* CPU time of the planner's pumps, without changing what is measured.
 *
 * Reading the thread's CPU clock asks the kernel: some 500 ns on virtual machines, and as much again until the processor has
 * found back into the planner. Pumps of the acceleration-limited planner take less than that. So beyond the first ones only
 * one in sixteen is timed (and all in which the window is moved on), by the clock of the passing time, which is read without
 * the kernel. What others take meanwhile does not count: such a pump takes at most the CPU time since the end of the pump
 * before it. The jerk-limited planner is timed by its CPU clock always.
 */
#include <time.h>
#include "engine/state/state.h"

#define EXACT_PUMPS 64 /* are timed each by the CPU clock, later ones ... */
#define TIMED_SHARE 16 /* ... at random */

static double seconds_of(clockid_t clock) {
    struct timespec t;
    clock_gettime(clock, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static double least_reading(clockid_t clock) {
    double least = 1.0;
    for (int i = 0; i < 32; i++) {
        double t = seconds_of(clock);
        least = lesser(least, seconds_of(clock) - t);
    }
    return least;
}

static bool by_cpu_clock(const engine *e) { return e->drive.planner || e->plan.watch.pumps <= EXACT_PUMPS; }

/* Whether the next pump is timed. */
static void choose_next(engine *e, stopwatch *w) {
    w->pumps++;
    w->chance = w->chance * 6364136223846793005u + 1442695040888963407u;
    w->weight = by_cpu_clock(e) ? 1.0 : w->chance >> 33 & (TIMED_SHARE - 1) ? 0.0 : TIMED_SHARE;
    if (w->weight > 0.0) w->cpu_before = seconds_of(CLOCK_THREAD_CPUTIME_ID);
}

void watch_start(engine *e) {
    stopwatch *w = &e->plan.watch;
    if (!w->clock_s) {
        w->clock_s = least_reading(CLOCK_THREAD_CPUTIME_ID);
        w->passing_s = least_reading(CLOCK_MONOTONIC);
        choose_next(e, w);
    }
    if (w->weight <= 0.0) return;
    if (by_cpu_clock(e)) w->cpu_before = seconds_of(CLOCK_THREAD_CPUTIME_ID);
    w->from = seconds_of(CLOCK_MONOTONIC);
}

static void count(engine *e, stopwatch *w) {
    double passed = greater(0.0, seconds_of(CLOCK_MONOTONIC) - w->from - w->passing_s);
    double cpu = greater(0.0, seconds_of(CLOCK_THREAD_CPUTIME_ID) - w->cpu_before - w->clock_s);
    e->plan.cpu_s += w->weight * (by_cpu_clock(e) ? cpu : lesser(passed, cpu));
}

/* The window is moved on, which is rare and takes long: from here to the end this pump is timed whether it was to be or not. */
void watch_window(engine *e) {
    stopwatch *w = &e->plan.watch;
    if (w->weight == 1.0) return;
    if (w->weight > 0.0) count(e, w);
    w->weight = 1.0;
    w->cpu_before = seconds_of(CLOCK_THREAD_CPUTIME_ID);
    w->from = seconds_of(CLOCK_MONOTONIC);
}

void watch_stop(engine *e) {
    stopwatch *w = &e->plan.watch;
    if (w->weight > 0.0) count(e, w);
    choose_next(e, w);
}
