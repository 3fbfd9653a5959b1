/* How long the planner takes for the motion that it commits: a count of commits
 * for each step of a scale whose steps grow by a tenth. Bounded, and read while
 * the planner counts on.
 */
#include <math.h>
#include "engine/commit/pace.h"
#include "engine/state/state.h"

#define FIRST_US 0.01 /* for each ms of motion: less is as good as nothing */
#define STEP 1.1      /* from one to the next */

/* Upper end of the step in which so many of the commits are reached. */
static double quantile(const uint64_t *commits, double count) {
    double us = FIRST_US;
    uint64_t sum = 0;
    for (int i = 0; i < PACE_STEPS; i++) {
        sum += commits[i];
        if ((double)sum >= count) {
            break;
        }
        us *= STEP;
    }
    return us;
}

void pace_quantiles(const struct engine *engine, double us_per_ms[3]) {
    const struct pace *pace = &engine->commit.pace;
    uint64_t commits[PACE_STEPS];
    uint64_t all = 0;
    for (int i = 0; i < PACE_STEPS; i++) {
        commits[i] = __atomic_load_n(&pace->commits[i], __ATOMIC_RELAXED);
        all += commits[i];
    }
    __atomic_load(&pace->most_us, &us_per_ms[2], __ATOMIC_RELAXED);
    us_per_ms[0] = us_per_ms[1] = 0.0;
    if (all > 0) {
        us_per_ms[0] = fmin(us_per_ms[2], quantile(commits, 0.5 * (double)all));
        us_per_ms[1] =
            fmin(us_per_ms[2], quantile(commits, 0.99 * (double)all));
    }
}

static void show(struct engine *engine) {
    double us[3];
    pace_quantiles(engine, us);
    HLI_SIDE_PLANNER *shown = &engine->hli.side->planner[engine->cfg.channel];
    store_f64_relaxed(&shown->p50, us[0]);
    store_f64_relaxed(&shown->p99, us[1]);
    store_f64_relaxed(&shown->most, us[2]);
}

void note_pace(struct engine *engine, double cpu_s, double committed_s) {
    struct pace *pace = &engine->commit.pace;
    if (!(committed_s > 0.0)) {
        return;
    }
    double us = 1e3 * cpu_s / committed_s;
    double step = us > FIRST_US ? ceil(log(us / FIRST_US) / log(STEP)) : 0.0;
    int i = (int)fmin(step, PACE_STEPS - 1);
    __atomic_fetch_add(&pace->commits[i], 1, __ATOMIC_RELAXED);
    __atomic_store(&pace->last_us, &us, __ATOMIC_RELAXED);
    if (us > pace->most_us) {
        __atomic_store(&pace->most_us, &us, __ATOMIC_RELAXED);
    }
    if (engine->hli.side) {
        show(engine);
    }
}
