/* Limits of the axes inside an interval: the derivatives there, and the largest
 * ratio to a limit, at LANES places at a time.  Part of the checker's code
 * (verify_core.h). */
#ifndef JERK_RATIOS_H
#define JERK_RATIOS_H
#include <math.h>
#include <stddef.h>
#include "jerk/path/motion_law.h"
#include "jerk/solver/vectors.h"
#include "jerk/state/state.h"

/* Speed, acceleration and jerk along the path. */
typedef struct motion {
    vec v, a, j;
} motion;

/* What is looked at over an interval: its axes that move, and 1 over their
 * limits. */
typedef struct view {
    const jerk_interval *interval;
    double per_length; /* 1 over its length */
    int count;
    int axis[JERK_AXES];
    double v[JERK_AXES], acc[JERK_AXES], jerk[JERK_AXES];
} view;

/* Derivatives of the axes of a view. */
typedef struct bends {
    vec d1[JERK_AXES], d2[JERK_AXES], d3[JERK_AXES];
} bends;

static bool rests(const jerk_interval *interval, int axis) {
    double sum = 0.0;
    for (int end = 0; end < 2; end++) {
        sum += fabs(interval->d1[end][axis]);
        sum += fabs(interval->d2[end][axis]);
        sum += fabs(interval->d3[end][axis]);
    }
    return sum == 0.0;
}

static view view_of(const jerk_planner *planner,
                    const struct segment *segment) {
    const jerk_interval *interval = segment->interval;
    view out = {.interval = interval, .per_length = 1.0 / segment->length};
    for (int i = 0; i < planner->cfg.axes; i++) {
        if (rests(interval, i)) {
            continue;
        }
        int n = out.count++;
        out.axis[n] = i;
        out.v[n] = 1.0 / planner->cfg.v_max[i];
        double acc = acc_max(planner, interval, i) * segment->acc[i];
        double jerk = jerk_max(planner, interval, i) * segment->jump;
        out.acc[n] = 1.0 / acc;
        out.jerk[n] = 1.0 / jerk;
    }
    return out;
}

static vec axis_jerk(const bends *at, int n, const motion *motion) {
    vec v = motion->v;
    vec v2 = v * v;
    vec bend = at->d3[n] * v2 + 3.0 * at->d2[n] * motion->a;
    return v * bend + at->d1[n] * motion->j;
}

/* Largest ratio of an axis value to its limit; `inside`: d3 may be more by what
 * the interval says. */
static double ratio_at(const view *view,
                       const bends *at,
                       bool inside,
                       const motion *motion) {
    vec worst = set1(0.0);
    vec all = motion->v + motion->a + motion->j;
    vec v2 = motion->v * motion->v;
    vec v3 = inside ? v2 * motion->v : set1(0.0);
    for (int n = 0; n < view->count; n++) {
        double miss = (double)view->interval->miss[view->axis[n]];
        vec v = size_of(at->d1[n]) * motion->v * view->v[n];
        vec a = at->d1[n] * motion->a + at->d2[n] * v2;
        vec j = axis_jerk(at, n, motion);
        vec acc = size_of(a) * view->acc[n];
        vec jerk = (size_of(j) + miss * v3) * view->jerk[n];
        all += v + acc + jerk;
        worst = vmax(v, worst);
        worst = vmax(acc, worst);
        worst = vmax(jerk, worst);
    }
    return isfinite(sum(all)) ? largest(worst) : INFINITY;
}

/* The derivatives at the shares t of the interval: the polynomial of degree 5
 * for the tangent that meets the tangent and its two derivatives at both ends,
 * in Hermite's basis. */
static void bends_inside(const view *view, const vec *at, bends *out) {
    const jerk_interval *interval = view->interval;
    vec t = *at;
    double length = interval->length;
    double per_length = view->per_length;
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
        int i = view->axis[n];
        double p0 = interval->d1[0][i];
        double p1 = interval->d1[1][i];
        double v0 = interval->d2[0][i];
        double v1 = interval->d2[1][i];
        double w0 = interval->d3[0][i];
        double w1 = interval->d3[1][i];
        double turn = p0 - p1;
        out->d1[n] = p1 + s1 * turn + s2 * v0 + s3 * w0 + e2 * v1 + e3 * w1;
        out->d2[n] = first * turn + b2 * v0 + b3 * w0 + f2 * v1 + f3 * w1;
        out->d3[n] = second * turn + g2 * v0 + g3 * w0 + k2 * v1 + k3 * w1;
    }
}

static void bends_at_ends(const view *view, bends *out) {
    const jerk_interval *interval = view->interval;
    for (int n = 0; n < view->count; n++) {
        int i = view->axis[n];
        out->d1[n] = in_turn(interval->d1[0][i], interval->d1[1][i]);
        out->d2[n] = in_turn(interval->d2[0][i], interval->d2[1][i]);
        out->d3[n] = in_turn(interval->d3[0][i], interval->d3[1][i]);
    }
}

static double ratio_inside(const view *view,
                           const vec *t,
                           const motion *motion) {
    bends at;
    bends_inside(view, t, &at);
    return ratio_at(view, &at, true, motion);
}

/* The motion of a law that begins at 0; `s` gets the places.  It is jerk_at()
 * of LANES times: a call for each time would be 7 % of all planning. */
static motion motion_at(const jerk_law *law, const vec *times, vec *s) {
    vec t = *times;
    double j = law->jerk;
    double snap = law->snap;
    double crackle = law->crackle;
    double pop = law->pop;
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

static double ratio_at_times(const view *view,
                             const jerk_law *law,
                             const vec *t) {
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

/* Largest ratio at the ends of so many parts of its time. */
static double ratio_at_parts(const view *view, const jerk_law *law, int parts) {
    double worst = 0.0;
    for (int k = 1; k < parts; k += LANES) {
        vec part = law->time * parts_from(k, parts - 1, parts);
        double ratio = ratio_at_times(view, law, &part);
        worst = ratio > worst ? ratio : worst;
    }
    return worst;
}

/* The motion and the derivatives at the ends of an interval and inside. */
typedef struct look {
    motion at_ends, within;
    vec places; /* inside, as shares of its length */
    bends ends, inside;
} look;

static void look_at(const view *view, const jerk_law *law, look *out) {
    vec s, places;
    const vec sides = in_turn(0.0, law->time);
    out->at_ends = motion_at(law, &sides, &s);
    const vec times =
        law->time * parts_from(1, FORESEEN_PARTS - 1, FORESEEN_PARTS);
    out->within = motion_at(law, &times, &places);
    out->places = places * view->per_length;
    bends_at_ends(view, &out->ends);
    bends_inside(view, &out->places, &out->inside);
}

static double ends_ratio(const view *view, const look *seen) {
    return ratio_at(view, &seen->ends, false, &seen->at_ends);
}

static double inside_ratio(const view *view, const look *seen) {
    return ratio_at(view, &seen->inside, true, &seen->within);
}

/* The law over an interval h with the inputs c and their bow; x, u: at its end.
 */
static jerk_law law_of(double length,
                       double *x,
                       double *accel,
                       const double input[2],
                       double bow) {
    double x0 = *x;
    double u0 = *accel;
    jerk_law law = {0};
    *x = x_after(length, x0, u0, input[0], input[1]);
    *accel = accel_after(length, u0, input[0], input[1]);
    double v0 = sqrt(x0);
    double v1 = sqrt(*x);
    motion_law_between(&law,
                       length,
                       v0,
                       u0,
                       (input[0] - bow) * v0,
                       v1,
                       *accel,
                       (input[1] - bow) * v1);
    return law;
}
#endif
