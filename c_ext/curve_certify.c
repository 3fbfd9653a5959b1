/* How far the derivatives by path length of a polynomial can leave a straight line over a part of it.
 *
 * With E = |p'|^2 over the axes the length is measured over, per axis
 *     q'' = N / E^2,  N = p'' E - p' E'/2
 * and N, E are polynomials of the parameter; N vanishes wherever the path is straight, however the parameter runs. One
 * derivative by length is d/dw / sqrt(E), so
 *     q'''  = (N' - 2 N E'/E) / E^(5/2)
 *     q'''' = (N'' - (9/2 N' E' + 2 N E'')/E + 7 N E'^2/E^2) / E^3
 * Both are bounded by the sums of the magnitudes of Taylor coefficients about the middle of the part, with the smallest E:
 * no sampling, so nothing is missed between samples. A function with |f''| <= m leaves its chord over h by at most m h^2/8.
 */
#include "curve.h"
#include <math.h>
#include <string.h>

#define SHARE_LEFT 0.3 /* of E in the middle must be left as its lower bound */

enum { FIRST = CURVE_ORDER - 1, METRIC = 2 * FIRST - 1, NORMAL = METRIC + FIRST - 2 }; /* numbers of p', E, N */

/* Largest magnitudes over -1..1 of a polynomial and its first two derivatives. */
typedef struct sums {
    double f, d1, d2;
} sums;

static sums sums_of(const double *k, int n) {
    sums s = {0};
    for (int i = 0; i < n; i++) {
        double m = fabs(k[i]);
        s.f += m;
        s.d1 += m * i;
        s.d2 += m * (i * (i - 1));
    }
    return s;
}

/* p'(z) for w = middle + half z. */
static void tangent_about(const double *c, double middle, double half, double *out) {
    double shifted[CURVE_ORDER], scale = half;
    memcpy(shifted, c, sizeof shifted);
    for (int i = 0; i < CURVE_ORDER; i++)
        for (int k = CURVE_ORDER - 2; k >= i; k--) shifted[k] += middle * shifted[k + 1];
    for (int i = 0; i < FIRST; i++, scale *= half) out[i] = (i + 1) * shifted[i + 1] * scale;
}

static void add_square(const double *p, double *e) {
    for (int i = 0; i < FIRST; i++) {
        if (p[i] == 0.0) continue;
        for (int k = 0; k < FIRST; k++) e[i + k] += p[i] * p[k];
    }
}

/* p'' E - p' E'/2 */
static void normal_of(const double *p, const double *e, double *n) {
    memset(n, 0, sizeof(double) * NORMAL);
    for (int i = 0; i < FIRST; i++) {
        if (p[i] == 0.0) continue;
        for (int k = 0; k < METRIC; k++) {
            int at = i + k - 1; /* i p_i z^(i-1) e_k z^k - p_i z^i k e_k z^(k-1) / 2 */
            if (at >= 0 && at < NORMAL) n[at] += p[i] * e[k] * (i - 0.5 * k);
        }
    }
}

/* Bounds of q''' and q'''' of every axis between the parameters a and b; false where the speed changes too much to tell. */
bool curve_certify(const curve *c, double a, double b, double *third, double *fourth) {
    double p[NC_AXES][FIRST], e[METRIC] = {0}, n[NORMAL];
    double middle = 0.5 * (a + b), half = 0.5 * fabs(b - a);
    for (int i = 0; i < c->axes; i++) {
        if (!(c->moving >> i & 1)) continue;
        tangent_about(c->c[i], middle, half, p[i]);
        if (c->metric >> i & 1) add_square(p[i], e);
    }
    if (c->natural > 0.0) e[0] = c->natural * c->natural * half * half;
    sums s = sums_of(e, METRIC);
    double least = 2.0 * e[0] - s.f;
    if (!(least > SHARE_LEFT * e[0])) return false;
    double inv = 1.0 / least, inv3 = inv * inv * inv, root = sqrt(inv), e1 = s.d1 * inv, e2 = s.d2 * inv;
    for (int i = 0; i < c->axes; i++) {
        third[i] = fourth[i] = 0.0;
        if (!(c->moving >> i & 1)) continue;
        normal_of(p[i], e, n);
        sums m = sums_of(n, NORMAL);
        third[i] = (m.d1 + 2.0 * m.f * e1) * inv * inv * root;
        fourth[i] = (m.d2 + (4.5 * m.d1 + 7.0 * m.f * e1) * e1 + 2.0 * m.f * e2) * inv3;
    }
    return true;
}
