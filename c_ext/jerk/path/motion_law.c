/* Time laws: over an interval the speed is a polynomial of degree 5 in time. */
#include <math.h>
#include "jerk/path/motion_law.h"
#include "jerk/state/tuning.h"
#include "maths/order.h"

/* Position, speed and acceleration of a law at the time t since its start. */
void jerk_at(const jerk_law *law, double t, jerk_state *out) {
    const double j = law->jerk;
    const double snap = law->snap;
    const double crackle = law->crackle;
    const double pop = law->pop;
    double s5 = snap * PER_24 + t * (crackle * PER_120 + t * (pop * PER_720));
    double s3 = law->a0 / 2 + t * (j * PER_6 + t * s5);
    double v3 = snap * PER_6 + t * (crackle * PER_24 + t * (pop * PER_120));
    double a2 = snap / 2 + t * (crackle * PER_6 + t * (pop * PER_24));
    out->s = law->s0 + t * (law->v0 + t * s3);
    double v2 = j / 2 + t * v3;
    out->v = law->v0 + t * (law->a0 + t * v2);
    out->a = law->a0 + t * (j + t * a2);
}

double motion_law_jerk(const jerk_law *law, double t) {
    double j2 = law->crackle / 2 + t * (law->pop * PER_6);
    return law->jerk + t * (law->snap + t * j2);
}

void jerk_begin_at(jerk_law *law, double t) {
    jerk_state at;
    jerk_at(law, t, &at);
    law->s0 = at.s;
    law->v0 = at.v;
    law->a0 = at.a;
    law->jerk = motion_law_jerk(law, t);
    law->snap += t * (law->crackle + t * law->pop / 2);
    law->crackle += t * law->pop;
}

/* Constant jerk from or to rest, with the speed v at the other end: s = jerk
 * t^3 / 6, v = jerk t^2 / 2, h = v t / 3. */
static void standstill_law(jerk_law *law,
                           double length,
                           double v,
                           bool to_standstill) {
    law->time = 3.0 * length / v;
    law->jerk = 2.0 * v / (law->time * law->time);
    law->snap = 0.0;
    law->crackle = 0.0;
    law->pop = 0.0;
    law->v0 = to_standstill ? v : 0.0;
    law->a0 = to_standstill ? -law->jerk * law->time : 0.0;
}

/* Time over h: the integral of the polynomial through the speeds, accelerations
 * and jerks at both ends. NAN: there is none near that of a linear jerk (the
 * speed would all but vanish inside). */
static double duration(double length,
                       double v0,
                       double a0,
                       double j0,
                       double v1,
                       double a1,
                       double j1) {
    double mean = 0.5 * (v0 + v1);
    double turn = (a0 - a1) * 0.1;
    double twist = (j0 + j1) * PER_120;
    double square = mean * mean + (a0 - a1) * length * (1.0 / 3.0);
    double t = 2.0 * length / (mean + sqrt(greater(square, 0.0)));
    for (int i = 0; i < DURATION_STEPS; i++) {
        double slope = mean + t * (2.0 * turn + 3.0 * t * twist);
        double step = (length - t * (mean + t * (turn + t * twist))) / slope;
        t += step;
        if (fabs(step) <= DURATION_CLOSE * t) {
            return slope > LEAST_SLOPE * mean ? t : NAN;
        }
    }
    return NAN;
}

/* The law over h between two states and the jerks there: Hermite's polynomial
 * for the speed. */
void motion_law_between(jerk_law *law,
                        double length,
                        double v0,
                        double a0,
                        double j0,
                        double v1,
                        double a1,
                        double j1) {
    double t = duration(length, v0, a0, j0, v1, a1, j1);
    double t2 = t * t;
    double v = v1 - v0 - a0 * t - 0.5 * j0 * t2;
    double a = (a1 - a0 - j0 * t) * t;
    double j = (j1 - j0) * t2;
    double per_t = 1.0 / t;
    double per_t2 = per_t * per_t;
    double per_t3 = per_t2 * per_t;
    law->length = length;
    law->v0 = v0;
    law->a0 = a0;
    law->jerk = j0;
    law->time = t;
    law->snap = 6.0 * (10.0 * v - 4.0 * a + 0.5 * j) * per_t3;
    law->crackle = 24.0 * (-15.0 * v + 7.0 * a - j) * (per_t2 * per_t2);
    double pop = 6.0 * v - 3.0 * a + 0.5 * j;
    law->pop = 120.0 * pop * (per_t2 * per_t3);
}

/* The law over h from scaled (x, u) to (x1, u1), with c[0] and c[1] there; x =
 * 0: it starts at rest, x1 = 0: it ends at rest. */
void motion_law_from(jerk_law *law,
                     double length,
                     double x,
                     double accel,
                     double x1,
                     double u1,
                     const double input[2],
                     double scale) {
    double f2 = scale * scale;
    double v = scale * sqrt(greater(x, 0.0));
    double v1 = scale * sqrt(greater(x1, 0.0));
    law->length = length;
    if (x <= 0.0) {
        standstill_law(law, length, v1, false);
    } else if (x1 <= 0.0) {
        standstill_law(law, length, v, true);
    } else {
        motion_law_between(law,
                           length,
                           v,
                           f2 * accel,
                           f2 * input[0] * v,
                           v1,
                           f2 * u1,
                           f2 * input[1] * v1);
    }
}

/* States every `dt` over consecutive laws; `phase` is the time of the first
 * sample in the first law, and is left as that of the next one behind the last
 * law.  Returns the number of samples. */
int64_t jerk_sample(const jerk_law *laws,
                    int64_t number,
                    double dt,
                    double *phase,
                    jerk_state *out,
                    int64_t max) {
    int64_t count = 0;
    double t = *phase;
    for (int64_t i = 0; i < number; i++) {
        for (; t < laws[i].time && count < max; t += dt) {
            jerk_at(&laws[i], t, &out[count++]);
        }
        t -= laws[i].time;
    }
    *phase = t;
    return count;
}
