/* How fine the planner's grid has to be along an interval: by what the axes that move there can do, not by the quickest axis
 * of the machine. */
#include <math.h>
#include "jerk_internal.h"

#define RAMP_PARTS 6.0      /* planner intervals over the ramp from rest to full acceleration, */
#define STOP_PARTS 80.0     /* over the way from full speed to rest, */
#define REST_PARTS 60.0     /* parts of that ramp next to a standstill, but no more than ... */
#define JOINED_PARTS 6.0    /* of that ramp on a line: one interval from rest, whose jerk is constant */
#define FINEST_PARTS 2000.0 /* ... of the longest interval */

typedef struct along {
    double v, a, j; /* limits of the path */
} along;

/* The longest interval resolves the ramp to full acceleration, or the way to rest where that ramp is very short. */
static steps steps_for(along m) {
    double a = fmin(m.a, sqrt(m.v * m.j)), ramp = a * a * a / (6.0 * m.j * m.j), stop = 0.5 * m.v * (m.v / a + a / m.j);
    steps out = {.longest = fmax(ramp / RAMP_PARTS, stop / STOP_PARTS)};
    out.rest = ramp / JOINED_PARTS;
    out.finest = fmax(ramp / REST_PARTS, fmin(0.5 * ramp, out.longest / FINEST_PARTS));
    return out;
}

/* Of an axis, the largest rate over the interval counts; no interval is longer than along the slowest of the axes that move. */
steps interval_steps(const jerk_planner *p, const jerk_interval *q) {
    along m = {1e30, 1e30, 1e30};
    steps most = {0};
    for (int a = 0; a < p->cfg.axes; a++) {
        double rate = fmax(fabs(q->d1[0][a]), fabs(q->d1[1][a]));
        if (rate < 1e-9) continue;
        along own = {p->cfg.v_max[a], acc_max(p, q, a), jerk_max(p, q, a)};
        steps alone = steps_for(own);
        most = (steps){fmax(most.longest, alone.longest), fmax(most.finest, alone.finest), .knots = 0.0};
        m = (along){fmin(m.v, own.v / rate), fmin(m.a, own.a / rate), fmin(m.j, own.j / rate)};
    }
    steps out = steps_for(m);
    if (!(most.longest > 0.0)) most = out; /* no axis moves here: a parameter runs on (profiles) */
    out.longest = fmin(out.longest, most.longest);
    out.finest = fmin(out.finest, most.finest);
    if (p->cfg.spacing_mm > 0.0) out.longest = p->cfg.spacing_mm;
    out.knots = ceil(q->length / out.longest);
    return out;
}

/* Intervals of the planner's grid from full speed to rest. */
double jerk_stop_knots(const jerk_config *c) {
    double most = 0.0;
    for (int i = 0; i < c->axes; i++) {
        double v = c->v_max[i], a = fmin(c->a_max[i], sqrt(v * c->j_max[i]));
        most = fmax(most, 0.5 * v * (v / a + a / c->j_max[i]) / steps_for((along){v, c->a_max[i], c->j_max[i]}).longest);
    }
    return most;
}
