/* Quintic B-splines: every span's basis as polynomials, the fairness matrix, the banded system. */
#include "smooth_internal.h"

/* Product of polynomial p (degree n) and a + b x. */
static void times_linear(const double *p, int n, double a, double b, double *out) {
    out[0] = a * p[0];
    for (int k = 1; k <= n; k++) out[k] = a * p[k] + b * p[k - 1];
    out[n + 1] = b * p[n];
}

/* m[j][k]: coefficient of x^k of the basis function of control point span + j, on the knot span tau[span + 5],
 * tau[span + 6] (de Boor's recursion on polynomials). */
void spline_span_basis(const double *tau, int span, double m[ORDER][ORDER]) {
    const double *k = tau + span + 5; /* the span is k[0]..k[1] */
    double h = k[1] - k[0], now[ORDER][ORDER] = {{1.0}}, next[ORDER][ORDER];
    for (int p = 1; p < ORDER; p++) { /* now[i]: function of degree p - 1 that begins at k[i - p + 1] */
        memset(next, 0, sizeof next);
        for (int i = 0; i < p; i++) {
            double from = k[i - p + 1], to = k[i + 1], width = to - from, up[ORDER + 1], down[ORDER + 1];
            times_linear(now[i], p - 1, (k[0] - from) / width, h / width, up);
            times_linear(now[i], p - 1, (to - k[0]) / width, -h / width, down);
            for (int d = 0; d <= p; d++) {
                next[i + 1][d] += up[d];
                next[i][d] += down[d];
            }
        }
        memcpy(now, next, sizeof now);
    }
    memcpy(m, now, sizeof now);
}

void spline_basis_at(const double m[ORDER][ORDER], double x, double b[ORDER]) {
    for (int j = 0; j < ORDER; j++)
        b[j] = m[j][0] + x * (m[j][1] + x * (m[j][2] + x * (m[j][3] + x * (m[j][4] + x * m[j][5]))));
}

/* Coefficients of the curve on one span, over x = 0..1. */
void spline_piece(const window *w, int span, int axes, double out[][ORDER]) {
    for (int a = 0; a < axes; a++) {
        double sum[ORDER] = {0.0};
        for (int j = 0; j < ORDER; j++)
            for (int k = 0; k < ORDER; k++) sum[k] += w->m[span][j][k] * w->c[span + j][a];
        memcpy(out[a], sum, sizeof sum);
    }
}

/* Integrals of the products of third derivatives over a span, row by row of the upper triangle. */
void spline_fairness(window *w, int span) {
    double h = w->tau[span + 6] - w->tau[span + 5], h2 = h * h, f = 1.0 / (h2 * h2 * h), d[ORDER][3], *out = w->fair[span];
    for (int j = 0; j < ORDER; j++) {
        d[j][0] = 6.0 * w->m[span][j][3];
        d[j][1] = 24.0 * w->m[span][j][4];
        d[j][2] = 60.0 * w->m[span][j][5];
    }
    for (int i = 0; i < ORDER; i++)
        for (int j = i; j < ORDER; j++)
            *out++ = f * (d[i][0] * d[j][0] + (d[i][0] * d[j][1] + d[i][1] * d[j][0]) / 2.0 +
                          (d[i][0] * d[j][2] + d[i][1] * d[j][1] + d[i][2] * d[j][0]) / 3.0 +
                          (d[i][1] * d[j][2] + d[i][2] * d[j][1]) / 4.0 + d[i][2] * d[j][2] / 5.0);
}

static void add_fairness(window *w, int span) {
    const double *f = w->fair[span];
    for (int i = 0; i < ORDER; i++)
        for (int j = 0; i + j < ORDER; j++) w->band[span + i][j] += w->rho[span] * *f++;
}

static void add_site(window *w, const site *p, double (*right)[NC_AXES], int axes) {
    for (int i = 0; i < ORDER; i++) {
        double f = p->weight * p->basis[i];
        for (int j = i; j < ORDER; j++) w->band[p->span + i][j - i] += f * p->basis[j];
        for (int a = 0; a < axes; a++) right[p->span + i][a] += f * p->q[a];
    }
}

/* Fixed control points go to the right-hand side; their own equations become trivial. */
static void fix(window *w, double (*right)[NC_AXES], int k, int n, int axes) {
    for (int d = 1; d < ORDER; d++) {
        if (k + d < n)
            for (int a = 0; a < axes; a++) right[k + d][a] -= w->band[k][d] * w->c[k][a];
        if (k - d >= 0) {
            for (int a = 0; a < axes; a++) right[k - d][a] -= w->band[k - d][d] * w->c[k][a];
            w->band[k - d][d] = 0.0;
        }
        w->band[k][d] = 0.0;
    }
    w->band[k][0] = 1.0;
    for (int a = 0; a < axes; a++) right[k][a] = w->c[k][a];
}

/* LDL^T of the band, in place: band[i][0] becomes D, band[i][d] the factor L(i + d, i). */
static void factor(window *w, int n) {
    for (int i = 0; i < n; i++) {
        double pivot = w->band[i][0], column[ORDER];
        int last = n - 1 - i < 5 ? n - 1 - i : 5;
        for (int d = 1; d <= last; d++) {
            column[d] = w->band[i][d];
            w->band[i][d] /= pivot;
        }
        for (int d = 1; d <= last; d++)
            for (int k = d; k <= last; k++) w->band[i + d][k - d] -= w->band[i][d] * column[k];
    }
}

static void substitute(window *w, double (*x)[NC_AXES], int n, int axes) {
    for (int i = 0; i < n; i++)
        for (int d = 1; d < ORDER && i + d < n; d++)
            for (int a = 0; a < axes; a++) x[i + d][a] -= w->band[i][d] * x[i][a];
    for (int i = n; i-- > 0;) {
        for (int a = 0; a < axes; a++) x[i][a] /= w->band[i][0];
        for (int d = 1; d < ORDER && i + d < n; d++)
            for (int a = 0; a < axes; a++) x[i][a] -= w->band[i][d] * x[i + d][a];
    }
}

/* Control points that minimise the weighted fairness and residuals; fixed ones stay. */
void spline_solve(window *w, int axes) {
    int n = w->spans + 5;
    double right[CONTROLS][NC_AXES];
    memset(right, 0, sizeof right[0] * (size_t)n);
    memset(w->band, 0, sizeof w->band[0] * (size_t)n);
    for (int k = 0; k < w->spans; k++) add_fairness(w, k);
    for (int k = 0; k < w->sites_n; k++) add_site(w, &w->sites[k], right, axes);
    for (int k = 0; k < w->fixed_head; k++) fix(w, right, k, n, axes);
    for (int k = n - w->fixed_tail; k < n; k++) fix(w, right, k, n, axes);
    factor(w, n);
    substitute(w, right, n, axes);
    for (int k = w->fixed_head; k < n - w->fixed_tail; k++) memcpy(w->c[k], right[k], sizeof right[k]);
}
