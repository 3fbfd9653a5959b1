/* Stages of the window's problem, LANES at a time: the states at their ends and in their middle by the state at the start and
 * the inputs c0 and c1, and Hessians and gradients by the former written over the latter. */
#ifndef JERK_IPM_STAGE_H
#define JERK_IPM_STAGE_H
#include <math.h>
#include "jerk/state.h"

static inline vec set1(double v) { return (vec){v, v, v, v}; }
static inline vec load(const double *p) { return *(const vec *)p; }
static inline void store(double *p, vec v) { *(vec *)p = v; }
static inline vec vmax(vec a, vec b) {
    ivec m = a > b;
    return (vec)((m & (ivec)a) | (~m & (ivec)b));
}
static double top(vec v) { return fmax(fmax(v[0], v[1]), fmax(v[2], v[3])); }
static double sum(vec v) { return (v[0] + v[1]) + (v[2] + v[3]); }

static vec root_of(vec x) {
    vec out;
    for (int l = 0; l < LANES; l++) out[l] = sqrt(x[l]);
    return out;
}

/* What the inputs make of the state at the start of the stages. */
static inline void end_state(vec h, vec x, vec u, const vec c[2], vec *x1, vec *u1) {
    *x1 = x + 2.0 * h * u + h * h * (2.0 * c[0] + c[1]) / 3.0;
    *u1 = u + 0.5 * h * (c[0] + c[1]);
}

/* Hessian and gradient by the state at one end of the stages and c there. */
typedef struct sums {
    vec xx, xu, uu, xc, uc, cc;
    vec x, u, c;
} sums;

/* The same by the state at the start, c0 and c1. */
typedef struct totals {
    vec xx, xu, uu, xc[2], uc[2], cc[3];
    vec x, u, c[2];
} totals;

static inline void add_start(totals *t, const sums *s) {
    t->xx += s->xx;
    t->xu += s->xu;
    t->uu += s->uu;
    t->xc[0] += s->xc;
    t->uc[0] += s->uc;
    t->cc[0] += s->cc;
}

static inline void add_start_gradient(totals *t, const sums *s) {
    t->x += s->x;
    t->u += s->u;
    t->c[0] += s->c;
}

/* x1 = x + 2 h u + third (2 c0 + c1), u1 = u + half (c0 + c1). */
static inline void add_end(totals *t, const sums *s, vec h) {
    vec third = h * h / 3.0, half = 0.5 * h, x0 = 2.0 * third * s->xx + half * s->xu, u0 = 2.0 * third * s->xu + half * s->uu;
    vec x1 = third * s->xx + half * s->xu, u1 = third * s->xu + half * s->uu; /* derivatives of x1, u1 by c0, c1, by Hessian */
    t->xx += s->xx;
    t->xu += 2.0 * h * s->xx + s->xu;
    t->uu += 4.0 * h * (h * s->xx + s->xu) + s->uu;
    t->xc[0] += x0;
    t->xc[1] += x1 + s->xc;
    t->uc[0] += 2.0 * h * x0 + u0;
    t->uc[1] += 2.0 * h * (x1 + s->xc) + u1 + s->uc;
    t->cc[0] += 2.0 * third * x0 + half * u0;
    vec c0 = 2.0 * third * s->xc + half * s->uc, c1 = third * s->xc + half * s->uc;
    t->cc[1] += third * x0 + half * u0 + c0;
    t->cc[2] += third * x1 + half * u1 + 2.0 * c1 + s->cc;
}

static inline void add_end_gradient(totals *t, const sums *s, vec h) {
    vec third = h * h / 3.0 * s->x, half = 0.5 * h * s->u;
    t->x += s->x;
    t->u += 2.0 * h * s->x + s->u;
    t->c[0] += 2.0 * third + half;
    t->c[1] += third + half + s->c;
}

/* In the middle of the stages: x + h u + h^2 (5 c0 + c1) / 24, and the middle control point of u, u + h c0 / 2: with the limit at both ends
 * and there u keeps it everywhere between. */
static inline void middle_state(vec h, vec x, vec u, const vec c[2], vec *xm, vec *um) {
    *xm = x + h * u + h * h * (5.0 * c[0] + c[1]) / 24.0;
    *um = u + 0.5 * h * c[0];
}

static inline void add_middle(totals *t, const sums *s, vec h) {
    vec ax[2] = {h * h * 5.0 / 24.0, h * h / 24.0}, au[2] = {0.5 * h, set1(0.0)}, x[2], u[2];
    for (int n = 0; n < 2; n++) {
        x[n] = ax[n] * s->xx + au[n] * s->xu;
        u[n] = ax[n] * s->xu + au[n] * s->uu;
        t->xc[n] += x[n];
        t->uc[n] += h * x[n] + u[n];
    }
    t->xx += s->xx;
    t->xu += h * s->xx + s->xu;
    t->uu += h * (h * s->xx + 2.0 * s->xu) + s->uu;
    t->cc[0] += ax[0] * x[0] + au[0] * u[0];
    t->cc[1] += ax[1] * x[0] + au[1] * u[0];
    t->cc[2] += ax[1] * x[1] + au[1] * u[1];
}

static inline void add_middle_gradient(totals *t, const sums *s, vec h) {
    t->x += s->x;
    t->u += h * s->x + s->u;
    t->c[0] += h * (h * 5.0 / 24.0 * s->x + 0.5 * s->u);
    t->c[1] += h * h / 24.0 * s->x;
}
#endif
