/* Time laws: s'' = u + c (s - s0) over an interval, as a record that is evaluated in constant time. */
#include <math.h>
#include "jerk_internal.h"

#define SMALL 1e-3 /* what the series leaves out behind y^4 is below rounding */

/* sinh(r)/r, (cosh(r) - 1)/r^2 with y = r^2; sin and cos for y < 0. */
static void entire(double y, double *s1, double *c2) {
    if (y == 0.0) {
        *s1 = 1.0;
        *c2 = 0.5;
    } else if (fabs(y) < SMALL) {
        *s1 = 1.0 + y * (1.0 / 6.0 + y * (1.0 / 120.0 + y * (1.0 / 5040.0 + y * (1.0 / 362880.0))));
        *c2 = 0.5 + y * (1.0 / 24.0 + y * (1.0 / 720.0 + y * (1.0 / 40320.0 + y * (1.0 / 3628800.0))));
    } else if (fabs(y) < 1.0) {
        *s1 = 1.0 + y / 6.0 * (1.0 + y / 20.0 * (1.0 + y / 42.0 * (1.0 + y / 72.0 * (1.0 + y / 110.0 * (1.0 + y / 156.0 *
              (1.0 + y / 210.0 * (1.0 + y / 272.0)))))));
        *c2 = 0.5 * (1.0 + y / 12.0 * (1.0 + y / 30.0 * (1.0 + y / 56.0 * (1.0 + y / 90.0 * (1.0 + y / 132.0 * (1.0 + y / 182.0 *
              (1.0 + y / 240.0 * (1.0 + y / 306.0))))))));
    } else if (y > 0) {
        double r = sqrt(y);
        *s1 = sinh(r) / r;
        *c2 = (cosh(r) - 1.0) / y;
    } else {
        double r = sqrt(-y);
        *s1 = sin(r) / r;
        *c2 = (cos(r) - 1.0) / y;
    }
}

/* Position, speed and acceleration of a law at the time t since its start. */
void jerk_at(const jerk_law *law, double t, jerk_state *out) {
    double s1, c2, y = law->c * t * t;
    entire(y, &s1, &c2);
    double d = t * (law->v0 * s1 + law->a0 * t * c2), j = law->jerk * t;
    out->v = law->v0 * (1.0 + y * c2) + law->a0 * t * s1 + 0.5 * j * t;
    out->a = law->a0 + law->c * d + j;
    out->s = law->s0 + d + j * t * t / 6.0;
}

/* Time to cover h: Newton's iteration, kept inside a bracket; the speed is positive all over the interval. */
static double duration(const jerk_law *law, double h, double v1) {
    jerk_law at_zero = *law;
    at_zero.s0 = 0.0;
    double t = 2.0 * h / (law->v0 + v1), low = 0.0, high = INFINITY;
    for (int i = 0; i < 60; i++) {
        jerk_state at;
        jerk_at(&at_zero, t, &at);
        if (at.s >= h || at.v <= 0.0) high = t; /* behind the turning point s comes back to h */
        else low = t;
        double next = at.v > 0.0 ? t + (h - at.s) / at.v : -1.0; /* else halved */
        if (!(next > low && next < high)) next = isfinite(high) ? 0.5 * (low + high) : 2.0 * t;
        if (fabs(next - t) <= 1e-14 * t) return next;
        t = next;
    }
    return t;
}

/* The law over h from scaled (x, u, c) to x1; x = 0: it starts at rest, x1 = 0: it ends at rest. `time`: if known, else 0. */
void law_from(jerk_law *law, double h, double x, double u, double c, double x1, double time, double scale) {
    double f2 = scale * scale;
    law->length = h;
    law->v0 = scale * sqrt(fmax(0.0, x));
    law->a0 = f2 * u;
    law->c = f2 * c;
    law->jerk = 0.0;
    if (x <= 0.0 || x1 <= 0.0) {
        /* s = jerk t^3 / 6 from or to rest: v = jerk t^2 / 2 at the other end, h = v t / 3 */
        double v = scale * sqrt(x > 0.0 ? x : x1);
        law->time = 3.0 * h / v;
        law->jerk = 2.0 * v / (law->time * law->time);
        law->c = 0.0;
        law->v0 = x > 0.0 ? v : 0.0;
        law->a0 = x > 0.0 ? -law->jerk * law->time : 0.0;
        return;
    }
    law->time = time > 0.0 ? time : duration(law, h, scale * sqrt(x1));
}

void law_constant_jerk(jerk_law *law, double h, double v, double a, double jerk, double time) {
    law->length = h;
    law->v0 = v;
    law->a0 = a;
    law->c = 0.0;
    law->jerk = jerk;
    law->time = time;
}

/* States every `dt` over consecutive laws; `phase` is the time of the first sample in the first law, and is left as
 * that of the next one behind the last law.  Returns the number of samples. */
int64_t jerk_sample(const jerk_law *laws, int64_t n, double dt, double *phase, jerk_state *out, int64_t max) {
    int64_t count = 0;
    double t = *phase;
    for (int64_t i = 0; i < n; i++) {
        for (; t < laws[i].time && count < max; t += dt) jerk_at(&laws[i], t, &out[count++]);
        t -= laws[i].time;
    }
    *phase = t;
    return count;
}
