/* Life of a planner, and what is handed out: laws from the plan, a new plan
 * when enough of the old one is used up. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "jerk/state.h"

#define RING_MIN (1024 + HANDED_MAX)
#define DEFAULT_REFRESH 0.2
#define SHORT_WINDOW 50 /* blocks: here what is left of the window counts */
#define SHORT_REFRESH 0.12
#define LEAST_PART 1e-7 /* mm: shorter parts of a law are not handed out */
#define LEAST_TIME 1e-9 /* s */
#define TRY_AGAIN_S                                                            \
    0.003 /* so long the old plan is followed where there is none for a hold   \
             or another speed; for a speed twice as long each time, ... */
#define TRY_AGAIN_MAX_S 0.05 /* ... up to this */

static bool positive(double v) {
    return isfinite(v) && v > 0.0;
}

int jerk_check_config(const jerk_config *config) {
    if (config->axes < 1 || config->axes > JERK_AXES
        || !positive(config->cycle_s) || config->window_knots < 8
        || config->window_blocks < 1) {
        return JERK_BAD_LIMITS;
    }
    for (int axis = 0; axis < config->axes; axis++) {
        if (!positive(config->v_max[axis]) || !positive(config->a_max[axis])
            || !positive(config->j_max[axis])) {
            return JERK_BAD_LIMITS;
        }
    }
    return isfinite(config->spacing_mm) && isfinite(config->refresh)
               ? 0
               : JERK_BAD_LIMITS;
}

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

static void lay_out(jerk_planner *planner, struct arena *arena) {
    size_t count = (size_t)planner->capacity, stages = count + 2 * LANES,
           blocks = stages / LANES + 1, axes = (size_t)planner->cfg.axes;
    planner->ring =
        take(arena, sizeof *planner->ring * (size_t)(planner->mask + 1));
    planner->tight = doubles(arena, (size_t)(planner->mask + 1));
    planner->steps =
        take(arena, sizeof *planner->steps * (size_t)(planner->mask + 1));
    planner->grid.seg = take(arena, sizeof(struct segment) * count);
    planner->grid.parts = take(arena, sizeof(jerk_interval) * count);
    planner->grid.knot_cap = doubles(arena, count + 1);
    planner->grid.step = doubles(arena, count + 2);
    planner->grid.grade = doubles(arena, count + 2);
    planner->grid.from_start = doubles(arena, count + 1);
    planner->grid.top = doubles(arena, count + 1);
    struct problem *problem = &planner->prob;
    double **stage[] = {
        &problem->h,          &problem->x,          &problem->u,
        &problem->c[0],       &problem->c[1],       &problem->dx,
        &problem->du,         &problem->dc[0],      &problem->dc[1],
        &problem->guess,      &problem->weight,     &problem->root[0],
        &problem->root[1],    &problem->calm,       &problem->on,
        &problem->cost.xx,    &problem->cost.xu,    &problem->cost.uu,
        &problem->cost.xc[0], &problem->cost.xc[1], &problem->cost.uc[0],
        &problem->cost.uc[1], &problem->cost.cc[0], &problem->cost.cc[1],
        &problem->cost.cc[2], &problem->grad.x,     &problem->grad.u,
        &problem->grad.c[0],  &problem->grad.c[1],  &problem->corr.x,
        &problem->corr.u,     &problem->corr.c[0],  &problem->corr.c[1],
        &problem->cent.x,     &problem->cent.u,     &problem->cent.c[0],
        &problem->cent.c[1],  &problem->free[0],    &problem->free[1]};
    for (size_t i = 0; i < sizeof stage / sizeof *stage; i++) {
        *stage[i] = doubles(arena, stages);
    }
    problem->gain = take(arena, sizeof(struct gain) * stages);
    problem->block = take(arena, sizeof(struct block) * blocks);
    problem->jerk = take(arena, sizeof(two_sided) * blocks * 2 * axes);
    problem->mid = take(arena, sizeof(two_sided) * blocks * axes);
    problem->acc = take(arena, sizeof(two_sided) * blocks * 2 * axes);
    problem->one =
        take(arena, sizeof(struct one_sided) * blocks * ONE_SIDED_ROWS);
    double **kept[] = {&planner->plan.h,
                       &planner->plan.x,
                       &planner->plan.u,
                       &planner->plan.time,
                       &planner->plan.c[0],
                       &planner->plan.c[1],
                       &planner->plan.jerk,
                       &planner->plan.snap,
                       &planner->plan.crackle,
                       &planner->plan.pop,
                       &planner->plan.offset,
                       &planner->scratch};
    for (size_t i = 0; i < sizeof kept / sizeof *kept; i++) {
        *kept[i] = doubles(arena, stages + HANDED_MAX);
    }
    planner->plan.tag = take(arena, sizeof(uint64_t) * (count + HANDED_MAX));
    planner->plan.last = take(arena, count + HANDED_MAX);
}

static void set_scales(jerk_planner *planner) {
    const jerk_config *config = &planner->cfg;
    double v = 0.0;
    for (int i = 0; i < config->axes; i++) {
        v = fmax(v,
                 reached_speed(config->v_max[i],
                               config->a_max[i],
                               config->j_max[i]));
    }
    planner->scale = v / 3.0;
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
    planner->capacity = planner->grid.max = config->window_knots + GRADED_EXTRA;
    planner->mask = 1023;
    while (planner->mask + 1
               < (uint64_t)(capacity > 0 ? capacity + HANDED_MAX : 0)
           || planner->mask + 1 < RING_MIN) {
        planner->mask = 2 * planner->mask + 1;
    }
    planner->at_rest = true;
    planner->feed_factor = planner->rapid_factor = 1.0;
    planner->command_speed = -1.0;
    planner->was = speeds_now(planner);
    planner->reach = 1e30;
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

/* Another motion is wanted, from here on. */
static void changes(jerk_planner *planner) {
    planner->changed = true;
    planner->again_s = planner->waited_s = 0.0;
}

void jerk_override(jerk_planner *planner, double feed, double rapid) {
    if (!isfinite(feed) || !isfinite(rapid)) {
        return;
    }
    if (feed == planner->feed_factor && rapid == planner->rapid_factor) {
        return;
    }
    planner->feed_factor = fmax(0.0, feed);
    planner->rapid_factor = fmax(0.0, rapid);
    changes(planner);
}

void jerk_hold(jerk_planner *planner, int hold) {
    if ((hold != 0) == planner->hold) {
        return;
    }
    planner->hold = hold != 0;
    changes(planner);
}

/* The path under the plan's end as far as it could be planned now. */
static bool more_path(const jerk_planner *planner) {
    return planner->plan.end != planner->tail
           || (planner->finished && !planner->plan.stands);
}

static bool worth_planning(const jerk_planner *planner) {
    const plan *pl = &planner->plan;
    if (planner->changed && (planner->at_rest || !(planner->again_s > 0.0))) {
        return true;
    }
    if (pl->next >= pl->n) {
        return planner->head != planner->tail;
    }
    if (planner->hold || planner->changed || planner->wait > 0) {
        return false;
    }
    if (!pl->final) {
        return true;
    }
    if (pl->stands || !more_path(planner)) {
        return false;
    }
    return pl->since >= pl->refresh * pl->n && pl->length < pl->lasts;
}

static double thread_cpu_s(void) {
    struct timespec time;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &time);
    return (double)time.tv_sec + 1e-9 * (double)time.tv_nsec;
}

static bool zero_factor(const jerk_planner *planner) {
    const jerk_interval *interval = ring_at(planner, planner->head);
    return planner->head != planner->tail
           && asked_speed(planner, interval) <= 0.0;
}

static void plan_again(jerk_planner *planner) {
    double t0 = thread_cpu_s();
    bool met = true;
    if (planner->hold || zero_factor(planner)) {
        if (planner->at_rest) {
            forget_plan(planner);
        } else if (planner->changed) {
            met = plan_stop(planner);
        }
        planner->changed = false;
    } else {
        met = plan_window(planner);
    }
    if (!met) {
        planner->changed = true;
    }
    planner->waited_s =
        met ? 0.0
        : planner->hold
            ? TRY_AGAIN_S
            : fmin(TRY_AGAIN_MAX_S, fmax(TRY_AGAIN_S, 2.0 * planner->waited_s));
    planner->again_s = planner->waited_s;
    planner->stats.worst_solve_s =
        fmax(planner->stats.worst_solve_s, thread_cpu_s() - t0);
}

/* The law of segment k of the plan. */
static void law_of(const jerk_planner *planner, int k, jerk_law *law) {
    const plan *pl = &planner->plan;
    bool end = k + 1 == pl->n;
    law->tag = pl->tag[k];
    law->s0 = pl->offset[k];
    law->flags = end ? JERK_STAND : 0;
    law->last = pl->last[k];
    if (pl->time[k] > 0.0) {
        law->length = pl->h[k];
        law->v0 = planner->scale * sqrt(pl->x[k]);
        law->a0 = planner->scale * planner->scale * pl->u[k];
        law->jerk = pl->jerk[k];
        law->snap = pl->snap[k];
        law->crackle = pl->crackle[k];
        law->pop = pl->pop[k];
        law->time = pl->time[k];
        return;
    }
    const double c[2] = {pl->c[0][k], pl->c[1][k]};
    law_from(law,
             pl->h[k],
             pl->x[k],
             pl->u[k],
             end ? 0.0 : pl->x[k + 1],
             end ? 0.0 : pl->u[k + 1],
             c,
             planner->scale);
    pl->time[k] = law->time; /* tails are asked for again and again */
    pl->jerk[k] = law->jerk;
    pl->snap[k] = law->snap;
    pl->crackle[k] = law->crackle;
    pl->pop[k] = law->pop;
}

/* Segment `next` of the plan is the caller's: the path and the state move on.
 */
static void hand_out(jerk_planner *planner) {
    plan *pl = &planner->plan;
    int k = pl->next++;
    pl->since++;
    planner->wait--;
    pl->length -= pl->h[k];
    planner->at_rest = pl->next == pl->n;
    planner->x = planner->at_rest ? 0.0 : pl->x[k + 1];
    planner->u = planner->at_rest ? 0.0 : pl->u[k + 1];
    planner->behind_mm =
        planner->at_rest ? 0.0 : fmax(0.0, planner->behind_mm - pl->h[k]);
    planner->driven += pl->h[k];
    if (pl->last[k] && !planner->at_rest) {
        jump_passed(planner,
                    ring_at(planner, planner->head),
                    ring_at(planner, planner->head + 1));
    }
    ring_consume(planner, pl->h[k], pl->last[k]);
    planner->stats.segments++;
}

int jerk_next(jerk_planner *planner, jerk_law *law) {
    return jerk_next_within(planner, law, INFINITY);
}

/* Only the first `seconds` of the law of segment `next` are handed out; what is
 * left stays in the plan. */
static void split(jerk_planner *planner, jerk_law *law, double seconds) {
    plan *pl = &planner->plan;
    int k = pl->next;
    jerk_state at;
    jerk_at(law, seconds, &at);
    double d = at.s - law->s0, left = pl->h[k] - d;
    if (!(d > LEAST_PART) || !(left > LEAST_PART) || !(at.v > 0.0)) {
        remember_law(planner, k, law, true);
        hand_out(planner);
        return;
    }
    const jerk_law part = {.tag = law->tag,
                           .s0 = law->s0,
                           .v0 = law->v0,
                           .a0 = law->a0,
                           .jerk = law->jerk,
                           .snap = law->snap,
                           .crackle = law->crackle,
                           .pop = law->pop,
                           .time = seconds,
                           .length = d};
    remember_law(planner, k, &part, false);
    jerk_law left_over = *law;
    jerk_begin_at(&left_over, seconds);
    pl->jerk[k] = left_over.jerk;
    pl->snap[k] = left_over.snap;
    pl->crackle[k] = left_over.crackle;
    pl->pop[k] = left_over.pop;
    pl->time[k] = k + 1 == pl->n
                      ? 0.0
                      : law->time - seconds; /* towards a rest the law follows
                                                from speed and way */
    pl->h[k] = left;
    pl->length -= d;
    pl->offset[k] += d;
    pl->x[k] = planner->x = at.v * at.v / (planner->scale * planner->scale);
    pl->u[k] = planner->u = at.a / (planner->scale * planner->scale);
    pl->rest_start = planner->at_rest = false;
    planner->behind_mm = fmax(0.0, planner->behind_mm - d);
    planner->driven += d;
    ring_consume(planner, d, false);
    *law = part;
}

/* The beginning of what was taken back is handed out all the same; returns its
 * time. */
double hand_out_again(jerk_planner *planner, double seconds) {
    jerk_law law;
    law_of(planner, planner->plan.next, &law);
    split(planner, &law, seconds);
    return law.time;
}

int jerk_next_within(jerk_planner *planner, jerk_law *law, double seconds) {
    if (worth_planning(planner)) {
        plan_again(planner);
    }
    if (planner->plan.next >= planner->plan.n) {
        return 0;
    }
    law_of(planner, planner->plan.next, law);
    if (planner->again_s > 0.0) {
        seconds = fmin(seconds, planner->again_s);
    }
    if (law->time <= seconds * (1.0 + 1e-9)) {
        remember_law(planner, planner->plan.next, law, true);
        hand_out(planner);
    } else {
        split(planner, law, seconds);
    }
    planner->again_s = fmax(0.0, planner->again_s - law->time);
    planner->stats.laws++;
    return 1;
}

void jerk_watch(jerk_planner *planner, const uint64_t *word) {
    planner->gone = word;
}

double jerk_advance(jerk_planner *planner, double seconds) {
    double t = 0.0;
    while (seconds - t > LEAST_TIME && planner->plan.next < planner->plan.n) {
        jerk_law law;
        law_of(planner, planner->plan.next, &law);
        if (law.time > seconds - t) {
            t += hand_out_again(planner, seconds - t);
            continue;
        }
        remember_law(planner, planner->plan.next, &law, true);
        hand_out(planner);
        t += law.time;
    }
    return t;
}

int64_t jerk_take(jerk_planner *planner,
                  jerk_law *laws,
                  int64_t max,
                  double seconds) {
    int64_t count = 0;
    for (double t = 0.0;
         count < max && seconds - t > LEAST_TIME
         && jerk_next_within(planner, &laws[count], seconds - t);
         count++) {
        t += laws[count].time;
    }
    return count;
}

/* The whole look-ahead is known, or all there will ever be. */
int jerk_ready(const jerk_planner *planner) {
    double knots = 0.0;
    int blocks = 0;
    for (uint64_t i = planner->head; i != planner->tail; i++) {
        const jerk_interval *interval = ring_at(planner, i);
        knots += knots_at(planner, i);
        blocks += (int)interval->blocks;
        if ((interval->flags & JERK_STAND) || knots >= planner->cfg.window_knots
            || blocks >= planner->cfg.window_blocks) {
            return 1;
        }
    }
    return planner->finished || jerk_room(planner) == 0;
}

int64_t jerk_tail(const jerk_planner *planner, jerk_law *laws, int64_t max) {
    int64_t count = 0;
    for (int k = planner->plan.next; k < planner->plan.n && count < max; k++) {
        law_of(planner, k, &laws[count++]);
    }
    return count;
}

uint64_t jerk_edition(const jerk_planner *planner) {
    return planner->plan.edition;
}

int64_t jerk_used(const jerk_planner *planner) {
    return planner->plan.next;
}

void jerk_tail_driven(jerk_planner *planner) {
    while (planner->plan.next < planner->plan.n) {
        hand_out(planner);
    }
}

void jerk_get_stats(const jerk_planner *planner, jerk_stats *out) {
    *out = planner->stats;
}
