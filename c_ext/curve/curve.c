/* Polynomial by arc length: cells, quadrature, inversion. */
#include "curve/curve.h"
#include "curve/tuning.h"
#include <math.h>
#include <string.h>

/* Nodes and weights of the 8-point Gauss rule on -1..1. */
static const double NODE[4] = {0.1834346424956498,
                               0.5255324099163290,
                               0.7966664774136267,
                               0.9602898564975363};
static const double WEIGHT[4] = {0.3626837833783620,
                                 0.3137066458778873,
                                 0.2223810344533745,
                                 0.1012285362903763};

static double first_derivative(const double *coef, double parameter) {
    return coef[1]
           + parameter
                 * (2.0 * coef[2]
                    + parameter
                          * (3.0 * coef[3]
                             + parameter
                                   * (4.0 * coef[4]
                                      + parameter * 5.0 * coef[5])));
}

static double second_derivative(const double *coef, double parameter) {
    return 2.0 * coef[2]
           + parameter
                 * (6.0 * coef[3]
                    + parameter
                          * (12.0 * coef[4] + parameter * 20.0 * coef[5]));
}

static double value(const double *coef, double parameter) {
    return coef[0]
           + parameter
                 * (coef[1]
                    + parameter
                          * (coef[2]
                             + parameter
                                   * (coef[3]
                                      + parameter
                                            * (coef[4]
                                               + parameter * coef[5]))));
}

static double speed(const struct curve *curve, double parameter) {
    if (curve->natural > 0.0) {
        return curve->natural;
    }
    double sum = 0.0;
    for (int i = 0; i < curve->axes; i++) {
        if (!(curve->metric >> i & 1)) {
            continue;
        }
        double rate = first_derivative(curve->c[i], parameter);
        sum += rate * rate;
    }
    return sqrt(sum);
}

/* Two parameters at a time. */
typedef double pair __attribute__((vector_size(16)));

static pair speeds(const struct curve *curve, pair parameter) {
    if (curve->natural > 0.0) {
        return (pair){curve->natural, curve->natural};
    }
    pair sum = {0.0, 0.0};
    for (int i = 0; i < curve->axes; i++) {
        if (!(curve->metric >> i & 1)) {
            continue;
        }
        const double *k = curve->c[i];
        pair rate =
            k[1]
            + parameter
                  * (2.0 * k[2]
                     + parameter
                           * (3.0 * k[3]
                              + parameter
                                    * (4.0 * k[4] + parameter * 5.0 * k[5])));
        sum += rate * rate;
    }
    return (pair){sqrt(sum[0]), sqrt(sum[1])};
}

/* Length from a to b; *low and *high are widened to the speeds met. */
static double integrate(const struct curve *curve,
                        double from,
                        double to,
                        double *low,
                        double *high) {
    double middle = 0.5 * (from + to);
    double half = 0.5 * (to - from);
    double sum = 0.0;
    for (int k = 0; k < 4; k++) {
        pair v =
            speeds(curve,
                   (pair){middle - half * NODE[k], middle + half * NODE[k]});
        sum += WEIGHT[k] * (v[0] + v[1]);
        if (*low > v[0]) {
            *low = v[0];
        }
        if (*low > v[1]) {
            *low = v[1];
        }
        if (*high < v[0]) {
            *high = v[0];
        }
        if (*high < v[1]) {
            *high = v[1];
        }
    }
    return half * sum;
}

/* Length from the start to the parameter w. */
double curve_length_to(const struct curve *curve, double parameter) {
    if (curve->natural > 0.0) {
        return parameter * curve->natural;
    }
    int i = 0;
    while (i + 1 < curve->cells && parameter > curve->w[i + 1]) {
        i++;
    }
    double low = 0.0;
    double high = 0.0;
    double part = integrate(curve, curve->w[i], parameter, &low, &high);
    return curve->s[i] + part;
}

/* Length between two parameters where the speed changes little: four points. */
double curve_length_between(const struct curve *curve, double from, double to) {
    static const double node[2] = {0.3399810435848563, 0.8611363115940526};
    static const double weight[2] = {0.6521451548625461, 0.3478548451374538};
    double middle = 0.5 * (from + to);
    double half = 0.5 * fabs(to - from);
    double sum = 0.0;
    for (int k = 0; k < 2; k++) {
        pair v =
            speeds(curve,
                   (pair){middle - half * node[k], middle + half * node[k]});
        sum += weight[k] * (v[0] + v[1]);
    }
    return half * sum;
}

void curve_position(const struct curve *curve,
                    double parameter,
                    double *position) {
    for (int i = 0; i < curve->axes; i++) {
        position[i] = value(curve->c[i], parameter);
    }
}

void curve_tangent(const struct curve *curve, double parameter, double *d1) {
    double v = speed(curve, parameter);
    for (int i = 0; i < curve->axes; i++) {
        d1[i] = first_derivative(curve->c[i], parameter) / v;
    }
}

/* First and second derivative by length. */
void curve_derivatives(const struct curve *curve,
                       double parameter,
                       double *d1,
                       double *d2) {
    double v2 = 0.0;
    double along = 0.0;
    for (int i = 0; i < curve->axes; i++) {
        const double *k = curve->c[i];
        d1[i] = parameter == 0.0 ? k[1] : first_derivative(k, parameter);
        d2[i] = parameter == 0.0 ? 2.0 * k[2] : second_derivative(k, parameter);
        if (!(curve->metric >> i & 1)) {
            continue;
        }
        v2 += d1[i] * d1[i];
        along += d1[i] * d2[i];
    }
    if (curve->natural > 0.0) {
        v2 = curve->natural * curve->natural;
    }
    double inv2 = 1.0 / v2;
    double inv = sqrt(inv2);
    double share = along * inv2;
    for (int i = 0; i < curve->axes; i++) {
        d2[i] = (d2[i] - d1[i] * share) * inv2;
        d1[i] *= inv;
    }
}

void curve_at(const struct curve *curve,
              double parameter,
              struct curve_point *curve_point) {
    curve_position(curve, parameter, curve_point->q);
    curve_derivatives(curve, parameter, curve_point->d1, curve_point->d2);
}

/* With v = |q'(w)| over the metric axes and dots for derivatives by w: q''' =
 * (q3 - v2 d1 - 3 v v1 d2) / v^3. */
void curve_third(const struct curve *curve, double parameter, double *d3) {
    double first[NC_AXES], second[NC_AXES], third[NC_AXES];
    double vv = 0.0;
    double fs = 0.0;
    double ss = 0.0;
    double ft = 0.0;
    for (int i = 0; i < curve->axes; i++) {
        const double *k = curve->c[i];
        first[i] = first_derivative(k, parameter);
        second[i] = second_derivative(k, parameter);
        third[i] =
            6.0 * k[3] + parameter * (24.0 * k[4] + parameter * 60.0 * k[5]);
        if (!(curve->metric >> i & 1)) {
            continue;
        }
        vv += first[i] * first[i];
        fs += first[i] * second[i];
        ss += second[i] * second[i];
        ft += first[i] * third[i];
    }
    if (curve->natural > 0.0) {
        vv = curve->natural * curve->natural;
    }
    double v = sqrt(vv);
    double v1 = fs / v;
    double v2 = (ss + ft - v1 * v1) / v;
    for (int i = 0; i < curve->axes; i++) {
        double d1 = first[i] / v;
        double d2 = (second[i] - v1 * d1) / vv;
        double remainder = third[i] - v2 * d1 - 3.0 * v * v1 * d2;
        d3[i] = remainder / (v * vv);
    }
}

/* Its length is that of the rule that leads into it: nothing jumps at its end.
 */
typedef struct cell {
    double from, to, length;
    double wrong;  /* above 1: must be cut */
    double coarse; /* above 1: should be cut */
} cell;

static double metric_angle(const struct curve *curve,
                           const struct curve_point *curve_point,
                           const struct curve_point *curve_point_b,
                           double *bend) {
    double turn = 0.0;
    double change = 0.0;
    double most = 0.0;
    double fast = 0.0;
    for (int i = 0; i < curve->axes; i++) {
        change = fmax(change, fabs(curve_point->d2[i] - curve_point_b->d2[i]));
        most = fmax(most,
                    fmax(fabs(curve_point->d2[i]), fabs(curve_point_b->d2[i])));
        fast = fmax(fast,
                    fmax(fabs(curve_point->d1[i]), fabs(curve_point_b->d1[i])));
        if (!(curve->natural > 0.0) && !(curve->metric >> i & 1)) {
            continue;
        }
        turn += (curve_point->d1[i] - curve_point_b->d1[i])
                * (curve_point->d1[i] - curve_point_b->d1[i]);
    }
    *bend = most > 0.0 ? change / most : 0.0;
    return curve->natural > 0.0 && fast > 0.0 ? sqrt(turn) / fast : sqrt(turn);
}

static void judge(const struct curve *curve, struct cell *cell) {
    double low = INFINITY;
    double high = 0.0;
    double middle = 0.5 * (cell->from + cell->to);
    cell->length = integrate(curve, cell->from, cell->to, &low, &high);
    double halves = integrate(curve, cell->from, middle, &low, &high)
                    + integrate(curve, middle, cell->to, &low, &high);
    double speed_from = speed(curve, cell->from);
    double speed_to = speed(curve, cell->to);
    low = fmin(low, fmin(speed_from, speed_to));
    high = fmax(high, fmax(speed_from, speed_to));
    cell->wrong = 0.0;
    cell->coarse = 0.0;
    if (!(low > 0.0) || !(cell->length > 0.0)) {
        cell->wrong = 1e30;
        return;
    }
    cell->wrong =
        fmax(fabs(halves - cell->length) / (QUADRATURE * (1.0 + cell->length)),
             high / low / SPEED_RATIO);
    if (cell->length < SHORT_CELL) {
        return;
    }
    struct curve_point curve_point, curve_point_q;
    double bend;
    curve_at(curve, cell->from, &curve_point);
    curve_at(curve, cell->to, &curve_point_q);
    double turn = metric_angle(curve, &curve_point, &curve_point_q, &bend);
    cell->coarse = fmax(turn / CELL_TURN, turn > 0.02 ? bend / CELL_BEND : 0.0);
}

static int worst_cell(const struct cell *cells, int count) {
    int at = -1;
    double most = 1.0;
    for (int i = 0; i < count; i++) {
        double score = cells[i].wrong > 1.0  ? 1e6 * cells[i].wrong
                       : count < LIMIT_CELLS ? cells[i].coarse
                                             : 0.0;
        if (score > most) {
            most = score;
            at = i;
        }
    }
    return at;
}

/* Cut the worst cell until all are good; false if CURVE_CELLS do not do. */
static bool cut_cells(const struct curve *curve,
                      struct cell *cells,
                      int *count) {
    cells[0] = (struct cell){.from = 0.0, .to = 1.0};
    judge(curve, &cells[0]);
    for (*count = 1;; (*count)++) {
        int i = worst_cell(cells, *count);
        if (i < 0) {
            return true;
        }
        if (*count == CURVE_CELLS) {
            return false;
        }
        size_t behind = (size_t)(*count - i);
        memmove(&cells[i + 1], &cells[i], sizeof *cells * behind);
        double middle = 0.5 * (cells[i].from + cells[i].to);
        cells[i].to = middle;
        cells[i + 1].from = middle;
        judge(curve, &cells[i]);
        judge(curve, &cells[i + 1]);
    }
}

static void set_coefficients(struct curve *curve,
                             const double *given,
                             int degree,
                             double end) {
    memset(curve->c, 0, sizeof curve->c);
    for (int i = 0; i < curve->axes; i++) {
        double scale = 1.0;
        for (int k = 0; k <= degree; k++, scale *= end) {
            curve->c[i][k] = given[i * (degree + 1) + k] * scale;
        }
    }
}

static void set_metric(struct curve *curve, uint16_t main) {
    curve->moving = 0;
    for (int i = 0; i < curve->axes; i++) {
        double reach = 0.0;
        for (int k = 1; k < CURVE_ORDER; k++) {
            reach += fabs(curve->c[i][k]);
        }
        if (reach > STANDS) {
            curve->moving |= (uint16_t)(1u << i);
        }
    }
    curve->metric = curve->moving & main ? curve->moving & main : curve->moving;
}

static bool set_cells(struct curve *curve) {
    struct cell cells[CURVE_CELLS + 1];
    int count;
    if (!curve->moving || !cut_cells(curve, cells, &count)) {
        return false;
    }
    curve->cells = (uint8_t)count;
    curve->w[0] = 0.0;
    curve->s[0] = 0.0;
    for (int i = 0; i < count; i++) {
        curve->w[i + 1] = cells[i].to;
        curve->s[i + 1] = curve->s[i] + cells[i].length;
    }
    for (int i = 0; i <= count; i++) {
        curve->dwds[i] = 1.0 / speed(curve, curve->w[i]);
    }
    return true;
}

bool curve_build(struct curve *curve,
                 const double *coefficients,
                 int axes,
                 int degree,
                 double end,
                 uint16_t main) {
    curve->axes = (uint8_t)axes;
    curve->natural = 0.0;
    set_coefficients(curve, coefficients, degree, end);
    set_metric(curve, main);
    return set_cells(curve);
}

bool curve_build_by_length(struct curve *curve,
                           const double *coefficients,
                           int axes,
                           int degree,
                           double end,
                           double length) {
    curve->axes = (uint8_t)axes;
    curve->natural = length;
    set_coefficients(curve, coefficients, degree, end);
    set_metric(curve, 0);
    curve->metric = 0;
    if (!(length > 0.0) || !set_cells(curve)) {
        return false;
    }
    for (int i = 0; i <= curve->cells; i++) {
        curve->s[i] = curve->w[i] * length;
    }
    return true;
}

static double hermite_guess(const struct curve *curve, int i, double s) {
    double length = curve->s[i + 1] - curve->s[i];
    double t = (s - curve->s[i]) / length;
    double remainder = 1.0 - t;
    return curve->w[i] * remainder * remainder * (1.0 + 2.0 * t)
           + curve->w[i + 1] * t * t * (1.0 + 2.0 * remainder)
           + length * t * remainder
                 * (curve->dwds[i] * remainder - curve->dwds[i + 1] * t);
}

/* Change of the parameter over a length, by the speed there and its slope: what
 * is left is of third order. */
static double step_by(const struct curve *curve,
                      double parameter,
                      double length) {
    double square = 0.0;
    double product = 0.0;
    for (int i = 0; i < curve->axes; i++) {
        if (!(curve->metric >> i & 1)) {
            continue;
        }
        double rate = first_derivative(curve->c[i], parameter);
        square += rate * rate;
        product += rate * second_derivative(curve->c[i], parameter);
    }
    double step = length / sqrt(square);
    return step - 0.5 * step * step * product / square;
}

/* Normalised parameter 0..1 at arc length s. */
double curve_parameter(const struct curve *curve, double s) {
    if (s <= 0.0) {
        return 0.0;
    }
    if (s >= curve->s[curve->cells]) {
        return 1.0;
    }
    if (curve->natural > 0.0) {
        return s / curve->natural;
    }
    int i = 0;
    while (s > curve->s[i + 1]) {
        i++;
    }
    double parameter = hermite_guess(curve, i, s);
    double width = curve->w[i + 1] - curve->w[i];
    double low = 0.0;
    double high = 0.0;
    for (int k = 0; k < CURVE_STEPS; k++) {
        parameter = fmin(fmax(parameter, curve->w[i]), curve->w[i + 1]);
        double miss = s - curve->s[i]
                      - integrate(curve, curve->w[i], parameter, &low, &high);
        double step = step_by(curve, parameter, miss);
        parameter += step;
        if (fabs(miss) * step * step < INVERSION * width * width) {
            break;
        }
    }
    return fmin(fmax(parameter, curve->w[i]), curve->w[i + 1]);
}
