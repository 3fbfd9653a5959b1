/* How fine the planner's grid has to be along an interval: by what the axes that move there can do, not by the quickest axis
 * of the machine. */
#include <math.h>
#include "jerk/state.h"

#define RAMP_PARTS 6.0      /* planner intervals over the ramp from rest to full acceleration, */
#define STOP_PARTS 80.0     /* over the way from full speed to rest, */
#define REST_PARTS 60.0     /* parts of that ramp next to a standstill, but no more than ... */
#define JOINED_PARTS 6.0    /* of that ramp on a line: one interval from rest, whose jerk is constant */
#define FINEST_PARTS 2000.0 /* ... of the longest interval */

#define LONGEST_WAY 1e4     /* mm: no speed counts that is not reached from rest over it */
#define SLOW_STEP 2e-4      /* mm: no interval need be shorter, nor than the way in SLOW_TIME: so on machines that do less than 1 mm/s, about */
#define MAX_TURN 0.07    /* rad in one planner interval */
#define LEAN 0.14        /* change of an axis rate over its jerk limit in one planner interval, of the largest such rate */
#define REST_TURN 0.08     /* of either, from rest: under constant path jerk the axes see nine times the change of their rates */
#define LEAST_PARTS 16.0   /* of that or of the pushed interval: the finest that an interval is made later on */
#define LITTLE_TURN 3.0     /* a pushed interval turns next to not at all: this much shorter than what it may turn by */

typedef struct along {
    double v, a, j; /* limits of the path */
} along;

/* Of a limit of speed, what there is a way to reach: numbers are scaled by it, and so are steps. */
double reached_speed(double v, double a, double j) {
    double by_a2 = 2.0 * a * LONGEST_WAY, by_j3 = 4.5 * j * LONGEST_WAY * LONGEST_WAY;
    return v * v <= by_a2 && v * v * v <= by_j3 ? v : fmin(v, fmin(sqrt(by_a2), cbrt(by_j3)));
}

/* The longest interval resolves the ramp to full acceleration, or the way to rest where that ramp is very short. */
static steps steps_for(along m) {
    m.v = reached_speed(m.v, m.a, m.j);
    double a = fmin(m.a, sqrt(m.v * m.j)), ramp = a * a * a / (6.0 * m.j * m.j), stop = 0.5 * m.v * (m.v / a + a / m.j);
    steps out = {.longest = fmax(ramp / RAMP_PARTS, stop / STOP_PARTS)};
    out.rest = ramp / JOINED_PARTS;
    out.finest = fmax(ramp / REST_PARTS, fmin(0.5 * ramp, out.longest / FINEST_PARTS));
    return out;
}

/* How fast an axis comes to bind the path, or ceases to, at q: change per mm of its rate over its jerk limit, over the largest of
 * all axes. A slow axis that turns round beside quick ones does so within a small part of the turn. */
static double lean_rate(const jerk_planner *p, const jerk_interval *q) {
    double worst = 0.0;
    for (int e = 0; e < 2; e++) {
        double most = 0.0, change = 0.0;
        for (int a = 0; a < p->cfg.axes; a++) {
            double jerk = jerk_max(p, q, a);
            most = fmax(most, fabs(q->d1[e][a]) / jerk);
            change = fmax(change, fabs(q->d2[e][a]) / jerk);
        }
        if (most > 0.0) worst = fmax(worst, change / most);
    }
    return worst;
}

/* Longest interval at q: beyond a few degrees of turn the rows at both ends no longer hold the middle. Axes that outrun the path
 * count by the relative change of their rate. */
static double turn_length(const jerk_planner *p, const jerk_interval *q) {
    double start = 0.0, end = 0.0;
    for (int a = 0; a < p->cfg.axes; a++) {
        double rate = fmax(1.0, fmax(fabs(q->d1[0][a]), fabs(q->d1[1][a]))), d0 = q->d2[0][a] / rate, d1 = q->d2[1][a] / rate;
        start += d0 * d0;
        end += d1 * d1;
    }
    return fmin(MAX_TURN / sqrt(fmax(1e-30, fmax(start, end))), LEAN / fmax(1e-15, lean_rate(p, q)));
}

/* Of the third derivatives by the jerk limits: the largest, and the length over which they change by as much. */
static void set_bend(const jerk_planner *p, const jerk_interval *q, steps *out) {
    double change = 0.0;
    out->bend = 0.0;
    for (int a = 0; a < p->cfg.axes; a++) {
        double jerk = jerk_max(p, q, a);
        out->bend = fmax(out->bend, fmax(fabs(q->d3[0][a]), fabs(q->d3[1][a])) / jerk);
        change = fmax(change, fabs(q->d3[1][a] - q->d3[0][a]) / jerk);
    }
    out->even = q->length * out->bend / fmax(1e-30, change);
    out->little = out->turn > LITTLE_TURN * q->length;
}

/* Of an axis, the largest rate over the interval counts; no interval is longer than along the slowest of the axes that move. */
steps interval_steps(const jerk_planner *p, const jerk_interval *q) {
    along m = {1e30, 1e30, 1e30};
    steps most = {0};
    double least = 1e30;
    for (int a = 0; a < p->cfg.axes; a++) {
        double rate = fmax(fabs(q->d1[0][a]), fabs(q->d1[1][a]));
        if (rate < 1e-9) continue;
        along own = {p->cfg.v_max[a], acc_max(p, q, a), jerk_max(p, q, a)};
        steps alone = steps_for(own);
        least = fmin(least, fmin(SLOW_STEP, SLOW_TIME * own.v) / rate);
        most = (steps){fmax(most.longest, alone.longest), fmax(most.finest, alone.finest), .knots = 0.0};
        m = (along){fmin(m.v, own.v / rate), fmin(m.a, own.a / rate), fmin(m.j, own.j / rate)};
    }
    steps out = steps_for(m);
    if (!(most.longest > 0.0)) most = out; /* no axis moves here: a parameter runs on (profiles) */
    out.least = fmin(least, q->length);
    out.longest = fmax(fmin(out.longest, most.longest), out.least);
    out.finest = fmin(out.finest, most.finest);
    if (p->cfg.spacing_mm > 0.0) out.longest = p->cfg.spacing_mm;
    out.turn = turn_length(p, q);
    out.bent_rest = REST_TURN * out.turn;
    out.shortest = fmin(out.turn, q->length) / LEAST_PARTS;
    set_bend(p, q, &out);
    out.knots = ceil(q->length / out.longest);
    return out;
}

/* Intervals of the planner's grid from full speed to rest. */
double jerk_stop_knots(const jerk_config *c) {
    double most = 0.0;
    for (int i = 0; i < c->axes; i++) {
        double v = reached_speed(c->v_max[i], c->a_max[i], c->j_max[i]), a = fmin(c->a_max[i], sqrt(v * c->j_max[i]));
        most = fmax(most, 0.5 * v * (v / a + a / c->j_max[i]) / steps_for((along){v, c->a_max[i], c->j_max[i]}).longest);
    }
    return most;
}
