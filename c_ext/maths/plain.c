#include "maths/plain.h"

#include <math.h>

/* The C library has one code for long double. A result of 64 bits, rounded to
 * 53, is almost always the nearest number that there is. */
#define OF_ONE(name, call)                                                     \
    double name(double in) {                                                   \
        return (double)call((long double)in);                                  \
    }
OF_ONE(plain_sin, sinl)
OF_ONE(plain_cos, cosl)
OF_ONE(plain_tan, tanl)
OF_ONE(plain_atan, atanl)
OF_ONE(plain_asin, asinl)
OF_ONE(plain_acos, acosl)
OF_ONE(plain_exp, expl)
OF_ONE(plain_log, logl)
OF_ONE(plain_cbrt, cbrtl)

double plain_atan2(double y, double x) {
    return (double)atan2l((long double)y, (long double)x);
}

double plain_pow(double base, double exponent) {
    return (double)powl((long double)base, (long double)exponent);
}

#define EACH(name)                                                             \
    void name##_all(const double *in, double *out, int64_t count) {            \
        for (int64_t i = 0; i < count; i++) {                                  \
            out[i] = name(in[i]);                                              \
        }                                                                      \
    }
EACH(plain_sin)
EACH(plain_cos)
EACH(plain_acos)
EACH(plain_cbrt)

void plain_atan2_all(const double *y,
                     const double *x,
                     double *out,
                     int64_t count) {
    for (int64_t i = 0; i < count; i++) {
        out[i] = plain_atan2(y[i], x[i]);
    }
}
