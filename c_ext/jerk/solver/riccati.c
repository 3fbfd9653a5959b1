/* The Newton step of the window: a linear-quadratic problem with two states and
 * two inputs, solved by recursion.
 *
 * x+ = x + 2 h u + h^2 (2 c0 + c1) / 3, u+ = u + h (c0 + c1) / 2.  The last
 * interval ends at rest with constant path jerk, which ties x + 1.5 h u = 0 at
 * its start and so takes the inputs of the interval before it, which are one:
 * c0 = c1; an interval that starts at rest leaves its end speed as the only
 * freedom.
 */
#include <math.h>
#include "jerk/solver/riccati.h"
#include "jerk/state/state.h"

typedef struct cost_to_go {
    double xx, xu, uu;
} cost_to_go;

/* Stage n-2: its input is the one that meets the rest interval. */
static struct cost_to_go factor_terminal(struct problem *problem,
                                         struct cost_to_go to_go) {
    int k = problem->count - 2;
    double length = problem->lengths[k];
    double t = problem->terminal;
    double den = length * length + t * length;
    double kx = -1.0 / den;
    double ku = -(2.0 * length + t) / den;
    const struct stage_cost *cost = &problem->cost;
    double xc = cost->xc[0][k] + cost->xc[1][k];
    double uc = cost->uc[0][k] + cost->uc[1][k];
    double cc = cost->cc[0][k] + 2.0 * cost->cc[1][k];
    cc = cc + cost->cc[2][k];
    double axx = 1.0 + length * length * kx;
    double axu = 2.0 * length + length * length * ku;
    double aux = length * kx;
    double auu = 1.0 + length * ku;
    problem->gain[k] = (struct gain){.length = length,
                                     .kx = {kx, kx},
                                     .ku = {ku, ku},
                                     .xx = axx,
                                     .xu = axu,
                                     .ux = aux,
                                     .uu = auu};
    struct cost_to_go before;
    before.xx = cost->xx[k] + 2.0 * xc * kx + cc * kx * kx
                + to_go.xx * axx * axx + 2.0 * to_go.xu * axx * aux
                + to_go.uu * aux * aux;
    before.xu = cost->xu[k] + xc * ku + uc * kx + cc * kx * ku
                + to_go.xx * axx * axu + to_go.xu * (axx * auu + aux * axu)
                + to_go.uu * aux * auu;
    before.uu = cost->uu[k] + 2.0 * uc * ku + cc * ku * ku
                + to_go.xx * axu * axu + 2.0 * to_go.xu * axu * auu
                + to_go.uu * auu * auu;
    return before;
}

/* Each stage waits for the one behind it.  So what that decides is divided
 * once, and everything else is ready by then. */
static bool factor_stage(struct problem *problem,
                         int k,
                         struct cost_to_go *to_go) {
    const struct stage_cost *cost = &problem->cost;
    double length = problem->lengths[k];
    double along = 0.5 * length;
    double third = THIRD * length * length;
    double twice = 2.0 * length;
    double bx[2] = {2.0 * third, third};
    double px[2], pu[2], sx[2], su[2];
    for (int i = 0; i < 2; i++) {
        px[i] = to_go->xx * bx[i] + to_go->xu * along;
        pu[i] = to_go->xu * bx[i] + to_go->uu * along;
        sx[i] = cost->xc[i][k] + px[i];
        double before = cost->uc[i][k] + twice * px[i];
        su[i] = before + pu[i];
    }
    double p00 = bx[0] * px[0] + along * pu[0];
    double p01 = bx[0] * px[1] + along * pu[1];
    double p11 = bx[1] * px[1] + along * pu[1];
    double r00 = cost->cc[0][k] + p00;
    double r01 = cost->cc[1][k] + p01;
    double r11 = cost->cc[2][k] + p11;
    double det = r00 * r11 - r01 * r01;
    if (!(r00 > 0.0) || !(det > 0.0)) {
        return false;
    }
    double inverse = 1.0 / det;
    double x0 = r11 * sx[0] - r01 * sx[1];
    double x1 = r00 * sx[1] - r01 * sx[0];
    double u0 = r11 * su[0] - r01 * su[1];
    double u1 = r00 * su[1] - r01 * su[0];
    double less_xx = sx[0] * x0 + sx[1] * x1;
    double less_xu = su[0] * x0 + su[1] * x1;
    double less_uu = su[0] * u0 + su[1] * u1;
    double xx = cost->xx[k] + to_go->xx;
    double xu = cost->xu[k] + (twice * to_go->xx + to_go->xu);
    double uu = cost->uu[k]
                + (twice * (twice * to_go->xx + 2.0 * to_go->xu) + to_go->uu);
    *to_go = (struct cost_to_go){xx - less_xx * inverse,
                                 xu - less_xu * inverse,
                                 uu - less_uu * inverse};
    double kx[2] = {-x0 * inverse, -x1 * inverse};
    double ku[2] = {-u0 * inverse, -u1 * inverse};
    problem->gain[k] =
        (struct gain){.length = length,
                      .kx = {kx[0], kx[1]},
                      .ku = {ku[0], ku[1]},
                      .inverse = {r11 * inverse, -r01 * inverse, r00 * inverse},
                      .xx = 1.0 + bx[0] * kx[0] + bx[1] * kx[1],
                      .xu = twice + bx[0] * ku[0] + bx[1] * ku[1],
                      .ux = along * (kx[0] + kx[1]),
                      .uu = 1.0 + along * (ku[0] + ku[1])};
    return true;
}

/* Gains of all stages; false if the cost is not convex (or not a number). */
bool riccati_factor(struct problem *problem) {
    const struct stage_cost *cost = &problem->cost;
    int last = problem->count - 1;
    struct cost_to_go to_go;
    to_go.xx = cost->xx[last];
    to_go.xu = cost->xu[last];
    to_go.uu = cost->uu[last];
    to_go = factor_terminal(problem, to_go);
    for (int k = last - 2; k >= problem->first; k--) {
        if (!factor_stage(problem, k, &to_go)) {
            return false;
        }
    }
    if (problem->from_standstill) {
        double t = 1.5 * problem->lengths[0];
        problem->start_cost = t * t * to_go.xx + 2.0 * t * to_go.xu + to_go.uu;
        if (!(problem->start_cost > 0.0)) {
            return false;
        }
    }
    return isfinite(to_go.xx) && isfinite(to_go.uu);
}

/* Gradient of the cost to go ahead of a stage, by x and by the acceleration. */
static inline double x_before(const struct gain *gain, double px, double pu) {
    return gain->xx * px + gain->ux * pu;
}
static inline double accel_before(const struct gain *gain,
                                  double px,
                                  double pu) {
    return gain->xu * px + gain->uu * pu;
}

/* Backwards: the gradients of the cost to go, x and u, at stage b->first.  What
 * waits for the stage before is two products only. */
static void gather_gradients(struct problem *problem,
                             const struct stage_grad *gradient,
                             double *x,
                             double *accel) {
    int last = problem->count - 1;
    int k = last - 1;
    double px = gradient->x[last];
    double pu = gradient->accel[last];
    double input = gradient->input[0][k] + gradient->input[1][k];
    const struct gain *gain = &problem->gain[k];
    double nx = gradient->x[k] + gain->kx[0] * input;
    nx = nx + x_before(gain, px, pu);
    double nu = gradient->accel[k] + gain->ku[0] * input;
    pu = nu + accel_before(gain, px, pu);
    px = nx;
    double *free_0 = problem->free[0];
    double *free_1 = problem->free[1];
    for (k = last - 2; k >= problem->first; k--) {
        gain = &problem->gain[k];
        double g0 = gradient->input[0][k];
        double g1 = gradient->input[1][k];
        double length = gain->length;
        double both = 0.5 * length * pu;
        double third = THIRD * length * length * px;
        double r0 = g0 + 2.0 * third + both;
        double r1 = g1 + third + both;
        const double *inverse = gain->inverse;
        free_0[k] = -(inverse[0] * r0 + inverse[1] * r1);
        free_1[k] = -(inverse[1] * r0 + inverse[2] * r1);
        double by_x = gain->kx[0] * g0 + gain->kx[1] * g1;
        double by_accel = gain->ku[0] * g0 + gain->ku[1] * g1;
        nx = gradient->x[k] + by_x + x_before(gain, px, pu);
        pu = gradient->accel[k] + by_accel + accel_before(gain, px, pu);
        px = nx;
    }
    *x = px;
    *accel = pu;
}

/* dx, du, dc for the gradient g. */
void riccati_solve(struct problem *problem, const struct stage_grad *gradient) {
    int last = problem->count - 1;
    double px, pu;
    double x = 0.0;
    double accel = 0.0;
    gather_gradients(problem, gradient, &px, &pu);
    problem->dx[0] = 0.0;
    problem->du[0] = 0.0;
    problem->dc[0][0] = 0.0;
    problem->dc[1][0] = 0.0;
    if (problem->from_standstill) {
        double t = 1.5 * problem->lengths[0];
        accel = -(t * px + pu) / problem->start_cost;
        x = t * accel;
    }
    problem->free[0][last - 1] = 0.0;
    problem->free[1][last - 1] = 0.0;
    for (int k = problem->first; k < last; k++) {
        const struct gain *gain = &problem->gain[k];
        double d0 = problem->free[0][k];
        double d1 = problem->free[1][k];
        double length = gain->length;
        problem->dx[k] = x;
        problem->du[k] = accel;
        const double *kx = gain->kx;
        const double *ku = gain->ku;
        problem->dc[0][k] = kx[0] * x + ku[0] * accel + d0;
        problem->dc[1][k] = kx[1] * x + ku[1] * accel + d1;
        double nx = THIRD * length * length * (2.0 * d0 + d1)
                    + (gain->xx * x + gain->xu * accel);
        double fed_back = gain->ux * x + gain->uu * accel;
        accel = 0.5 * length * (d0 + d1) + fed_back;
        x = nx;
    }
    problem->dx[last] = x;
    problem->du[last] = accel;
    problem->dc[0][last] = 0.0;
    problem->dc[1][last] = 0.0;
}
