/* TOPP2 on a stream: see topp2.h.
 *
 * controllable_v2[k] is the largest x = v^2 at knot k from which the end of the
 * window can be met at rest.  More path can only raise it, and where a new
 * value equals the old one nothing before it changes: the backward pass stops
 * there, so that a knot is visited a bounded number of times whatever the
 * length of the path.
 */
#include <math.h>
#include <stdlib.h>
#include "jerk/path/ring.h"
#include "jerk/topp2.h"
#include "jerk/state/tuning.h"

typedef struct knot_rows { /* u along the path and x: |cu u + cx x| <= 1, at the
                              start and, through x + 2 h u, at the end */
    double length, v2_limit, feed;
    double cu[2 * JERK_AXES], cx[2 * JERK_AXES];
    double controllable_v2; /* largest x at the start */
    bool last, stand, rapid;
    uint64_t tag;
    double offset;
    uint32_t blocks;
} knot_rows;

struct topp2 {
    jerk_config cfg;
    knot_rows *ring;
    uint64_t head, tail, planned,
        mask;                 /* intervals; `planned`: first whose
                                 controllable_v2 is not of the present window */
    uint64_t standstill_from; /* first interval that does not know of the
                           standstill before it */
    double x, feed_factor, rapid_factor, spacing;
    bool hold, changed;
    uint64_t steps;
};

static knot_rows *row_at(const topp2 *topp, uint64_t i) {
    return &topp->ring[i & topp->mask];
}

static double v2_limit_of(const topp2 *topp, const knot_rows *rows) {
    double v = rows->feed > 0 ? rows->feed
                                    * (rows->rapid ? topp->rapid_factor
                                                   : topp->feed_factor)
                              : 1e30;
    return fmin(rows->v2_limit, v * v);
}

/* Range of u at x, with the lines (value and slope by x) that bound it. */
typedef struct range {
    double low, high, low_slope, high_slope;
} range;

/* `least`: smallest x allowed at the end. */
static struct range range_at(const topp2 *topp,
                             const knot_rows *rows,
                             double x,
                             double least,
                             double next) {
    struct range range = {(least - x) / (2.0 * rows->length),
                          (next - x) / (2.0 * rows->length),
                          -0.5 / rows->length,
                          -0.5 / rows->length};
    for (int axis = 0; axis < 2 * topp->cfg.axes; axis++) {
        double cu = rows->cu[axis];
        double cx = rows->cx[axis];
        if (fabs(cu) < 1e-12) {
            continue;
        }
        double inv = 1.0 / cu;
        double middle = -cx * x * inv;
        double half = fabs(inv);
        if (middle + half < range.high) {
            range.high = middle + half, range.high_slope = -cx * inv;
        }
        if (middle - half > range.low) {
            range.low = middle - half, range.low_slope = -cx * inv;
        }
    }
    return range;
}

/* Largest x at the start of the interval with an input that leads to at most
 * `next`. */
static double controllable(const topp2 *topp,
                           const knot_rows *rows,
                           double next) {
    double x = v2_limit_of(topp, rows);
    for (int i = 0; i < 4 * JERK_AXES; i++) {
        struct range range = range_at(topp, rows, x, 0.0, next);
        double gap = range.low - range.high;
        double slope = range.low_slope - range.high_slope;
        if (gap <= 1e-13 * (fabs(range.low) + 1.0)) {
            return x;
        }
        if (!(slope > 0.0)) {
            return 0.0;
        }
        x = fmax(0.0, x - gap / slope);
    }
    return x;
}

/* Needs of the window: from its end, where the axes stand, back to where
 * nothing changes any more. */
static void backward(topp2 *topp) {
    uint64_t end = topp->head;
    int blocks = 0;
    while (end != topp->tail && blocks < topp->cfg.window_blocks
           && end - topp->head < (uint64_t)topp->cfg.window_knots) {
        blocks += (int)row_at(topp, end++)->blocks;
    }
    uint64_t fresh = topp->changed ? end : topp->planned;
    double next = 0.0;
    for (uint64_t i = end; i-- > topp->head;) {
        knot_rows *rows = row_at(topp, i);
        if (rows->stand) {
            next = 0.0;
        }
        double controllable_v2 = controllable(topp, rows, next);
        topp->steps++;
        if (i < fresh
            && fabs(controllable_v2 - rows->controllable_v2)
                   <= TOPP2_SAME * controllable_v2) {
            break;
        }
        rows->controllable_v2 = next = controllable_v2;
    }
    topp->planned = end;
    topp->changed = false;
}

static void add_part(topp2 *topp, const jerk_interval *interval, bool stand) {
    knot_rows *rows = row_at(topp, topp->tail++);
    double v = interval->v_hard > 0 ? interval->v_hard : 1e15;
    *rows = (knot_rows){.length = interval->length,
                        .feed = interval->feed,
                        .rapid = interval->flags & JERK_RAPID,
                        .tag = interval->tag,
                        .offset = interval->offset,
                        .blocks = interval->blocks,
                        .last = interval->blocks != 0,
                        .stand = stand};
    for (int axis = 0; axis < topp->cfg.axes; axis++) {
        double first = interval->d1[0][axis];
        double most = larger(first, interval->d1[1][axis]);
        double acc = TOPP2_USABLE * topp->cfg.a_max[axis]
                     * (interval->acc_share[axis] > 0.0f
                            ? (double)interval->acc_share[axis]
                            : 1.0);
        if (most * v > topp->cfg.v_max[axis]) {
            v = topp->cfg.v_max[axis] / most;
        }
        for (int end = 0; end < 2; end++) {
            int k = 2 * axis + end;
            rows->cx[k] = interval->d2[end][axis] / acc;
            rows->cu[k] = interval->d1[end][axis] / acc
                          + (end ? 2.0 * interval->length * rows->cx[k] : 0.0);
            double bend = fabs(interval->d2[end][axis]) / acc;
            bool stands = fabs(interval->d1[end][axis]) < 1e-9;
            if (stands && bend * v * v > 1.0) {
                v = sqrt(1.0 / bend);
            }
        }
    }
    rows->v2_limit = v * v;
}

static int parts_of(const topp2 *topp, const jerk_interval *interval) {
    bool alone =
        (topp->tail == topp->standstill_from) && (interval->flags & JERK_STAND);
    return (int)fmin(4096.0,
                     fmax(alone ? TOPP2_STOP_PARTS : 1.0,
                          ceil(interval->length / topp->spacing - 1e-9)));
}

int64_t topp2_room(const topp2 *topp) {
    return (int64_t)(topp->mask + 1 - (topp->tail - topp->head));
}

static int64_t refusal(const topp2 *topp, const jerk_interval *interval) {
    double sum =
        interval->length + interval->feed + interval->v_hard + interval->offset;
    for (int end = 0; end < 2; end++) {
        for (int axis = 0; axis < topp->cfg.axes; axis++) {
            sum += interval->d1[end][axis] + interval->d2[end][axis];
        }
    }
    return !isfinite(sum)               ? JERK_NOT_FINITE
           : !(interval->length > 1e-9) ? JERK_BAD_LENGTH
                                        : 0;
}

int64_t topp2_push(topp2 *topp, const jerk_interval *intervals, int64_t count) {
    for (int64_t i = 0; i < count; i++) {
        const jerk_interval *interval = &intervals[i];
        int64_t error = refusal(topp, interval);
        if (error) {
            return i > 0 ? i : error;
        }
        int parts = parts_of(topp, interval);
        if (topp2_room(topp) < parts) {
            return i;
        }
        for (int k = 0; k < parts; k++) {
            jerk_interval part;
            interval_part(interval,
                          interval->length * k / parts,
                          k + 1 == parts ? interval->length
                                         : interval->length * (k + 1) / parts,
                          topp->cfg.axes,
                          &part);
            part.blocks = k + 1 == parts ? interval->blocks : 0;
            add_part(topp,
                     &part,
                     k + 1 == parts && (interval->flags & JERK_STAND));
            row_at(topp, topp->tail - 1)->last = k + 1 == parts;
        }
        if (interval->flags & JERK_STAND) {
            topp->standstill_from = topp->tail;
        }
    }
    return count;
}

static void set_law(const knot_rows *rows,
                    double length,
                    double x,
                    double acc,
                    jerk_law *law,
                    bool last) {
    double x1 = fmax(0.0, x + 2.0 * length * acc);
    double v = sqrt(x);
    double v1 = sqrt(x1);
    *law = (jerk_law){.tag = rows->tag,
                      .s0 = rows->offset,
                      .v0 = v,
                      .a0 = acc,
                      .time = 2.0 * length / (v + v1),
                      .length = length,
                      .last = last};
    law->flags = x1 <= 0.0 ? JERK_STAND : 0;
}

/* Path acceleration that all axes allow at both ends at a standstill. */
static double standing_acc(const topp2 *topp, const knot_rows *rows) {
    double most = 1e-30;
    for (int axis = 0; axis < topp->cfg.axes; axis++) {
        double end = rows->cu[2 * axis + 1]
                     - 2.0 * rows->length * rows->cx[2 * axis + 1];
        most = fmax(most, larger(rows->cu[2 * axis], end));
    }
    return 1.0 / most;
}

/* From rest to rest over one interval, accelerating over one half and braking
 * over the other: two laws. */
static void hop(const topp2 *topp, const knot_rows *rows, jerk_law *laws) {
    double half = 0.5 * rows->length;
    double acc = fmin(0.5 * standing_acc(topp, rows),
                      v2_limit_of(topp, rows) / (2.0 * half));
    double bend = 0.0;
    for (int axis = 0; axis < 2 * topp->cfg.axes; axis++) {
        bend = fmax(bend, fabs(rows->cx[axis]));
    }
    acc = fmin(acc, 0.5 / fmax(1e-30, 2.0 * half * bend));
    double v = sqrt(2.0 * half * acc);
    double t = v / acc;
    laws[0] = (jerk_law){.tag = rows->tag,
                         .s0 = rows->offset,
                         .a0 = acc,
                         .time = t,
                         .length = half};
    laws[1] = (jerk_law){.tag = rows->tag,
                         .s0 = rows->offset + half,
                         .v0 = v,
                         .a0 = -acc,
                         .time = t,
                         .length = half,
                         .last = rows->last,
                         .flags = JERK_STAND};
}

/* What a step over interval i does: as fast as `next` allows, or braking with
 * all there is. */
typedef struct step {
    double length, acc, x1;
    bool whole;
} step;

static struct step brake_over(const topp2 *topp,
                              const knot_rows *rows,
                              double x,
                              double next) {
    struct step step = {rows->length, 0.0, 0.0, true};
    struct range at = range_at(topp, rows, x, -1e30, next);
    step.acc = fmin(at.low, at.high);
    if (x + 2.0 * rows->length * step.acc
        <= 0.0) { /* the stop lies inside, or at the end */
        step.acc = fmin(fmax(step.acc, -standing_acc(topp, rows)),
                        -x / (2.0 * rows->length));
        step.length = -x / (2.0 * step.acc);
        step.whole = step.length >= rows->length * (1.0 - 1e-9);
        if (step.whole) {
            step.length = rows->length;
        }
        return step;
    }
    step.x1 = x + 2.0 * rows->length * step.acc;
    return step;
}

static struct step step_over(const topp2 *topp,
                             uint64_t i,
                             double x,
                             bool brake,
                             double next) {
    const knot_rows *rows = row_at(topp, i);
    if (brake) {
        return brake_over(topp, rows, x, next);
    }
    struct range at = range_at(topp, rows, x, 0.0, next);
    struct step step = {rows->length,
                        at.high,
                        fmin(next, fmax(0.0, x + 2.0 * rows->length * at.high)),
                        true};
    return step;
}

static double next_controllable_v2(const topp2 *topp, uint64_t i) {
    return row_at(topp, i)->stand || i + 1 >= topp->planned
               ? 0.0
               : row_at(topp, i + 1)->controllable_v2;
}

/* The step from the head: a hold brakes; so does a speed that a reduced
 * override no longer allows, and then what the caps ask of the next knot cannot
 * be met yet. */
static struct step next_step(const topp2 *topp) {
    double controllable_v2 = row_at(topp, topp->head)->controllable_v2;
    bool above = topp->x > controllable_v2 * (1.0 + 1e-9);
    return step_over(topp,
                     topp->head,
                     topp->x,
                     topp->hold || above,
                     above ? 1e30 : next_controllable_v2(topp, topp->head));
}

static void consume(topp2 *topp, const struct step *step) {
    knot_rows *rows = row_at(topp, topp->head);
    topp->x = step->x1;
    if (step->whole) {
        topp->head++;
        return;
    }
    double share =
        step->length / rows->length; /* a stop inside: rows of the rest stay
                              those of the ends, cut linearly */
    for (int axis = 0; axis < topp->cfg.axes; axis++) {
        double cx = rows->cx[2 * axis];
        double cu = rows->cu[2 * axis];
        double ex = rows->cx[2 * axis + 1];
        double eu = rows->cu[2 * axis + 1] - 2.0 * rows->length * ex;
        rows->cx[2 * axis] = cx + share * (ex - cx);
        rows->cu[2 * axis] = cu + share * (eu - cu);
        double left = rows->length - step->length;
        rows->cu[2 * axis + 1] = eu + 2.0 * left * ex;
    }
    rows->length -= step->length;
    rows->offset += step->length;
    topp->changed = true;
}

static bool due(const topp2 *topp) {
    if (topp->changed || topp->head >= topp->planned) {
        return true;
    }
    return topp->tail != topp->planned
           && (double)(topp->planned - topp->head)
                  < (1.0 - TOPP2_BATCH)
                        * fmin(topp->cfg.window_knots, topp->cfg.window_blocks);
}

int64_t topp2_take(topp2 *topp, jerk_law *laws, int64_t max, double seconds) {
    int64_t count = 0;
    double t = 0.0;
    while (count < max && t < seconds && topp->head != topp->tail) {
        if (due(topp)) {
            backward(topp);
        }
        knot_rows *rows = row_at(topp, topp->head);
        if (topp->x <= 0.0 && (topp->hold || v2_limit_of(topp, rows) <= 0.0)) {
            break;
        }
        struct step step = next_step(topp);
        if (!(topp->x + step.x1 > 0.0)) { /* between two standstills */
            if (count + 2 > max
                || !(next_controllable_v2(topp, topp->head) <= 0.0)) {
                break;
            }
            hop(topp, rows, &laws[count]);
            t += laws[count].time + laws[count + 1].time;
            count += 2;
            topp->head++;
            continue;
        }
        step.acc = (step.x1 - topp->x) / (2.0 * step.length);
        set_law(rows,
                step.length,
                topp->x,
                step.acc,
                &laws[count],
                step.whole && rows->last);
        t += laws[count++].time;
        topp->steps++;
        consume(topp, &step);
    }
    return count;
}

int64_t topp2_tail(const topp2 *topp, jerk_law *laws, int64_t max) {
    int64_t count = 0;
    double x = topp->x;
    for (uint64_t i = topp->head; i != topp->tail && count < max && x > 0.0;
         i++) {
        struct step step = step_over(topp, i, x, true, 1e30);
        if (row_at(topp, i)->stand) {
            step.x1 = 0.0;
        }
        step.acc = (step.x1 - x) / (2.0 * step.length);
        set_law(row_at(topp, i),
                step.length,
                x,
                step.acc,
                &laws[count++],
                step.whole && row_at(topp, i)->last);
        x = step.x1;
    }
    return count;
}

void topp2_override(topp2 *topp, double feed, double rapid) {
    if (!isfinite(feed) || !isfinite(rapid)) {
        return;
    }
    topp->changed = topp->changed || feed != topp->feed_factor
                    || rapid != topp->rapid_factor;
    topp->feed_factor = fmax(0.0, feed);
    topp->rapid_factor = fmax(0.0, rapid);
}

void topp2_hold(topp2 *topp, int hold) {
    topp->hold = hold != 0;
}

uint64_t topp2_steps(const topp2 *topp) {
    return topp->steps;
}

topp2 *topp2_new(const jerk_config *config, int capacity) {
    jerk_config this_config = *config;
    for (int axis = 0; axis < JERK_AXES; axis++) {
        this_config.j_max[axis] = 1.0;
    }
    if (jerk_check_config(&this_config)) {
        return NULL;
    }
    topp2 *topp = calloc(1, sizeof *topp);
    if (!topp) {
        return NULL;
    }
    topp->cfg = this_config;
    topp->spacing =
        this_config.spacing_mm > 0 ? this_config.spacing_mm : TOPP2_SPACING_MM;
    topp->feed_factor = 1.0;
    topp->rapid_factor = 1.0;
    topp->mask = 1023;
    while (topp->mask + 1 < (uint64_t)(capacity > 0 ? capacity : 0)) {
        topp->mask = 2 * topp->mask + 1;
    }
    topp->ring = calloc(topp->mask + 1, sizeof *topp->ring);
    if (topp->ring) {
        return topp;
    }
    free(topp);
    return NULL;
}

void topp2_free(topp2 *topp) {
    if (!topp) {
        return;
    }
    free(topp->ring);
    free(topp);
}
