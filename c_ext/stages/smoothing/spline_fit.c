/* Quintic B-splines: every span's basis as polynomials, the fairness matrix,
 * the banded system. Two numbers at a time. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* loops of fixed length are written out */
#endif
#include "stages/smoothing/spline_fit.h"
#include "stages/smoothing/state.h"

/* Product of polynomial p (degree n) and a + b x. */
static void times_linear(const double *coef,
                         int count,
                         double constant,
                         double slope,
                         double *out) {
    out[0] = constant * coef[0];
    for (int k = 1; k <= count; k++) {
        out[k] = constant * coef[k] + slope * coef[k - 1];
    }
    out[count + 1] = slope * coef[count];
}

/* m[j][k]: coefficient of x^k of the basis function of control point span + j,
 * on the knot span tau[span + 5], tau[span + 6] (de Boor's recursion on
 * polynomials). */
static void span_basis(const double *tau,
                       int span,
                       double basis[ORDER][ORDER]) {
    const double *knot = tau + span + 5; /* the span is k[0]..k[1] */
    double length = knot[1] - knot[0];
    double now[ORDER][ORDER] = {{1.0}};
    double next[ORDER][ORDER];
    for (int degree = 1; degree < ORDER;
         degree++) { /* now[i]: function of degree p - 1 that
         begins at k[i - p + 1] */
        memset(next, 0, sizeof next);
        for (int i = 0; i < degree; i++) {
            double from = knot[i - degree + 1];
            double to = knot[i + 1];
            double width = to - from;
            double up[ORDER + 1], down[ORDER + 1];
            times_linear(now[i],
                         degree - 1,
                         (knot[0] - from) / width,
                         length / width,
                         up);
            times_linear(now[i],
                         degree - 1,
                         (to - knot[0]) / width,
                         -length / width,
                         down);
            for (int off = 0; off <= degree; off++) {
                next[i + 1][off] += up[off];
                next[i][off] += down[off];
            }
        }
        memcpy(now, next, sizeof now);
    }
    memcpy(basis, now, sizeof now);
}

/* Bernstein coefficients from those of powers. */
static void to_bernstein(const double *coef, double *out) {
    static const double up[ORDER][ORDER] = {{1},
                                            {1, 0.2},
                                            {1, 0.4, 0.1},
                                            {1, 0.6, 0.3, 0.1},
                                            {1, 0.8, 0.6, 0.4, 0.2},
                                            {1, 1, 1, 1, 1, 1}};
    for (int j = 0; j < ORDER; j++) {
        out[j] = 0.0;
        for (int i = 0; i <= j; i++) {
            out[j] += up[j][i] * coef[i];
        }
    }
}

/* Integrals of the products of third derivatives over a span. What is behind
 * the triangle stays zero. */
static void fairness(struct window *window, int span) {
    double length = window->tau[span + 6] - window->tau[span + 5];
    double h2 = length * length;
    double scale = 1.0 / (h2 * h2 * length);
    double third[ORDER][3];
    for (int j = 0; j < ORDER; j++) {
        third[j][0] = 6.0 * window->basis[span][j][3];
        third[j][1] = 24.0 * window->basis[span][j][4];
        third[j][2] = 60.0 * window->basis[span][j][5];
    }
    for (int i = 0; i < ORDER; i++) {
        for (int j = i; j < ORDER; j++) {
            window->fair[span][i][j - i] =
                scale
                * (third[i][0] * third[j][0]
                   + (third[i][0] * third[j][1] + third[i][1] * third[j][0])
                         / 2.0
                   + (third[i][0] * third[j][2] + third[i][1] * third[j][1]
                      + third[i][2] * third[j][0])
                         / 3.0
                   + (third[i][1] * third[j][2] + third[i][2] * third[j][1])
                         / 4.0
                   + third[i][2] * third[j][2] / 5.0);
        }
    }
}

/* Everything about a span that its knots say. */
void spline_span(struct window *window, int span) {
    span_basis(window->tau, span, window->basis[span]);
    fairness(window, span);
    for (int j = 0; j < ORDER; j++) {
        const double *basis = window->basis[span][j];
        to_bernstein(basis, window->hull[span][j]);
        window->middle[span][0][j] = basis[1] + basis[2] + 0.75 * basis[3]
                                     + 0.5 * basis[4] + 0.3125 * basis[5];
        window->middle[span][1][j] =
            2.0 * basis[2] + 3.0 * basis[3] + 3.0 * basis[4] + 2.5 * basis[5];
    }
}

void spline_basis_at(const double basis[ORDER][ORDER],
                     double x,
                     double out[ORDER]) {
    for (int j = 0; j < ORDER; j++) {
        out[j] =
            basis[j][0]
            + x
                  * (basis[j][1]
                     + x
                           * (basis[j][2]
                              + x
                                    * (basis[j][3]
                                       + x * (basis[j][4] + x * basis[j][5]))));
    }
}

static pair both(double v) {
    return (pair){v, v};
}
static pair at(const double *from) {
    return *(const pair *)from;
}
static void put(double *to, pair v) {
    *(pair *)to = v;
}

static void combine(const double basis[ORDER][ORDER],
                    const double control[][AXES_EVEN],
                    int axes,
                    double out[][ORDER]) {
    for (int axis = 0; axis < axes; axis++) {
        pair sum[PAIRS] = {both(0.0), both(0.0), both(0.0)};
        for (int j = 0; j < ORDER; j++) {
            for (int k = 0; k < PAIRS; k++) {
                sum[k] += at(basis[j] + 2 * k) * both(control[j][axis]);
            }
        }
        for (int k = 0; k < PAIRS; k++) {
            put(out[axis] + 2 * k, sum[k]);
        }
    }
}

/* Coefficients of the curve on one span, over x = 0..1. */
void spline_piece(const struct window *window,
                  int span,
                  int axes,
                  double out[][ORDER]) {
    combine(window->basis[span], window->control + span, axes, out);
}

/* Its Bernstein coefficients. */
void spline_hull(const struct window *window,
                 int span,
                 int axes,
                 double out[][ORDER]) {
    combine(window->hull[span], window->control + span, axes, out);
}

/* The system: rows of the band and right-hand sides, from control point 0 on.
 * ORDER rows before and behind it stand zeros. */
typedef struct equations {
    double (*band)[ORDER];
    pair *right;
    int count;
} equations;

static void add_fairness(const struct equations *equations,
                         const struct window *window,
                         int span) {
    pair rho = both(window->rho[span]);
    for (int i = 0; i < ORDER; i++) {
        for (int k = 0; 2 * k < ORDER - i; k++) {
            double *to = equations->band[span + i] + 2 * k;
            put(to, at(to) + rho * at(window->fair[span][i] + 2 * k));
        }
    }
}

static inline void add_site(const struct equations *equations,
                            const struct site *site,
                            int pairs) {
    for (int i = 0; i < ORDER; i++) {
        pair factor = both(site->weight * site->basis[i]);
        pair *to = equations->right + (site->span + i) * pairs;
        double *row = equations->band[site->span + i];
        for (int k = 0; 2 * k < ORDER - i; k++) {
            put(row + 2 * k,
                at(row + 2 * k) + factor * at(site->basis + i + 2 * k));
        }
        for (int axis = 0; axis < pairs; axis++) {
            to[axis] += factor * at(site->position + 2 * axis);
        }
    }
}

/* Fixed control points go to the right-hand side; their own equations become
 * trivial. */
static void fix(const struct equations *equations,
                const double *control,
                int k,
                int pairs) {
    pair *x = equations->right + k * pairs;
    for (int off = 1; off < ORDER; off++) {
        pair behind =
            both(k + off < equations->count ? equations->band[k][off] : 0.0);
        const double *row = equations->band[k - off];
        pair before = both(k - off >= 0 ? row[off] : 0.0);
        for (int axis = 0; axis < pairs; axis++) {
            x[off * pairs + axis] -= behind * at(control + 2 * axis);
            x[axis - off * pairs] -= before * at(control + 2 * axis);
        }
        if (k - off >= 0) {
            equations->band[k - off][off] = 0.0;
        }
        equations->band[k][off] = 0.0;
    }
    equations->band[k][0] = 1.0;
    for (int axis = 0; axis < pairs; axis++) {
        x[axis] = at(control + 2 * axis);
    }
}

/* LDL^T of the band, in place: row i becomes 1 / D and the factors L(i + 1..,
 * i). */
static void factor(const struct equations *equations) {
    for (int i = 0; i < equations->count; i++) {
        double *row = equations->band[i];
        pair c01 = at(row);
        pair c23 = at(row + 2);
        pair c45 = at(row + 4);
        pair c12 = {c01[1], c23[0]};
        pair c34 = {c23[1], c45[0]};
        pair c5 = {c45[1], 0.0};
        double inverse = 1.0 / row[0];
        const pair l1 = both(c01[1] * inverse);
        const pair l2 = both(c23[0] * inverse);
        const pair l3 = both(c23[1] * inverse);
        const pair l4 = both(c45[0] * inverse);
        const pair l5 = both(c45[1] * inverse);
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

static inline void substitute(const struct equations *equations, int pairs) {
    for (int i = 1; i < equations->count; i++) {
        for (int axis = 0; axis < pairs; axis++) {
            pair *x = equations->right + i * pairs + axis;
            pair sum = *x;
            for (int off = ORDER - 1; off > 0; off--) {
                sum -= both(equations->band[i - off][off]) * x[-off * pairs];
            }
            *x = sum;
        }
    }
    for (int i = equations->count; i-- > 0;) {
        for (int axis = 0; axis < pairs; axis++) {
            pair *x = equations->right + i * pairs + axis;
            pair sum = *x * both(equations->band[i][0]);
            for (int off = ORDER - 1; off > 0; off--) {
                sum -= both(equations->band[i][off]) * x[off * pairs];
            }
            *x = sum;
        }
    }
}

static inline void solve(struct window *window, int pairs) {
    pair room[(ORDER + CONTROLS + ORDER) * AXES_EVEN / 2];
    struct equations equations = {window->band + ORDER,
                                  room + ORDER * pairs,
                                  window->spans + 5};
    memset(room,
           0,
           sizeof *room * (size_t)((equations.count + 2 * ORDER) * pairs));
    memset(window->band,
           0,
           sizeof window->band[0] * (size_t)(equations.count + 2 * ORDER));
    for (int k = 0; k < window->spans; k++) {
        add_fairness(&equations, window, k);
    }
    for (int k = 0; k < window->sites_n; k++) {
        add_site(&equations, &window->sites[k], pairs);
    }
    for (int k = 0; k < window->fixed_head; k++) {
        fix(&equations, window->control[k], k, pairs);
    }
    for (int k = equations.count - window->fixed_tail; k < equations.count;
         k++) {
        fix(&equations, window->control[k], k, pairs);
    }
    factor(&equations);
    substitute(&equations, pairs);
    for (int k = window->fixed_head; k < equations.count - window->fixed_tail;
         k++) {
        memcpy(window->control[k],
               equations.right + k * pairs,
               sizeof *equations.right * (size_t)pairs);
    }
}

/* Control points that minimise the weighted fairness and residuals; fixed ones
 * stay. */
void spline_solve(struct window *window, int axes) {
    int pairs = (axes + 1) / 2;
    if (pairs == 2) {
        solve(window, 2);
    } else {
        solve(window, pairs);
    }
}

void spline_band_solve(double (*band)[ORDER], pair *right, int count) {
    struct equations equations = {band + ORDER, right + ORDER, count};
    factor(&equations);
    substitute(&equations, 1);
}

/* The roughness of an axis at the speed of the law. */
static void add_rough(const struct equations *equations,
                      const struct window *window,
                      int span,
                      int axis) {
    for (int place = 0; place < LAW_PLACES; place++) {
        double weight = window->heavy[span][place][axis];
        const double *row = window->row[span][place];
        for (int i = 0; i < ORDER; i++) {
            double part = weight * row[i];
            double *to = equations->band[span + i];
            for (int j = i; j < ORDER; j++) {
                to[j - i] += part * row[j];
            }
        }
    }
}

static void add_wall(const struct equations *equations,
                     const struct site *site,
                     int axis,
                     int group) {
    for (int i = 0; i < ORDER; i++) {
        double part = site->force[group] * site->basis[i];
        double *to = equations->band[site->span + i];
        for (int k = 0; 2 * k < ORDER - i; k++) {
            put(to + 2 * k,
                at(to + 2 * k) + both(part) * at(site->basis + i + 2 * k));
        }
        equations->right[site->span + i][0] += part * site->aim[axis];
    }
}

static void solve_axis(struct window *window, int axis, int group) {
    pair room[ORDER + CONTROLS + ORDER];
    int count = window->spans + 5;
    struct equations equations = {window->band + ORDER, room + ORDER, count};
    size_t rows = (size_t)(count + 2 * ORDER);
    memset(room, 0, sizeof *room * rows);
    memset(window->band, 0, sizeof window->band[0] * rows);
    for (int k = 0; k < window->spans; k++) {
        add_rough(&equations, window, k, axis);
    }
    for (int k = 0; k < window->sites_n; k++) {
        add_wall(&equations, &window->sites[k], axis, group);
    }
    for (int k = 0; k < count; k++) {
        equations.right[k][0] += window->pull[k][axis];
    }
    int last = count - window->fixed_tail;
    for (int k = 0; k < count; k++) {
        if (k < window->fixed_head || k >= last) {
            double control[2] = {window->control[k][axis], 0.0};
            fix(&equations, control, k, 1);
        }
    }
    spline_band_solve(window->band, room, count);
    for (int k = window->fixed_head; k < last; k++) {
        window->control[k][axis] = equations.right[k][0];
    }
}

void spline_solve_timed(struct window *window, uint32_t rotary) {
    for (int k = 0; k < window->moving_n; k++) {
        int axis = window->moving[k];
        solve_axis(window, axis, rotary >> axis & 1);
    }
}

/* Inverse of the system that was solved last, within its band; control points
 * that are fixed do not give. */
void spline_invert(struct window *window) {
    int count = window->spans + 5;
    double (*z)[ORDER] = window->inverse;
    memset(z[count], 0, sizeof *z * ORDER);
    for (int i = count; i-- > 0;) {
        const double *factors = window->band[ORDER + i];
        double give = factors[0];
        for (int j = 1; j < ORDER; j++) {
            double sum = 0.0;
            for (int k = 1; k < ORDER; k++) {
                sum -=
                    factors[k] * (k <= j ? z[i + k][j - k] : z[i + j][k - j]);
            }
            z[i][j] = sum;
        }
        for (int k = 1; k < ORDER; k++) {
            give -= factors[k] * z[i][k];
        }
        z[i][0] = give;
    }
    for (int k = 0; k < window->fixed_head; k++) {
        z[k][0] = 0.0;
    }
    for (int k = count - window->fixed_tail; k < count; k++) {
        z[k][0] = 0.0;
    }
}

/* How far the curve of spline_invert gives way to a force of 1 at a point. With
 * a weight w more there, the residual is divided by 1 + give * w. */
double spline_give(const struct window *window, const struct site *site) {
    double sum = 0.0;
    for (int i = 0; i < ORDER; i++) {
        double give = window->inverse[site->span + i][0];
        double part = 0.5 * give * site->basis[i];
        for (int other = i + 1; other < ORDER; other++) {
            part +=
                window->inverse[site->span + i][other - i] * site->basis[other];
        }
        sum += part * site->basis[i];
    }
    return fmax(2.0 * sum, 1e-300);
}
