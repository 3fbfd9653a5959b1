/* The Newton step of the window: a linear-quadratic problem with two states and two inputs, solved by recursion.
 *
 * x+ = x + 2 h u + h^2 (2 c0 + c1) / 3, u+ = u + h (c0 + c1) / 2.  The last interval ends at rest with constant path jerk,
 * which ties x + 1.5 h u = 0 at its start and so takes the inputs of the interval before it, which are one: c0 = c1; an
 * interval that starts at rest leaves its end speed as the only freedom.
 */
#include <math.h>
#include "jerk/state.h"

typedef struct cost_to_go {
    double xx, xu, uu;
} cost_to_go;

/* Stage n-2: its input is the one that meets the rest interval. */
static cost_to_go factor_terminal(problem *b, cost_to_go p) {
    int k = b->n - 2;
    double h = b->h[k], t = b->terminal, den = h * h + t * h;
    double kx = -1.0 / den, ku = -(2.0 * h + t) / den;
    const stage_cost *q = &b->cost;
    double xc = q->xc[0][k] + q->xc[1][k], uc = q->uc[0][k] + q->uc[1][k], cc = q->cc[0][k] + 2.0 * q->cc[1][k] + q->cc[2][k];
    double axx = 1.0 + h * h * kx, axu = 2.0 * h + h * h * ku, aux = h * kx, auu = 1.0 + h * ku;
    b->gain[k] = (gain){.h = h, .kx = {kx, kx}, .ku = {ku, ku}, .xx = axx, .xu = axu, .ux = aux, .uu = auu};
    cost_to_go o;
    o.xx = q->xx[k] + 2.0 * xc * kx + cc * kx * kx + p.xx * axx * axx + 2.0 * p.xu * axx * aux + p.uu * aux * aux;
    o.xu = q->xu[k] + xc * ku + uc * kx + cc * kx * ku + p.xx * axx * axu + p.xu * (axx * auu + aux * axu) + p.uu * aux * auu;
    o.uu = q->uu[k] + 2.0 * uc * ku + cc * ku * ku + p.xx * axu * axu + 2.0 * p.xu * axu * auu + p.uu * auu * auu;
    return o;
}

static bool factor_stage(problem *b, int k, cost_to_go *p) {
    const stage_cost *q = &b->cost;
    double h = b->h[k], along = 0.5 * h, bx[2] = {h * h * 2.0 / 3.0, h * h / 3.0}, px[2], pu[2], sx[2], su[2];
    for (int i = 0; i < 2; i++) {
        px[i] = p->xx * bx[i] + p->xu * along;
        pu[i] = p->xu * bx[i] + p->uu * along;
        sx[i] = q->xc[i][k] + px[i];
        su[i] = q->uc[i][k] + 2.0 * h * px[i] + pu[i];
    }
    double r00 = q->cc[0][k] + bx[0] * px[0] + along * pu[0], r01 = q->cc[1][k] + bx[0] * px[1] + along * pu[1];
    double r11 = q->cc[2][k] + bx[1] * px[1] + along * pu[1], det = r00 * r11 - r01 * r01;
    if (!(r00 > 0.0) || !(det > 0.0)) return false;
    double i00 = r11 / det, i01 = -r01 / det, i11 = r00 / det;
    double kx[2] = {-(i00 * sx[0] + i01 * sx[1]), -(i01 * sx[0] + i11 * sx[1])};
    double ku[2] = {-(i00 * su[0] + i01 * su[1]), -(i01 * su[0] + i11 * su[1])};
    b->gain[k] = (gain){.h = h, .kx = {kx[0], kx[1]}, .ku = {ku[0], ku[1]}, .inverse = {i00, i01, i11},
                        .xx = 1.0 + bx[0] * kx[0] + bx[1] * kx[1], .xu = 2.0 * h + bx[0] * ku[0] + bx[1] * ku[1],
                        .ux = along * (kx[0] + kx[1]), .uu = 1.0 + along * (ku[0] + ku[1])};
    double xx = q->xx[k] + p->xx + sx[0] * kx[0] + sx[1] * kx[1];
    double xu = q->xu[k] + 2.0 * h * p->xx + p->xu + sx[0] * ku[0] + sx[1] * ku[1];
    double uu = q->uu[k] + 4.0 * h * h * p->xx + 4.0 * h * p->xu + p->uu + su[0] * ku[0] + su[1] * ku[1];
    *p = (cost_to_go){xx, xu, uu};
    return true;
}

/* Gains of all stages; false if the cost is not convex (or not a number). */
bool riccati_factor(problem *b) {
    const stage_cost *q = &b->cost;
    int last = b->n - 1;
    cost_to_go p = {q->xx[last], q->xu[last], q->uu[last]};
    p = factor_terminal(b, p);
    for (int k = last - 2; k >= b->first; k--)
        if (!factor_stage(b, k, &p)) return false;
    if (b->rest_start) {
        double t = 1.5 * b->h[0];
        b->start_cost = t * t * p.xx + 2.0 * t * p.xu + p.uu;
        if (!(b->start_cost > 0.0)) return false;
    }
    return isfinite(p.xx) && isfinite(p.uu);
}

/* Backwards: the gradients of the cost to go, x and u, at stage b->first.  What waits for the stage before is two products only. */
static void gather_gradients(problem *b, const stage_grad *g, double *x, double *u) {
    int last = b->n - 1, k = last - 1;
    double px = g->x[last], pu = g->u[last], c = g->c[0][k] + g->c[1][k];
    const gain *o = &b->gain[k];
    double nx = g->x[k] + o->kx[0] * c + (o->xx * px + o->ux * pu);
    pu = g->u[k] + o->ku[0] * c + (o->xu * px + o->uu * pu);
    px = nx;
    for (k = last - 2; k >= b->first; k--) {
        o = &b->gain[k];
        double g0 = g->c[0][k], g1 = g->c[1][k], h = o->h;
        double both = 0.5 * h * pu, third = h * h * px / 3.0, r0 = g0 + 2.0 * third + both, r1 = g1 + third + both;
        b->free[0][k] = -(o->inverse[0] * r0 + o->inverse[1] * r1);
        b->free[1][k] = -(o->inverse[1] * r0 + o->inverse[2] * r1);
        nx = g->x[k] + (o->kx[0] * g0 + o->kx[1] * g1) + (o->xx * px + o->ux * pu);
        pu = g->u[k] + (o->ku[0] * g0 + o->ku[1] * g1) + (o->xu * px + o->uu * pu);
        px = nx;
    }
    *x = px;
    *u = pu;
}

/* dx, du, dc for the gradient g. */
void riccati_solve(problem *b, const stage_grad *g) {
    int last = b->n - 1;
    double px, pu, x = 0.0, u = 0.0;
    gather_gradients(b, g, &px, &pu);
    b->dx[0] = b->du[0] = b->dc[0][0] = b->dc[1][0] = 0.0;
    if (b->rest_start) {
        double t = 1.5 * b->h[0];
        u = -(t * px + pu) / b->start_cost;
        x = t * u;
    }
    b->free[0][last - 1] = b->free[1][last - 1] = 0.0;
    for (int k = b->first; k < last; k++) {
        const gain *o = &b->gain[k];
        double d0 = b->free[0][k], d1 = b->free[1][k], h = o->h;
        b->dx[k] = x;
        b->du[k] = u;
        b->dc[0][k] = o->kx[0] * x + o->ku[0] * u + d0;
        b->dc[1][k] = o->kx[1] * x + o->ku[1] * u + d1;
        double nx = h * h * (2.0 * d0 + d1) / 3.0 + (o->xx * x + o->xu * u);
        u = 0.5 * h * (d0 + d1) + (o->ux * x + o->uu * u);
        x = nx;
    }
    b->dx[last] = x;
    b->du[last] = u;
    b->dc[0][last] = b->dc[1][last] = 0.0;
}
