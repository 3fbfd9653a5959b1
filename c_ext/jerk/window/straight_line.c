/* From rest to rest on a straight line the time-optimal motion is known: at
 * most seven phases of constant path jerk. */
#include <math.h>
#include "jerk/window/history.h"
#include "jerk/state/state.h"
#include "jerk/window/straight_line.h"
#include "maths/order.h"

typedef struct line_limits {
    double v, a, j; /* along the line */
} line_limits;

static bool straight(const jerk_planner *planner,
                     const jerk_interval *interval,
                     const jerk_interval *first) {
    for (int i = 0; i < planner->cfg.axes; i++) {
        if (interval->d2[0][i] != 0.0 || interval->d2[1][i] != 0.0
            || interval->d3[0][i] != 0.0 || interval->d3[1][i] != 0.0) {
            return false;
        }
        if (interval->acc_share[i] != first->acc_share[i]
            || interval->jerk_share[i] != first->jerk_share[i]) {
            return false;
        }
        if (fabs(interval->d1[0][i] - first->d1[0][i]) > SAME_DIRECTION
            || fabs(interval->d1[1][i] - first->d1[0][i]) > SAME_DIRECTION) {
            return false;
        }
    }
    return true;
}

/* Length of the line ahead, to where the axes must stand; 0: something else is
 * ahead. */
static double line_ahead(const jerk_planner *planner, uint64_t *end) {
    const jerk_interval *first = ring_at(planner, planner->head);
    double length = 0.0;
    double speed = asked_speed(planner, first);
    int blocks = 0;
    for (uint64_t i = planner->head; i != planner->tail; i++) {
        const jerk_interval *interval = ring_at(planner, i);
        blocks += (int)interval->blocks;
        if (!straight(planner, interval, first)
            || asked_speed(planner, interval) != speed
            || interval->v_hard != first->v_hard
            || blocks > planner->cfg.window_blocks) {
            return 0.0;
        }
        length += interval->length;
        *end = i + 1;
        if (interval->flags & JERK_STAND) {
            return length;
        }
    }
    return planner->finished ? length : 0.0;
}

static line_limits limits_along(const jerk_planner *planner,
                                const jerk_interval *interval) {
    line_limits limits = {asked_speed(planner, interval), 1e30, 1e30};
    if (interval->v_hard > 0.0) {
        limits.v = fmin(limits.v, interval->v_hard);
    }
    for (int i = 0; i < planner->cfg.axes; i++) {
        double share = fmax(fabs(interval->d1[0][i]), 1e-12);
        limits.v = fmin(limits.v, planner->cfg.v_max[i] / share);
        limits.a = fmin(limits.a, acc_max(planner, interval, i) / share);
        limits.j = fmin(limits.j, jerk_max(planner, interval, i) / share);
    }
    return (
        line_limits){limits.v, limits.a * ACC_USABLE, limits.j * JERK_USABLE};
}

typedef struct profile {
    double ramp, hold, cruise; /* s: times of jerk, of constant acceleration, of
                                  constant speed */
} profile;

static struct profile fastest(line_limits limits, double length) {
    double full = limits.a / limits.j; /* time to full acceleration */
    struct profile profile = {0};
    if (limits.v * limits.j >= limits.a * limits.a) {
        profile =
            (struct profile){.ramp = full, .hold = limits.v / limits.a - full};
    } else {
        profile.ramp = sqrt(limits.v / limits.j);
    }
    double way = limits.v * (2.0 * profile.ramp + profile.hold);
    if (way <= length) {
        profile.cruise = (length - way) / limits.v;
        return profile;
    }
    double v =
        0.5 * limits.a * (sqrt(full * full + 4.0 * length / limits.a) - full);
    if (v >= limits.a * full) {
        return (struct profile){.ramp = full, .hold = v / limits.a - full};
    }
    return (struct profile){.ramp = cbrt(0.5 * length / limits.j)};
}

/* Time from rest to rest over a line of this direction at this speed at most,
 * s. */
double jerk_line_time(const jerk_planner *planner,
                      const double *direction,
                      double length,
                      double speed) {
    line_limits limits = {speed, 1e30, 1e30};
    for (int i = 0; i < planner->cfg.axes; i++) {
        double share = fmax(fabs(direction[i]), 1e-12);
        limits.v = fmin(limits.v, planner->cfg.v_max[i] / share);
        limits.a = fmin(limits.a, planner->cfg.a_max[i] / share);
        limits.j = fmin(limits.j, planner->cfg.j_max[i] / share);
    }
    struct profile profile = fastest((line_limits){limits.v * VEL_USABLE,
                                                   limits.a * ACC_USABLE,
                                                   limits.j * JERK_USABLE},
                                     length);
    return 4.0 * profile.ramp + 2.0 * profile.hold + profile.cruise;
}

typedef struct pen {
    jerk_planner *planner;
    uint64_t i; /* ring interval, and */
    double at;  /* where in it */
    double v, a;
    bool fits;
} pen;

static double time_over(const jerk_law *law, double way) {
    double low = 0.0;
    double high = law->time;
    double t =
        fmin(high, 2.0 * way / fmax(1e-9, 2.0 * law->v0 + law->a0 * high));
    for (int k = 0; k < 80; k++) {
        jerk_state at;
        jerk_at(law, t, &at);
        if (at.s >= way) {
            high = t;
        } else {
            low = t;
        }
        double next = at.v > 0.0 ? t + (way - at.s) / at.v : 0.5 * (low + high);
        if (!(next > low && next < high)) {
            next = 0.5 * (low + high);
        }
        if (fabs(next - t) <= 1e-15) {
            break;
        }
        t = next;
    }
    return t;
}

/* One entry of the plan: `time` of constant jerk over `way` mm. */
static void put(struct pen *pen, double jerk, double time, double way) {
    jerk_planner *planner = pen->planner;
    plan *pl = &planner->plan;
    const jerk_interval *interval = ring_at(planner, pen->i);
    double f2 = planner->scale * planner->scale;
    if (pl->count >= planner->capacity) {
        pen->fits = false;
        return;
    }
    int k = pl->count++;
    pl->lengths[k] = way;
    pl->x[k] = pen->v * pen->v / f2;
    pl->accel[k] = pen->a / f2;
    pl->jerk[k] = jerk;
    pl->snap[k] = 0.0;
    pl->crackle[k] = 0.0;
    pl->pop[k] = 0.0;
    pl->time[k] = time;
    pl->tag[k] = interval->tag;
    pl->offset[k] = interval->offset + pen->at;
    pl->last[k] = 0;
}

/* The pushed interval ends with the last entry. */
static void end_interval(struct pen *pen) {
    plan *pl = &pen->planner->plan;
    const jerk_interval *interval = ring_at(pen->planner, pen->i);
    pl->last[pl->count - 1] = (uint8_t)(interval->blocks > 0 ? 3 : 1);
}

/* A phase of the profile, cut where the pushed intervals end. Where the last
 * one ends, the profile does: the last phase may be shorter than rounding. */
static void phase(struct pen *pen, double jerk, double time) {
    while (time > LEAST_PHASE && pen->fits) {
        const jerk_interval *interval = ring_at(pen->planner, pen->i);
        jerk_law law = {.v0 = pen->v, .a0 = pen->a};
        law.jerk = jerk;
        law.time = time;
        jerk_state end;
        jerk_at(&law, time, &end);
        double left = interval->length - pen->at;
        double part = time;
        double way = lesser(end.s, left);
        bool passed =
            pen->i + 1 < pen->planner->plan.end && end.s >= left - 1e-12;
        if (passed && way < end.s) {
            part = time_over(&law, way);
            jerk_at(&law, part, &end);
        }
        put(pen, jerk, part, passed ? left : way);
        pen->v = end.v;
        pen->a = end.a;
        pen->at += way;
        time -= part;
        if (passed && pen->fits) {
            end_interval(pen);
            pen->i++;
            pen->at = 0.0;
        }
    }
}

/* The profile ends where the line does. */
static void end_line(struct pen *pen) {
    plan *pl = &pen->planner->plan;
    const jerk_interval *interval = ring_at(pen->planner, pen->i);
    pl->lengths[pl->count - 1] += interval->length - pen->at;
    end_interval(pen);
    pl->x[pl->count] = 0.0;
    pl->accel[pl->count] = 0.0;
}

/* Plan from rest to the next stand if a straight line leads there. */
bool plan_straight(jerk_planner *planner) {
    uint64_t end = planner->head;
    double length = planner->at_standstill && planner->head != planner->tail
                        ? line_ahead(planner, &end)
                        : 0.0;
    if (!(length > 0.0)) {
        return false;
    }
    line_limits limits = limits_along(planner, ring_at(planner, planner->head));
    if (!(limits.v > 0.0)) {
        return false;
    }
    struct profile t = fastest(limits, length);
    keep_plan(planner);
    plan *pl = &planner->plan;
    pl->count = 0;
    pl->next = 0;
    pl->since = 0;
    pl->edition++;
    planner->was = speeds_now(planner);
    pl->end = end;
    pl->from_standstill = true;
    pl->final = true;
    pl->stands = true;
    pl->remaining = length;
    pl->lasts = 0.0;
    struct pen pen = {.planner = planner, .i = planner->head, .fits = true};
    phase(&pen, limits.j, t.ramp);
    pen.a = limits.j * t.ramp;
    phase(&pen, 0.0, t.hold);
    phase(&pen, -limits.j, t.ramp);
    pen.a = 0.0;
    phase(&pen, 0.0, t.cruise);
    phase(&pen, -limits.j, t.ramp);
    pen.a = -limits.j * t.ramp;
    phase(&pen, 0.0, t.hold);
    phase(&pen, limits.j, t.ramp);
    if (!pen.fits || pl->count == 0) {
        pl->count = 0;
        return false;
    }
    end_line(&pen);
    planner->stats.straight++;
    return true;
}
