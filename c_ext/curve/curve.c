/* Polynomial by arc length: cells, quadrature, inversion. */
#include "curve/curve.h"
#include <math.h>
#include <string.h>

#define QUADRATURE 1e-11 /* mm a cell's length may change when it is halved, and relative to the length */
#define SPEED_RATIO 3.0  /* of largest to smallest speed in a cell, so that the inversion converges */
#define CELL_TURN 0.35   /* rad, and ... */
#define CELL_BEND 0.3    /* ... share of its largest curvature that a cell should not exceed: limits are constant per cell */
#define SHORT_CELL 0.01  /* mm; shorter cells are not cut for the sake of limits */
#define STANDS 1e-9       /* mm or degrees an axis moves at most that rests */
#define LIMIT_CELLS 12   /* cells cut for the sake of limits */

/* Nodes and weights of the 8-point Gauss rule on -1..1. */
static const double NODE[4] = {0.1834346424956498, 0.5255324099163290, 0.7966664774136267, 0.9602898564975363};
static const double WEIGHT[4] = {0.3626837833783620, 0.3137066458778873, 0.2223810344533745, 0.1012285362903763};

static double first_derivative(const double *c, double w) {
    return c[1] + w * (2.0 * c[2] + w * (3.0 * c[3] + w * (4.0 * c[4] + w * 5.0 * c[5])));
}

static double second_derivative(const double *c, double w) {
    return 2.0 * c[2] + w * (6.0 * c[3] + w * (12.0 * c[4] + w * 20.0 * c[5]));
}

static double value(const double *c, double w) {
    return c[0] + w * (c[1] + w * (c[2] + w * (c[3] + w * (c[4] + w * c[5]))));
}

static double speed(const curve *c, double w) {
    if (c->natural > 0.0) return c->natural;
    double sum = 0.0;
    for (int i = 0; i < c->axes; i++) {
        if (!(c->metric >> i & 1)) continue;
        double d = first_derivative(c->c[i], w);
        sum += d * d;
    }
    return sqrt(sum);
}

/* Two parameters at a time. */
typedef double pair __attribute__((vector_size(16)));

static pair speeds(const curve *c, pair w) {
    if (c->natural > 0.0) return (pair){c->natural, c->natural};
    pair sum = {0.0, 0.0};
    for (int i = 0; i < c->axes; i++) {
        if (!(c->metric >> i & 1)) continue;
        const double *k = c->c[i];
        pair d = k[1] + w * (2.0 * k[2] + w * (3.0 * k[3] + w * (4.0 * k[4] + w * 5.0 * k[5])));
        sum += d * d;
    }
    return (pair){sqrt(sum[0]), sqrt(sum[1])};
}

/* Length from a to b; *low and *high are widened to the speeds met. */
static double integrate(const curve *c, double a, double b, double *low, double *high) {
    double middle = 0.5 * (a + b), half = 0.5 * (b - a), sum = 0.0;
    for (int k = 0; k < 4; k++) {
        pair v = speeds(c, (pair){middle - half * NODE[k], middle + half * NODE[k]});
        sum += WEIGHT[k] * (v[0] + v[1]);
        if (*low > v[0]) *low = v[0];
        if (*low > v[1]) *low = v[1];
        if (*high < v[0]) *high = v[0];
        if (*high < v[1]) *high = v[1];
    }
    return half * sum;
}

/* Length from the start to the parameter w. */
double curve_length_to(const curve *c, double w) {
    if (c->natural > 0.0) return w * c->natural;
    int i = 0;
    while (i + 1 < c->cells && w > c->w[i + 1]) i++;
    double low = 0.0, high = 0.0;
    return c->s[i] + integrate(c, c->w[i], w, &low, &high);
}

/* Length between two parameters where the speed changes little: four points. */
double curve_length_between(const curve *c, double a, double b) {
    static const double node[2] = {0.3399810435848563, 0.8611363115940526}, weight[2] = {0.6521451548625461, 0.3478548451374538};
    double middle = 0.5 * (a + b), half = 0.5 * fabs(b - a), sum = 0.0;
    for (int k = 0; k < 2; k++) {
        pair v = speeds(c, (pair){middle - half * node[k], middle + half * node[k]});
        sum += weight[k] * (v[0] + v[1]);
    }
    return half * sum;
}

void curve_position(const curve *c, double w, double *q) {
    for (int i = 0; i < c->axes; i++) q[i] = value(c->c[i], w);
}

void curve_tangent(const curve *c, double w, double *d1) {
    double v = speed(c, w);
    for (int i = 0; i < c->axes; i++) d1[i] = first_derivative(c->c[i], w) / v;
}

/* First and second derivative by length. */
void curve_derivatives(const curve *c, double w, double *d1, double *d2) {
    double v2 = 0.0, along = 0.0;
    for (int i = 0; i < c->axes; i++) {
        const double *k = c->c[i];
        d1[i] = w == 0.0 ? k[1] : first_derivative(k, w);
        d2[i] = w == 0.0 ? 2.0 * k[2] : second_derivative(k, w);
        if (!(c->metric >> i & 1)) continue;
        v2 += d1[i] * d1[i];
        along += d1[i] * d2[i];
    }
    if (c->natural > 0.0) v2 = c->natural * c->natural;
    double inv2 = 1.0 / v2, inv = sqrt(inv2), share = along * inv2;
    for (int i = 0; i < c->axes; i++) {
        d2[i] = (d2[i] - d1[i] * share) * inv2;
        d1[i] *= inv;
    }
}

void curve_at(const curve *c, double w, curve_point *p) {
    curve_position(c, w, p->q);
    curve_derivatives(c, w, p->d1, p->d2);
}

/* With v = |q'(w)| over the metric axes and dots for derivatives by w: q''' = (q3 - v2 d1 - 3 v v1 d2) / v^3. */
void curve_third(const curve *c, double w, double *d3) {
    double first[NC_AXES], second[NC_AXES], third[NC_AXES], vv = 0.0, fs = 0.0, ss = 0.0, ft = 0.0;
    for (int i = 0; i < c->axes; i++) {
        const double *k = c->c[i];
        first[i] = first_derivative(k, w);
        second[i] = second_derivative(k, w);
        third[i] = 6.0 * k[3] + w * (24.0 * k[4] + w * 60.0 * k[5]);
        if (!(c->metric >> i & 1)) continue;
        vv += first[i] * first[i];
        fs += first[i] * second[i];
        ss += second[i] * second[i];
        ft += first[i] * third[i];
    }
    if (c->natural > 0.0) vv = c->natural * c->natural;
    double v = sqrt(vv), v1 = fs / v, v2 = (ss + ft - v1 * v1) / v;
    for (int i = 0; i < c->axes; i++) {
        double d1 = first[i] / v, d2 = (second[i] - v1 * d1) / vv;
        d3[i] = (third[i] - v2 * d1 - 3.0 * v * v1 * d2) / (v * vv);
    }
}

typedef struct cell {
    double from, to, length;
    double wrong;  /* above 1: must be cut */
    double coarse; /* above 1: should be cut */
} cell;

static double metric_angle(const curve *c, const curve_point *a, const curve_point *b, double *bend) {
    double turn = 0.0, change = 0.0, most = 0.0, fast = 0.0;
    for (int i = 0; i < c->axes; i++) {
        change = fmax(change, fabs(a->d2[i] - b->d2[i]));
        most = fmax(most, fmax(fabs(a->d2[i]), fabs(b->d2[i])));
        fast = fmax(fast, fmax(fabs(a->d1[i]), fabs(b->d1[i])));
        if (!(c->natural > 0.0) && !(c->metric >> i & 1)) continue;
        turn += (a->d1[i] - b->d1[i]) * (a->d1[i] - b->d1[i]);
    }
    *bend = most > 0.0 ? change / most : 0.0;
    return c->natural > 0.0 && fast > 0.0 ? sqrt(turn) / fast : sqrt(turn);
}

static void judge(const curve *c, cell *k) {
    double low = INFINITY, high = 0.0, middle = 0.5 * (k->from + k->to);
    double whole = integrate(c, k->from, k->to, &low, &high);
    k->length = integrate(c, k->from, middle, &low, &high) + integrate(c, middle, k->to, &low, &high);
    double a = speed(c, k->from), b = speed(c, k->to);
    low = fmin(low, fmin(a, b));
    high = fmax(high, fmax(a, b));
    k->wrong = k->coarse = 0.0;
    if (!(low > 0.0) || !(k->length > 0.0)) {
        k->wrong = 1e30;
        return;
    }
    k->wrong = fmax(fabs(whole - k->length) / (QUADRATURE * (1.0 + k->length)), high / low / SPEED_RATIO);
    if (k->length < SHORT_CELL) return;
    curve_point p, q;
    double bend;
    curve_at(c, k->from, &p);
    curve_at(c, k->to, &q);
    double turn = metric_angle(c, &p, &q, &bend);
    k->coarse = fmax(turn / CELL_TURN, turn > 0.02 ? bend / CELL_BEND : 0.0);
}

static int worst_cell(const cell *cells, int n) {
    int at = -1;
    double most = 1.0;
    for (int i = 0; i < n; i++) {
        double score = cells[i].wrong > 1.0 ? 1e6 * cells[i].wrong : n < LIMIT_CELLS ? cells[i].coarse : 0.0;
        if (score > most) {
            most = score;
            at = i;
        }
    }
    return at;
}

/* Cut the worst cell until all are good; false if CURVE_CELLS do not do. */
static bool cut_cells(const curve *c, cell *cells, int *n) {
    cells[0] = (cell){.from = 0.0, .to = 1.0};
    judge(c, &cells[0]);
    for (*n = 1;; (*n)++) {
        int i = worst_cell(cells, *n);
        if (i < 0) return true;
        if (*n == CURVE_CELLS) return false;
        memmove(&cells[i + 1], &cells[i], sizeof *cells * (size_t)(*n - i));
        cells[i].to = cells[i + 1].from = 0.5 * (cells[i].from + cells[i].to);
        judge(c, &cells[i]);
        judge(c, &cells[i + 1]);
    }
}

static void set_coefficients(curve *c, const double *given, int degree, double end) {
    memset(c->c, 0, sizeof c->c);
    for (int i = 0; i < c->axes; i++) {
        double scale = 1.0;
        for (int k = 0; k <= degree; k++, scale *= end) c->c[i][k] = given[i * (degree + 1) + k] * scale;
    }
}

static void set_metric(curve *c, uint16_t main) {
    c->moving = 0;
    for (int i = 0; i < c->axes; i++) {
        double reach = 0.0;
        for (int k = 1; k < CURVE_ORDER; k++) reach += fabs(c->c[i][k]);
        if (reach > STANDS) c->moving |= (uint16_t)(1u << i);
    }
    c->metric = c->moving & main ? c->moving & main : c->moving;
}

static bool set_cells(curve *c) {
    cell cells[CURVE_CELLS + 1];
    int n;
    if (!c->moving || !cut_cells(c, cells, &n)) return false;
    c->cells = (uint8_t)n;
    c->w[0] = c->s[0] = 0.0;
    for (int i = 0; i < n; i++) {
        c->w[i + 1] = cells[i].to;
        c->s[i + 1] = c->s[i] + cells[i].length;
    }
    for (int i = 0; i <= n; i++) c->dwds[i] = 1.0 / speed(c, c->w[i]);
    return true;
}

bool curve_build(curve *c, const double *coefficients, int axes, int degree, double end, uint16_t main) {
    c->axes = (uint8_t)axes;
    c->natural = 0.0;
    set_coefficients(c, coefficients, degree, end);
    set_metric(c, main);
    return set_cells(c);
}

bool curve_build_by_length(curve *c, const double *coefficients, int axes, int degree, double end, double length) {
    c->axes = (uint8_t)axes;
    c->natural = length;
    set_coefficients(c, coefficients, degree, end);
    set_metric(c, 0);
    c->metric = 0;
    if (!(length > 0.0) || !set_cells(c)) return false;
    for (int i = 0; i <= c->cells; i++) c->s[i] = c->w[i] * length;
    return true;
}

static double hermite_guess(const curve *c, int i, double s) {
    double h = c->s[i + 1] - c->s[i], t = (s - c->s[i]) / h, r = 1.0 - t;
    return c->w[i] * r * r * (1.0 + 2.0 * t) + c->w[i + 1] * t * t * (1.0 + 2.0 * r) +
           h * t * r * (c->dwds[i] * r - c->dwds[i + 1] * t);
}

/* Normalised parameter 0..1 at arc length s. */
double curve_parameter(const curve *c, double s) {
    if (s <= 0.0) return 0.0;
    if (s >= c->s[c->cells]) return 1.0;
    if (c->natural > 0.0) return s / c->natural;
    int i = 0;
    while (s > c->s[i + 1]) i++;
    double w = hermite_guess(c, i, s), low = 0.0, high = 0.0;
    for (int k = 0; k < CURVE_NEWTON; k++) {
        w = fmin(fmax(w, c->w[i]), c->w[i + 1]);
        double miss = c->s[i] + integrate(c, c->w[i], w, &low, &high) - s;
        w -= miss / speed(c, w);
        if (fabs(miss) < 1e-7) break; /* what is left is its square */
    }
    return fmin(fmax(w, c->w[i]), c->w[i + 1]);
}
