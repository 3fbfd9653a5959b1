/* Memory of a planner: it is made, copied and freed here. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "jerk/window/history.h"
#include "jerk/memory.h"
#include "jerk/path/step_size.h"
#include "jerk/state/state.h"

/* All memory of a planner: one block, handed out in order. */
typedef struct arena {
    char *at;
    size_t used;
} arena;

static void *take(struct arena *arena, size_t bytes) {
    void *out = arena->at ? arena->at + arena->used : NULL;
    arena->used += (bytes + 63) / 64 * 64;
    return out;
}

static double *doubles(struct arena *arena, size_t count) {
    return take(arena, sizeof(double) * count);
}

static void lay_out_path(jerk_planner *planner, struct arena *arena) {
    size_t count = (size_t)planner->capacity;
    planner->ring =
        take(arena, sizeof *planner->ring * (size_t)(planner->mask + 1));
    planner->tight = doubles(arena, (size_t)(planner->mask + 1));
    planner->acc_tight = doubles(arena, (size_t)(planner->mask + 1));
    planner->steps =
        take(arena, sizeof *planner->steps * (size_t)(planner->mask + 1));
    planner->grid.seg = take(arena, sizeof(struct segment) * count);
    planner->grid.parts = take(arena, sizeof(jerk_interval) * count);
    planner->grid.knot_cap = doubles(arena, count + 1);
    planner->grid.step = doubles(arena, count + 2);
    planner->grid.grade = doubles(arena, count + 2);
    planner->grid.reach = doubles(arena, count + 1);
    planner->grid.from_start = doubles(arena, count + 1);
    planner->grid.top = doubles(arena, count + 1);
}

static void lay_out_problem(jerk_planner *planner, struct arena *arena) {
    size_t stages = (size_t)planner->capacity + 2 * LANES;
    size_t blocks = stages / LANES + 1;
    size_t axes = (size_t)planner->cfg.axes + 1; /* and the path */
    struct problem *problem = &planner->prob;
    double **stage[] = {&problem->lengths,
                        &problem->x,
                        &problem->accel,
                        &problem->input[0],
                        &problem->input[1],
                        &problem->dx,
                        &problem->du,
                        &problem->dc[0],
                        &problem->dc[1],
                        &problem->bow,
                        &problem->guess,
                        &problem->cap,
                        &problem->most,
                        &problem->brake,
                        &problem->slope,
                        &problem->weight,
                        &problem->pull,
                        &problem->root[0],
                        &problem->root[1],
                        &problem->calm,
                        &problem->on,
                        &problem->cost.xx,
                        &problem->cost.xu,
                        &problem->cost.uu,
                        &problem->cost.xc[0],
                        &problem->cost.xc[1],
                        &problem->cost.uc[0],
                        &problem->cost.uc[1],
                        &problem->cost.cc[0],
                        &problem->cost.cc[1],
                        &problem->cost.cc[2],
                        &problem->grad.x,
                        &problem->grad.accel,
                        &problem->grad.input[0],
                        &problem->grad.input[1],
                        &problem->corr.x,
                        &problem->corr.accel,
                        &problem->corr.input[0],
                        &problem->corr.input[1],
                        &problem->cent.x,
                        &problem->cent.accel,
                        &problem->cent.input[0],
                        &problem->cent.input[1]};
    for (size_t i = 0; i < sizeof stage / sizeof *stage; i++) {
        *stage[i] = doubles(arena, stages);
    }
    size_t pairs = stages / 2 + 2 * LANES;
    problem->gain = take(arena, sizeof *problem->gain * pairs);
    problem->free = take(arena, sizeof *problem->free * pairs);
    problem->block = take(arena, sizeof(struct block) * blocks);
    problem->used = take(arena, sizeof(struct used) * blocks);
    problem->jerk = take(arena, sizeof(two_sided) * blocks * 2 * axes);
    problem->mid = take(arena, sizeof(two_sided) * blocks * axes);
    problem->acc = take(arena, sizeof(two_sided) * blocks * 2 * axes);
    problem->one =
        take(arena, sizeof(struct one_sided) * blocks * ONE_SIDED_ROWS);
}

static void lay_out_plan(plan *plan, struct arena *arena, size_t count) {
    double **numbers[] = PLAN_ARRAYS(plan);
    for (size_t i = 0; i < sizeof numbers / sizeof *numbers; i++) {
        *numbers[i] = doubles(arena, count + 2 * LANES);
    }
    plan->tag = take(arena, sizeof(uint64_t) * count);
    plan->last = take(arena, count);
}

/* A guess needs no more of it. */
static void lay_out_found(plan *found, struct arena *arena, size_t count) {
    found->lengths = doubles(arena, count);
    found->x = doubles(arena, count);
    found->accel = doubles(arena, count);
}

static void lay_out_plans(jerk_planner *planner, struct arena *arena) {
    size_t count = (size_t)planner->capacity + HANDED_MAX;
    lay_out_plan(&planner->plan, arena, count);
    lay_out_plan(&planner->kept.plan, arena, count);
    lay_out_found(&planner->found, arena, count);
    planner->scratch = doubles(arena, count + 2 * LANES);
}

/* Intervals of a window at the most. */
static int capacity_for(const jerk_config *config) {
    return config->window_knots + GRADED_EXTRA + SCARCE_EXTRA;
}

int64_t jerk_laws_max(const jerk_config *config) {
    return capacity_for(config) + HANDED_MAX;
}

static void lay_out(jerk_planner *planner, struct arena *arena) {
    lay_out_path(planner, arena);
    lay_out_problem(planner, arena);
    lay_out_plans(planner, arena);
}

static void set_scales(jerk_planner *planner) {
    jerk_config *config = &planner->cfg;
    double v = 0.0;
    double acc = 0.0;
    double jerk = 0.0;
    for (int i = 0; i < config->axes; i++) {
        acc += config->a_max[i];
        jerk += config->j_max[i];
        v = fmax(v,
                 reached_speed(config->v_max[i],
                               config->a_max[i],
                               config->j_max[i]));
    }
    planner->scale = v / 3.0;
    planner->axes = config->axes;
    config->v_max[config->axes] = PATH_FREE * v;
    config->a_max[config->axes] = PATH_FREE * acc;
    config->j_max[config->axes] = PATH_FREE * jerk;
    if (!(config->refresh > 0.0)) {
        planner->cfg.refresh = config->window_blocks < SHORT_WINDOW
                                   ? SHORT_REFRESH
                                   : DEFAULT_REFRESH;
    }
}

jerk_planner *jerk_new(const jerk_config *config, int capacity) {
    if (jerk_check_config(config)) {
        return NULL;
    }
    jerk_planner *planner = calloc(1, sizeof *planner);
    if (!planner) {
        return NULL;
    }
    planner->cfg = *config;
    set_scales(planner);
    planner->capacity = planner->grid.max = capacity_for(config);
    planner->mask = 1023;
    while (planner->mask + 1
               < (uint64_t)(capacity > 0 ? capacity + HANDED_MAX : 0)
           || planner->mask + 1 < RING_MIN) {
        planner->mask = 2 * planner->mask + 1;
    }
    planner->at_standstill = true;
    planner->feed_factor = 1.0;
    planner->rapid_factor = 1.0;
    planner->command_speed = -1.0;
    planner->other_s = -CALM_S;
    planner->was = speeds_now(planner);
    planner->reach = 1e30;
    planner->credit = WORK_KEPT;
    struct arena arena = {0};
    lay_out(planner, &arena);
    planner->handed = calloc(HANDED_MAX, sizeof *planner->handed);
    if (posix_memalign(&planner->arena, 64, arena.used)) {
        planner->arena = NULL;
    }
    if (!planner->arena || !planner->handed) {
        free(planner->arena);
        free(planner->handed);
        free(planner);
        return NULL;
    }
    memset(planner->arena, 0, arena.used);
    arena = (struct arena){planner->arena, 0};
    lay_out(planner, &arena);
    return planner;
}

/* `to` was made with the same configuration and capacity: it becomes the same
 * planner with memory of its own. */
void planner_copy(jerk_planner *to, const jerk_planner *from) {
    struct arena arena = {to->arena, 0};
    struct handed *kept = to->handed;
    *to = *from;
    to->arena = arena.at;
    to->handed = kept;
    to->gone = NULL;
    forget_laws(to);
    to->kept.state = KEEP_NONE;
    lay_out(to, &arena);
    memcpy(to->arena, from->arena, arena.used);
}

void jerk_free(jerk_planner *planner) {
    if (!planner) {
        return;
    }
    free(planner->arena);
    free(planner->handed);
    free(planner);
}
