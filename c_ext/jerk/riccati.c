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
#include "jerk/state.h"

typedef struct cost_to_go {
    double xx, xu, uu;
} cost_to_go;

/* Stage n-2: its input is the one that meets the rest interval. */
static struct cost_to_go factor_terminal(struct problem *problem,
                                         struct cost_to_go cost_to_go) {
    int k = problem->n - 2;
    double h = problem->h[k], t = problem->terminal, den = h * h + t * h;
    double kx = -1.0 / den, ku = -(2.0 * h + t) / den;
    const struct stage_cost *stage_cost = &problem->cost;
    double xc = stage_cost->xc[0][k] + stage_cost->xc[1][k],
           uc = stage_cost->uc[0][k] + stage_cost->uc[1][k],
           cc = stage_cost->cc[0][k] + 2.0 * stage_cost->cc[1][k]
                + stage_cost->cc[2][k];
    double axx = 1.0 + h * h * kx, axu = 2.0 * h + h * h * ku, aux = h * kx,
           auu = 1.0 + h * ku;
    problem->gain[k] = (struct gain){.h = h,
                                     .kx = {kx, kx},
                                     .ku = {ku, ku},
                                     .xx = axx,
                                     .xu = axu,
                                     .ux = aux,
                                     .uu = auu};
    struct cost_to_go cost_to_go_o;
    cost_to_go_o.xx = stage_cost->xx[k] + 2.0 * xc * kx + cc * kx * kx
                      + cost_to_go.xx * axx * axx
                      + 2.0 * cost_to_go.xu * axx * aux
                      + cost_to_go.uu * aux * aux;
    cost_to_go_o.xu = stage_cost->xu[k] + xc * ku + uc * kx + cc * kx * ku
                      + cost_to_go.xx * axx * axu
                      + cost_to_go.xu * (axx * auu + aux * axu)
                      + cost_to_go.uu * aux * auu;
    cost_to_go_o.uu = stage_cost->uu[k] + 2.0 * uc * ku + cc * ku * ku
                      + cost_to_go.xx * axu * axu
                      + 2.0 * cost_to_go.xu * axu * auu
                      + cost_to_go.uu * auu * auu;
    return cost_to_go_o;
}

static bool factor_stage(struct problem *problem,
                         int k,
                         struct cost_to_go *cost_to_go) {
    const struct stage_cost *stage_cost = &problem->cost;
    double h = problem->h[k], along = 0.5 * h,
           bx[2] = {h * h * 2.0 / 3.0, h * h / 3.0}, px[2], pu[2], sx[2], su[2];
    for (int i = 0; i < 2; i++) {
        px[i] = cost_to_go->xx * bx[i] + cost_to_go->xu * along;
        pu[i] = cost_to_go->xu * bx[i] + cost_to_go->uu * along;
        sx[i] = stage_cost->xc[i][k] + px[i];
        su[i] = stage_cost->uc[i][k] + 2.0 * h * px[i] + pu[i];
    }
    double r00 = stage_cost->cc[0][k] + bx[0] * px[0] + along * pu[0],
           r01 = stage_cost->cc[1][k] + bx[0] * px[1] + along * pu[1];
    double r11 = stage_cost->cc[2][k] + bx[1] * px[1] + along * pu[1],
           det = r00 * r11 - r01 * r01;
    if (!(r00 > 0.0) || !(det > 0.0)) {
        return false;
    }
    double i00 = r11 / det, i01 = -r01 / det, i11 = r00 / det;
    double kx[2] = {-(i00 * sx[0] + i01 * sx[1]), -(i01 * sx[0] + i11 * sx[1])};
    double ku[2] = {-(i00 * su[0] + i01 * su[1]), -(i01 * su[0] + i11 * su[1])};
    problem->gain[k] =
        (struct gain){.h = h,
                      .kx = {kx[0], kx[1]},
                      .ku = {ku[0], ku[1]},
                      .inverse = {i00, i01, i11},
                      .xx = 1.0 + bx[0] * kx[0] + bx[1] * kx[1],
                      .xu = 2.0 * h + bx[0] * ku[0] + bx[1] * ku[1],
                      .ux = along * (kx[0] + kx[1]),
                      .uu = 1.0 + along * (ku[0] + ku[1])};
    double xx =
        stage_cost->xx[k] + cost_to_go->xx + sx[0] * kx[0] + sx[1] * kx[1];
    double xu = stage_cost->xu[k] + 2.0 * h * cost_to_go->xx + cost_to_go->xu
                + sx[0] * ku[0] + sx[1] * ku[1];
    double uu = stage_cost->uu[k] + 4.0 * h * h * cost_to_go->xx
                + 4.0 * h * cost_to_go->xu + cost_to_go->uu + su[0] * ku[0]
                + su[1] * ku[1];
    *cost_to_go = (struct cost_to_go){xx, xu, uu};
    return true;
}

/* Gains of all stages; false if the cost is not convex (or not a number). */
bool riccati_factor(struct problem *b) {
    const struct stage_cost *q = &b->cost;
    int last = b->n - 1;
    struct cost_to_go p = {q->xx[last], q->xu[last], q->uu[last]};
    p = factor_terminal(b, p);
    for (int k = last - 2; k >= b->first; k--) {
        if (!factor_stage(b, k, &p)) {
            return false;
        }
    }
    if (b->rest_start) {
        double t = 1.5 * b->h[0];
        b->start_cost = t * t * p.xx + 2.0 * t * p.xu + p.uu;
        if (!(b->start_cost > 0.0)) {
            return false;
        }
    }
    return isfinite(p.xx) && isfinite(p.uu);
}

/* Backwards: the gradients of the cost to go, x and u, at stage b->first.  What
 * waits for the stage before is two products only. */
static void gather_gradients(struct problem *problem,
                             const struct stage_grad *stage_grad,
                             double *x,
                             double *u) {
    int last = problem->n - 1, k = last - 1;
    double px = stage_grad->x[last], pu = stage_grad->u[last],
           c = stage_grad->c[0][k] + stage_grad->c[1][k];
    const struct gain *gain = &problem->gain[k];
    double nx =
        stage_grad->x[k] + gain->kx[0] * c + (gain->xx * px + gain->ux * pu);
    pu = stage_grad->u[k] + gain->ku[0] * c + (gain->xu * px + gain->uu * pu);
    px = nx;
    for (k = last - 2; k >= problem->first; k--) {
        gain = &problem->gain[k];
        double g0 = stage_grad->c[0][k], g1 = stage_grad->c[1][k], h = gain->h;
        double both = 0.5 * h * pu, third = h * h * px / 3.0,
               r0 = g0 + 2.0 * third + both, r1 = g1 + third + both;
        problem->free[0][k] = -(gain->inverse[0] * r0 + gain->inverse[1] * r1);
        problem->free[1][k] = -(gain->inverse[1] * r0 + gain->inverse[2] * r1);
        nx = stage_grad->x[k] + (gain->kx[0] * g0 + gain->kx[1] * g1)
             + (gain->xx * px + gain->ux * pu);
        pu = stage_grad->u[k] + (gain->ku[0] * g0 + gain->ku[1] * g1)
             + (gain->xu * px + gain->uu * pu);
        px = nx;
    }
    *x = px;
    *u = pu;
}

/* dx, du, dc for the gradient g. */
void riccati_solve(struct problem *problem,
                   const struct stage_grad *stage_grad) {
    int last = problem->n - 1;
    double px, pu, x = 0.0, u = 0.0;
    gather_gradients(problem, stage_grad, &px, &pu);
    problem->dx[0] = problem->du[0] = problem->dc[0][0] = problem->dc[1][0] =
        0.0;
    if (problem->rest_start) {
        double t = 1.5 * problem->h[0];
        u = -(t * px + pu) / problem->start_cost;
        x = t * u;
    }
    problem->free[0][last - 1] = problem->free[1][last - 1] = 0.0;
    for (int k = problem->first; k < last; k++) {
        const struct gain *gain = &problem->gain[k];
        double d0 = problem->free[0][k], d1 = problem->free[1][k], h = gain->h;
        problem->dx[k] = x;
        problem->du[k] = u;
        problem->dc[0][k] = gain->kx[0] * x + gain->ku[0] * u + d0;
        problem->dc[1][k] = gain->kx[1] * x + gain->ku[1] * u + d1;
        double nx =
            h * h * (2.0 * d0 + d1) / 3.0 + (gain->xx * x + gain->xu * u);
        u = 0.5 * h * (d0 + d1) + (gain->ux * x + gain->uu * u);
        x = nx;
    }
    problem->dx[last] = x;
    problem->du[last] = u;
    problem->dc[0][last] = problem->dc[1][last] = 0.0;
}
