/* LANES numbers at a time.
 *
 * Functions that are not inlined take vectors by address, or numbers: behind
 * one that takes a vector GCC 12 leaves the upper halves of AVX2's registers in
 * use, and what is built for any processor then takes three times as long. */
#ifndef JERK_VECTORS_H
#define JERK_VECTORS_H
#include <math.h>
#include "jerk/state/problem.h"

static inline vec set1(double v) {
    return (vec){v, v, v, v};
}
static inline vec load(const double *from) {
    return *(const vec *)from;
}
static inline void store(double *to, vec v) {
    *(vec *)to = v;
}
/* The greater lanes; those of the second where one is NAN. */
static inline vec vmax(vec a, vec other) {
#ifdef __AVX__
    return __builtin_ia32_maxpd256(a, other);
#else
    ivec mask = a > other;
    return (vec)((mask & (ivec)a) | (~mask & (ivec)other));
#endif
}
/* The lesser lanes; those of the second where one is NAN. */
static inline vec vmin(vec a, vec other) {
#ifdef __AVX__
    return __builtin_ia32_minpd256(a, other);
#else
    ivec mask = a < other;
    return (vec)((mask & (ivec)a) | (~mask & (ivec)other));
#endif
}
/* Lanes of `then` where the mask is set, of `other` elsewhere. */
static inline vec chosen(ivec mask, vec then, vec other) {
    return (vec)((mask & (ivec)then) | (~mask & (ivec)other));
}
static inline bool any_of(ivec mask) {
#ifdef __AVX__
    return __builtin_ia32_movmskpd256((vec)mask) != 0;
#else
    return (mask[0] | mask[1] | mask[2] | mask[3]) != 0;
#endif
}
static inline ivec are_finite(vec v) {
    return v - v == 0.0;
}
static inline vec size_of(vec v) {
    return vmax(v, -v);
}
/* Its lanes hold both numbers in turn. */
static inline vec in_turn(double one, double other) {
    return (vec){one, other, one, other};
}
static inline double top(vec v) {
    double front = fmax(v[0], v[1]);
    return fmax(front, fmax(v[2], v[3]));
}
/* The same of numbers none of which is NAN. */
static inline double largest(vec v) {
    double front = v[0] > v[1] ? v[0] : v[1];
    double back = v[2] > v[3] ? v[2] : v[3];
    return front > back ? front : back;
}
static inline double sum(vec v) {
    return (v[0] + v[1]) + (v[2] + v[3]);
}

static inline vec root_of(vec x) {
    vec out;
    for (int lane = 0; lane < LANES; lane++) {
        out[lane] = sqrt(x[lane]);
    }
    return out;
}
#endif
