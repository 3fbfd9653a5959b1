/* Functions of angles and powers that give the same bits with every compiler
 * and on every processor of an architecture. Those of the C library for double
 * choose their code by the processor, and the last bit may be another one.
 *
 * The error is below 0.51 ulp (tests/unit/maths). Angles in rad. */
#ifndef MATHS_PLAIN_H
#define MATHS_PLAIN_H
#include <stdint.h>

/* cdef begin */
double plain_sin(double angle);
double plain_cos(double angle);
double plain_tan(double angle);
double plain_atan(double slope);
double plain_atan2(double y, double x);
double plain_asin(double sine);
double plain_acos(double cosine);
double plain_exp(double power);
double plain_log(double value);
double plain_cbrt(double value);
double plain_pow(double base, double exponent);

/* The same of `count` numbers; `out` may be the input. */
void plain_sin_all(const double *angle, double *out, int64_t count);
void plain_cos_all(const double *angle, double *out, int64_t count);
void plain_acos_all(const double *cosine, double *out, int64_t count);
void plain_cbrt_all(const double *value, double *out, int64_t count);
void plain_atan2_all(const double *y,
                     const double *x,
                     double *out,
                     int64_t count);
/* cdef end */
#endif
