/* How far the derivatives by path length of a polynomial can leave a straight
 * line over a part of it.
 *
 * With E = |p'|^2 over the axes the length is measured over, per axis
 *     q'' = N / E^2,  N = p'' E - p' E'/2
 * and N, E are polynomials of the parameter; N vanishes wherever the path is
 * straight, however the parameter runs. One derivative by length is d/dw /
 * sqrt(E), so q'''  = (N' - 2 N E'/E) / E^(5/2) q'''' = (N'' - (9/2 N' E' + 2 N
 * E'')/E + 7 N E'^2/E^2) / E^3 Both are bounded by the sums of the magnitudes
 * of Taylor coefficients about the middle of the part, with the smallest E: no
 * sampling, so nothing is missed between samples. A function with |f''| <= m
 * leaves its chord over h by at most m h^2/8.
 */
#include "curve/curve.h"
#include "curve/tuning.h"
#include <math.h>
#include <string.h>

enum {
    FIRST = CURVE_ORDER - 1,
    METRIC = 2 * FIRST - 1,
    NORMAL = METRIC + FIRST - 1
}; /* numbers of p', E, z N */

/* i - k/2 */
static const double SHARE[FIRST][METRIC] = {
    {0.0, -0.5, -1.0, -1.5, -2.0, -2.5, -3.0, -3.5, -4.0},
    {1.0, 0.5, 0.0, -0.5, -1.0, -1.5, -2.0, -2.5, -3.0},
    {2.0, 1.5, 1.0, 0.5, 0.0, -0.5, -1.0, -1.5, -2.0},
    {3.0, 2.5, 2.0, 1.5, 1.0, 0.5, 0.0, -0.5, -1.0},
    {4.0, 3.5, 3.0, 2.5, 2.0, 1.5, 1.0, 0.5, 0.0},
};
static const double NUMBER[NORMAL] = {0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12};

/* Largest magnitudes over -1..1 of a polynomial of n numbers and its first two
 * derivatives. */
typedef struct sums {
    double value, d1, d2;
} sums;

#define INLINE                                                                 \
    static inline __attribute__((                                              \
        always_inline)) /* loops of a known length: twice as fast */
INLINE struct sums sums_of(const double *k, int count) {
    struct sums sums = {0};
#pragma GCC unroll 16
    for (int i = 0; i < count; i++) {
        double magnitude = fabs(k[i]);
        double slope = magnitude * NUMBER[i];
        sums.value += magnitude;
        sums.d1 += slope;
        sums.d2 += slope * NUMBER[i];
    }
    sums.d2 -= sums.d1;
    return sums;
}

/* Numbers of p' by the parameter. */
static int order_of(const struct curve *curve) {
    int order = 1;
    for (int i = 0; i < curve->axes; i++) {
        for (int k = FIRST; k > order; k--) {
            if (curve->c[i][k] != 0.0) {
                order = k;
            }
        }
    }
    return order;
}

/* p'(z) for w = middle + half z. */
INLINE void tangent_about(const double *coef,
                          int order,
                          double middle,
                          double half,
                          double *out) {
    double about[CURVE_ORDER];
    double scale = half;
    memcpy(about, coef, sizeof about);
#pragma GCC unroll 8
    for (int i = 0; i < order; i++)
#pragma GCC unroll 8
        for (int k = order - 1; k >= i && k > 0; k--) {
            about[k] += middle * about[k + 1];
        }
#pragma GCC unroll 8
    for (int i = 0; i < order; i++, scale *= half) {
        out[i] = NUMBER[i + 1] * about[i + 1] * scale;
    }
}

INLINE void add_square(const double *tangent, int order, double *metric) {
#pragma GCC unroll 8
    for (int i = 0; i < order; i++)
#pragma GCC unroll 8
        for (int k = 0; k < order; k++) {
            metric[i + k] += tangent[i] * tangent[k];
        }
}

/* z (p'' E - p' E'/2) */
INLINE void normal_of(const double *tangent,
                      int order,
                      const double *metric,
                      double *normal) {
#pragma GCC unroll 8
    for (int i = 0; i < order; i++)
#pragma GCC unroll 16
        for (int k = 0; k < 2 * order - 1; k++) {
            normal[i + k] += tangent[i] * metric[k] * SHARE[i][k];
        }
}

/* Where the parameter runs with the length: the derivatives are those of the
 * polynomial. Taylor coefficients about the middle. */
static void certify_natural(const struct curve *curve,
                            double middle,
                            double half,
                            double *third,
                            double *fourth) {
    double inv = 1.0 / curve->natural;
    double inv3 = inv * inv * inv;
    double inv4 = inv3 * inv;
    for (int i = 0; i < curve->axes; i++) {
        const double *k = curve->c[i];
        double slope = fabs(24.0 * k[4] + 120.0 * k[5] * middle);
        double bend = fabs(60.0 * k[5]) * half;
        bool moves = curve->moving >> i & 1;
        third[i] = moves
                       ? (fabs(6.0 * k[3]
                               + middle * (24.0 * k[4] + middle * 60.0 * k[5]))
                          + half * (slope + bend))
                             * inv3
                       : 0.0;
        fourth[i] = moves ? (slope + 2.0 * bend) * inv4 : 0.0;
    }
}

/* p' of `order` numbers per axis. */
INLINE bool certify(const struct curve *curve,
                    int order,
                    double middle,
                    double half,
                    double *third,
                    double *fourth) {
    double tangent[NC_AXES][FIRST];
    double metric[METRIC] = {0};
    for (int i = 0; i < curve->axes; i++) {
        if (!(curve->moving >> i & 1)) {
            continue;
        }
        tangent_about(curve->c[i], order, middle, half, tangent[i]);
        if (curve->metric >> i & 1) {
            add_square(tangent[i], order, metric);
        }
    }
    struct sums sums = sums_of(metric, 2 * order - 1);
    double least = 2.0 * metric[0] - sums.value;
    if (!(least > SHARE_LEFT * metric[0])) {
        return false;
    }
    double inv = 1.0 / least;
    double inv3 = inv * inv * inv;
    double root = sqrt(inv);
    double e1 = sums.d1 * inv;
    double e2 = sums.d2 * inv;
    for (int i = 0; i < curve->axes; i++) {
        third[i] = 0.0;
        fourth[i] = 0.0;
        if (!(curve->moving >> i & 1)) {
            continue;
        }
        double normal[NORMAL] = {0};
        normal_of(tangent[i], order, metric, normal);
        struct sums sums_m = sums_of(normal + 1, 3 * order - 3);
        third[i] = (sums_m.d1 + 2.0 * sums_m.value * e1) * inv * inv * root;
        fourth[i] =
            (sums_m.d2 + (4.5 * sums_m.d1 + 7.0 * sums_m.value * e1) * e1
             + 2.0 * sums_m.value * e2)
            * inv3;
    }
    return true;
}

/* Bounds of q''' and q'''' of every axis between the parameters a and b; false
 * where the speed changes too much to tell. */
bool curve_certify(const struct curve *curve,
                   double from,
                   double to,
                   double *third,
                   double *fourth) {
    double middle = 0.5 * (from + to);
    double half = 0.5 * fabs(to - from);
    if (curve->natural > 0.0) {
        certify_natural(curve, middle, half, third, fourth);
        return true;
    }
    int order = order_of(curve);
    return order == FIRST ? certify(curve, FIRST, middle, half, third, fourth)
                          : certify(curve, order, middle, half, third, fourth);
}
