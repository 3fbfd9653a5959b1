/* Quintic B-splines: every span's basis as polynomials, the fairness matrix, the banded system. Two numbers at a time. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* loops of fixed length are written out */
#endif
#include "stages/smoothing/state.h"

/* Product of polynomial p (degree n) and a + b x. */
static void times_linear(const double *p, int n, double a, double b, double *out) {
    out[0] = a * p[0];
    for (int k = 1; k <= n; k++) out[k] = a * p[k] + b * p[k - 1];
    out[n + 1] = b * p[n];
}

/* m[j][k]: coefficient of x^k of the basis function of control point span + j, on the knot span tau[span + 5],
 * tau[span + 6] (de Boor's recursion on polynomials). */
static void span_basis(const double *tau, int span, double m[ORDER][ORDER]) {
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

/* Bernstein coefficients from those of powers. */
static void to_bernstein(const double *p, double *out) {
    static const double up[ORDER][ORDER] = {{1}, {1, 0.2}, {1, 0.4, 0.1}, {1, 0.6, 0.3, 0.1}, {1, 0.8, 0.6, 0.4, 0.2}, {1, 1, 1, 1, 1, 1}};
    for (int j = 0; j < ORDER; j++) {
        out[j] = 0.0;
        for (int i = 0; i <= j; i++) out[j] += up[j][i] * p[i];
    }
}

/* Integrals of the products of third derivatives over a span. What is behind the triangle stays zero. */
static void fairness(window *w, int span) {
    double h = w->tau[span + 6] - w->tau[span + 5], h2 = h * h, f = 1.0 / (h2 * h2 * h), d[ORDER][3];
    for (int j = 0; j < ORDER; j++) {
        d[j][0] = 6.0 * w->m[span][j][3];
        d[j][1] = 24.0 * w->m[span][j][4];
        d[j][2] = 60.0 * w->m[span][j][5];
    }
    for (int i = 0; i < ORDER; i++)
        for (int j = i; j < ORDER; j++)
            w->fair[span][i][j - i] = f * (d[i][0] * d[j][0] + (d[i][0] * d[j][1] + d[i][1] * d[j][0]) / 2.0 +
                          (d[i][0] * d[j][2] + d[i][1] * d[j][1] + d[i][2] * d[j][0]) / 3.0 +
                          (d[i][1] * d[j][2] + d[i][2] * d[j][1]) / 4.0 + d[i][2] * d[j][2] / 5.0);
}

/* Everything about a span that its knots say. */
void spline_span(window *w, int span) {
    span_basis(w->tau, span, w->m[span]);
    fairness(w, span);
    for (int j = 0; j < ORDER; j++) {
        const double *m = w->m[span][j];
        to_bernstein(m, w->hull[span][j]);
        w->middle[span][0][j] = m[1] + m[2] + 0.75 * m[3] + 0.5 * m[4] + 0.3125 * m[5];
        w->middle[span][1][j] = 2.0 * m[2] + 3.0 * m[3] + 3.0 * m[4] + 2.5 * m[5];
    }
}

void spline_basis_at(const double m[ORDER][ORDER], double x, double b[ORDER]) {
    for (int j = 0; j < ORDER; j++)
        b[j] = m[j][0] + x * (m[j][1] + x * (m[j][2] + x * (m[j][3] + x * (m[j][4] + x * m[j][5]))));
}

static pair both(double v) { return (pair){v, v}; }
static pair at(const double *p) { return *(const pair *)p; }
static void put(double *p, pair v) { *(pair *)p = v; }

static void combine(const double m[ORDER][ORDER], const double c[][AXES_EVEN], int axes, double out[][ORDER]) {
    for (int a = 0; a < axes; a++) {
        pair sum[PAIRS] = {both(0.0), both(0.0), both(0.0)};
        for (int j = 0; j < ORDER; j++)
            for (int k = 0; k < PAIRS; k++) sum[k] += at(m[j] + 2 * k) * both(c[j][a]);
        for (int k = 0; k < PAIRS; k++) put(out[a] + 2 * k, sum[k]);
    }
}

/* Coefficients of the curve on one span, over x = 0..1. */
void spline_piece(const window *w, int span, int axes, double out[][ORDER]) { combine(w->m[span], w->c + span, axes, out); }

/* Its Bernstein coefficients. */
void spline_hull(const window *w, int span, int axes, double out[][ORDER]) { combine(w->hull[span], w->c + span, axes, out); }

/* The system: rows of the band and right-hand sides, from control point 0 on. ORDER rows before and behind it stand zeros. */
typedef struct equations {
    double (*band)[ORDER];
    pair *right;
    int n;
} equations;

static void add_fairness(const equations *e, const window *w, int span) {
    pair rho = both(w->rho[span]);
    for (int i = 0; i < ORDER; i++)
        for (int k = 0; 2 * k < ORDER - i; k++) {
            double *to = e->band[span + i] + 2 * k;
            put(to, at(to) + rho * at(w->fair[span][i] + 2 * k));
        }
}

static inline void add_site(const equations *e, const site *p, int pairs) {
    for (int i = 0; i < ORDER; i++) {
        pair f = both(p->weight * p->basis[i]), *to = e->right + (p->span + i) * pairs;
        double *row = e->band[p->span + i];
        for (int k = 0; 2 * k < ORDER - i; k++) put(row + 2 * k, at(row + 2 * k) + f * at(p->basis + i + 2 * k));
        for (int a = 0; a < pairs; a++) to[a] += f * at(p->q + 2 * a);
    }
}

/* Fixed control points go to the right-hand side; their own equations become trivial. */
static void fix(const equations *e, const double *c, int k, int pairs) {
    pair *x = e->right + k * pairs;
    for (int d = 1; d < ORDER; d++) {
        pair behind = both(k + d < e->n ? e->band[k][d] : 0.0), before = both(k - d >= 0 ? e->band[k - d][d] : 0.0);
        for (int a = 0; a < pairs; a++) {
            x[d * pairs + a] -= behind * at(c + 2 * a);
            x[a - d * pairs] -= before * at(c + 2 * a);
        }
        if (k - d >= 0) e->band[k - d][d] = 0.0;
        e->band[k][d] = 0.0;
    }
    e->band[k][0] = 1.0;
    for (int a = 0; a < pairs; a++) x[a] = at(c + 2 * a);
}

/* LDL^T of the band, in place: row i becomes 1 / D and the factors L(i + 1.., i). */
static void factor(const equations *e) {
    for (int i = 0; i < e->n; i++) {
        double *row = e->band[i];
        pair c01 = at(row), c23 = at(row + 2), c45 = at(row + 4), c12 = {c01[1], c23[0]}, c34 = {c23[1], c45[0]}, c5 = {c45[1], 0.0};
        double inverse = 1.0 / row[0];
        const pair l1 = both(c01[1] * inverse), l2 = both(c23[0] * inverse), l3 = both(c23[1] * inverse);
        const pair l4 = both(c45[0] * inverse), l5 = both(c45[1] * inverse);
        put(row, (pair){inverse, l1[0]});
        put(row + 2, (pair){l2[0], l3[0]});
        put(row + 4, (pair){l4[0], l5[0]});
        row += ORDER;
        put(row, at(row) - l1 * c12);
        put(row + 2, at(row + 2) - l1 * c34);
        put(row + 4, at(row + 4) - l1 * c5);
        row += ORDER;
        put(row, at(row) - l2 * c23);
        put(row + 2, at(row + 2) - l2 * c45);
        row += ORDER;
        put(row, at(row) - l3 * c34);
        put(row + 2, at(row + 2) - l3 * c5);
        row += ORDER;
        put(row, at(row) - l4 * c45);
        row += ORDER;
        put(row, at(row) - l5 * c5);
    }
}

static inline void substitute(const equations *e, int pairs) {
    for (int i = 1; i < e->n; i++)
        for (int a = 0; a < pairs; a++) {
            pair *x = e->right + i * pairs + a, sum = *x;
            for (int d = ORDER - 1; d > 0; d--) sum -= both(e->band[i - d][d]) * x[-d * pairs];
            *x = sum;
        }
    for (int i = e->n; i-- > 0;)
        for (int a = 0; a < pairs; a++) {
            pair *x = e->right + i * pairs + a, sum = *x * both(e->band[i][0]);
            for (int d = ORDER - 1; d > 0; d--) sum -= both(e->band[i][d]) * x[d * pairs];
            *x = sum;
        }
}

static inline void solve(window *w, int pairs) {
    pair room[(ORDER + CONTROLS + ORDER) * AXES_EVEN / 2];
    equations e = {w->band + ORDER, room + ORDER * pairs, w->spans + 5};
    memset(room, 0, sizeof *room * (size_t)((e.n + 2 * ORDER) * pairs));
    memset(w->band, 0, sizeof w->band[0] * (size_t)(e.n + 2 * ORDER));
    for (int k = 0; k < w->spans; k++) add_fairness(&e, w, k);
    for (int k = 0; k < w->sites_n; k++) add_site(&e, &w->sites[k], pairs);
    for (int k = 0; k < w->fixed_head; k++) fix(&e, w->c[k], k, pairs);
    for (int k = e.n - w->fixed_tail; k < e.n; k++) fix(&e, w->c[k], k, pairs);
    factor(&e);
    substitute(&e, pairs);
    for (int k = w->fixed_head; k < e.n - w->fixed_tail; k++) memcpy(w->c[k], e.right + k * pairs, sizeof *e.right * (size_t)pairs);
}

/* Control points that minimise the weighted fairness and residuals; fixed ones stay. */
void spline_solve(window *w, int axes) {
    int pairs = (axes + 1) / 2;
    if (pairs == 2) solve(w, 2);
    else solve(w, pairs);
}

/* Inverse of the system that was solved last, within its band; control points that are fixed do not give. */
void spline_invert(window *w) {
    int n = w->spans + 5;
    double (*z)[ORDER] = w->inverse;
    memset(z[n], 0, sizeof *z * ORDER);
    for (int i = n; i-- > 0;) {
        const double *l = w->band[ORDER + i];
        double give = l[0];
        for (int j = 1; j < ORDER; j++) {
            double sum = 0.0;
            for (int k = 1; k < ORDER; k++) sum -= l[k] * (k <= j ? z[i + k][j - k] : z[i + j][k - j]);
            z[i][j] = sum;
        }
        for (int k = 1; k < ORDER; k++) give -= l[k] * z[i][k];
        z[i][0] = give;
    }
    for (int k = 0; k < w->fixed_head; k++) z[k][0] = 0.0;
    for (int k = n - w->fixed_tail; k < n; k++) z[k][0] = 0.0;
}

/* How far the curve of spline_invert gives way to a force of 1 at a point. With a weight w more there, the residual is divided by
 * 1 + give * w. */
double spline_give(const window *w, const site *p) {
    double sum = 0.0;
    for (int a = 0; a < ORDER; a++) {
        double part = 0.5 * w->inverse[p->span + a][0] * p->basis[a];
        for (int b = a + 1; b < ORDER; b++) part += w->inverse[p->span + a][b - a] * p->basis[b];
        sum += part * p->basis[a];
    }
    return fmax(2.0 * sum, 1e-300);
}
