/* What is handed out: laws from the plan, and a new plan when enough of the old
 * one is used up. */
#include <math.h>
#include "jerk/hand_out.h"
#include "jerk/window/history.h"
#include "jerk/path/caps.h"
#include "jerk/path/plan_law.h"
#include "jerk/path/ring.h"
#include "jerk/replan.h"
#include "jerk/state/state.h"
#include "jerk/stop/stop.h"

/* The path under the plan's end as far as it could be planned now. */
static bool more_path(const jerk_planner *planner) {
    return planner->plan.end != planner->tail
           || (planner->finished && !planner->plan.stands);
}

static bool worth_planning(const jerk_planner *planner) {
    const plan *pl = &planner->plan;
    if (planner->changed
        && (planner->at_standstill || !(planner->again_s > 0.0))) {
        return true;
    }
    if (pl->next >= pl->count) {
        return planner->head != planner->tail;
    }
    if (planner->hold || planner->changed || planner->wait > 0
        || planner->credit < 0.0) {
        return false;
    }
    if (!pl->final || planner->near) {
        return true;
    }
    if (pl->stands || !more_path(planner)) {
        return false;
    }
    return pl->since >= pl->refresh * pl->count && pl->remaining < pl->lasts;
}

static bool zero_factor(const jerk_planner *planner) {
    const jerk_interval *interval = ring_at(planner, planner->head);
    return planner->head != planner->tail
           && asked_speed(planner, interval) <= 0.0;
}

/* Motion that earns what was worked since then, s: other speeds that come all
 * the time wait so long. */
static double earned_in(const jerk_planner *planner, uint64_t since) {
    if (!planner->hurried) {
        return 0.0;
    }
    double work = (double)(planner->stats.work - since);
    return fmax(fmin(EARNED_MAX_S, work / WORK_PER_S), work / WORK_MAX_PER_S);
}

/* A plan over the window takes what motion has earned; more is owed. What the
 * operator asks for has its own budget: little of it is owed. */
static bool plan_for_credit(jerk_planner *planner) {
    double spent = (double)planner->stats.spent;
    double may = fmax(LEAST_WORK, planner->credit);
    double least =
        planner->changed ? fmin(planner->credit, -WORK_KEPT) : -INFINITY;
    planner->scarce = planner->credit < SCARCE * WORK_KEPT;
    planner->most = planner->changed ? INFINITY : spent + may;
    bool met = plan_window(planner);
    double left = planner->credit - ((double)planner->stats.spent - spent);
    planner->credit = fmax(least, left);
    return met;
}

static void earn(jerk_planner *planner, double seconds) {
    planner->credit =
        fmin(WORK_KEPT, planner->credit + WINDOW_WORK_PER_S * seconds);
}

static void plan_again(jerk_planner *planner) {
    uint64_t work = planner->stats.work;
    bool met = true;
    if (planner->hold || zero_factor(planner)) {
        if (planner->at_standstill) {
            keep_plan(planner); /* GEO may refuse the way to this rest */
            forget_plan(planner);
        } else if (planner->changed) {
            met = plan_stop(planner);
        }
        planner->changed = false;
    } else {
        met = plan_for_credit(planner);
    }
    if (!met) {
        planner->changed = true;
    }
    planner->waited_s =
        met ? 0.0
        : planner->hold
            ? TRY_AGAIN_S
            : fmin(TRY_AGAIN_MAX_S, fmax(TRY_AGAIN_S, 2.0 * planner->waited_s));
    planner->again_s = fmax(planner->waited_s, earned_in(planner, work));
}

/* Segment `next` of the plan is the caller's: the path and the state move on.
 */
static void hand_out(jerk_planner *planner) {
    plan *pl = &planner->plan;
    int k = pl->next++;
    pl->since++;
    pl->remaining -= pl->lengths[k];
    planner->at_standstill = pl->next == pl->count;
    planner->x = planner->at_standstill ? 0.0 : pl->x[k + 1];
    planner->accel = planner->at_standstill ? 0.0 : pl->accel[k + 1];
    planner->behind_mm = planner->at_standstill
                             ? 0.0
                             : fmax(0.0, planner->behind_mm - pl->lengths[k]);
    planner->driven += pl->lengths[k];
    if (pl->last[k] && !planner->at_standstill) {
        jump_passed(planner,
                    ring_at(planner, planner->head),
                    ring_at(planner, planner->head + 1));
    }
    ring_consume(planner, pl->lengths[k], pl->last[k]);
    planner->stats.segments++;
}

int jerk_next(jerk_planner *planner, jerk_law *law) {
    return jerk_next_within(planner, law, INFINITY);
}

/* The time of a part of the law, a little more where that would be none. */
static double time_to_part(const jerk_law *law, double seconds) {
    jerk_state at;
    jerk_at(law, seconds, &at);
    while (seconds < law->time && !(at.s - law->s0 > LEAST_PART)) {
        seconds = lesser(2.0 * seconds, law->time);
        jerk_at(law, seconds, &at);
    }
    return seconds;
}

/* Of what is left of a law. At a constant speed the way says it: a long line is
 * cut many times, and what is rounded adds up. */
static double time_left(const jerk_law *law, double way, double time) {
    bool even = law->a0 == 0.0 && law->jerk == 0.0 && law->snap == 0.0
                && law->crackle == 0.0;
    return even ? way / law->v0 : time;
}

/* Only the first `seconds` of the law of segment `next` are handed out; what is
 * left stays in the plan. */
static void split(jerk_planner *planner, jerk_law *law, double seconds) {
    plan *pl = &planner->plan;
    int k = pl->next;
    jerk_state at;
    seconds = time_to_part(law, seconds);
    jerk_at(law, seconds, &at);
    double way = at.s - law->s0;
    double left = law->s0 + pl->lengths[k] - at.s;
    if (!(left > LEAST_PART) || !(at.v > 0.0)) {
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
                           .length = way};
    remember_law(planner, k, &part, false);
    jerk_law left_over = *law;
    jerk_begin_at(&left_over, seconds);
    pl->jerk[k] = left_over.jerk;
    pl->snap[k] = left_over.snap;
    pl->crackle[k] = left_over.crackle;
    pl->pop[k] = left_over.pop;
    /* towards a rest the law follows from speed and way */
    bool rests = k + 1 == pl->count;
    pl->time[k] =
        rests ? 0.0 : time_left(&left_over, left, law->time - seconds);
    pl->lengths[k] = left;
    pl->remaining -= way;
    pl->offset[k] += way;
    double scale2 = planner->scale * planner->scale;
    planner->x = at.v * at.v / scale2;
    pl->x[k] = planner->x;
    pl->accel[k] = planner->accel = at.a / (planner->scale * planner->scale);
    pl->input[0][k] = left_over.jerk / (at.v * scale2);
    pl->from_standstill = false;
    planner->at_standstill = false;
    planner->behind_mm = fmax(0.0, planner->behind_mm - way);
    planner->driven += way;
    ring_consume(planner, way, false);
    *law = part;
}

/* The beginning of what was taken back is handed out all the same; returns its
 * time. */
double hand_out_again(jerk_planner *planner, double seconds) {
    jerk_law law;
    plan_law(planner, planner->plan.next, &law);
    split(planner, &law, seconds);
    return law.time;
}

int jerk_next_within(jerk_planner *planner, jerk_law *law, double seconds) {
    if (worth_planning(planner)) {
        plan_again(planner);
    }
    if (planner->plan.next >= planner->plan.count) {
        return 0;
    }
    plan_law(planner, planner->plan.next, law);
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
    planner->wait--;
    earn(planner, law->time);
    planner->stats.laws++;
    return 1;
}

double jerk_advance(jerk_planner *planner, double seconds) {
    double t = 0.0;
    while (seconds - t > LEAST_TIME
           && planner->plan.next < planner->plan.count) {
        jerk_law law;
        plan_law(planner, planner->plan.next, &law);
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
    return ring_reaches(planner) || planner->finished
           || jerk_room(planner) == 0;
}

int64_t jerk_tail(const jerk_planner *planner, jerk_law *laws, int64_t max) {
    int64_t count = 0;
    for (int k = planner->plan.next; k < planner->plan.count && count < max;
         k++) {
        plan_law(planner, k, &laws[count++]);
    }
    return count;
}

void jerk_tail_driven(jerk_planner *planner) {
    while (planner->plan.next < planner->plan.count) {
        hand_out(planner);
    }
}
