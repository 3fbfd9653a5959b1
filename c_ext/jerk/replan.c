/* Planning the window: guess, solve, check, and only then take the place of the stored tail. */
#include <math.h>
#include <string.h>
#include "jerk/state.h"

#define WINDOW_ITERATIONS 50 /* at the most: a window that fails costs more than that */
#define SLOWER 1.002     /* a plan this much slower than the tail over the tail's way is not taken */
#define CREEPS 0.1       /* share of the guess below which an unfinished solution creeps */
#define TIGHTENINGS 4
#define SLOWER_BY 0.99  /* of the cap on x where the feed was exceeded inside an interval */
#define TIGHTEN_UP_TO 1.6
#define FINER_FROM 1.08  /* ratio inside an interval from which it is made finer ... */
#define FINER_BELOW 0.85 /* ... as where so little of the limit is planned with */
#define FINER_STEPS 0.55
#define FINER_TRIES 4
#define FINER_SHORTER 2  /* of shorter windows */
#define FINER_LOSS 2e-3  /* of the window's time, that lowered limits cost: beyond it intervals are made finer ... */
#define FINER_TIGHT 0.98 /* ... that come below this share of the limit, ... */
#define FINER_BULGE 0.02 /* ... for as much more inside, of second order in the step, ... */
#define FINER_LEAST 0.4  /* ... by so much at once */
#define FINER_ENOUGH 0.8 /* less gains nothing */
#define TIGHTEST 0.3
#define LEAST_X 1e-14
#define PAUSE 0.1        /* gap at which the solver looks inside the intervals */
#define PAUSE_AGAIN 0.01
#define NEARLY 1.05     /* ratio of a solution that the solver goes on from */
#define MISSED_SO 0.03   /* rows that were lowered meanwhile, over START_SLACK */
#define FORESEEN 0.9     /* of the limit: jerks below it do not matter there */
#define FORESEEN_FROM 1.003
#define AIM 1.003        /* ratio that a tightened interval should come to */
#define FALLBACK_SCALE 0.7
#define FALLBACK_LENGTHS 6
#define SHRINK 0.25      /* of the guess, at the second try from rest */
#define FALLBACK_TRIES 40
#define SHORTER 0.5
#define SHORTER_TRIES 4
#define LONGER 2.0
#define REACH_FORGOTTEN 1e4 /* mm */
#define TAIL_MORE 1.15   /* a window must be so much longer than what is left of the plan */
#define TAIL_AND 1.003   /* of x, where the feeds before allow it */
#define ABOVE_BEFORE 1.001 /* of x: room for a solver that starts at the cap */
#define TAIL_ONLY 1.0005 /* of x, elsewhere */
#define LASTS 2.5         /* a plan is not made anew while so many stopping ways are left of it */
#define JUST_COVERS 2.6   /* stopping ways: a shorter plan begins to brake for its end soon, so ... */
#define JUST_REFRESH 0.1  /* ... it is made anew after so much of it */

/* Way from the largest speed of the plan to rest with the smallest limits. */
static double stopping_way(const jerk_planner *p, const grid *g) {
    double x = 0.0, a = 1e30, j = 1e30;
    for (int k = 0; k < g->n; k++) x = fmax(x, p->prob.x[k]);
    for (int i = 0; i < p->cfg.axes; i++) {
        a = fmin(a, p->cfg.a_max[i]);
        j = fmin(j, p->cfg.j_max[i]);
    }
    double v = p->scale * sqrt(x), ramp = fmin(a, sqrt(v * j));
    return 0.5 * v * (v / ramp + ramp / j);
}

/* What solutions on the way have taken off limits is given back, as far as the plan did not need it. */
static void relax(const grid *g, const problem *b) {
    for (int k = b->first; k < g->n - 1; k++) {
        const segment *s = &g->seg[k];
        if (s->tight != &s->own && *s->tight < 1.0) *s->tight = fmax(*s->tight, fmin(1.0, AIM / s->bulge));
    }
}

/* The checked problem becomes the plan, unless what it begins with is no longer what is driven. */
bool plan_accept(jerk_planner *p, const grid *g, bool final) {
    if (p->gone && __atomic_load_n(p->gone, __ATOMIC_ACQUIRE) & 1) {
        p->changed = true;
        return false;
    }
    plan *pl = &p->plan;
    problem *b = &p->prob;
    size_t bytes = sizeof(double) * (size_t)(g->n + 1);
    memcpy(pl->x, b->x, bytes);
    memcpy(pl->u, b->u, bytes);
    for (int i = 0; i < 2; i++) memcpy(pl->c[i], b->c[i], bytes);
    uint64_t end = p->head;
    for (int k = 0; k < g->n; k++) {
        const segment *s = &g->seg[k];
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
    pl->refresh = pl->length < JUST_COVERS * way ? fmin(p->cfg.refresh, JUST_REFRESH) : p->cfg.refresh;
    return true;
}

/* Time over the first `length` mm, to compare plans; rest intervals are exact, others by the mean speed. */
static double time_over(const double *h, const double *x, int from, int n, double length) {
    double t = 0.0, at = 0.0;
    for (int k = from; k < n && at + h[k] <= length + 1e-9; k++) {
        double v = sqrt(x[k]) + sqrt(x[k + 1]);
        t += (x[k] > 0.0 && x[k + 1] > 0.0 ? 2.0 : 3.0) * h[k] / v;
        at += h[k];
    }
    return t;
}

static bool slower_than_tail(const jerk_planner *p, const grid *g) {
    const plan *pl = &p->plan;
    double length = 0.0;
    for (int k = pl->next; k < pl->n; k++) length += pl->h[k];
    if (length <= 0.0 || g->from_start[g->n] < length - 1e-9) return false;
    double t_new = 0.0, at = 0.0;
    for (int k = 0; k < g->n && at < length - 1e-9; k++) {
        double h = g->seg[k].h, v = sqrt(p->prob.x[k]) + sqrt(p->prob.x[k + 1]), part = fmin(1.0, (length - at) / h);
        t_new += part * (p->prob.x[k] > 0.0 && p->prob.x[k + 1] > 0.0 ? 2.0 : 3.0) * h / v;
        at += h;
    }
    return t_new > SLOWER * time_over(pl->h, pl->x, pl->next, pl->n, 1e30);
}

/* A solver that was stopped on its way may leave a plan that is legal and creeps. */
static bool creeps(const jerk_planner *p, const grid *g) {
    for (int k = 1; k < g->n; k++)
        if (p->prob.x[k] < CREEPS * p->prob.guess[k]) return true;
    return false;
}

static double check(jerk_planner *p, grid *g) {
    double worst = plan_check(p, g, &p->prob);
    if (worst <= CHECK_SLACK) p->stats.worst_ratio = fmax(p->stats.worst_ratio, worst);
    return worst;
}

/* From rest to rest any profile, slowed down, becomes legal: accelerations fall with the square of the speed. */
static bool slow_bump(jerk_planner *p, grid *g) {
    problem *b = &p->prob;
    problem_from_grid(p, g, 0.0, 0.0);
    if (!guess_bump(p, g)) return false;
    for (int i = 0; i < FALLBACK_TRIES; i++) {
        if (check(p, g) <= CHECK_SLACK) return true;
        for (int k = 0; k <= g->n; k++) {
            b->x[k] *= FALLBACK_SCALE;
            b->u[k] *= FALLBACK_SCALE;
            b->c[0][k] *= FALLBACK_SCALE;
            b->c[1][k] *= FALLBACK_SCALE;
        }
    }
    return false;
}

/* The solver has failed at a standstill: a slow move, over less and less of the window. */
static bool slow_fallback(jerk_planner *p, grid *g) {
    double length = g->from_start[g->n];
    bool stands = g->stands;
    for (int i = 0; i < FALLBACK_LENGTHS; i++) {
        if (grid_to(p, g, length) && g->n >= 3 && slow_bump(p, g)) {
            g->stands = stands && i == 0;
            return true;
        }
        length *= 0.25;
    }
    return false;
}

/* The speed peaks inside an interval above the feed that it was planned with: with so much less it will peak at the feed. */
static void plan_slower(segment *s) {
    double over = s->fast * FEED_SLACK / CHECK_SLACK, by = fmin(SLOWER_BY, 1.0 / (over * over));
    s->soft *= by;
    s->slower *= by;
}

/* Rows at its ends say too little of what the path does inside segment s: the pushed interval that it is of takes finer steps from now on. */
static bool finer_steps(jerk_planner *p, const segment *s) {
    steps *of = &p->steps[s->at & p->mask];
    double to = fmax(of->shortest, FINER_STEPS * s->h);
    if (s->tight == &s->own) return false; /* a line is resolved as it is */
    if (!(s->excess > FINER_FROM || (s->excess > 0.0 && *s->tight < FINER_BELOW)) || to > FINER_STEPS * fmin(of->turn, 2.0 * s->h)) return false;
    of->turn = to;
    *s->tight = 1.0;
    return true;
}

/* From a solution that is all but legal the solver goes on, with less of the jerk where it says so. */
static bool tighten_present(jerk_planner *p, grid *g) {
    problem *b = &p->prob;
    for (int k = 0; k < g->n; k++) {
        segment *s = &g->seg[k];
        double share = s->jump * *s->tight;
        if (share < s->share && k >= b->first && k < g->n - 1) tighten_rows(b, k, share / s->share);
        s->share = share;
    }
    b->paused = true;
    b->missed = fmax(b->missed, MISSED_SO);
    b->iterations = 0;
    return true;
}

/* Between its ends an interval may exceed a limit by a few percent: less of the jerk is planned with there, from now on. */
static bool tighten(jerk_planner *p, grid *g, double worst) {
    if (!isfinite(worst)) return false;
    for (int k = 0; k < g->n && p->finer_tries > 1; k++) p->finer = finer_steps(p, &g->seg[k]) || p->finer;
    if (p->finer || !(worst < TIGHTEN_UP_TO)) return false;
    for (int k = 0; k < g->n; k++) {
        segment *s = &g->seg[k];
        if (s->fast > 0.0) plan_slower(s);
        if (s->leave > 0.0) *s->tight = fmin(*s->tight, fmax(TIGHTEST, (1.0 - s->leave) / s->jump));
        s->leave = 0.0;
        if (s->excess <= 0.0) continue;
        double share = s->share / s->jump * AIM / s->excess;
        *s->tight = fmin(*s->tight, fmax(TIGHTEST, share));
    }
    bool slower = false;
    for (int k = 0; k < g->n; k++) slower = slower || g->seg[k].fast > 0.0;
    if (p->prob.solved && worst < NEARLY && !slower) return tighten_present(p, g);
    for (int k = 0; k < g->n; k++) g->seg[k].share = g->seg[k].jump * *g->seg[k].tight;
    memcpy(p->scratch, p->prob.x, sizeof(double) * (size_t)(g->n + 1));
    problem_from_grid(p, g, p->x, p->u);
    return guess_from(p, g, p->scratch);
}

/* The share of the limit that interval k can be planned with, by what the iterate does inside it. */
static double foreseen(const jerk_planner *p, const problem *b, const segment *s, int k) {
    double more, f2 = p->scale * p->scale, c[2] = {b->c[0][k] * f2, b->c[1][k] * f2};
    double most = bend_inside(p, s, b->x[k] * f2, b->u[k] * f2, c, &more), tight = *s->tight;
    if (!(most > FORESEEN * tight) || !isfinite(most)) return tight;
    double then = more * JERK_USABLE * tight;
    return then > FORESEEN_FROM ? fmax(TIGHTEST, tight / then) : tight;
}

/* Limits that are lowered cost a third of what is taken, where the jerk binds. */
static double loss_of_time(const grid *g, const problem *b, const double *share) {
    double lost = 0.0, time = 0.0;
    for (int k = b->first; k < g->n - 1; k++) {
        double t = g->seg[k].h / sqrt(fmax(b->x[k], LEAST_X));
        time += t;
        if (g->seg[k].tight != &g->seg[k].own) lost += t * (1.0 - share[k]) / 3.0;
    }
    return lost / time;
}

/* Where limits would have to be lowered much, steps are made finer: what is more inside falls with their square. */
static bool made_finer(jerk_planner *p, const grid *g, const problem *b, const double *share) {
    if (p->finer_tries < 2 || !(loss_of_time(g, b, share) > FINER_LOSS)) return false;
    bool any = false;
    for (int k = b->first; k < g->n - 1; k++) {
        const segment *s = &g->seg[k];
        steps *of = &p->steps[s->at & p->mask];
        if (s->tight == &s->own || share[k] > FINER_TIGHT) continue;
        double to = fmax(of->shortest, s->h * fmax(FINER_LEAST, sqrt(FINER_BULGE / (1.0 / share[k] - 1.0))));
        if (to > FINER_ENOUGH * fmin(of->turn, 2.0 * s->h)) continue;
        of->turn = to;
        *s->tight = 1.0;
        any = true;
    }
    return any;
}

/* On the way to the solution: where the path bends more inside an interval than at its ends, the limits there are lowered, or steps
 * are made finer (false: the grid is another one). */
static bool foresee(jerk_planner *p, grid *g) {
    problem *b = &p->prob;
    double *share = p->scratch;
    for (int k = b->first; k < g->n - 1; k++) share[k] = foreseen(p, b, &g->seg[k], k);
    p->finer = made_finer(p, g, b, share);
    if (p->finer) return false;
    for (int k = b->first; k < g->n - 1; k++) {
        segment *s = &g->seg[k];
        if (share[k] >= *s->tight) continue;
        tighten_rows(b, k, share[k] / *s->tight);
        b->missed = fmax(b->missed, MISSED_SO);
        *s->tight = share[k];
        s->share = s->jump * share[k];
    }
    return true;
}

static bool solve_from_guess(jerk_planner *p, grid *g, int iterations) {
    problem *b = &p->prob;
    p->stats.solves++;
    b->pause = b->paused ? 0.0 : PAUSE;
    bool solved = ipm_solve(b, iterations), goes_on = true;
    for (int i = 0; b->paused && goes_on; i++) {
        goes_on = foresee(p, g);
        if (i == 0) b->pause = PAUSE_AGAIN;
        if (goes_on) solved = ipm_solve(b, iterations);
    }
    b->pause = 0.0;
    b->solved = solved;
    p->stats.iterations += (uint64_t)p->prob.iterations;
    p->stats.failed += !solved;
    return solved;
}

/* Solve over the grid; true if a legal plan stands in the problem. */
bool solve_window(jerk_planner *p, grid *g, bool warm, double shrink) {
    p->finer = false;
    problem_from_grid(p, g, p->x, p->u);
    return guess_window(p, g, warm, shrink) && solve_guess(p, g, TIGHTENINGS, WINDOW_ITERATIONS);
}

bool solve_guess(jerk_planner *p, grid *g, int tries, int iterations) {
    for (int i = 0; i < tries; i++) {
        bool solved = solve_from_guess(p, g, iterations);
        if (p->finer) return false;
        double worst = !solved && creeps(p, g) ? INFINITY : check(p, g);
        if (worst <= CHECK_SLACK) return true;
        p->stats.refused += solved;
        if (!tighten(p, g, worst)) return false;
    }
    return false;
}

/* Cap on x (scaled) by the feeds that the present plan was made under. */
static double cap_before(const jerk_planner *p, const jerk_interval *q) {
    double feed = fmin(1e15, asked_under(&p->was, q) * VEL_USABLE / p->scale);
    return feed * feed;
}

/* Above the caps (an override was reduced, a hold was released): what the stored tail drives stays allowed over `reach` mm. A little more of it where
 * the feed was higher, next to nothing else: plan upon plan it would add up. */
static void allow_tail(jerk_planner *p, grid *g, double reach) {
    const plan *pl = &p->plan;
    double at = 0.0;
    int i = pl->next;
    for (int k = 0; k < g->n && i < pl->n && g->from_start[k] < reach; k++) {
        segment *s = &g->seg[k];
        double most = 0.0, end = g->from_start[k + 1];
        while (i < pl->n && at < end - 1e-9) { /* what begins where the segment ends is not of it */
            most = fmax(most, fmax(pl->x[i], pl->x[i + 1]));
            if (at + pl->h[i] > end + 1e-9) break;
            at += pl->h[i++];
        }
        double allowed = fmin(TAIL_AND * most, fmax(cap_before(p, s->q), TAIL_ONLY * most));
        if (allowed > s->soft && s->soft < s->cap) s->soft = fmin(s->cap, allowed);
    }
}

/* On the way down over `reach` mm: what the stored tail drives, and the feeds that the plan was made under, up to x = `top`. Never the
 * speed of here behind the place where a lower feed begins. */
void allow_present(jerk_planner *p, grid *g, double reach, double top) {
    for (int k = 0; k < g->n && g->from_start[k] < reach; k++) {
        segment *s = &g->seg[k];
        s->soft = fmin(s->cap, fmax(s->soft, fmin(top, ABOVE_BEFORE * cap_before(p, s->q))));
    }
    allow_tail(p, g, reach);
}

static bool above_soft(const jerk_planner *p, const grid *g) {
    return !g->rest_start && g->n > 1 && p->x > 1.003 * fmin(g->seg[0].soft, g->seg[1].soft);
}

/* The window up to a reach, with finer steps where they turn out to be too long. */
static bool solve_finer(jerk_planner *p, grid *g, double reach, int tries) {
    bool legal = false;
    for (p->finer_tries = tries; p->finer_tries > 0; p->finer_tries--) {
        legal = solve_window(p, g, true, 1.0);
        if (legal || !p->finer) break;
        grid_window(p, g, reach);
    }
    p->finer_tries = 0;
    return legal;
}

/* Windows over many slow knots may fail as a whole: shorter ones do not. */
static bool solve_shorter(jerk_planner *p, grid *g, double least) {
    double reach = g->from_start[g->n];
    for (int i = 0; i < SHORTER_TRIES; i++) {
        reach *= SHORTER;
        if (reach <= least) return false;
        grid_window(p, g, reach);
        if (g->n < (g->rest_start ? 3 : 2)) return false;
        p->reach = reach;
        if (solve_finer(p, g, reach, FINER_SHORTER)) return true;
    }
    return false;
}

/* Give back what a failure has taken from the windows. */
static void reach_further(jerk_planner *p, const grid *g) {
    if (p->reach < 1e30) p->reach = fmax(p->reach, g->from_start[g->n]) * LONGER;
    if (p->reach > REACH_FORGOTTEN) p->reach = 1e30;
}

/* A new plan over the window, if it is legal and not slower than the stored tail; else the tail stays. False: it is not what is wanted. */
bool plan_window(jerk_planner *p) {
    grid *g = &p->grid;
    if (plan_straight(p)) {
        p->changed = false;
        return true;
    }
    double left = p->plan.next < p->plan.n ? fmax(0.0, p->plan.length) : 0.0;
    double ahead = fmax(p->reach, TAIL_MORE * left);
    grid_window(p, g, ahead);
    if (g->n < (g->rest_start ? 3 : 2)) return true;
    bool changed = p->changed, above = above_soft(p, g);
    p->changed = false;
    p->wait = 1 + g->n / 10;
    if (!above && (solve_finer(p, g, ahead, FINER_TRIES) || solve_shorter(p, g, TAIL_MORE * left))) {
        if (!changed && !g->rest_start && slower_than_tail(p, g)) {
            p->stats.slower++;
            p->plan.final = p->plan.final || p->prob.solved; /* the solver does no better */
        } else if (plan_accept(p, g, p->prob.solved)) {
            p->was = speeds_now(p);
        }
        reach_further(p, g);
        return true;
    }
    if (g->rest_start) {
        grid_window(p, g, 1e30);
        if ((solve_window(p, g, false, SHRINK) || slow_fallback(p, g)) && plan_accept(p, g, false)) p->was = speeds_now(p);
        return true;
    }
    if (changed && plan_ramp(p)) return true;
    bool met = !changed || plan_stop(p); /* the fastest way down */
    if (!changed && !above) return true;
    grid_window(p, g, 1e30);
    allow_tail(p, g, INFINITY);
    return (solve_window(p, g, true, 1.0) && plan_accept(p, g, p->prob.solved)) || met;
}
