/* Limits of the axes inside intervals: the derivatives there, and the largest
 * ratios to a limit.  LANES intervals at a time, or one at as many places.
 * Part of the checker's code (verify_core.h). */
#ifndef JERK_RATIOS_H
#define JERK_RATIOS_H
#include <math.h>
#include <stddef.h>
#include "jerk/path/motion_law.h"
#include "jerk/state/vectors.h"
#include "jerk/state/state.h"
#include "jerk/state/tuning.h"
#include "maths/order.h"

/* Speed, acceleration and jerk along the path. */
typedef struct motion {
    vec v, a, j;
} motion;

/* Derivatives of the axes of a view. */
typedef struct bends {
    vec d1[JERK_AXES], d2[JERK_AXES], d3[JERK_AXES];
} bends;

/* What is looked at over intervals, one in each lane: axes that move in one of
 * them, their derivatives at both ends, and 1 over their limits. */
typedef struct view {
    vec length, per_length; /* per_length: 1 over the way that is driven */
    int count;
    bends ends[2];
    vec v[JERK_AXES], acc[JERK_AXES], jerk[JERK_AXES];
    vec miss[JERK_AXES]; /* d3 may be more inside by it */
} view;

/* The time laws over them: speeds are polynomials of degree 5. */
typedef struct laws {
    vec v0, a0, jerk, snap, crackle, pop, time;
} laws;

/* What the view has of an axis. */
static void look_along(const jerk_planner *planner,
                       const struct segment *const segments[LANES],
                       const jerk_interval *const of[LANES],
                       int axis,
                       view *out) {
    int n = out->count;
    vec moves = set1(0.0);
    for (int end = 0; end < 2; end++) {
        vec d1, d2, d3;
        for (int lane = 0; lane < LANES; lane++) {
            d1[lane] = of[lane]->d1[end][axis];
            d2[lane] = of[lane]->d2[end][axis];
            d3[lane] = of[lane]->d3[end][axis];
        }
        moves += size_of(d1) + size_of(d2) + size_of(d3);
        out->ends[end].d1[n] = d1;
        out->ends[end].d2[n] = d2;
        out->ends[end].d3[n] = d3;
    }
    if (!any_of(moves != 0.0)) {
        return;
    }
    vec acc, jerk, miss;
    for (int lane = 0; lane < LANES; lane++) {
        acc[lane] =
            acc_max(planner, of[lane], axis) * segments[lane]->acc[axis];
        jerk[lane] = jerk_max(planner, of[lane], axis) * segments[lane]->jump;
        miss[lane] = (double)of[lane]->miss[axis];
    }
    out->v[n] = set1(1.0 / planner->cfg.v_max[axis]);
    out->acc[n] = 1.0 / acc;
    out->jerk[n] = 1.0 / jerk;
    out->miss[n] = miss;
    out->count++;
}

static void view_of(const jerk_planner *planner,
                    const struct segment *const segments[LANES],
                    view *out) {
    const jerk_interval *of[LANES];
    vec way;
    for (int lane = 0; lane < LANES; lane++) {
        of[lane] = segments[lane]->interval;
        out->length[lane] = of[lane]->length;
        way[lane] = segments[lane]->length;
    }
    out->per_length = 1.0 / way;
    out->count = 0;
    for (int axis = 0; axis < planner->axes; axis++) {
        look_along(planner, segments, of, axis, out);
    }
}

/* One interval in all lanes. */
static void view_of_one(const jerk_planner *planner,
                        const struct segment *segment,
                        view *out) {
    const struct segment *const all[LANES] = {segment,
                                              segment,
                                              segment,
                                              segment};
    view_of(planner, all, out);
}

static void spread_bends(const bends *from, int count, int lane, bends *out) {
    for (int n = 0; n < count; n++) {
        out->d1[n] = set1(from->d1[n][lane]);
        out->d2[n] = set1(from->d2[n][lane]);
        out->d3[n] = set1(from->d3[n][lane]);
    }
}

/* The interval of one lane in all of them. */
static void spread_view(const view *from, int lane, view *out) {
    out->length = set1(from->length[lane]);
    out->per_length = set1(from->per_length[lane]);
    out->count = from->count;
    for (int end = 0; end < 2; end++) {
        spread_bends(&from->ends[end], from->count, lane, &out->ends[end]);
    }
    for (int n = 0; n < from->count; n++) {
        out->v[n] = from->v[n];
        out->acc[n] = set1(from->acc[n][lane]);
        out->jerk[n] = set1(from->jerk[n][lane]);
        out->miss[n] = set1(from->miss[n][lane]);
    }
}

static laws spread_laws(const laws *from, int lane) {
    return (laws){.v0 = set1(from->v0[lane]),
                  .a0 = set1(from->a0[lane]),
                  .jerk = set1(from->jerk[lane]),
                  .snap = set1(from->snap[lane]),
                  .crackle = set1(from->crackle[lane]),
                  .pop = set1(from->pop[lane]),
                  .time = set1(from->time[lane])};
}

static vec axis_jerk(const bends *at, int n, const motion *motion) {
    vec v = motion->v;
    vec v2 = v * v;
    vec bend = at->d3[n] * v2 + 3.0 * at->d2[n] * motion->a;
    return v * bend + at->d1[n] * motion->j;
}

/* Largest ratio of an axis value to its limit in each lane; `inside`: d3 may be
 * more by what the interval says. */
static vec ratio_at(const view *view,
                    const bends *at,
                    bool inside,
                    const motion *motion) {
    vec worst = set1(0.0);
    vec all = motion->v + motion->a + motion->j;
    vec v2 = motion->v * motion->v;
    vec v3 = inside ? v2 * motion->v : set1(0.0);
    for (int n = 0; n < view->count; n++) {
        vec v = size_of(at->d1[n]) * motion->v * view->v[n];
        vec a = at->d1[n] * motion->a + at->d2[n] * v2;
        vec j = axis_jerk(at, n, motion);
        vec acc = size_of(a) * view->acc[n];
        vec jerk = (size_of(j) + view->miss[n] * v3) * view->jerk[n];
        all += v + acc + jerk;
        worst = vmax(v, worst);
        worst = vmax(acc, worst);
        worst = vmax(jerk, worst);
    }
    return chosen(are_finite(all), worst, set1(INFINITY));
}

/* The derivatives at the shares t of the intervals: the polynomial of degree 5
 * for the tangent that meets the tangent and its two derivatives at both ends,
 * in Hermite's basis. */
static void bends_inside(const view *view, const vec *at, bends *out) {
    vec t = *at;
    vec length = view->length;
    vec per_length = view->per_length;
    vec left = 1.0 - t;
    vec t2 = t * t;
    vec r2 = left * left;
    vec s1 = r2 * left * (1.0 + 3.0 * t + 6.0 * t2);
    vec s2 = length * r2 * left * t * (1.0 + 3.0 * t);
    vec s3 = 0.5 * length * length * r2 * left * t2;
    vec e2 = -length * t2 * t * left * (1.0 + 3.0 * left);
    vec e3 = 0.5 * length * length * t2 * t * r2;
    vec first = -30.0 * per_length * t2 * r2;
    vec b2 = r2 * (1.0 + 2.0 * t - 15.0 * t2);
    vec b3 = 0.5 * length * t * r2 * (2.0 - 5.0 * t);
    vec f2 = t2 * (1.0 + 2.0 * left - 15.0 * r2);
    vec f3 = -0.5 * length * left * t2 * (2.0 - 5.0 * left);
    vec tl = per_length * t * left;
    vec second = -60.0 * per_length * tl * (1.0 - 2.0 * t);
    vec g2 = -12.0 * tl * (3.0 - 5.0 * t);
    vec g3 = left * (1.0 - 8.0 * t + 10.0 * t2);
    vec k2 = 12.0 * tl * (3.0 - 5.0 * left);
    vec k3 = t * (1.0 - 8.0 * left + 10.0 * r2);
    for (int n = 0; n < view->count; n++) {
        vec p0 = view->ends[0].d1[n];
        vec p1 = view->ends[1].d1[n];
        vec v0 = view->ends[0].d2[n];
        vec v1 = view->ends[1].d2[n];
        vec w0 = view->ends[0].d3[n];
        vec w1 = view->ends[1].d3[n];
        vec turn = p0 - p1;
        out->d1[n] = p1 + s1 * turn + s2 * v0 + s3 * w0 + e2 * v1 + e3 * w1;
        out->d2[n] = first * turn + b2 * v0 + b3 * w0 + f2 * v1 + f3 * w1;
        out->d3[n] = second * turn + g2 * v0 + g3 * w0 + k2 * v1 + k3 * w1;
    }
}

static vec ratio_inside(const view *view, const vec *t, const motion *motion) {
    bends at;
    bends_inside(view, t, &at);
    return ratio_at(view, &at, true, motion);
}

/* The motion of laws that begin at 0; `s` gets the places.  It is jerk_at() of
 * LANES times. */
static motion motion_at(const laws *law, const vec *times, vec *s) {
    vec t = *times;
    vec j = law->jerk;
    vec snap = law->snap;
    vec crackle = law->crackle;
    vec pop = law->pop;
    vec s5 = snap * PER_24 + t * (crackle * PER_120 + t * (pop * PER_720));
    vec s3 = law->a0 / 2 + t * (j * PER_6 + t * s5);
    vec v3 = snap * PER_6 + t * (crackle * PER_24 + t * (pop * PER_120));
    vec a2 = snap / 2 + t * (crackle * PER_6 + t * (pop * PER_24));
    *s = t * (law->v0 + t * s3);
    vec v2 = j / 2 + t * v3;
    vec j2 = crackle / 2 + t * (pop * PER_6);
    return (motion){.v = law->v0 + t * (law->a0 + t * v2),
                    .a = law->a0 + t * (j + t * a2),
                    .j = j + t * (snap + t * j2)};
}

static vec ratio_at_times(const view *view, const laws *law, const vec *t) {
    vec s;
    const motion at = motion_at(law, t, &s);
    s = s * view->per_length;
    return ratio_inside(view, &s, &at);
}

/* The ends of parts k, k + 1 .. `last`, as shares of the whole. */
static inline vec parts_from(int k, int last, int parts) {
    vec out;
    for (int lane = 0; lane < LANES; lane++) {
        out[lane] = k + lane < last ? k + lane : last;
    }
    return out / parts;
}

/* Largest ratio of one interval at the ends of so many parts of its time. */
static double ratio_at_parts(const view *view, const laws *law, int parts) {
    vec worst = set1(0.0);
    for (int k = 1; k < parts; k += LANES) {
        vec part = law->time * parts_from(k, parts - 1, parts);
        worst = vmax(ratio_at_times(view, law, &part), worst);
    }
    return largest(worst);
}

#define INNER_PLACES (FORESEEN_PARTS - 1)

/* The motion at the ends of intervals and inside, and the derivatives there. */
typedef struct look {
    motion at_ends[2], within[INNER_PLACES];
    vec places[INNER_PLACES]; /* as shares of the length */
    bends inside[INNER_PLACES];
} look;

static void look_at(const view *view, const laws *law, look *out) {
    vec s;
    out->at_ends[0] = (motion){law->v0, law->a0, law->jerk};
    out->at_ends[1] = motion_at(law, &law->time, &s);
    for (int i = 0; i < INNER_PLACES; i++) {
        vec t = law->time * ((double)(i + 1) / FORESEEN_PARTS);
        out->within[i] = motion_at(law, &t, &s);
        out->places[i] = s * view->per_length;
        bends_inside(view, &out->places[i], &out->inside[i]);
    }
}

static vec ends_ratio(const view *view, const look *seen) {
    vec worst = set1(0.0);
    for (int end = 0; end < 2; end++) {
        worst =
            vmax(ratio_at(view, &view->ends[end], false, &seen->at_ends[end]),
                 worst);
    }
    return worst;
}

static vec inside_ratio(const view *view, const look *seen) {
    vec worst = set1(0.0);
    for (int i = 0; i < INNER_PLACES; i++) {
        worst = vmax(ratio_at(view, &seen->inside[i], true, &seen->within[i]),
                     worst);
    }
    return worst;
}

/* What intervals are driven with: length, x and u at their starts, inputs and
 * bows. */
typedef struct drives {
    vec length, x, accel, input[2], bow;
} drives;

/* duration() of motion_law.c, with the same steps in every lane. */
static inline vec durations(vec length,
                            const motion *first,
                            const motion *last) {
    vec mean = 0.5 * (first->v + last->v);
    vec turn = (first->a - last->a) * 0.1;
    vec twist = (first->j + last->j) * PER_120;
    vec square = mean * mean + (first->a - last->a) * length * (1.0 / 3.0);
    vec t = 2.0 * length / (mean + root_of(vmax(square, set1(0.0))));
    vec out = set1(NAN);
    ivec open = {-1, -1, -1, -1};
    for (int i = 0; i < DURATION_STEPS && any_of(open); i++) {
        vec slope = mean + t * (2.0 * turn + 3.0 * t * twist);
        vec step = (length - t * (mean + t * (turn + t * twist))) / slope;
        t += step;
        ivec close = open & (size_of(step) <= DURATION_CLOSE * t);
        ivec rises = slope > LEAST_SLOPE * mean;
        out = chosen(close & rises, t, out);
        open &= ~close;
    }
    return out;
}

/* motion_law_between() of LANES intervals. */
static inline laws laws_between(vec length,
                                const motion *first,
                                const motion *last) {
    vec t = durations(length, first, last);
    vec t2 = t * t;
    vec v = last->v - first->v - first->a * t - 0.5 * first->j * t2;
    vec a = (last->a - first->a - first->j * t) * t;
    vec j = (last->j - first->j) * t2;
    vec per_t = 1.0 / t;
    vec per_t2 = per_t * per_t;
    vec per_t3 = per_t2 * per_t;
    vec pop = 6.0 * v - 3.0 * a + 0.5 * j;
    return (laws){.v0 = first->v,
                  .a0 = first->a,
                  .jerk = first->j,
                  .snap = 6.0 * (10.0 * v - 4.0 * a + 0.5 * j) * per_t3,
                  .crackle =
                      24.0 * (-15.0 * v + 7.0 * a - j) * (per_t2 * per_t2),
                  .pop = 120.0 * pop * (per_t2 * per_t3),
                  .time = t};
}

/* x of the states behind them. */
static vec x_behind(const drives *of) {
    vec along = of->x + 2.0 * of->length * of->accel;
    return along
           + of->length * of->length * (2.0 * of->input[0] + of->input[1])
                 / 3.0;
}

static laws laws_of(const drives *of) {
    vec v0 = root_of(of->x);
    vec v1 = root_of(x_behind(of));
    vec both = of->input[0] + of->input[1];
    vec accel = of->accel + 0.5 * of->length * both;
    vec c0 = of->input[0] - of->bow;
    const motion first = {v0, of->accel, c0 * v0};
    const motion last = {v1, accel, (of->input[1] - of->bow) * v1};
    return laws_between(of->length, &first, &last);
}

static inline vec largest_jerk(const motion *motions, int count) {
    vec most = motions[0].j;
    for (int i = 1; i < count; i++) {
        most = vmax(motions[i].j, most);
    }
    return most;
}
static inline vec least_jerk_of(const motion *motions, int count) {
    vec least = motions[0].j;
    for (int i = 1; i < count; i++) {
        least = vmin(motions[i].j, least);
    }
    return least;
}
#endif
