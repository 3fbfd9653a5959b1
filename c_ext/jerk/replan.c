/* Planning the window: guess, solve, check, and only then take the place of the
 * stored tail. */
#include <math.h>
#include <string.h>
#include "jerk/state.h"

#define WINDOW_ITERATIONS                                                      \
    50 /* at the most: a window that fails costs more than that */
#define SLOWER                                                                 \
    1.002 /* a plan this much slower than the tail over the tail's way is not  \
             taken */
#define CREEPS                                                                 \
    0.1 /* share of the guess below which an unfinished solution creeps */
#define TIGHTENINGS 4
#define SLOWER_BY                                                              \
    0.99 /* of the cap on x where the feed was exceeded inside an interval */
#define TIGHTEN_UP_TO 1.6
#define FINER_FROM                                                             \
    1.08 /* ratio inside an interval from which it is made finer ... */
#define FINER_BELOW                                                            \
    0.85 /* ... as where so little of the limit is planned with */
#define FINER_STEPS 0.55
#define FINER_TRIES 4
#define FINER_SHORTER 2 /* of shorter windows */
#define FINER_LOSS                                                             \
    2e-3 /* of the window's time, that lowered limits cost: beyond it          \
            intervals are made finer ... */
#define FINER_TIGHT 0.98 /* ... that come below this share of the limit, ...   \
                          */
#define FINER_BULGE                                                            \
    0.02 /* ... for as much more inside, of second order in the step, ... */
#define FINER_LEAST 0.4  /* ... by so much at once */
#define FINER_ENOUGH 0.8 /* less gains nothing */
#define TIGHTEST 0.3
#define LEAST_X 1e-14
#define PAUSE 0.1 /* gap at which the solver looks inside the intervals */
#define PAUSE_AGAIN 0.01
#define NEARLY 1.05    /* ratio of a solution that the solver goes on from */
#define MISSED_SO 0.03 /* rows that were lowered meanwhile, over START_SLACK   \
                        */
#define FORESEEN 0.9   /* of the limit: jerks below it do not matter there */
#define FORESEEN_FROM 1.003
#define AIM 1.003 /* ratio that a tightened interval should come to */
#define FALLBACK_SCALE 0.7
#define FALLBACK_LENGTHS 6
#define SHRINK 0.25 /* of the guess, at the second try from rest */
#define FALLBACK_TRIES 40
#define SHORTER 0.5
#define SHORTER_TRIES 4
#define LONGER 2.0
#define REACH_FORGOTTEN 1e4 /* mm */
#define TAIL_MORE                                                              \
    1.15 /* a window must be so much longer than what is left of the plan */
#define TAIL_AND 1.003     /* of x, where the feeds before allow it */
#define ABOVE_BEFORE 1.001 /* of x: room for a solver that starts at the cap   \
                            */
#define TAIL_ONLY 1.0005   /* of x, elsewhere */
#define LASTS                                                                  \
    2.5 /* a plan is not made anew while so many stopping ways are left of it  \
         */
#define JUST_COVERS                                                            \
    2.6 /* stopping ways: a shorter plan begins to brake for its end soon, so  \
           ... */
#define JUST_REFRESH 0.1 /* ... it is made anew after so much of it */

/* Way from the largest speed of the plan to rest with the smallest limits. */
static double stopping_way(const jerk_planner *planner,
                           const struct grid *grid) {
    double x = 0.0, a = 1e30, j = 1e30;
    for (int k = 0; k < grid->n; k++) {
        x = fmax(x, planner->prob.x[k]);
    }
    for (int i = 0; i < planner->cfg.axes; i++) {
        a = fmin(a, planner->cfg.a_max[i]);
        j = fmin(j, planner->cfg.j_max[i]);
    }
    double v = planner->scale * sqrt(x), ramp = fmin(a, sqrt(v * j));
    return 0.5 * v * (v / ramp + ramp / j);
}

/* What solutions on the way have taken off limits is given back, as far as the
 * plan did not need it. */
static void relax(const struct grid *grid, const struct problem *problem) {
    for (int k = problem->first; k < grid->n - 1; k++) {
        const struct segment *segment = &grid->seg[k];
        if (segment->tight != &segment->own && *segment->tight < 1.0) {
            *segment->tight =
                fmax(*segment->tight, fmin(1.0, AIM / segment->bulge));
        }
    }
}

/* The checked problem becomes the plan, unless what it begins with is no longer
 * what is driven. */
bool plan_accept(jerk_planner *p, const struct grid *g, bool final) {
    if (p->gone && __atomic_load_n(p->gone, __ATOMIC_ACQUIRE) & 1) {
        p->changed = true;
        return false;
    }
    plan *pl = &p->plan;
    struct problem *b = &p->prob;
    size_t bytes = sizeof(double) * (size_t)(g->n + 1);
    memcpy(pl->x, b->x, bytes);
    memcpy(pl->u, b->u, bytes);
    for (int i = 0; i < 2; i++) {
        memcpy(pl->c[i], b->c[i], bytes);
    }
    uint64_t end = p->head;
    for (int k = 0; k < g->n; k++) {
        const struct segment *s = &g->seg[k];
        pl->h[k] = s->h;
        pl->tag[k] = s->q->tag;
        pl->offset[k] = s->q->offset;
        pl->last[k] = (uint8_t)(s->last + 2 * (s->last && s->q->blocks > 0));
        pl->jerk[k] = pl->time[k] = 0.0;
        end += s->last;
    }
    relax(g, b);
    pl->n = g->n;
    pl->next = pl->since = 0;
    pl->edition++;
    pl->rest_start = g->rest_start;
    pl->final = final;
    pl->stands = g->stands;
    pl->end = end;
    pl->length = g->from_start[g->n];
    double way = stopping_way(p, g);
    pl->lasts = LASTS * way;
    pl->refresh = pl->length < JUST_COVERS * way
                      ? fmin(p->cfg.refresh, JUST_REFRESH)
                      : p->cfg.refresh;
    return true;
}

/* Time over the first `length` mm, to compare plans; rest intervals are exact,
 * others by the mean speed. */
static double time_over(const double *h,
                        const double *x,
                        int from,
                        int count,
                        double length) {
    double t = 0.0, at = 0.0;
    for (int k = from; k < count && at + h[k] <= length + 1e-9; k++) {
        double v = sqrt(x[k]) + sqrt(x[k + 1]);
        t += (x[k] > 0.0 && x[k + 1] > 0.0 ? 2.0 : 3.0) * h[k] / v;
        at += h[k];
    }
    return t;
}

static bool slower_than_tail(const jerk_planner *planner,
                             const struct grid *grid) {
    const plan *pl = &planner->plan;
    double length = 0.0;
    for (int k = pl->next; k < pl->n; k++) {
        length += pl->h[k];
    }
    if (length <= 0.0 || grid->from_start[grid->n] < length - 1e-9) {
        return false;
    }
    double t_new = 0.0, at = 0.0;
    for (int k = 0; k < grid->n && at < length - 1e-9; k++) {
        double h = grid->seg[k].h,
               v = sqrt(planner->prob.x[k]) + sqrt(planner->prob.x[k + 1]),
               part = fmin(1.0, (length - at) / h);
        t_new +=
            part
            * (planner->prob.x[k] > 0.0 && planner->prob.x[k + 1] > 0.0 ? 2.0
                                                                        : 3.0)
            * h / v;
        at += h;
    }
    return t_new > SLOWER * time_over(pl->h, pl->x, pl->next, pl->n, 1e30);
}

/* A solver that was stopped on its way may leave a plan that is legal and
 * creeps. */
static bool creeps(const jerk_planner *planner, const struct grid *grid) {
    for (int k = 1; k < grid->n; k++) {
        if (planner->prob.x[k] < CREEPS * planner->prob.guess[k]) {
            return true;
        }
    }
    return false;
}

static double check(jerk_planner *planner, struct grid *grid) {
    double worst = plan_check(planner, grid, &planner->prob);
    if (worst <= CHECK_SLACK) {
        planner->stats.worst_ratio = fmax(planner->stats.worst_ratio, worst);
    }
    return worst;
}

/* From rest to rest any profile, slowed down, becomes legal: accelerations fall
 * with the square of the speed. */
static bool slow_bump(jerk_planner *planner, struct grid *grid) {
    struct problem *problem = &planner->prob;
    problem_from_grid(planner, grid, 0.0, 0.0);
    if (!guess_bump(planner, grid)) {
        return false;
    }
    for (int i = 0; i < FALLBACK_TRIES; i++) {
        if (check(planner, grid) <= CHECK_SLACK) {
            return true;
        }
        for (int k = 0; k <= grid->n; k++) {
            problem->x[k] *= FALLBACK_SCALE;
            problem->u[k] *= FALLBACK_SCALE;
            problem->c[0][k] *= FALLBACK_SCALE;
            problem->c[1][k] *= FALLBACK_SCALE;
        }
    }
    return false;
}

/* The solver has failed at a standstill: a slow move, over less and less of the
 * window. */
static bool slow_fallback(jerk_planner *planner, struct grid *grid) {
    double length = grid->from_start[grid->n];
    bool stands = grid->stands;
    for (int i = 0; i < FALLBACK_LENGTHS; i++) {
        if (grid_to(planner, grid, length) && grid->n >= 3
            && slow_bump(planner, grid)) {
            grid->stands = stands && i == 0;
            return true;
        }
        length *= 0.25;
    }
    return false;
}

/* The speed peaks inside an interval above the feed that it was planned with:
 * with so much less it will peak at the feed. */
static void plan_slower(struct segment *segment) {
    double over = segment->fast * FEED_SLACK / CHECK_SLACK,
           by = fmin(SLOWER_BY, 1.0 / (over * over));
    segment->soft *= by;
    segment->slower *= by;
}

/* Rows at its ends say too little of what the path does inside segment s: the
 * pushed interval that it is of takes finer steps from now on. */
static bool finer_steps(jerk_planner *planner, const struct segment *segment) {
    struct steps *of = &planner->steps[segment->at & planner->mask];
    double to = fmax(of->shortest, FINER_STEPS * segment->h);
    if (segment->tight == &segment->own) {
        return false; /* a line is resolved as it is */
    }
    if (!(segment->excess > FINER_FROM
          || (segment->excess > 0.0 && *segment->tight < FINER_BELOW))
        || to > FINER_STEPS * fmin(of->turn, 2.0 * segment->h)) {
        return false;
    }
    of->turn = to;
    *segment->tight = 1.0;
    return true;
}

/* From a solution that is all but legal the solver goes on, with less of the
 * jerk where it says so. */
static bool tighten_present(jerk_planner *planner, struct grid *grid) {
    struct problem *problem = &planner->prob;
    for (int k = 0; k < grid->n; k++) {
        struct segment *segment = &grid->seg[k];
        double share = segment->jump * *segment->tight;
        if (share < segment->share && k >= problem->first && k < grid->n - 1) {
            tighten_rows(problem, k, share / segment->share);
        }
        segment->share = share;
    }
    problem->paused = true;
    problem->missed = fmax(problem->missed, MISSED_SO);
    problem->iterations = 0;
    return true;
}

/* Between its ends an interval may exceed a limit by a few percent: less of the
 * jerk is planned with there, from now on. */
static bool tighten(jerk_planner *planner, struct grid *grid, double worst) {
    if (!isfinite(worst)) {
        return false;
    }
    for (int k = 0; k < grid->n && planner->finer_tries > 1; k++) {
        planner->finer = finer_steps(planner, &grid->seg[k]) || planner->finer;
    }
    if (planner->finer || !(worst < TIGHTEN_UP_TO)) {
        return false;
    }
    for (int k = 0; k < grid->n; k++) {
        struct segment *segment = &grid->seg[k];
        if (segment->fast > 0.0) {
            plan_slower(segment);
        }
        if (segment->leave > 0.0) {
            *segment->tight =
                fmin(*segment->tight,
                     fmax(TIGHTEST, (1.0 - segment->leave) / segment->jump));
        }
        segment->leave = 0.0;
        if (segment->excess <= 0.0) {
            continue;
        }
        double share = segment->share / segment->jump * AIM / segment->excess;
        *segment->tight = fmin(*segment->tight, fmax(TIGHTEST, share));
    }
    bool slower = false;
    for (int k = 0; k < grid->n; k++) {
        slower = slower || grid->seg[k].fast > 0.0;
    }
    if (planner->prob.solved && worst < NEARLY && !slower) {
        return tighten_present(planner, grid);
    }
    for (int k = 0; k < grid->n; k++) {
        grid->seg[k].share = grid->seg[k].jump * *grid->seg[k].tight;
    }
    memcpy(planner->scratch,
           planner->prob.x,
           sizeof(double) * (size_t)(grid->n + 1));
    problem_from_grid(planner, grid, planner->x, planner->u);
    return guess_from(planner, grid, planner->scratch);
}

/* The share of the limit that interval k can be planned with, by what the
 * iterate does inside it. */
static double foreseen(const jerk_planner *planner,
                       const struct problem *problem,
                       const struct segment *segment,
                       int k) {
    double more, f2 = planner->scale * planner->scale,
                 c[2] = {problem->c[0][k] * f2, problem->c[1][k] * f2};
    double most = bend_inside(planner,
                              segment,
                              problem->x[k] * f2,
                              problem->u[k] * f2,
                              c,
                              &more),
           tight = *segment->tight;
    if (!(most > FORESEEN * tight) || !isfinite(most)) {
        return tight;
    }
    double then = more * JERK_USABLE * tight;
    return then > FORESEEN_FROM ? fmax(TIGHTEST, tight / then) : tight;
}

/* Limits that are lowered cost a third of what is taken, where the jerk binds.
 */
static double loss_of_time(const struct grid *grid,
                           const struct problem *problem,
                           const double *share) {
    double lost = 0.0, time = 0.0;
    for (int k = problem->first; k < grid->n - 1; k++) {
        double t = grid->seg[k].h / sqrt(fmax(problem->x[k], LEAST_X));
        time += t;
        if (grid->seg[k].tight != &grid->seg[k].own) {
            lost += t * (1.0 - share[k]) / 3.0;
        }
    }
    return lost / time;
}

/* Where limits would have to be lowered much, steps are made finer: what is
 * more inside falls with their square. */
static bool made_finer(jerk_planner *planner,
                       const struct grid *grid,
                       const struct problem *problem,
                       const double *share) {
    if (planner->finer_tries < 2
        || !(loss_of_time(grid, problem, share) > FINER_LOSS)) {
        return false;
    }
    bool any = false;
    for (int k = problem->first; k < grid->n - 1; k++) {
        const struct segment *segment = &grid->seg[k];
        struct steps *of = &planner->steps[segment->at & planner->mask];
        if (segment->tight == &segment->own || share[k] > FINER_TIGHT) {
            continue;
        }
        double to =
            fmax(of->shortest,
                 segment->h
                     * fmax(FINER_LEAST,
                            sqrt(FINER_BULGE / (1.0 / share[k] - 1.0))));
        if (to > FINER_ENOUGH * fmin(of->turn, 2.0 * segment->h)) {
            continue;
        }
        of->turn = to;
        *segment->tight = 1.0;
        any = true;
    }
    return any;
}

/* On the way to the solution: where the path bends more inside an interval than
 * at its ends, the limits there are lowered, or steps are made finer (false:
 * the grid is another one). */
static bool foresee(jerk_planner *planner, struct grid *grid) {
    struct problem *problem = &planner->prob;
    double *share = planner->scratch;
    for (int k = problem->first; k < grid->n - 1; k++) {
        share[k] = foreseen(planner, problem, &grid->seg[k], k);
    }
    planner->finer = made_finer(planner, grid, problem, share);
    if (planner->finer) {
        return false;
    }
    for (int k = problem->first; k < grid->n - 1; k++) {
        struct segment *segment = &grid->seg[k];
        if (share[k] >= *segment->tight) {
            continue;
        }
        tighten_rows(problem, k, share[k] / *segment->tight);
        problem->missed = fmax(problem->missed, MISSED_SO);
        *segment->tight = share[k];
        segment->share = segment->jump * share[k];
    }
    return true;
}

static bool solve_from_guess(jerk_planner *planner,
                             struct grid *grid,
                             int iterations) {
    struct problem *problem = &planner->prob;
    planner->stats.solves++;
    problem->pause = problem->paused ? 0.0 : PAUSE;
    bool solved = ipm_solve(problem, iterations), goes_on = true;
    for (int i = 0; problem->paused && goes_on; i++) {
        goes_on = foresee(planner, grid);
        if (i == 0) {
            problem->pause = PAUSE_AGAIN;
        }
        if (goes_on) {
            solved = ipm_solve(problem, iterations);
        }
    }
    problem->pause = 0.0;
    problem->solved = solved;
    planner->stats.iterations += (uint64_t)planner->prob.iterations;
    planner->stats.failed += !solved;
    return solved;
}

/* Solve over the grid; true if a legal plan stands in the problem. */
bool solve_window(jerk_planner *p, struct grid *g, bool warm, double shrink) {
    p->finer = false;
    problem_from_grid(p, g, p->x, p->u);
    return guess_window(p, g, warm, shrink)
           && solve_guess(p, g, TIGHTENINGS, WINDOW_ITERATIONS);
}

bool solve_guess(jerk_planner *p, struct grid *g, int tries, int iterations) {
    for (int i = 0; i < tries; i++) {
        bool solved = solve_from_guess(p, g, iterations);
        if (p->finer) {
            return false;
        }
        double worst = !solved && creeps(p, g) ? INFINITY : check(p, g);
        if (worst <= CHECK_SLACK) {
            return true;
        }
        p->stats.refused += solved;
        if (!tighten(p, g, worst)) {
            return false;
        }
    }
    return false;
}

/* Cap on x (scaled) by the feeds that the present plan was made under. */
static double cap_before(const jerk_planner *planner,
                         const jerk_interval *interval) {
    double feed = fmin(1e15,
                       asked_under(&planner->was, interval) * VEL_USABLE
                           / planner->scale);
    return feed * feed;
}

/* Above the caps (an override was reduced, a hold was released): what the
 * stored tail drives stays allowed over `reach` mm. A little more of it where
 * the feed was higher, next to nothing else: plan upon plan it would add up. */
static void allow_tail(jerk_planner *planner, struct grid *grid, double reach) {
    const plan *pl = &planner->plan;
    double at = 0.0;
    int i = pl->next;
    for (int k = 0; k < grid->n && i < pl->n && grid->from_start[k] < reach;
         k++) {
        struct segment *segment = &grid->seg[k];
        double most = 0.0, end = grid->from_start[k + 1];
        while (i < pl->n && at < end - 1e-9) { /* what begins where the segment
                                                  ends is not of it */
            most = fmax(most, fmax(pl->x[i], pl->x[i + 1]));
            if (at + pl->h[i] > end + 1e-9) {
                break;
            }
            at += pl->h[i++];
        }
        double allowed =
            fmin(TAIL_AND * most,
                 fmax(cap_before(planner, segment->q), TAIL_ONLY * most));
        if (allowed > segment->soft && segment->soft < segment->cap) {
            segment->soft = fmin(segment->cap, allowed);
        }
    }
}

/* On the way down over `reach` mm: what the stored tail drives, and the feeds
 * that the plan was made under, up to x = `top`. Never the speed of here behind
 * the place where a lower feed begins. */
void allow_present(jerk_planner *planner,
                   struct grid *grid,
                   double reach,
                   double top) {
    for (int k = 0; k < grid->n && grid->from_start[k] < reach; k++) {
        struct segment *segment = &grid->seg[k];
        segment->soft = fmin(
            segment->cap,
            fmax(segment->soft,
                 fmin(top, ABOVE_BEFORE * cap_before(planner, segment->q))));
    }
    allow_tail(planner, grid, reach);
}

static bool above_soft(const jerk_planner *planner, const struct grid *grid) {
    return !grid->rest_start && grid->n > 1
           && planner->x > 1.003 * fmin(grid->seg[0].soft, grid->seg[1].soft);
}

/* The window up to a reach, with finer steps where they turn out to be too
 * long. */
static bool solve_finer(jerk_planner *planner,
                        struct grid *grid,
                        double reach,
                        int tries) {
    bool legal = false;
    for (planner->finer_tries = tries; planner->finer_tries > 0;
         planner->finer_tries--) {
        legal = solve_window(planner, grid, true, 1.0);
        if (legal || !planner->finer) {
            break;
        }
        grid_window(planner, grid, reach);
    }
    planner->finer_tries = 0;
    return legal;
}

/* Windows over many slow knots may fail as a whole: shorter ones do not. */
static bool solve_shorter(jerk_planner *planner,
                          struct grid *grid,
                          double least) {
    double reach = grid->from_start[grid->n];
    for (int i = 0; i < SHORTER_TRIES; i++) {
        reach *= SHORTER;
        if (reach <= least) {
            return false;
        }
        grid_window(planner, grid, reach);
        if (grid->n < (grid->rest_start ? 3 : 2)) {
            return false;
        }
        planner->reach = reach;
        if (solve_finer(planner, grid, reach, FINER_SHORTER)) {
            return true;
        }
    }
    return false;
}

/* Give back what a failure has taken from the windows. */
static void reach_further(jerk_planner *planner, const struct grid *grid) {
    if (planner->reach < 1e30) {
        planner->reach =
            fmax(planner->reach, grid->from_start[grid->n]) * LONGER;
    }
    if (planner->reach > REACH_FORGOTTEN) {
        planner->reach = 1e30;
    }
}

/* A new plan over the window, if it is legal and not slower than the stored
 * tail; else the tail stays. False: it is not what is wanted. */
bool plan_window(jerk_planner *p) {
    struct grid *g = &p->grid;
    if (plan_straight(p)) {
        p->changed = false;
        return true;
    }
    double left = p->plan.next < p->plan.n ? fmax(0.0, p->plan.length) : 0.0;
    double ahead = fmax(p->reach, TAIL_MORE * left);
    grid_window(p, g, ahead);
    if (g->n < (g->rest_start ? 3 : 2)) {
        return true;
    }
    bool changed = p->changed, above = above_soft(p, g);
    p->changed = false;
    p->wait = 1 + g->n / 10;
    if (!above
        && (solve_finer(p, g, ahead, FINER_TRIES)
            || solve_shorter(p, g, TAIL_MORE * left))) {
        if (!changed && !g->rest_start && slower_than_tail(p, g)) {
            p->stats.slower++;
            p->plan.final =
                p->plan.final || p->prob.solved; /* the solver does no better */
        } else if (plan_accept(p, g, p->prob.solved)) {
            p->was = speeds_now(p);
        }
        reach_further(p, g);
        return true;
    }
    if (g->rest_start) {
        grid_window(p, g, 1e30);
        if ((solve_window(p, g, false, SHRINK) || slow_fallback(p, g))
            && plan_accept(p, g, false)) {
            p->was = speeds_now(p);
        }
        return true;
    }
    if (changed && plan_ramp(p)) {
        return true;
    }
    bool met = !changed || plan_stop(p); /* the fastest way down */
    if (!changed && !above) {
        return true;
    }
    grid_window(p, g, 1e30);
    allow_tail(p, g, INFINITY);
    return (solve_window(p, g, true, 1.0) && plan_accept(p, g, p->prob.solved))
           || met;
}
