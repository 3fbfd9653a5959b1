/* The Newton step of the window: a linear-quadratic problem with two states and one input, solved by recursion.
 *
 * x+ = x + 2 h u + h^2 c, u+ = u + h c.  The last interval ends at rest with constant path jerk, which ties
 * x + 1.5 h u = 0 at its start and so takes the input of the interval before it; an interval that starts at rest leaves
 * its end speed as the only freedom.
 */
#include <math.h>
#include "jerk_internal.h"

typedef struct cost_to_go {
    double xx, xu, uu;
} cost_to_go;

/* Stage n-2: its input is the one that meets the rest interval. */
static cost_to_go factor_terminal(problem *b, cost_to_go p) {
    int k = b->n - 2;
    double h = b->h[k], t = b->terminal, den = h * h + t * h;
    double kx = -1.0 / den, ku = -(2.0 * h + t) / den;
    const stage_cost *q = &b->cost;
    b->ric.kx[k] = kx;
    b->ric.ku[k] = ku;
    double axx = 1.0 + h * h * kx, axu = 2.0 * h + h * h * ku, aux = h * kx, auu = 1.0 + h * ku;
    cost_to_go o;
    o.xx = q->xx[k] + 2.0 * q->xc[k] * kx + q->cc[k] * kx * kx + p.xx * axx * axx + 2.0 * p.xu * axx * aux + p.uu * aux * aux;
    o.xu = q->xu[k] + q->xc[k] * ku + q->uc[k] * kx + q->cc[k] * kx * ku + p.xx * axx * axu +
           p.xu * (axx * auu + aux * axu) + p.uu * aux * auu;
    o.uu = q->uu[k] + 2.0 * q->uc[k] * ku + q->cc[k] * ku * ku + p.xx * axu * axu + 2.0 * p.xu * axu * auu + p.uu * auu * auu;
    return o;
}

static bool factor_stage(problem *b, int k, cost_to_go *p) {
    double h = b->h[k], h2 = h * h;
    const stage_cost *q = &b->cost;
    double bx = h2 * p->xx + h * p->xu, bu = h2 * p->xu + h * p->uu;
    double r = q->cc[k] + h2 * bx + h * bu;
    double sx = q->xc[k] + bx, su = q->uc[k] + 2.0 * h * bx + bu;
    if (!(r > 0.0)) return false;
    double ir = 1.0 / r, kx = -sx * ir, ku = -su * ir;
    b->ric.ir[k] = ir;
    b->ric.sx[k] = sx;
    b->ric.su[k] = su;
    b->ric.kx[k] = kx;
    b->ric.ku[k] = ku;
    double xx = q->xx[k] + p->xx + sx * kx;
    double xu = q->xu[k] + 2.0 * h * p->xx + p->xu + sx * ku;
    double uu = q->uu[k] + 4.0 * h2 * p->xx + 4.0 * h * p->xu + p->uu + su * ku;
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
        b->ric.ir[0] = t * t * p.xx + 2.0 * t * p.xu + p.uu;
        if (!(b->ric.ir[0] > 0.0)) return false;
    }
    return isfinite(p.xx) && isfinite(p.uu);
}

/* dx, du, dc for the gradient g. */
void riccati_solve(problem *b, const stage_grad *g) {
    int last = b->n - 1, k = last - 1;
    double px = g->x[last], pu = g->u[last];
    {
        double h = b->h[k], kx = b->ric.kx[k], ku = b->ric.ku[k];
        double rc = g->c[k] + h * h * px + h * pu;
        double nx = g->x[k] + px + rc * kx, nu = g->u[k] + 2.0 * h * px + pu + rc * ku;
        px = nx;
        pu = nu;
    }
    for (k = last - 2; k >= b->first; k--) {
        double h = b->h[k], r = g->c[k] + h * h * px + h * pu, d = -r * b->ric.ir[k];
        double nx = g->x[k] + px + b->ric.sx[k] * d;
        pu = g->u[k] + 2.0 * h * px + pu + b->ric.su[k] * d;
        px = nx;
        b->ric.d[k] = d;
    }
    double x = 0.0, u = 0.0;
    b->dx[0] = b->du[0] = b->dc[0] = 0.0;
    if (b->rest_start) {
        double t = 1.5 * b->h[0];
        u = -(t * px + pu) / b->ric.ir[0];
        x = t * u;
    }
    for (k = b->first; k < last; k++) {
        double h = b->h[k], c = b->ric.kx[k] * x + b->ric.ku[k] * u + (k < last - 1 ? b->ric.d[k] : 0.0);
        b->dx[k] = x;
        b->du[k] = u;
        b->dc[k] = c;
        x += 2.0 * h * u + h * h * c;
        u += h * c;
    }
    b->dx[last] = x;
    b->du[last] = u;
    b->dc[last] = 0.0;
}
