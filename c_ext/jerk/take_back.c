/* Laws that were handed out and are not driven after all: they become the
 * beginning of the plan again. */
#include <string.h>
#include "jerk/hand_out.h"
#include "jerk/window/history.h"
#include "jerk/path/joints.h"
#include "jerk/path/ring.h"
#include "jerk/state/state.h"

/* The plan moves `by` places up in its arrays. */
static void shift_plan(plan *pl, int by) {
    size_t count = (size_t)(pl->count - pl->next);
    double *knots[] = {pl->x, pl->accel};
    double *segments[] = {pl->lengths,
                          pl->time,
                          pl->jerk,
                          pl->snap,
                          pl->crackle,
                          pl->pop,
                          pl->input[0],
                          pl->input[1],
                          pl->offset};
    int from = pl->next;
    int to = from + by;
    for (size_t i = 0; i < sizeof knots / sizeof *knots; i++) {
        size_t bytes = sizeof(double) * (count + 1);
        memmove(knots[i] + to, knots[i] + from, bytes);
    }
    for (size_t i = 0; i < sizeof segments / sizeof *segments; i++) {
        memmove(segments[i] + to, segments[i] + from, sizeof(double) * count);
    }
    memmove(pl->tag + to, pl->tag + from, sizeof *pl->tag * count);
    memmove(pl->last + to, pl->last + from, count);
    pl->next += by;
    pl->count += by;
}

static void put_back(jerk_planner *planner, const struct handed *handed) {
    plan *pl = &planner->plan;
    int k = --pl->next;
    pl->x[k] = handed->x;
    pl->accel[k] = handed->accel;
    pl->lengths[k] = handed->length;
    pl->offset[k] = handed->offset;
    pl->tag[k] = handed->tag;
    pl->last[k] = handed->last;
    pl->time[k] = handed->time;
    pl->jerk[k] = handed->jerk;
    pl->snap[k] = handed->snap;
    pl->crackle[k] = handed->crackle;
    pl->pop[k] = handed->pop;
    for (int i = 0; i < 2; i++) {
        pl->input[i][k] = handed->input[i];
    }
    pl->remaining += handed->length;
    pl->from_standstill = k == 0 && handed->from_standstill;
    jerk_interval *interval = &planner->ring[handed->head & planner->mask];
    uint32_t stand =
        handed->head == planner->head
            ? interval->flags & JERK_STAND
            : handed->interval.flags
                  & JERK_STAND; /* it may have come or gone since */
    *interval = handed->interval;
    interval->flags = (interval->flags & ~JERK_STAND) | stand;
    planner->head = handed->head;
    planner->x = handed->at_x;
    planner->accel = handed->at_u;
    planner->behind_mm = handed->behind_mm;
    planner->behind_share = handed->behind_share;
    turns_back(planner, handed->driven);
    planner->driven_s -= handed->time;
    planner->at_standstill = handed->at_standstill;
}

/* Law h has come to rest, so the plan that it was of ended behind it: it ends
 * there again. */
static void end_plan(jerk_planner *planner, const struct handed *handed) {
    plan *pl = &planner->plan;
    pl->count = pl->next;
    pl->x[pl->count] = 0.0;
    pl->accel[pl->count] = 0.0;
    pl->remaining = 0.0;
    pl->end = planner->head;
    pl->stands = pl->final =
        handed->last && (handed->interval.flags & JERK_STAND);
}

bool take_back_laws(jerk_planner *planner, uint64_t count) {
    plan *pl = &planner->plan;
    if (count > planner->handed_count || count > HANDED_MAX) {
        return false;
    }
    if ((uint64_t)pl->next < count) {
        int by = (int)count - pl->next;
        if (pl->count + by > planner->capacity + HANDED_MAX) {
            return false;
        }
        shift_plan(pl, by);
    }
    pl->edition++;
    for (uint64_t i = 0; i < count; i++) {
        const struct handed *handed =
            handed_at(planner, --planner->handed_count);
        if (planner->at_standstill) {
            end_plan(planner, handed);
        }
        put_back(planner, handed);
    }
    ring_find_stand(planner);
    pl->since = pl->since > (int)count ? pl->since - (int)count : 0;
    return true;
}

double jerk_take_back(jerk_planner *planner, double seconds) {
    double t = 0.0;
    uint64_t count = 0;
    for (; t < seconds - LEAST_TIME; count++) {
        if (count >= planner->handed_count || count >= HANDED_MAX) {
            return 0.0;
        }
        t += handed_at(planner, planner->handed_count - 1 - count)->time;
    }
    if (!take_back_laws(planner, count)) {
        return 0.0;
    }
    return t - seconds > LEAST_TIME ? t - hand_out_again(planner, t - seconds)
                                    : t;
}

/* What was handed out behind the kept plan is forgotten, and that plan follows
 * again; returns how long it took, s, below 0: it cannot be done. */
static double return_to_kept(jerk_planner *planner) {
    uint64_t first = planner->kept.handed;
    double t = 0.0;
    for (uint64_t i = first; i < planner->handed_count; i++) {
        t += handed_at(planner, i)->time;
    }
    if (planner->handed_count < first
        || !take_back_laws(planner, planner->handed_count - first)) {
        return -1.0;
    }
    kept_plan_follows(planner);
    return t;
}

double jerk_go_back(jerk_planner *planner, double seconds) {
    struct kept *kept = &planner->kept;
    double t = 0.0;
    if (kept->state == KEEP_DONE) {
        t = return_to_kept(planner);
    } else if (planner->plan.edition != kept->edition) {
        t = -1.0;
    }
    kept->state = KEEP_NONE;
    return t < 0.0 ? t : t + jerk_take_back(planner, seconds - t);
}
