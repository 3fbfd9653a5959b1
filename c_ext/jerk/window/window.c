/* Planning one window: guess, solve, check, and only then take the place of the
 * stored tail. */
#include <math.h>
#include <string.h>
#include "jerk/path/plan_law.h"
#include "jerk/window/history.h"
#include "jerk/rows/constraints.h"
#include "jerk/solver/initial_guess.h"
#include "jerk/solver/interior_point.h"
#include "jerk/state/state.h"
#include "jerk/window/verify.h"
#include "jerk/window/window.h"
#include "maths/order.h"

double way_from(const jerk_planner *planner,
                const jerk_interval *interval,
                double v) {
    double a = 1e30;
    double j = 1e30;
    for (int i = 0; i < planner->axes; i++) {
        double rate =
            greater(1.0, larger(interval->d1[0][i], interval->d1[1][i]));
        a = lesser(a, acc_max(planner, interval, i) / rate);
        j = lesser(j, jerk_max(planner, interval, i) / rate);
    }
    double ramp = lesser(a, sqrt(v * j));
    return 0.5 * v * (v / ramp + ramp / j);
}

/* The longest way to rest from a knot of the plan's second half: the speed that
 * it comes to, not that at which it begins.  A window cut short has half of its
 * knots where it ends: there the second half of the way counts too. */
static double stopping_way(const jerk_planner *planner,
                           const struct grid *grid) {
    double most = 0.0;
    double half = grid->cut ? 0.5 * grid->from_start[grid->count] : INFINITY;
    for (int k = grid->count - 1; k >= 0; k--) {
        if (k < grid->count / 2 && grid->from_start[k] < half) {
            break;
        }
        double v = planner->scale * sqrt(planner->prob.x[k]);
        most = greater(most, way_from(planner, grid->seg[k].interval, v));
    }
    return most;
}

/* What solutions on the way have taken off limits is given back, as far as the
 * plan did not need it. */
static void relax(const struct grid *grid, const struct problem *problem) {
    for (int k = problem->first; k < grid->count - 1; k++) {
        const struct segment *segment = &grid->seg[k];
        if (segment->tight != &segment->own && *segment->tight < 1.0) {
            *segment->tight =
                greater(*segment->tight, lesser(1.0, AIM / segment->bulge));
        }
    }
}

static struct steps *steps_of(jerk_planner *planner,
                              const struct segment *segment) {
    return &planner->steps[segment->at & planner->mask];
}

/* The checked problem becomes the plan, unless what it begins with is no longer
 * what is driven. */
bool plan_accept(jerk_planner *planner, const struct grid *grid, bool final) {
    if (plan_is_gone(planner)) {
        planner->changed = true;
        return false;
    }
    keep_plan(planner);
    plan *pl = &planner->plan;
    struct problem *problem = &planner->prob;
    size_t bytes = sizeof(double) * (size_t)(grid->count + 1);
    memcpy(pl->x, problem->x, bytes);
    memcpy(pl->accel, problem->accel, bytes);
    for (int k = 0; k < grid->count; k++) {
        pl->input[0][k] = problem->input[0][k] - problem->bow[k];
        pl->input[1][k] = problem->input[1][k] - problem->bow[k];
    }
    uint64_t end = planner->head;
    for (int k = 0; k < grid->count; k++) {
        const struct segment *s = &grid->seg[k];
        pl->lengths[k] = s->length;
        pl->tag[k] = s->interval->tag;
        pl->offset[k] = s->interval->offset;
        pl->last[k] =
            (uint8_t)(s->last + 2 * (s->last && s->interval->blocks > 0));
        pl->jerk[k] = 0.0;
        pl->time[k] = 0.0;
        end += s->last;
        steps_of(planner, s)->kept = steps_of(planner, s)->turn;
    }
    relax(grid, problem);
    pl->count = grid->count;
    pl->next = 0;
    pl->since = 0;
    pl->edition++;
    pl->from_standstill = grid->from_standstill;
    pl->final = final;
    pl->stands = grid->stands;
    pl->end = end;
    pl->remaining = grid->from_start[grid->count];
    double way = stopping_way(planner, grid);
    int near_end =
        grid->count > LAST_INTERVALS ? grid->count - LAST_INTERVALS : 0;
    pl->lasts =
        greater(LASTS * way, pl->remaining - grid->from_start[near_end]);
    pl->refresh = pl->remaining < JUST_COVERS * way
                      ? lesser(planner->cfg.refresh, JUST_REFRESH)
                      : planner->cfg.refresh;
    return true;
}

/* A solver that was stopped on its way may leave a plan that is legal and
 * creeps. */
static bool creeps(const jerk_planner *planner, const struct grid *grid) {
    for (int k = 1; k < grid->count; k++) {
        if (planner->prob.x[k] < CREEPS * planner->prob.guess[k]) {
            return true;
        }
    }
    return false;
}

double check_plan(jerk_planner *planner, struct grid *grid) {
    double worst = plan_check(planner, grid, &planner->prob);
    if (worst <= CHECK_SLACK) {
        planner->stats.worst_ratio = greater(planner->stats.worst_ratio, worst);
    }
    return worst;
}

/* The speed peaks inside an interval above the feed that it was planned with:
 * with so much less it will peak at the feed. */
static void plan_slower(struct segment *segment) {
    double over = segment->fast * FEED_SLACK / CHECK_SLACK;
    double by = lesser(SLOWER_BY, 1.0 / (over * over));
    segment->soft *= by;
    segment->slower *= by;
}

/* A lower limit has changed little: rows at the ends of the segment are far
 * from it. */
static bool stays_above(const struct segment *segment) {
    return segment->lowered > 0.0
           && segment->excess - 1.0 > FINER_STAYS * (segment->lowered - 1.0);
}

/* Rows at its ends say too little of what the path does inside segment s: the
 * pushed interval that it is of takes finer steps from now on. */
static bool finer_steps(jerk_planner *planner, const struct segment *segment) {
    struct steps *of = steps_of(planner, segment);
    double to = greater(of->shortest, FINER_STEPS * segment->length);
    if (segment->tight == &segment->own) {
        return false; /* a line is resolved as it is */
    }
    if (!(segment->excess > FINER_FROM
          || (segment->excess > 0.0
              && (*segment->tight < FINER_BELOW || stays_above(segment))))
        || to > FINER_STEPS * lesser(of->turn, 2.0 * segment->length)) {
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
    for (int k = 0; k < grid->count; k++) {
        struct segment *segment = &grid->seg[k];
        double share = segment->jump * *segment->tight;
        if (share < segment->share && k >= problem->first
            && k < grid->count - 1) {
            tighten_rows(problem, k, share / segment->share);
        }
        segment->share = share;
    }
    problem->paused = true;
    problem->missed = greater(problem->missed, MISSED_SO);
    problem->iterations = 0;
    return true;
}

/* Between its ends an interval may exceed a limit by a few percent: less of the
 * jerk is planned with there, from now on, or less of the acceleration. */
static bool tighten(jerk_planner *planner, struct grid *grid, double worst) {
    if (!isfinite(worst)) {
        return false;
    }
    for (int k = 0; k < grid->count && planner->finer_tries > 1; k++) {
        planner->finer = finer_steps(planner, &grid->seg[k]) || planner->finer;
    }
    if (planner->finer || !(worst < TIGHTEN_UP_TO)) {
        return false;
    }
    for (int k = 0; k < grid->count; k++) {
        struct segment *segment = &grid->seg[k];
        if (segment->fast > 0.0) {
            plan_slower(segment);
        }
        if (segment->leave > 0.0) {
            *segment->tight = lesser(
                *segment->tight,
                greater(TIGHTEST, (1.0 - segment->leave) / segment->jump));
        }
        segment->leave = 0.0;
        segment->lowered = segment->heavy > 0.0 ? 0.0 : segment->excess;
        if (segment->excess <= 0.0) {
            continue;
        }
        if (segment->heavy > 0.0) {
            if (planner->prob.solved) { /* else the solver had not come to it */
                double acc = *segment->acc_tight * AIM / segment->heavy;
                *segment->acc_tight = greater(TIGHTEST, acc);
            }
            continue;
        }
        double share = segment->share / segment->jump * AIM / segment->excess;
        *segment->tight = lesser(*segment->tight, greater(TIGHTEST, share));
    }
    bool other = false; /* rows than those of jerk have to change */
    for (int k = 0; k < grid->count; k++) {
        other = other || grid->seg[k].fast > 0.0 || grid->seg[k].heavy > 0.0;
    }
    if (planner->prob.solved && worst < NEARLY && !other) {
        return tighten_present(planner, grid);
    }
    for (int k = 0; k < grid->count; k++) {
        struct segment *segment = &grid->seg[k];
        segment->share = segment->jump * *segment->tight;
    }
    memcpy(planner->scratch,
           planner->prob.x,
           sizeof(double) * (size_t)(grid->count + 1));
    problem_from_grid(planner, grid, planner->x, planner->accel);
    return guess_from(planner, grid, planner->scratch);
}

/* Interval k gets the bow that its iterate asks for; the share of the limit
 * that it can be planned with then, by what the iterate does inside it. */
static double foreseen(struct problem *problem,
                       struct segment *segment,
                       const struct bent *bent,
                       int k) {
    double most = bent->most;
    if (bent->bow != problem->bow[k]) {
        problem->bow[k] = segment->bow = bent->bow;
        problem->missed = greater(problem->missed, MISSED_SO);
    }
    double tight = *segment->tight;
    if (!(most > FORESEEN * tight) || !isfinite(most)) {
        return tight;
    }
    double then = bent->more * JERK_USABLE * tight;
    return then > FORESEEN_FROM ? greater(TIGHTEST, tight / then) : tight;
}

/* Limits that are lowered cost a third of what is taken, where the jerk binds.
 */
static double loss_of_time(const struct grid *grid,
                           const struct problem *problem,
                           const double *share) {
    double lost = 0.0;
    double time = 0.0;
    for (int k = problem->first; k < grid->count - 1; k++) {
        double v = sqrt(greater(problem->x[k], TINY));
        double t = grid->seg[k].length / v;
        time += t;
        if (grid->seg[k].tight != &grid->seg[k].own) {
            lost += t * (1.0 - share[k]) / 3.0;
        }
    }
    return lost / time;
}

/* Where limits would have to be lowered much, steps are made finer: what is
 * more inside falls with their square.  Where work is scarce what it costs in
 * time does not count, and only the worst of them are. */
static bool made_finer(jerk_planner *planner,
                       const struct grid *grid,
                       const struct problem *problem,
                       const double *share) {
    bool pays =
        planner->scarce || loss_of_time(grid, problem, share) > FINER_LOSS;
    double below = planner->scarce ? FINER_BELOW : FINER_TIGHT;
    if (planner->finer_tries < 2 || !pays) {
        return false;
    }
    bool any = false;
    for (int k = problem->first; k < grid->count - 1; k++) {
        const struct segment *segment = &grid->seg[k];
        struct steps *of = steps_of(planner, segment);
        if (segment->tight == &segment->own || share[k] > below) {
            continue;
        }
        double to =
            greater(of->shortest,
                    segment->length
                        * greater(FINER_LEAST,
                                  sqrt(FINER_BULGE / (1.0 / share[k] - 1.0))));
        if (to > FINER_ENOUGH * lesser(of->turn, 2.0 * segment->length)) {
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
    for (int k = problem->first; k < grid->count - 1;) {
        struct bent bent[LANES];
        int count = bend_inside(planner, grid, problem, k, bent);
        for (int i = 0; i < count; i++, k++) {
            share[k] = foreseen(problem, &grid->seg[k], &bent[i], k);
        }
    }
    planner->finer = made_finer(planner, grid, problem, share);
    if (planner->finer) {
        return false;
    }
    for (int k = problem->first; k < grid->count - 1; k++) {
        struct segment *segment = &grid->seg[k];
        if (share[k] >= *segment->tight) {
            continue;
        }
        tighten_rows(problem, k, share[k] / *segment->tight);
        problem->missed = greater(problem->missed, MISSED_SO);
        *segment->tight = share[k];
        segment->share = segment->jump * share[k];
    }
    return true;
}

static void count_work(jerk_planner *planner) {
    const struct problem *problem = &planner->prob;
    int beside = problem->iterations + BESIDE_ITERATIONS;
    planner->stats.iterations += (uint64_t)problem->iterations;
    planner->stats.work += work_of(planner, problem->iterations);
    planner->stats.spent += work_of(planner, beside);
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
    count_work(planner);
    planner->stats.failed += !solved;
    return solved;
}

bool solve_roughly(jerk_planner *planner, int iterations) {
    struct problem *problem = &planner->prob;
    planner->stats.solves++;
    problem->pause = 0.0;
    ipm_solve(problem, iterations);
    count_work(planner);
    return isfinite(problem->gap);
}

/* Solve over the grid; true if a legal plan stands in the problem. */
bool solve_window(jerk_planner *planner,
                  struct grid *grid,
                  bool warm,
                  double shrink) {
    planner->finer = false;
    problem_from_grid(planner, grid, planner->x, planner->accel);
    return guess_window(planner, grid, warm, shrink)
           && solve_guess(planner, grid, TIGHTENINGS, WINDOW_ITERATIONS);
}

bool solve_guess(jerk_planner *planner,
                 struct grid *grid,
                 int tries,
                 int iterations) {
    for (int i = 0; i < tries; i++) {
        bool solved = solve_from_guess(planner, grid, iterations);
        if (planner->finer) {
            return false;
        }
        double worst = !solved && creeps(planner, grid)
                           ? INFINITY
                           : check_plan(planner, grid);
        if (worst <= CHECK_SLACK) {
            return true;
        }
        if (!solved && (grid->sinks || grid->stops)
            && planner->prob.missed > NEARLY_MET) {
            return false;
        }
        planner->stats.refused += solved;
        if (!tighten(planner, grid, worst)) {
            return false;
        }
    }
    return false;
}

/* What iterates took off limits and steps is given back: of a window that has
 * failed they say nothing. */
void give_back(jerk_planner *planner, struct grid *grid) {
    for (int k = 0; k < grid->count; k++) {
        struct segment *segment = &grid->seg[k];
        *segment->tight = segment->before;
        segment->share = segment->jump * segment->before;
        segment->bow = 0.0;
        steps_of(planner, segment)->turn = steps_of(planner, segment)->kept;
    }
}

/* Cap on x (scaled) by the feeds that the present plan was made under. */
static double cap_before(const jerk_planner *planner,
                         const jerk_interval *interval) {
    double feed =
        lesser(1e15, asked_under(&planner->was, interval) / planner->scale);
    return feed * feed;
}

/* Above the caps (an override was reduced, a hold was released): what the
 * stored tail drives stays allowed over `reach` mm. A little more of it where
 * the feed was higher, next to nothing else: plan upon plan it would add up. */
void allow_tail(jerk_planner *planner, struct grid *grid, double reach) {
    struct tail_walk walk = {.next = planner->plan.next};
    for (int k = 0; k < grid->count && walk.next < planner->plan.count
                    && grid->from_start[k] < reach;
         k++) {
        struct segment *segment = &grid->seg[k];
        double most = tail_most(planner, &walk, grid->from_start[k + 1]);
        double allowed = lesser(
            TAIL_AND * most,
            greater(cap_before(planner, segment->interval), TAIL_ONLY * most));
        if (allowed > segment->soft && segment->soft < segment->cap) {
            segment->soft = lesser(segment->cap, allowed);
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
    const double *from = grid->from_start;
    for (int k = 0; k < grid->count && from[k] < reach; k++) {
        struct segment *segment = &grid->seg[k];
        segment->soft = lesser(
            segment->cap,
            greater(
                segment->soft,
                lesser(top,
                       ABOVE_BEFORE * cap_before(planner, segment->interval))));
    }
    allow_tail(planner, grid, reach);
}
