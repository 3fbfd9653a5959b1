/* The planner's grid: pushed intervals, subdivided where they are long or near
 * a standstill, with their caps. */
#include <math.h>
#include <string.h>
#include "jerk/state.h"

#define GRADING                                                                \
    0.25 /* growth of the spacing with the distance from a standstill, ... */
#define REST_GRADING 0.1 /* ... and on curves, ... */
#define RAMP_STEPS                                                             \
    6.0 /* ... over so many of the longest steps: the ramp to full             \
           acceleration */
#define REST_SHARE                                                             \
    (1.0 / 20.0) /* of a line, that one interval from rest may take: half of   \
                    the way is four ramps of jerk */
#define REST_FEED                                                              \
    (1.0 / 12.0) /* of the way in which jerk changes the feed: half of the     \
                    ramp to half of it */
#define REST_MOST                                                              \
    (1.0 / 3.0) /* of the pushed interval, that it may take in any case */
#define BEHIND_REST 0.2 /* step behind such an interval, over its length */
#define STOP_STEPS 60   /* of a stop at least */
#define BEND_STEP                                                              \
    0.5 /* change of the third derivatives in one planner interval, of the     \
           largest ... */
#define BEND_MATTERS                                                           \
    40.0 /* ... where at full feed it would take so many times the jerk limit  \
          */
#define BEND_DECIDES                                                           \
    200.0 /* where it would take so many times and the pushed interval turns   \
             next to not at all, as in blends of small angles: */
#define BEND_FINER 0.2
#define JUMP_SHARE                                                             \
    0.5 /* share of the jerk limit that jumps of derivatives may use */
#define ACC_SHARE                                                              \
    0.012 /* share of the acceleration limit that a jump of the direction may  \
             use: nothing is set aside for it */
#define STEP_SEEN                                                              \
    0.75 /* an acceleration step da shows as a jerk of at most 0.75 da / cycle \
            in samples */
#define SLOW                                                                   \
    0.5 /* grid step over the length in which jerk changes a low speed */
#define SLOWEST_STEP                                                           \
    0.1 /* of the step at a standstill: the finest where the path goes on      \
           slowly, ... */
#define SLOWEST_KNOT                                                           \
    2e-3 /* ... and at knots that are passed slowly, between which it grows    \
            again */
#define SLOW_FEED 1.0 /* the same for a low feed: of the speed that counts */
#define SLOW_TAIL                                                              \
    0.6 /* and at the end of the window, where the plan comes to rest */
#define LEAST_SHARE                                                            \
    0.25 /* of the jerk limit that the continuous motion keeps */
#define SMALL_JUMP                                                             \
    1e-3 /* jumps below this share of the limit at the present cap need no     \
            reserve */

/* Largest path jerk (scaled) over the rest interval s: at distance d from the
 * standstill x ~ d^(4/3), and every axis jerk is jerk * |q' +- 9 d q'' + 4.5
 * d^2 q'''| (minus where the interval ends at rest). */
static double rest_jerk(const jerk_planner *planner,
                        const struct segment *segment,
                        int at_end) {
    jerk_interval half;
    double most = 0.0, h = segment->h, sign = at_end ? -1.0 : 1.0;
    interval_part(segment->q, 0.0, 0.5 * h, planner->cfg.axes, &half);
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        const jerk_interval *interval = segment->q;
        int far = !at_end;
        double near = interval->d1[at_end][axis], d = 0.5 * h;
        double mid = half.d1[1][axis] + sign * 9.0 * d * half.d2[1][axis]
                     + 4.5 * d * d * half.d3[1][axis];
        double end = interval->d1[far][axis]
                     + sign * 9.0 * h * interval->d2[far][axis]
                     + 4.5 * h * h * interval->d3[far][axis];
        double value = fmax(fabs(near), fmax(fabs(mid), fabs(end)));
        most = fmax(most,
                    value
                        / (segment->share * JERK_USABLE
                           * jerk_max(planner, interval, axis)));
    }
    return most > 0.0
               ? 1.0 / (most * planner->scale * planner->scale * planner->scale)
               : 1e30;
}

static double velocity_cap(const jerk_planner *planner,
                           const jerk_interval *interval) {
    double v = interval->v_hard > 0 ? interval->v_hard : 1e30;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        double h = interval->length,
               mid = 0.5 * (interval->d1[0][axis] + interval->d1[1][axis])
                     + 0.125 * h
                           * (interval->d2[0][axis] - interval->d2[1][axis]);
        double most = fmax(
            fabs(mid),
            fmax(fabs(interval->d1[0][axis]), fabs(interval->d1[1][axis])));
        if (most * v > planner->cfg.v_max[axis]) {
            v = planner->cfg.v_max[axis] / most;
        }
    }
    v = fmin(v * VEL_USABLE, 10.0 * planner->scale) / planner->scale;
    return v * v;
}

/* Where the path bends so little that no row bounds it, the tangent terms still
 * do; a cap keeps x bounded. */
void segment_limits(const jerk_planner *planner, struct segment *segment) {
    const jerk_interval *interval = segment->q;
    double feed =
        fmin(1e15,
             asked_speed(planner, interval) * VEL_USABLE / planner->scale);
    segment->h = interval->length;
    segment->jump = segment->share = 1.0;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        segment->acc[axis] = 1.0;
    }
    segment->excess = segment->fast = segment->leave = 0.0;
    segment->cap = velocity_cap(planner, interval);
    segment->soft = fmin(segment->cap, feed * feed);
    segment->slower = 1.0;
}

/* Share of the jerk limit that jumps of q' and q'' take when they are passed
 * with x. */
static double jump_used(const jerk_planner *planner,
                        const jerk_interval *left,
                        const jerk_interval *right,
                        double x) {
    double dt = planner->cfg.cycle_s, f = planner->scale, used = 0.0;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        double bend =
            STEP_SEEN * f * f * fabs(right->d2[0][axis] - left->d2[1][axis]);
        double corner = f / dt * fabs(right->d1[0][axis] - left->d1[1][axis]);
        used = fmax(used,
                    (bend * x + corner * sqrt(x))
                        / (fmin(jerk_max(planner, left, axis),
                                jerk_max(planner, right, axis))
                           * dt));
    }
    return used;
}

/* Largest x <= cap at which the jumps take no more than their share. */
static double jump_cap(const jerk_planner *planner,
                       const jerk_interval *left,
                       const jerk_interval *right,
                       double cap) {
    double dt = planner->cfg.cycle_s, f = planner->scale;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        double room = JUMP_SHARE
                      * fmin(jerk_max(planner, left, axis),
                             jerk_max(planner, right, axis))
                      * dt;
        double bend =
            STEP_SEEN * f * f * fabs(right->d2[0][axis] - left->d2[1][axis]);
        double corner = f / dt * fabs(right->d1[0][axis] - left->d1[1][axis]);
        double v =
            2.0 * room
            / (corner + sqrt(corner * corner + 4.0 * bend * room) + 1e-300);
        double acc =
            ACC_SHARE
            * fmin(acc_max(planner, left, axis), acc_max(planner, right, axis));
        if (corner * v > acc) {
            v = acc / corner;
        }
        cap = fmin(cap, v * v); /* bend x + corner sqrt(x) <= room */
    }
    return cap;
}

/* A jump shows in samples up to one and a half cycles away; the speed may rise
 * from x as fast as the path allows. */
static double jump_reach(const jerk_planner *planner,
                         const jerk_interval *left,
                         const jerk_interval *right,
                         double x) {
    double jerk = 1e30, t = 1.5 * planner->cfg.cycle_s;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        double along = fmax(fabs(left->d1[1][axis]), fabs(right->d1[0][axis]));
        jerk = fmin(
            jerk,
            fmax(jerk_max(planner, left, axis), jerk_max(planner, right, axis))
                / fmax(1e-9, along));
    }
    return t * (sqrt(x) * planner->scale + jerk * t * t / 6.0) + 1e-9;
}

/* The jump between two intervals that is passed at the head: it still shows in
 * what comes next. */
void jump_passed(jerk_planner *planner,
                 const jerk_interval *left,
                 const jerk_interval *right) {
    double used = jump_used(planner, left, right, planner->x);
    turn_passed(planner, left, right);
    if (used < SMALL_JUMP) {
        return;
    }
    planner->behind_share = fmax(1.0 - used, LEAST_SHARE);
    planner->behind_mm = jump_reach(planner, left, right, planner->x);
}

/* Jumps within reach of each other add up in the samples. */
static void take_share(struct segment *segment, double used) {
    segment->jump = fmax(segment->jump - used, LEAST_SHARE);
}

/* Cap at knot k, and what is left of the jerk limit around it. */
static void knot_jump(const jerk_planner *planner, struct grid *grid, int k) {
    const jerk_interval *left = grid->seg[k - 1].q, *right = grid->seg[k].q;
    if (!grid->seg[k - 1].last) {
        return;
    }
    grid->knot_cap[k] = jump_cap(planner, left, right, grid->knot_cap[k]);
    double used = jump_used(planner, left, right, grid->knot_cap[k]);
    if (used < SMALL_JUMP) {
        return;
    }
    double reach = jump_reach(planner, left, right, grid->knot_cap[k]);
    for (int i = k - 1;
         i >= 0 && grid->from_start[k] - grid->from_start[i + 1] < reach;
         i--) {
        take_share(&grid->seg[i], used);
    }
    for (int i = k;
         i < grid->n && grid->from_start[i] - grid->from_start[k] < reach;
         i++) {
        take_share(&grid->seg[i], used);
    }
}

void knot_caps(const jerk_planner *planner, struct grid *grid) {
    grid->from_start[0] = 0.0;
    for (int k = 0; k <= grid->n; k++) {
        double left = k > 0 ? grid->seg[k - 1].cap : 1e30,
               right = k < grid->n ? grid->seg[k].cap : 1e30;
        grid->knot_cap[k] = fmin(left, right);
        if (k < grid->n) {
            grid->from_start[k + 1] = grid->from_start[k] + grid->seg[k].h;
        }
    }
    for (int k = 1; k < grid->n; k++) {
        knot_jump(planner, grid, k);
    }
    turn_caps(planner, grid);
    for (int k = 0; k < grid->n; k++) {
        if (grid->from_start[k] < planner->behind_mm) {
            take_share(&grid->seg[k], 1.0 - planner->behind_share);
        }
        grid->seg[k].share = grid->seg[k].jump * *grid->seg[k].tight;
    }
    for (int k = 0; k < grid->n; k++) {
        grid->seg[k].jerk_up =
            k == 0 ? rest_jerk(planner, &grid->seg[k], 0) : 0.0;
        grid->seg[k].jerk_down =
            k == grid->n - 1 ? rest_jerk(planner, &grid->seg[k], 1) : 0.0;
    }
}

static bool straight(const jerk_planner *planner,
                     const jerk_interval *interval) {
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        if (interval->d2[0][axis] != 0.0 || interval->d2[1][axis] != 0.0) {
            return false;
        }
    }
    return true;
}

static bool add_segment(const jerk_planner *planner,
                        struct grid *grid,
                        const jerk_interval *interval,
                        uint64_t i,
                        bool last) {
    if (grid->n >= grid->max) {
        return false;
    }
    struct segment *segment = &grid->seg[grid->n++];
    segment->q = interval;
    segment->last = last;
    segment->at = i;
    segment->own = segment->bulge = 1.0;
    segment->tight = straight(planner, interval)
                         ? &segment->own
                         : &planner->tight[i & planner->mask];
    segment->before = *segment->tight;
    segment_limits(planner, segment);
    return true;
}

typedef struct extent {
    uint64_t end; /* ring index behind the window */
    double length;
    bool stands; /* ends where the axes must stand, or where the path is known
                    to end */
} extent;

/* How far the window reaches: by blocks, by knots, to a stand or to the end of
 * what was pushed. */
static struct extent window_extent(const jerk_planner *planner) {
    struct extent extent = {planner->head, 0.0, false};
    double knots = 0.0;
    int blocks = 0;
    while (extent.end != planner->tail) {
        const jerk_interval *interval = ring_at(planner, extent.end);
        if (extent.end != planner->head
            && asked_speed(planner, interval) <= 0.0) {
            return extent; /* an override of zero begins here */
        }
        extent.end++;
        extent.length += interval->length;
        knots += knots_at(planner, extent.end - 1);
        blocks += (int)interval->blocks;
        if (interval->flags & JERK_STAND) {
            extent.stands = true;
            return extent;
        }
        if (knots >= planner->cfg.window_knots
            || blocks >= planner->cfg.window_blocks) {
            return extent;
        }
    }
    extent.stands = planner->finished;
    return extent;
}

/* Step at a standstill on interval i of the ring. */
static double finest_at(const jerk_planner *planner,
                        const struct grid *grid,
                        uint64_t i) {
    return fmin(steps_at(planner, i)->finest, grid->finest);
}

/* Jerk along the path at the start of q that all axes can follow. */
static double path_jerk(const jerk_planner *planner,
                        const jerk_interval *interval) {
    double jerk = 1e30;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        jerk = fmin(jerk,
                    jerk_max(planner, interval, axis)
                        / fmax(1e-9, fabs(interval->d1[0][axis])));
    }
    return jerk;
}

/* Length over which the speed v can change much under the path jerk on interval
 * i: the grid must resolve it, down to a share `least` of the step at a
 * standstill. */
static double slow_length(const jerk_planner *planner,
                          const struct grid *grid,
                          uint64_t i,
                          double v,
                          double least) {
    return fmin(
        steps_at(planner, i)->longest,
        fmax(least * finest_at(planner, grid, i),
             SLOW * v * sqrt(v / path_jerk(planner, ring_at(planner, i)))));
}

/* Cap on x (scaled) over an interval by feed and machine. */
static double feed_cap(const jerk_planner *planner,
                       const jerk_interval *interval) {
    struct segment segment = {.q = interval};
    segment_limits(planner, &segment);
    return segment.soft;
}

/* The part of the way from rest to the feed of q that one interval may take. */
static double feed_part(const jerk_planner *planner,
                        const jerk_interval *interval) {
    double v = planner->scale * sqrt(feed_cap(planner, interval));
    return REST_FEED * v * sqrt(v / path_jerk(planner, interval));
}

/* How long the interval from or to rest is on the first or last `len` mm of
 * interval i: constant jerk is exact there on a line. Behind it the speed
 * multiplies from knot to knot, so the steps are short at first. */
static double rest_length(const jerk_planner *planner,
                          const struct grid *grid,
                          uint64_t i,
                          double len) {
    const jerk_interval *interval = ring_at(planner, i);
    double finest = finest_at(planner, grid, i),
           feed = feed_part(planner, interval);
    double least =
        fmin(REST_MOST * len, fmin(finest, fmax(SLOWEST_KNOT * finest, feed)));
    if (!straight(planner, interval)) {
        return fmin(least, steps_at(planner, i)->bent_rest);
    }
    return fmax(least,
                fmin(steps_at(planner, i)->rest, fmin(REST_SHARE * len, feed)));
}

/* Step at the knot ahead of interval i: fine where it must be passed slowly or
 * the feed changes. */
static double knot_step(const jerk_planner *planner,
                        const struct grid *grid,
                        uint64_t i) {
    const jerk_interval *left = ring_at(planner, i - 1),
                        *right = ring_at(planner, i);
    double before = feed_cap(planner, left), after = feed_cap(planner, right),
           open = fmin(before, after);
    double cap = jump_cap(planner, left, right, open),
           longest = fmax(steps_at(planner, i - 1)->longest,
                          steps_at(planner, i)->longest);
    if (cap > 0.8 * open && open > 0.6 * fmax(before, after)) {
        return longest;
    }
    return slow_length(planner,
                       grid,
                       i,
                       planner->scale * sqrt(cap),
                       SLOWEST_KNOT);
}

/* Longest interval on interval i of the ring at the speed v: where the
 * curvature changes so that jerk bounds the speed below v the path jerk is
 * constant over it, what the axes need to follow the bend is not. */
static double bend_length(const jerk_planner *planner, uint64_t i, double v) {
    const struct steps *steps = steps_at(planner, i);
    double times = steps->bend * v * v * v,
           part =
               times > BEND_DECIDES && steps->little ? BEND_FINER : BEND_STEP;
    return times < BEND_MATTERS ? steps->turn
                                : fmin(steps->turn, part * steps->even);
}

/* Growth of the spacing over interval i, which begins `at` mm from a standstill
 * on a curve: near it the speed multiplies from knot to knot, and rows hold the
 * jerk at the faster one. */
static double grading_at(const jerk_planner *planner, uint64_t i, double at) {
    return at < RAMP_STEPS * steps_at(planner, i)->longest ? REST_GRADING
                                                           : GRADING;
}

/* Steps at the knots of the pushed intervals head .. head + n - 1 (n + 1
 * values). */
static void knot_steps(const jerk_planner *planner,
                       struct grid *grid,
                       int count,
                       bool stands,
                       const double *rest) {
    double *step = grid->step;
    uint64_t head = planner->head, end = head + (uint64_t)count - 1;
    step[0] = planner->at_rest ? BEHIND_REST * rest[0]
                               : slow_length(planner,
                                             grid,
                                             head,
                                             planner->scale * sqrt(planner->x),
                                             SLOWEST_KNOT);
    step[count] =
        stands
            ? BEHIND_REST * rest[1]
            : slow_length(planner,
                          grid,
                          end,
                          planner->scale
                              * sqrt(feed_cap(planner, ring_at(planner, end)))
                              * SLOW_TAIL,
                          SLOWEST_STEP);
    for (int i = 1; i < count; i++) {
        step[i] = fmin(knot_step(planner, grid, head + i),
                       2.0
                           * fmin(steps_at(planner, head + i - 1)->turn,
                                  steps_at(planner, head + i)->turn));
    }
    double at = planner->at_rest && !straight(planner, ring_at(planner, head))
                    ? 0.0
                    : INFINITY,
           to = stands && !straight(planner, ring_at(planner, end)) ? 0.0
                                                                    : INFINITY;
    for (int i = 1; i <= count;
         at += ring_at(planner, head + i - 1)->length, i++) {
        grid->grade[i - 1] = grading_at(planner, head + i - 1, at);
        step[i] = fmin(step[i],
                       step[i - 1]
                           + grid->grade[i - 1]
                                 * ring_at(planner, head + i - 1)->length);
    }
    for (int i = count - 1; i >= 0;
         to += ring_at(planner, head + i)->length, i--) {
        grid->grade[i] =
            fmin(grid->grade[i], grading_at(planner, head + i, to));
        step[i] = fmin(
            step[i],
            step[i + 1] + grid->grade[i] * ring_at(planner, head + i)->length);
    }
}

/* Length of the next planner interval, `d0` behind a knot with the step s0 and
 * `d1` ahead of one with s1. */
static double step_at(double longest,
                      double grading,
                      double d0,
                      double s0,
                      double d1,
                      double s1) {
    double behind = s0 + grading * d0,
           ahead = fmax(s1, (s1 + grading * d1) / (1.0 + grading));
    return fmin(longest, fmin(behind, ahead));
}

static bool add_part(const jerk_planner *planner,
                     struct grid *grid,
                     uint64_t i,
                     double from,
                     double to) {
    const jerk_interval *interval = ring_at(planner, i);
    if (from <= 0.0 && to >= interval->length) {
        return add_segment(planner, grid, interval, i, true);
    }
    if (grid->n >= grid->max) {
        return false;
    }
    jerk_interval *part = &grid->parts[grid->used++];
    interval_part(interval, from, to, planner->cfg.axes, part);
    return add_segment(planner, grid, part, i, to >= interval->length);
}

/* Lay the grid over one pushed interval, or the first `len` mm of it, with such
 * intervals from and to rest in it. */
static bool fill_interval(jerk_planner *planner,
                          struct grid *grid,
                          int i,
                          double len,
                          double rest_from,
                          double rest_to) {
    const uint64_t at = planner->head + (uint64_t)i;
    const jerk_interval *interval = ring_at(planner, at);
    double v = planner->scale * sqrt(feed_cap(planner, interval)),
           slow =
               fmax(slow_length(planner, grid, at, v * SLOW_FEED, SLOWEST_STEP),
                    fmin(steps_at(planner, at)->least, SLOW_TIME * v));
    double turn = fmin(bend_length(planner, at, v), slow), end = len - rest_to;
    if (rest_from > 0.0 && !add_part(planner, grid, at, 0.0, rest_from)) {
        return false;
    }
    for (double done = rest_from; done < end;) {
        double left = end - done,
               step = grid->finer
                      * fmin(turn,
                             step_at(steps_at(planner, at)->longest,
                                     grid->grade[i],
                                     done,
                                     grid->step[i],
                                     len - done,
                                     grid->step[i + 1]));
        double parts = ceil(left / step - 1e-6),
               next = parts <= 1.0 ? end : done + left / parts;
        if (!add_part(planner, grid, at, done, next)) {
            return false;
        }
        done = next;
    }
    return !(rest_to > 0.0) || add_part(planner, grid, at, end, len);
}

/* Lay the grid over the path up to `to` mm ahead; false if it does not fit. */
static bool grid_fill(jerk_planner *planner,
                      struct grid *grid,
                      const struct extent *extent,
                      double to) {
    int count = (int)(extent->end - planner->head);
    grid->n = grid->used = 0;
    grid->rest_start = planner->at_rest;
    grid->stands = extent->stands;
    grid->land_from = grid->land_to = -1.0;
    grid->finest = extent->length / 24.0;
    if (count > grid->max) {
        return false;
    }
    double ahead = to, rest[2] = {0.0, 0.0};
    for (int i = 0; i < count - 1; i++) {
        ahead -= ring_at(planner, planner->head + (uint64_t)i)->length;
    }
    if (count > 0 && planner->at_rest) {
        rest[0] =
            rest_length(planner,
                        grid,
                        planner->head,
                        fmin(to, ring_at(planner, planner->head)->length));
    }
    if (count > 0 && extent->stands) {
        rest[1] =
            rest_length(planner,
                        grid,
                        extent->end - 1,
                        fmin(ahead, ring_at(planner, extent->end - 1)->length));
    }
    knot_steps(planner, grid, count, extent->stands, rest);
    double at = 0.0;
    for (int i = 0; i < count && to - at > 1e-9; i++) {
        double whole = ring_at(planner, planner->head + (uint64_t)i)->length,
               len = to - at > whole - 1e-9 ? whole : to - at;
        if (!fill_interval(planner,
                           grid,
                           i,
                           len,
                           i == 0 ? rest[0] : 0.0,
                           i == count - 1 ? rest[1] : 0.0)) {
            return false;
        }
        at += len;
    }
    return true;
}

/* The path ahead up to a distance. */
static struct extent extent_to(const jerk_planner *planner, double distance) {
    struct extent extent = {planner->head, 0.0, true};
    while (extent.end != planner->tail && extent.length < distance) {
        extent.length += ring_at(planner, extent.end++)->length;
    }
    extent.length = fmin(extent.length, distance);
    return extent;
}

/* The window of the next plan, or the first `reach` mm of it. */
void grid_window(jerk_planner *planner, struct grid *grid, double reach) {
    struct extent extent = window_extent(planner);
    bool whole = extent.length <= reach;
    grid->finer = 1.0;
    if (!whole) {
        extent = extent_to(planner, reach);
    }
    if (!grid_fill(planner, grid, &extent, whole ? 1e30 : reach)) {
        grid->stands = false;
    }
    if (!whole) {
        grid->stands =
            false; /* it ends at rest where the axes need not stand */
    }
    knot_caps(planner, grid);
}

/* A grid that ends at rest `distance` mm ahead; false if it does not fit. */
bool grid_to(jerk_planner *p, struct grid *g, double distance) {
    struct extent e = extent_to(p, distance);
    if (e.length < distance - 1e-9) {
        return false;
    }
    g->finer = 1.0;
    bool fits = grid_fill(p, g, &e, distance);
    if (fits && g->n < STOP_STEPS) {
        g->finer = (double)g->n / STOP_STEPS;
        fits = grid_fill(p, g, &e, distance);
    }
    knot_caps(p, g);
    return fits;
}
