/* Life of a planner, and what is handed out: laws from the plan, a new plan when enough of the old one is used up. */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include "jerk/state.h"

#define RING_MIN (1024 + HANDED_MAX)
#define DEFAULT_REFRESH 0.2 
#define SHORT_WINDOW 50      /* blocks: here what is left of the window counts */
#define SHORT_REFRESH 0.12
#define LEAST_PART 1e-7  /* mm: shorter parts of a law are not handed out */
#define LEAST_TIME 1e-9  /* s */
#define TRY_AGAIN_S 0.003 /* so long the old plan is followed where there is none for a hold or another speed; for a speed twice as long each time, ... */
#define TRY_AGAIN_MAX_S 0.05 /* ... up to this */

static bool positive(double v) { return isfinite(v) && v > 0.0; }

int jerk_check_config(const jerk_config *c) {
    if (c->axes < 1 || c->axes > JERK_AXES || !positive(c->cycle_s) || c->window_knots < 8 || c->window_blocks < 1) return JERK_BAD_LIMITS;
    for (int a = 0; a < c->axes; a++)
        if (!positive(c->v_max[a]) || !positive(c->a_max[a]) || !positive(c->j_max[a])) return JERK_BAD_LIMITS;
    return isfinite(c->spacing_mm) && isfinite(c->refresh) ? 0 : JERK_BAD_LIMITS;
}

/* All memory of a planner: one block, handed out in order. */
typedef struct arena {
    char *at;
    size_t used;
} arena;

static void *take(arena *m, size_t bytes) {
    void *out = m->at ? m->at + m->used : NULL;
    m->used += (bytes + 63) / 64 * 64;
    return out;
}

static double *doubles(arena *m, size_t n) { return take(m, sizeof(double) * n); }

static void lay_out(jerk_planner *p, arena *m) {
    size_t n = (size_t)p->capacity, stages = n + 2 * LANES, blocks = stages / LANES + 1, axes = (size_t)p->cfg.axes;
    p->ring = take(m, sizeof *p->ring * (size_t)(p->mask + 1));
    p->tight = doubles(m, (size_t)(p->mask + 1));
    p->steps = take(m, sizeof *p->steps * (size_t)(p->mask + 1));
    p->grid.seg = take(m, sizeof(segment) * n);
    p->grid.parts = take(m, sizeof(jerk_interval) * n);
    p->grid.knot_cap = doubles(m, n + 1);
    p->grid.step = doubles(m, n + 2);
    p->grid.grade = doubles(m, n + 2);
    p->grid.from_start = doubles(m, n + 1);
    p->grid.top = doubles(m, n + 1);
    problem *b = &p->prob;
    double **stage[] = {&b->h, &b->x, &b->u, &b->c[0], &b->c[1], &b->dx, &b->du, &b->dc[0], &b->dc[1], &b->guess, &b->weight, &b->root[0], &b->root[1], &b->calm, &b->on,
                        &b->cost.xx, &b->cost.xu, &b->cost.uu, &b->cost.xc[0], &b->cost.xc[1], &b->cost.uc[0], &b->cost.uc[1],
                        &b->cost.cc[0], &b->cost.cc[1], &b->cost.cc[2],
                        &b->grad.x, &b->grad.u, &b->grad.c[0], &b->grad.c[1], &b->corr.x, &b->corr.u, &b->corr.c[0], &b->corr.c[1],
                        &b->cent.x, &b->cent.u, &b->cent.c[0], &b->cent.c[1],
                        &b->free[0], &b->free[1]};
    for (size_t i = 0; i < sizeof stage / sizeof *stage; i++) *stage[i] = doubles(m, stages);
    b->gain = take(m, sizeof(gain) * stages);
    b->block = take(m, sizeof(block) * blocks);
    b->jerk = take(m, sizeof(two_sided) * blocks * 2 * axes);
    b->mid = take(m, sizeof(two_sided) * blocks * axes);
    b->acc = take(m, sizeof(two_sided) * blocks * 2 * axes);
    b->one = take(m, sizeof(one_sided) * blocks * ONE_SIDED_ROWS);
    double **kept[] = {&p->plan.h, &p->plan.x, &p->plan.u, &p->plan.time, &p->plan.c[0], &p->plan.c[1], &p->plan.jerk, &p->plan.snap, &p->plan.crackle, &p->plan.pop, &p->plan.offset, &p->scratch};
    for (size_t i = 0; i < sizeof kept / sizeof *kept; i++) *kept[i] = doubles(m, stages + HANDED_MAX);
    p->plan.tag = take(m, sizeof(uint64_t) * (n + HANDED_MAX));
    p->plan.last = take(m, n + HANDED_MAX);
}

static void set_scales(jerk_planner *p) {
    const jerk_config *c = &p->cfg;
    double v = 0.0;
    for (int i = 0; i < c->axes; i++) v = fmax(v, reached_speed(c->v_max[i], c->a_max[i], c->j_max[i]));
    p->scale = v / 3.0;
    if (!(c->refresh > 0.0)) p->cfg.refresh = c->window_blocks < SHORT_WINDOW ? SHORT_REFRESH : DEFAULT_REFRESH;
}

jerk_planner *jerk_new(const jerk_config *config, int capacity) {
    if (jerk_check_config(config)) return NULL;
    jerk_planner *p = calloc(1, sizeof *p);
    if (!p) return NULL;
    p->cfg = *config;
    set_scales(p);
    p->capacity = p->grid.max = config->window_knots + GRADED_EXTRA;
    p->mask = 1023;
    while (p->mask + 1 < (uint64_t)(capacity > 0 ? capacity + HANDED_MAX : 0) || p->mask + 1 < RING_MIN) p->mask = 2 * p->mask + 1;
    p->at_rest = true;
    p->feed_factor = p->rapid_factor = 1.0;
    p->command_speed = -1.0;
    p->was = speeds_now(p);
    p->reach = 1e30;
    arena m = {0};
    lay_out(p, &m);
    p->handed = calloc(HANDED_MAX, sizeof *p->handed);
    if (posix_memalign(&p->arena, 64, m.used)) p->arena = NULL;
    if (!p->arena || !p->handed) {
        free(p->arena);
        free(p->handed);
        free(p);
        return NULL;
    }
    memset(p->arena, 0, m.used);
    m = (arena){p->arena, 0};
    lay_out(p, &m);
    return p;
}

/* `to` was made with the same configuration and capacity: it becomes the same planner with memory of its own. */
void planner_copy(jerk_planner *to, const jerk_planner *from) {
    arena m = {to->arena, 0};
    handed *kept = to->handed;
    *to = *from;
    to->arena = m.at;
    to->handed = kept;
    to->gone = NULL;
    forget_laws(to);
    lay_out(to, &m);
    memcpy(to->arena, from->arena, m.used);
}

void jerk_free(jerk_planner *p) {
    if (!p) return;
    free(p->arena);
    free(p->handed);
    free(p);
}

/* Another motion is wanted, from here on. */
static void changes(jerk_planner *p) {
    p->changed = true;
    p->again_s = p->waited_s = 0.0;
}

void jerk_override(jerk_planner *p, double feed, double rapid) {
    if (!isfinite(feed) || !isfinite(rapid)) return;
    if (feed == p->feed_factor && rapid == p->rapid_factor) return;
    p->feed_factor = fmax(0.0, feed);
    p->rapid_factor = fmax(0.0, rapid);
    changes(p);
}

void jerk_hold(jerk_planner *p, int hold) {
    if ((hold != 0) == p->hold) return;
    p->hold = hold != 0;
    changes(p);
}

/* The path under the plan's end as far as it could be planned now. */
static bool more_path(const jerk_planner *p) { return p->plan.end != p->tail || (p->finished && !p->plan.stands); }

static bool worth_planning(const jerk_planner *p) {
    const plan *pl = &p->plan;
    if (p->changed && (p->at_rest || !(p->again_s > 0.0))) return true;
    if (pl->next >= pl->n) return p->head != p->tail;
    if (p->hold || p->changed || p->wait > 0) return false;
    if (!pl->final) return true;
    if (pl->stands || !more_path(p)) return false;
    return pl->since >= pl->refresh * pl->n && pl->length < pl->lasts;
}

static double thread_cpu_s(void) {
    struct timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return (double)t.tv_sec + 1e-9 * (double)t.tv_nsec;
}

static bool zero_factor(const jerk_planner *p) {
    const jerk_interval *q = ring_at(p, p->head);
    return p->head != p->tail && asked_speed(p, q) <= 0.0;
}

static void plan_again(jerk_planner *p) {
    double t0 = thread_cpu_s();
    bool met = true;
    if (p->hold || zero_factor(p)) {
        if (p->at_rest) forget_plan(p);
        else if (p->changed) met = plan_stop(p);
        p->changed = false;
    } else {
        met = plan_window(p);
    }
    if (!met) p->changed = true;
    p->waited_s = met ? 0.0 : p->hold ? TRY_AGAIN_S : fmin(TRY_AGAIN_MAX_S, fmax(TRY_AGAIN_S, 2.0 * p->waited_s));
    p->again_s = p->waited_s;
    p->stats.worst_solve_s = fmax(p->stats.worst_solve_s, thread_cpu_s() - t0);
}

/* The law of segment k of the plan. */
static void law_of(const jerk_planner *p, int k, jerk_law *law) {
    const plan *pl = &p->plan;
    bool end = k + 1 == pl->n;
    law->tag = pl->tag[k];
    law->s0 = pl->offset[k];
    law->flags = end ? JERK_STAND : 0;
    law->last = pl->last[k];
    if (pl->time[k] > 0.0) {
        law->length = pl->h[k];
        law->v0 = p->scale * sqrt(pl->x[k]);
        law->a0 = p->scale * p->scale * pl->u[k];
        law->jerk = pl->jerk[k];
        law->snap = pl->snap[k];
        law->crackle = pl->crackle[k];
        law->pop = pl->pop[k];
        law->time = pl->time[k];
        return;
    }
    const double c[2] = {pl->c[0][k], pl->c[1][k]};
    law_from(law, pl->h[k], pl->x[k], pl->u[k], end ? 0.0 : pl->x[k + 1], end ? 0.0 : pl->u[k + 1], c, p->scale);
    pl->time[k] = law->time; /* tails are asked for again and again */
    pl->jerk[k] = law->jerk;
    pl->snap[k] = law->snap;
    pl->crackle[k] = law->crackle;
    pl->pop[k] = law->pop;
}

/* Segment `next` of the plan is the caller's: the path and the state move on. */
static void hand_out(jerk_planner *p) {
    plan *pl = &p->plan;
    int k = pl->next++;
    pl->since++;
    p->wait--;
    pl->length -= pl->h[k];
    p->at_rest = pl->next == pl->n;
    p->x = p->at_rest ? 0.0 : pl->x[k + 1];
    p->u = p->at_rest ? 0.0 : pl->u[k + 1];
    p->behind_mm = p->at_rest ? 0.0 : fmax(0.0, p->behind_mm - pl->h[k]);
    p->driven += pl->h[k];
    if (pl->last[k] && !p->at_rest) jump_passed(p, ring_at(p, p->head), ring_at(p, p->head + 1));
    ring_consume(p, pl->h[k], pl->last[k]);
    p->stats.segments++;
}

int jerk_next(jerk_planner *p, jerk_law *law) { return jerk_next_within(p, law, INFINITY); }

/* Only the first `seconds` of the law of segment `next` are handed out; what is left stays in the plan. */
static void split(jerk_planner *p, jerk_law *law, double seconds) {
    plan *pl = &p->plan;
    int k = pl->next;
    jerk_state at;
    jerk_at(law, seconds, &at);
    double d = at.s - law->s0, left = pl->h[k] - d;
    if (!(d > LEAST_PART) || !(left > LEAST_PART) || !(at.v > 0.0)) {
        remember_law(p, k, law, true);
        hand_out(p);
        return;
    }
    const jerk_law part = {.tag = law->tag, .s0 = law->s0, .v0 = law->v0, .a0 = law->a0, .jerk = law->jerk, .snap = law->snap, .crackle = law->crackle, .pop = law->pop, .time = seconds, .length = d};
    remember_law(p, k, &part, false);
    jerk_law left_over = *law;
    jerk_begin_at(&left_over, seconds);
    pl->jerk[k] = left_over.jerk;
    pl->snap[k] = left_over.snap;
    pl->crackle[k] = left_over.crackle;
    pl->pop[k] = left_over.pop;
    pl->time[k] = k + 1 == pl->n ? 0.0 : law->time - seconds; /* towards a rest the law follows from speed and way */
    pl->h[k] = left;
    pl->length -= d;
    pl->offset[k] += d;
    pl->x[k] = p->x = at.v * at.v / (p->scale * p->scale);
    pl->u[k] = p->u = at.a / (p->scale * p->scale);
    pl->rest_start = p->at_rest = false;
    p->behind_mm = fmax(0.0, p->behind_mm - d);
    p->driven += d;
    ring_consume(p, d, false);
    *law = part;
}

/* The beginning of what was taken back is handed out all the same; returns its time. */
double hand_out_again(jerk_planner *p, double seconds) {
    jerk_law law;
    law_of(p, p->plan.next, &law);
    split(p, &law, seconds);
    return law.time;
}

int jerk_next_within(jerk_planner *p, jerk_law *law, double seconds) {
    if (worth_planning(p)) plan_again(p);
    if (p->plan.next >= p->plan.n) return 0;
    law_of(p, p->plan.next, law);
    if (p->again_s > 0.0) seconds = fmin(seconds, p->again_s);
    if (law->time <= seconds * (1.0 + 1e-9)) {
        remember_law(p, p->plan.next, law, true);
        hand_out(p);
    } else {
        split(p, law, seconds);
    }
    p->again_s = fmax(0.0, p->again_s - law->time);
    p->stats.laws++;
    return 1;
}

void jerk_watch(jerk_planner *p, const uint64_t *word) { p->gone = word; }

double jerk_advance(jerk_planner *p, double seconds) {
    double t = 0.0;
    while (seconds - t > LEAST_TIME && p->plan.next < p->plan.n) {
        jerk_law law;
        law_of(p, p->plan.next, &law);
        if (law.time > seconds - t) {
            t += hand_out_again(p, seconds - t);
            continue;
        }
        remember_law(p, p->plan.next, &law, true);
        hand_out(p);
        t += law.time;
    }
    return t;
}

int64_t jerk_take(jerk_planner *p, jerk_law *laws, int64_t max, double seconds) {
    int64_t n = 0;
    for (double t = 0.0; n < max && seconds - t > LEAST_TIME && jerk_next_within(p, &laws[n], seconds - t); n++) t += laws[n].time;
    return n;
}

/* The whole look-ahead is known, or all there will ever be. */
int jerk_ready(const jerk_planner *p) {
    double knots = 0.0;
    int blocks = 0;
    for (uint64_t i = p->head; i != p->tail; i++) {
        const jerk_interval *q = ring_at(p, i);
        knots += knots_at(p, i);
        blocks += (int)q->blocks;
        if ((q->flags & JERK_STAND) || knots >= p->cfg.window_knots || blocks >= p->cfg.window_blocks) return 1;
    }
    return p->finished || jerk_room(p) == 0;
}

int64_t jerk_tail(const jerk_planner *p, jerk_law *laws, int64_t max) {
    int64_t n = 0;
    for (int k = p->plan.next; k < p->plan.n && n < max; k++) law_of(p, k, &laws[n++]);
    return n;
}

uint64_t jerk_edition(const jerk_planner *p) { return p->plan.edition; }

int64_t jerk_used(const jerk_planner *p) { return p->plan.next; }

void jerk_tail_driven(jerk_planner *p) {
    while (p->plan.next < p->plan.n) hand_out(p);
}

void jerk_get_stats(const jerk_planner *p, jerk_stats *out) { *out = p->stats; }
