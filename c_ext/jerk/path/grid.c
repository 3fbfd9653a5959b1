/* The planner's grid: pushed intervals, subdivided where they are long or near
 * a standstill, with their caps. */
#include <math.h>
#include "jerk/path/caps.h"
#include "jerk/path/grid.h"
#include "jerk/path/plan_law.h"
#include "jerk/path/ring.h"
#include "jerk/state/state.h"
#include "maths/order.h"

static bool straight(const jerk_planner *planner,
                     const jerk_interval *interval) {
    for (int axis = 0; axis < planner->axes; axis++) {
        double first = interval->d2[0][axis];
        double last = interval->d2[1][axis];
        if (first != 0.0 || last != 0.0) {
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
    if (grid->count >= grid->max) {
        return false;
    }
    struct segment *segment = &grid->seg[grid->count++];
    segment->interval = interval;
    segment->last = last;
    segment->at = i;
    segment->own = 1.0;
    segment->bulge = 1.0;
    segment->bow = 0.0;
    segment->tight = straight(planner, interval)
                         ? &segment->own
                         : &planner->tight[i & planner->mask];
    segment->acc_tight = &planner->acc_tight[i & planner->mask];
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
    return lesser(steps_at(planner, i)->finest, grid->finest);
}

/* Jerk along the path at the start of q that all axes can follow. */
static double path_jerk(const jerk_planner *planner,
                        const jerk_interval *interval) {
    double jerk = 1e30;
    for (int axis = 0; axis < planner->axes; axis++) {
        jerk = lesser(jerk,
                      jerk_max(planner, interval, axis)
                          / fmax(1e-9, fabs(interval->d1[0][axis])));
    }
    return jerk;
}

/* Length over which the speed v can change much under the path jerk on interval
 * i. */
static double slow_way(const jerk_planner *planner, uint64_t i, double v) {
    return v * sqrt(v / path_jerk(planner, ring_at(planner, i)));
}

/* A step that resolves it, down to a share `least` of the step at a standstill.
 */
static double slow_length(const jerk_planner *planner,
                          const struct grid *grid,
                          uint64_t i,
                          double v,
                          double least) {
    return greater(least * finest_at(planner, grid, i),
                   SLOW * slow_way(planner, i, v));
}

/* Cap on x (scaled) over an interval by feed and machine. */
static double feed_cap(const jerk_planner *planner,
                       const jerk_interval *interval) {
    struct segment segment = {.interval = interval};
    segment_limits(planner, &segment);
    return segment.soft;
}

/* The part of the way from rest to the feed of q that one interval may take. */
static double feed_part(const jerk_planner *planner,
                        const jerk_interval *interval) {
    double v = planner->scale * sqrt(feed_cap(planner, interval));
    return STANDSTILL_FEED * v * sqrt(v / path_jerk(planner, interval));
}

/* How long the interval from or to rest is on the first or last `len` mm of
 * interval i: constant jerk is exact there on a line. Behind it the speed
 * multiplies from knot to knot, so the steps are short at first. */
static double standstill_length(const jerk_planner *planner,
                                const struct grid *grid,
                                uint64_t i,
                                double len) {
    const jerk_interval *interval = ring_at(planner, i);
    double finest = finest_at(planner, grid, i);
    double feed = feed_part(planner, interval);
    double least = lesser(STANDSTILL_MOST * len,
                          lesser(finest, greater(SLOWEST_KNOT * finest, feed)));
    if (!straight(planner, interval)) {
        return lesser(least, steps_at(planner, i)->curve_standstill);
    }
    return greater(least,
                   lesser(steps_at(planner, i)->line_standstill,
                          lesser(STANDSTILL_SHARE * len, feed)));
}

/* Step at the knot ahead of interval i: fine where it must be passed slowly or
 * the feed changes. */
static double knot_step(const jerk_planner *planner,
                        const struct grid *grid,
                        uint64_t i) {
    const jerk_interval *left = ring_at(planner, i - 1);
    const jerk_interval *right = ring_at(planner, i);
    double before = feed_cap(planner, left);
    double after = feed_cap(planner, right);
    double open = lesser(before, after);
    double cap = jump_cap(planner, left, right, open);
    if (cap > 0.8 * open && open > 0.6 * greater(before, after)) {
        return INFINITY;
    }
    double way = slow_way(planner, i, planner->scale * sqrt(cap));
    return greater(SLOWEST_KNOT * finest_at(planner, grid, i), SLOW_KNOT * way);
}

/* The squared speed grows by so much over interval i at the most. */
static double most_gained(const jerk_planner *planner, uint64_t i) {
    return 2.0 * steps_at(planner, i)->along * ring_at(planner, i)->length;
}

/* How fast the path can be at the knots of the pushed intervals, by its bends
 * and the accelerations between them. */
static void set_reach(const jerk_planner *planner,
                      struct grid *grid,
                      int count,
                      bool stands) {
    double *reach = grid->reach;
    uint64_t head = planner->head;
    reach[0] = planner->x * planner->scale * planner->scale;
    for (int i = 1; i <= count; i++) {
        double top = steps_at(planner, head + i - 1)->top[1];
        double next = i < count ? steps_at(planner, head + i)->top[0]
                      : stands  ? 0.0
                                : INFINITY;
        reach[i] = lesser(lesser(top, next),
                          reach[i - 1] + most_gained(planner, head + i - 1));
    }
    for (int i = count - 1; i >= 0; i--) {
        reach[i] =
            lesser(reach[i], reach[i + 1] + most_gained(planner, head + i));
    }
}

/* Longest interval on interval i behind the head, at the feed `v`. What is
 * driven in a part of a cycle is short enough, at speeds in reach at its ends.
 */
static double longest_at(const jerk_planner *planner,
                         const struct grid *grid,
                         int i,
                         double v) {
    double reach = sqrt(lesser(grid->reach[i], grid->reach[i + 1]));
    return greater(steps_at(planner, planner->head + (uint64_t)i)->longest,
                   FAST_CYCLES * planner->cfg.cycle_s * lesser(v, reach));
}

/* Longest interval on interval i behind the head: where the curvature changes
 * so that jerk bounds the speed below what can be reached there the path jerk
 * is constant over it, what the axes need to follow the bend is not. Where they
 * need most in the middle, rows at the ends do not see it. */
static double bend_length(const jerk_planner *planner,
                          const struct grid *grid,
                          int i,
                          double feed) {
    const uint64_t at = planner->head + (uint64_t)i;
    const struct steps *steps = steps_at(planner, at);
    double inside =
        0.5 * (grid->reach[i] + grid->reach[i + 1] + most_gained(planner, at));
    double v = lesser(feed, sqrt(inside));
    double times = steps->bend * v * v * v;
    double part =
        times > BEND_DECIDES && steps->little ? BEND_FINER : BEND_STEP;
    double matters = steps->peaks ? 1.0 : BEND_MATTERS;
    return times < matters ? steps->turn
                           : lesser(steps->turn, part * steps->even);
}

/* Growth of the spacing over interval i, which begins `at` mm from a standstill
 * on a curve: near it the speed multiplies from knot to knot, and rows hold the
 * jerk at the faster one. */
static double grading_at(const jerk_planner *planner, uint64_t i, double at) {
    return at < RAMP_STEPS * steps_at(planner, i)->longest ? STANDSTILL_GRADING
                                                           : GRADING;
}

/* Step where the window begins in motion: what it begins with asks for all of
 * the jerk, and where the speed changes much an interval has more inside. */
static double entry_step(const jerk_planner *planner, const struct grid *grid) {
    uint64_t head = planner->head;
    double change = ENTRY_STEP * planner->x / fmax(1e-30, fabs(planner->accel));
    double least = SLOWEST_KNOT * finest_at(planner, grid, head);
    double v = speed_at_head(planner);
    return lesser(slow_length(planner, grid, head, v, SLOWEST_KNOT),
                  greater(least, change));
}

/* Steps at the knots of the pushed intervals head .. head + n - 1 (n + 1
 * values). */
static void knot_steps(const jerk_planner *planner,
                       struct grid *grid,
                       int count,
                       bool stands,
                       const double *standstill) {
    double *step = grid->step;
    uint64_t head = planner->head;
    uint64_t end = head + (uint64_t)count - 1;
    step[0] = planner->at_standstill ? BEHIND_STANDSTILL * standstill[0]
                                     : entry_step(planner, grid);
    step[count] =
        stands
            ? BEHIND_STANDSTILL * standstill[1]
            : slow_length(planner,
                          grid,
                          end,
                          planner->scale
                              * sqrt(feed_cap(planner, ring_at(planner, end)))
                              * SLOW_TAIL,
                          SLOWEST_STEP);
    for (int i = 1; i < count; i++) {
        step[i] = lesser(knot_step(planner, grid, head + i),
                         2.0
                             * lesser(steps_at(planner, head + i - 1)->turn,
                                      steps_at(planner, head + i)->turn));
    }
    double at =
        planner->at_standstill && !straight(planner, ring_at(planner, head))
            ? 0.0
            : INFINITY;
    double to =
        stands && !straight(planner, ring_at(planner, end)) ? 0.0 : INFINITY;
    for (int i = 1; i <= count;
         at += ring_at(planner, head + i - 1)->length, i++) {
        grid->grade[i - 1] = grading_at(planner, head + i - 1, at);
        step[i] = lesser(step[i],
                         step[i - 1]
                             + grid->grade[i - 1]
                                   * ring_at(planner, head + i - 1)->length);
    }
    for (int i = count - 1; i >= 0;
         to += ring_at(planner, head + i)->length, i--) {
        grid->grade[i] =
            lesser(grid->grade[i], grading_at(planner, head + i, to));
        step[i] = lesser(
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
    double behind = s0 + grading * d0;
    double ahead = greater(s1, (s1 + grading * d1) / (1.0 + grading));
    return lesser(longest, lesser(behind, ahead));
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
    if (grid->count >= grid->max) {
        return false;
    }
    jerk_interval *part = &grid->parts[grid->used++];
    interval_part(interval, from, to, planner->axes, part);
    return add_segment(planner, grid, part, i, to >= interval->length);
}

/* Lay the grid over one pushed interval, or the first `len` mm of it, with such
 * intervals from and to rest in it. */
static bool fill_interval(jerk_planner *planner,
                          struct grid *grid,
                          int i,
                          double len,
                          double stand_from,
                          double stand_to) {
    const uint64_t at = planner->head + (uint64_t)i;
    const jerk_interval *interval = ring_at(planner, at);
    double v = planner->scale
               * sqrt(greater(grid->lowest, feed_cap(planner, interval)));
    double slow = greater(slow_length(planner, grid, at, v, SLOWEST_STEP),
                          lesser(steps_at(planner, at)->least, SLOW_TIME * v));
    double turn = lesser(bend_length(planner, grid, i, v), slow);
    double longest = longest_at(planner, grid, i, v);
    double end = len - stand_to;
    if (stand_from > 0.0 && !add_part(planner, grid, at, 0.0, stand_from)) {
        return false;
    }
    for (double done = stand_from; done < end;) {
        double left = end - done;
        double step = grid->finer
                      * lesser(turn,
                               step_at(longest,
                                       grid->grade[i],
                                       done,
                                       grid->step[i],
                                       len - done,
                                       grid->step[i + 1]));
        double parts = ceil(left / step - 1e-6);
        double next = parts <= 1.0 ? end : done + left / parts;
        if (!add_part(planner, grid, at, done, next)) {
            return false;
        }
        done = next;
    }
    return !(stand_to > 0.0) || add_part(planner, grid, at, end, len);
}

/* Intervals that a window may have now. */
static int window_room(const jerk_planner *planner) {
    return planner->capacity - (planner->scarce ? 0 : SCARCE_EXTRA);
}

/* Lay the grid over the path up to `to` mm ahead, with no step at a
 * standstill longer than one of so many parts of it; false if it does not fit.
 */
static bool grid_fill(jerk_planner *planner,
                      struct grid *grid,
                      const struct extent *extent,
                      double to,
                      double parts) {
    int count = (int)(extent->end - planner->head);
    grid->max = window_room(planner);
    grid->count = 0;
    grid->used = 0;
    grid->from_standstill = planner->at_standstill;
    grid->stands = extent->stands;
    grid->sinks = false;
    grid->usable = JERK_USABLE;
    grid->stops = false;
    grid->cut = false;
    grid->finest = extent->length / parts;
    if (count > grid->max) {
        return false;
    }
    double ahead = to;
    double standstill[2] = {0.0, 0.0};
    for (int i = 0; i < count - 1; i++) {
        ahead -= ring_at(planner, planner->head + (uint64_t)i)->length;
    }
    if (count > 0 && planner->at_standstill) {
        standstill[0] = standstill_length(
            planner,
            grid,
            planner->head,
            lesser(to, ring_at(planner, planner->head)->length));
    }
    if (count > 0 && extent->stands) {
        standstill[1] = standstill_length(
            planner,
            grid,
            extent->end - 1,
            lesser(ahead, ring_at(planner, extent->end - 1)->length));
    }
    knot_steps(planner, grid, count, extent->stands, standstill);
    set_reach(planner, grid, count, extent->stands);
    double at = 0.0;
    for (int i = 0; i < count && to - at > 1e-9; i++) {
        double whole = ring_at(planner, planner->head + (uint64_t)i)->length;
        double len = to - at > whole - 1e-9 ? whole : to - at;
        if (!fill_interval(planner,
                           grid,
                           i,
                           len,
                           i == 0 ? standstill[0] : 0.0,
                           i == count - 1 ? standstill[1] : 0.0)) {
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
    extent.length = lesser(extent.length, distance);
    return extent;
}

void grid_window(jerk_planner *planner,
                 struct grid *grid,
                 double reach,
                 double lowest) {
    struct extent extent = window_extent(planner);
    bool whole = extent.length <= reach;
    double parts = whole && extent.stands ? STAND_PARTS : END_PARTS;
    grid->finer = 1.0;
    grid->lowest = lowest;
    if (!whole) {
        extent = extent_to(planner, reach);
    }
    bool fits = grid_fill(planner, grid, &extent, whole ? 1e30 : reach, parts);
    /* cut short it ends at rest where the axes need not stand */
    grid->stands = grid->stands && fits && whole;
    grid->cut = !whole;
    knot_caps(planner, grid);
}

/* A grid that ends at rest `distance` mm ahead; false if it does not fit. */
bool grid_to(jerk_planner *planner, struct grid *grid, double distance) {
    struct extent extent = extent_to(planner, distance);
    if (extent.length < distance - 1e-9) {
        return false;
    }
    grid->finer = 1.0;
    grid->lowest = 0.0;
    bool fits = grid_fill(planner, grid, &extent, distance, END_PARTS);
    if (fits && grid->count < STOP_STEPS) {
        grid->finer = (double)grid->count / STOP_STEPS;
        fits = grid_fill(planner, grid, &extent, distance, END_PARTS);
    }
    knot_caps(planner, grid);
    return fits;
}

/* Bow of the input over segment k of the plan: what its states say of the input
 * at the start, less what the input is there. */
static double planned_bow(const plan *pl, int k) {
    double input[2];
    inputs_between(pl->lengths[k],
                   pl->x[k],
                   pl->accel[k],
                   pl->x[k + 1],
                   pl->accel[k + 1],
                   input);
    return input[0] - pl->input[0][k];
}

/* Over the first `until` mm parts of the plan are `step` long, as a fall of the
 * speed may end there. */
typedef struct fineness {
    double until, step;
} fineness;

/* Time of the next part of a law, from the state at `t` on. What is driven at
 * one speed behind the fine parts is one part: a long line would not fit. */
static double part_time(const jerk_law *law,
                        const fineness *fine,
                        double longest,
                        double t,
                        const jerk_state *at) {
    bool near = at->s < fine->until;
    if (!near && law->jerk == 0.0 && law->a0 == 0.0) {
        return law->time - t;
    }
    double step = near ? lesser(longest, fine->step) : longest;
    double left = law->length - at->s;
    double parts = ceil(left / step - 1e-6);
    return (law->time - t) / greater(1.0, parts);
}

/* Segment k of the plan, from `from` to `to` mm of interval i, in parts that
 * are short enough; the states at their ends. */
static bool add_planned(jerk_planner *planner,
                        struct grid *grid,
                        int k,
                        uint64_t i,
                        double from,
                        double to,
                        const fineness *fine,
                        struct states *states) {
    const plan *pl = &planner->plan;
    bool rests = k + 1 == pl->count;
    double f2 = planner->scale * planner->scale;
    double longest = steps_at(planner, i)->longest;
    double bow = rests ? 0.0 : planned_bow(pl, k);
    double begin = from;
    double t = 0.0;
    jerk_law law;
    plan_law(planner, k, &law);
    law.s0 = 0.0;
    jerk_state at = {0.0, law.v0, law.a0};
    double time = rests ? law.time : part_time(&law, fine, longest, t, &at);
    while (t + time < law.time * (1.0 - 1e-6)) {
        t += time;
        jerk_at(&law, t, &at);
        if (!add_part(planner, grid, i, begin, from + at.s)) {
            return false;
        }
        begin = from + at.s;
        double share = time / law.time;
        grid->seg[grid->count - 1].bow = bow * share * share;
        states->x[grid->count] = at.v * at.v / f2;
        states->accel[grid->count] = at.a / f2;
        time = part_time(&law, fine, longest, t, &at);
    }
    if (!add_part(planner, grid, i, begin, to)) {
        return false;
    }
    double share = 1.0 - t / law.time;
    grid->seg[grid->count - 1].bow = bow * share * share;
    states->x[grid->count] = rests ? 0.0 : pl->x[k + 1];
    states->accel[grid->count] = rests ? 0.0 : pl->accel[k + 1];
    return true;
}

bool grid_of_plan(jerk_planner *planner,
                  struct grid *grid,
                  struct states *states) {
    const plan *pl = &planner->plan;
    uint64_t i = planner->head;
    double from = 0.0;
    grid->max = planner->capacity;
    grid->count = 0;
    grid->used = 0;
    grid->from_standstill = false;
    grid->stands = pl->stands;
    grid->sinks = false;
    grid->usable = JERK_USABLE;
    grid->stops = false;
    grid->cut = false;
    grid->finer = 1.0;
    states->x[0] = planner->x;
    states->accel[0] = planner->accel;
    fineness fine = {.until = FINE_WAYS * jerk_stop_distance(planner)};
    fine.step = fine.until / FINE_PARTS;
    for (int k = pl->next; k < pl->count; k++) {
        double whole = ring_at(planner, i)->length;
        double to = pl->last[k] ? whole : from + pl->lengths[k];
        if (i == planner->tail
            || !add_planned(planner, grid, k, i, from, to, &fine, states)) {
            return false;
        }
        fine.until -= to - from;
        i += pl->last[k] ? 1 : 0;
        from = pl->last[k] ? 0.0 : to;
    }
    knot_caps(planner, grid);
    return true;
}
