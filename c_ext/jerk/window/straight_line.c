/* On a straight line the time-optimal motion is known: at most seven phases of
 * constant path jerk. */
#include <math.h>
#include "jerk/path/plan_law.h"
#include "jerk/path/speed_change.h"
#include "jerk/window/history.h"
#include "jerk/window/straight_line.h"
#include "maths/order.h"

static bool straight(const jerk_planner *planner,
                     const jerk_interval *interval,
                     const jerk_interval *first) {
    for (int i = 0; i < planner->axes; i++) {
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

/* A line from the head on. */
typedef struct line {
    double length; /* mm; 0: there is none */
    uint64_t end;  /* ring index behind it */
    bool stands;   /* the path ends there, or the axes must stand */
    bool open;     /* it may go on: nothing else is in the window */
} line;

/* The line ahead, as far as the window and, for `one_speed`, one speed that is
 * asked for reach. */
static line line_ahead(const jerk_planner *planner, bool one_speed) {
    const jerk_interval *first = ring_at(planner, planner->head);
    line out = {.end = planner->head};
    double speed = asked_speed(planner, first);
    int blocks = 0;
    while (out.end != planner->tail && !out.stands) {
        const jerk_interval *interval = ring_at(planner, out.end);
        bool goes_on = straight(planner, interval, first);
        if (one_speed) {
            goes_on = goes_on && asked_speed(planner, interval) == speed
                      && interval->v_hard == first->v_hard;
        }
        blocks += (int)interval->blocks;
        out.open = goes_on && blocks > planner->cfg.window_blocks;
        if (!goes_on || out.open) {
            return out;
        }
        out.length += interval->length;
        out.stands = (interval->flags & JERK_STAND) != 0;
        out.end++;
    }
    out.stands = out.stands || planner->finished;
    out.open = !out.stands;
    return out;
}

static path_limits usable(path_limits limits) {
    return (path_limits){limits.acc * ACC_USABLE, limits.jerk * JERK_USABLE};
}

/* The speed that is asked for, and possible there. */
static double speed_along(const jerk_planner *planner,
                          const jerk_interval *interval) {
    double v = asked_speed(planner, interval);
    if (interval->v_hard > 0.0) {
        v = fmin(v, interval->v_hard);
    }
    for (int i = 0; i < planner->axes; i++) {
        double share = fmax(fabs(interval->d1[0][i]), 1e-12);
        v = fmin(v, planner->cfg.v_max[i] / share);
    }
    return v;
}

/* Time from rest to a speed. */
static double time_to(double v, path_limits most) {
    double full = most.acc / most.jerk; /* to full acceleration */
    return v >= most.acc * full ? v / most.acc + full
                                : 2.0 * sqrt(v / most.jerk);
}

/* The highest speed from rest to rest over a length. */
static double top_speed(double v, path_limits most, double length) {
    double full = most.acc / most.jerk;
    if (v * time_to(v, most) <= length) {
        return v;
    }
    double top =
        0.5 * most.acc * (sqrt(full * full + 4.0 * length / most.acc) - full);
    if (top >= most.acc * full) {
        return top;
    }
    double ramp = cbrt(0.5 * length / most.jerk);
    return most.jerk * ramp * ramp;
}

/* Time from rest to rest over a line of this direction at this speed at most,
 * s. */
double jerk_line_time(const jerk_planner *planner,
                      const double *direction,
                      double length,
                      double speed) {
    path_limits most = {1e30, 1e30};
    for (int i = 0; i < planner->cfg.axes; i++) {
        double share = fmax(fabs(direction[i]), 1e-12);
        speed = fmin(speed, planner->cfg.v_max[i] / share);
        most.acc = fmin(most.acc, planner->cfg.a_max[i] / share);
        most.jerk = fmin(most.jerk, planner->cfg.j_max[i] / share);
    }
    most = usable(most);
    double top = top_speed(speed, most, length);
    double change = time_to(top, most);
    return 2.0 * change + fmax(0.0, length - top * change) / top;
}

typedef struct pen {
    jerk_planner *planner;
    uint64_t i; /* ring interval, and */
    double at;  /* where in it */
    double v, a;
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
    int k = pl->count++;
    pl->lengths[k] = way;
    pl->x[k] = pen->v * pen->v / f2;
    pl->accel[k] = pen->a / f2;
    pl->input[0][k] = pl->input[1][k] =
        pen->v > 0.0 ? jerk / (pen->v * f2) : 0.0;
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
    while (time > LEAST_PHASE) {
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
        if (passed) {
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
}

/* From the head to a speed, this speed for a while, and to rest. */
typedef struct profile {
    speed_change first, last;
    double v, cruise; /* mm/s, s */
} profile;

enum {
    PROFILE_PHASES = 3 + 1 + 3
};

/* By way of the speed v. False: there is no way to it. */
static bool profile_by(const jerk_planner *planner,
                       path_limits most,
                       double v,
                       profile *out) {
    double a = acceleration_at_head(planner);
    out->v = v;
    out->cruise = 0.0;
    return change_speed(speed_at_head(planner), a, v, most, &out->first)
           && change_speed(v, 0.0, 0.0, most, &out->last);
}

static double way_of(const profile *profile) {
    return profile->first.way + profile->last.way;
}

static double time_of(const profile *profile) {
    return profile->first.lasts + profile->cruise + profile->last.lasts;
}

static bool ends_within(const jerk_planner *planner,
                        path_limits most,
                        double v,
                        double length,
                        profile *out) {
    return profile_by(planner, most, v, out) && way_of(out) <= length;
}

/* By way of the highest speed from `low` to `high`. */
static bool highest(const jerk_planner *planner,
                    path_limits most,
                    double low,
                    double high,
                    double length,
                    profile *out) {
    for (int i = 0; i < LINE_HALVINGS; i++) {
        double middle = 0.5 * (low + high);
        bool fits = ends_within(planner, most, middle, length, out);
        *(fits ? &low : &high) = middle;
    }
    return ends_within(planner, most, low, length, out);
}

/* To rest at the end of the line, with less deceleration than there may be. */
static bool gently(const jerk_planner *planner,
                   path_limits most,
                   double length,
                   profile *out) {
    path_limits less = most;
    double low = 0.0;
    for (int i = 0; i < LINE_HALVINGS; i++) {
        less.acc = 0.5 * (low + most.acc);
        bool fits = ends_within(planner, less, 0.0, length, out);
        *(fits ? &most.acc : &low) = less.acc;
    }
    return ends_within(planner, most, 0.0, length, out);
}

/* The quickest over a length with at most the speed v. False: the way to rest
 * is longer. */
static bool fastest(const jerk_planner *planner,
                    path_limits most,
                    double v,
                    double length,
                    profile *out) {
    if (ends_within(planner, most, v, length, out)) {
        out->cruise = (length - way_of(out)) / v;
        return true;
    }
    if (planner->at_standstill) {
        return profile_by(planner, most, top_speed(v, most, length), out);
    }
    double levels = level_speed(speed_at_head(planner),
                                acceleration_at_head(planner),
                                most);
    if (levels < v && ends_within(planner, most, levels, length, out)) {
        return highest(planner, most, levels, v, length, out);
    }
    return gently(planner, most, length, out);
}

static void speed_phases(struct pen *pen, const speed_change *change) {
    for (int i = 0; i < 3; i++) {
        phase(pen, change->jerk[i], change->time[i]);
        pen->a = i < 2 ? change->peak : 0.0;
    }
}

/* The plan may be replaced, and there is room for a profile. */
static bool has_room(const jerk_planner *planner, const line *line) {
    return !plan_is_gone(planner)
           && line->end - planner->head + PROFILE_PHASES
                  <= (uint64_t)planner->capacity;
}

/* The profile becomes the plan. `stops`: it ends before the line does. */
static void take_profile(jerk_planner *planner,
                         const line *line,
                         const profile *profile,
                         bool stops) {
    keep_plan(planner);
    plan *pl = &planner->plan;
    pl->count = 0;
    pl->next = 0;
    pl->since = 0;
    pl->edition++;
    pl->end = line->end;
    pl->from_standstill = planner->at_standstill;
    pl->final = stops || line->stands || line->open;
    pl->stands = line->stands && !stops;
    pl->remaining = stops ? way_of(profile) : line->length;
    pl->lasts = line->open && !stops ? LASTS * profile->last.way : 0.0;
    pl->refresh = 0.0;
    struct pen pen = {.planner = planner, .i = planner->head};
    pen.v = speed_at_head(planner);
    pen.a = acceleration_at_head(planner);
    speed_phases(&pen, &profile->first);
    pen.v = profile->v;
    phase(&pen, 0.0, profile->cruise);
    pen.v = profile->v;
    speed_phases(&pen, &profile->last);
    if (stops) {
        pl->end = pen.i;
    } else {
        end_line(&pen);
    }
    pl->x[pl->count] = 0.0;
    pl->accel[pl->count] = 0.0;
    planner->stats.straight++;
}

/* s that the present plan takes over so many mm, or to its end. */
static double time_left(const jerk_planner *planner, double length) {
    double t = 0.0;
    double at = 0.0;
    for (int k = planner->plan.next; k < planner->plan.count && at < length;
         k++) {
        jerk_law law;
        plan_law(planner, k, &law);
        t += law.time * fmin(1.0, (length - at) / law.length);
        at += law.length;
    }
    return t;
}

/* The present plan is faster than v somewhere on the line. */
static bool is_faster(const jerk_planner *planner, const line *line, double v) {
    const plan *pl = &planner->plan;
    double most = FASTER * v * v / (planner->scale * planner->scale);
    double at = 0.0;
    for (int k = pl->next; k < pl->count && at < line->length; k++) {
        if (pl->x[k] > most) {
            return true;
        }
        at += pl->lengths[k];
    }
    return false;
}

/* Nothing of the path behind is felt. */
static bool is_free(const jerk_planner *planner) {
    return planner->head != planner->tail && !(planner->behind_mm > 0.0);
}

/* A change while it moves, to the speed v: the line to its end, or, where more
 * follows, the fall of the speed on it. */
static enum on_line change_on_line(jerk_planner *planner,
                                   const line *line,
                                   const profile *profile,
                                   double v) {
    bool faster = is_faster(planner, line, v);
    if (line->stands || line->open) {
        bool further = !planner->plan.stands
                       && planner->plan.remaining < ALMOST * line->length;
        if (faster || further
            || time_of(profile) < time_left(planner, INFINITY)) {
            take_profile(planner, line, profile, false);
        }
        return LINE_TO_END;
    }
    if (!faster || !(profile->cruise > 0.0)) {
        return LINE_NONE;
    }
    take_profile(planner, line, profile, false);
    return LINE_FALL;
}

/* The line ahead, the speed asked for on it, and its fastest profile from here;
 * false: there is none. */
static bool look_ahead(const jerk_planner *planner,
                       line *line,
                       double *v,
                       profile *profile) {
    if (!is_free(planner)) {
        return false;
    }
    const jerk_interval *here = ring_at(planner, planner->head);
    path_limits most = usable(limits_at(planner, here));
    *v = speed_along(planner, here);
    *line = line_ahead(planner, true);
    return *v > 0.0 && line->length > 0.0 && has_room(planner, line)
           && fastest(planner, most, *v, line->length, profile);
}

enum on_line plan_on_line(jerk_planner *planner) {
    line line;
    profile profile;
    double v;
    if (!look_ahead(planner, &line, &v, &profile)) {
        return LINE_NONE;
    }
    if (!planner->at_standstill) {
        return change_on_line(planner, &line, &profile, v);
    }
    if (!(line.stands || line.open)
        || time_of(&profile) < PROFILE_PHASES * LEAST_PHASE) {
        return LINE_NONE;
    }
    take_profile(planner, &line, &profile, false);
    return LINE_TO_END;
}

bool rise_on_line(jerk_planner *planner) {
    line line;
    profile profile;
    double v;
    if (planner->at_standstill || !look_ahead(planner, &line, &v, &profile)) {
        return false;
    }
    double present = time_left(planner, line.length);
    if (!(time_of(&profile) < LINE_QUICKER * present)) {
        return false;
    }
    take_profile(planner, &line, &profile, false);
    return true;
}

bool stop_on_line(jerk_planner *planner) {
    if (!is_free(planner)) {
        return false;
    }
    const jerk_interval *here = ring_at(planner, planner->head);
    line line = line_ahead(planner, false);
    profile stop;
    if (!has_room(planner, &line)
        || !profile_by(planner, usable(limits_at(planner, here)), 0.0, &stop)
        || way_of(&stop) > line.length) {
        return false;
    }
    if (planner->plan.remaining > (1.0 + CLOSE_ENOUGH) * way_of(&stop)) {
        take_profile(planner, &line, &stop, true);
    }
    return true;
}
