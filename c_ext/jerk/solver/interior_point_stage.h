/* Stages of the window's problem, LANES at a time: the states at their ends and
 * in their middle by the state at the start and the inputs c0 and c1, and
 * Hessians and gradients by the former written over the latter. */
#ifndef JERK_IPM_STAGE_H
#define JERK_IPM_STAGE_H
#include "jerk/state/vectors.h"
#include "jerk/state/problem.h"

/* Linear forms of the rows. */
static inline vec acc_value(const two_sided *row, vec x, vec accel) {
    return row->coef[0] * x + row->coef[1] * accel;
}
static inline vec jerk_value(const two_sided *row,
                             vec x,
                             vec accel,
                             vec input) {
    const vec *coef = row->coef;
    return coef[0] * x + coef[1] * accel + coef[2] * input;
}
static inline vec one_value(const struct one_sided *row,
                            vec x,
                            vec accel,
                            const vec input[2]) {
    const vec *coef = row->coef;
    vec by_state = coef[0] * x + coef[1] * accel;
    return by_state + coef[2] * input[0] + coef[3] * input[1];
}

/* What the inputs make of the state at the start of the stages. */
static inline void end_state(vec length,
                             vec x,
                             vec accel,
                             const vec input[2],
                             vec *x1,
                             vec *u1) {
    *x1 = x + 2.0 * length * accel
          + THIRD * length * length * (2.0 * input[0] + input[1]);
    *u1 = accel + 0.5 * length * (input[0] + input[1]);
}

/* Gradient by the state at one end of the stages and c there. */
typedef struct slope {
    vec x, accel, input;
} slope;

/* The same by the state at the start, c0 and c1. */
typedef struct slopes {
    vec x, accel, input[2];
} slopes;

/* Hessian and gradient by the state at one end of the stages and c there. */
typedef struct sums {
    vec xx, xu, uu, xc, uc, cc;
    struct slope slope;
} sums;

/* The same by the state at the start, c0 and c1. */
typedef struct totals {
    vec xx, xu, uu, xc[2], uc[2], cc[3];
    struct slopes slopes;
} totals;

/* One store each: compilers fill a whole struct with a slow loop. */
static inline void clear_slope(struct slope *slope) {
    slope->x = set1(0.0);
    slope->accel = set1(0.0);
    slope->input = set1(0.0);
}

static inline void clear_slopes(struct slopes *slopes) {
    slopes->x = set1(0.0);
    slopes->accel = set1(0.0);
    slopes->input[0] = set1(0.0);
    slopes->input[1] = set1(0.0);
}

static inline void clear_sums(struct sums *sums) {
    sums->xx = set1(0.0);
    sums->xu = set1(0.0);
    sums->uu = set1(0.0);
    sums->xc = set1(0.0);
    sums->uc = set1(0.0);
    sums->cc = set1(0.0);
    clear_slope(&sums->slope);
}

static inline void clear_totals(struct totals *totals) {
    totals->xx = set1(0.0);
    totals->xu = set1(0.0);
    totals->uu = set1(0.0);
    for (int i = 0; i < 2; i++) {
        totals->xc[i] = set1(0.0);
        totals->uc[i] = set1(0.0);
    }
    for (int i = 0; i < 3; i++) {
        totals->cc[i] = set1(0.0);
    }
    clear_slopes(&totals->slopes);
}

/* Adds the square of a row's form, times a weight. */
static inline void add_square(struct sums *sums, vec weight, const vec *coef) {
    vec wx = weight * coef[0];
    vec wu = weight * coef[1];
    vec wc = weight * coef[2];
    sums->xx += wx * coef[0];
    sums->xu += wx * coef[1];
    sums->uu += wu * coef[1];
    sums->xc += wx * coef[2];
    sums->uc += wu * coef[2];
    sums->cc += wc * coef[2];
}

static inline void add_start(struct totals *totals, const struct sums *sums) {
    totals->xx += sums->xx;
    totals->xu += sums->xu;
    totals->uu += sums->uu;
    totals->xc[0] += sums->xc;
    totals->uc[0] += sums->uc;
    totals->cc[0] += sums->cc;
}

static inline void add_start_slope(struct slopes *slopes,
                                   const struct slope *slope) {
    slopes->x += slope->x;
    slopes->accel += slope->accel;
    slopes->input[0] += slope->input;
}

/* x1 = x + 2 h u + third (2 c0 + c1), u1 = u + half (c0 + c1). */
static inline void add_end(struct totals *totals,
                           const struct sums *sums,
                           vec length) {
    vec third = THIRD * length * length;
    vec half = 0.5 * length;
    vec x0 = 2.0 * third * sums->xx + half * sums->xu;
    vec u0 = 2.0 * third * sums->xu + half * sums->uu;
    vec x1 = third * sums->xx + half * sums->xu;
    vec u1 =
        third * sums->xu
        + half * sums->uu; /* derivatives of x1, u1 by c0, c1, by Hessian */
    totals->xx += sums->xx;
    totals->xu += 2.0 * length * sums->xx + sums->xu;
    totals->uu += 4.0 * length * (length * sums->xx + sums->xu) + sums->uu;
    totals->xc[0] += x0;
    totals->xc[1] += x1 + sums->xc;
    totals->uc[0] += 2.0 * length * x0 + u0;
    totals->uc[1] += 2.0 * length * (x1 + sums->xc) + u1 + sums->uc;
    totals->cc[0] += 2.0 * third * x0 + half * u0;
    vec c0 = 2.0 * third * sums->xc + half * sums->uc;
    vec c1 = third * sums->xc + half * sums->uc;
    totals->cc[1] += third * x0 + half * u0 + c0;
    totals->cc[2] += third * x1 + half * u1 + 2.0 * c1 + sums->cc;
}

static inline void add_end_slope(struct slopes *slopes,
                                 const struct slope *slope,
                                 vec length) {
    vec third = THIRD * length * length * slope->x;
    vec half = 0.5 * length * slope->accel;
    slopes->x += slope->x;
    slopes->accel += 2.0 * length * slope->x + slope->accel;
    slopes->input[0] += 2.0 * third + half;
    slopes->input[1] += third + half + slope->input;
}

/* Driven backwards: the state behind the stages and -u take the place of that
 * ahead of them and u, and c1 that of c0. */
static inline void turn_slopes(struct slopes *slopes, vec length) {
    const struct slope ahead = {.x = slopes->x, .accel = -slopes->accel};
    struct slopes out;
    clear_slopes(&out);
    add_end_slope(&out, &ahead, length);
    out.input[0] += slopes->input[1];
    out.input[1] += slopes->input[0];
    *slopes = out;
}

static inline void turn_totals(struct totals *totals, vec length) {
    const struct sums ahead = {.xx = totals->xx,
                               .xu = -totals->xu,
                               .uu = totals->uu};
    vec third = THIRD * length * length;
    vec half = 0.5 * length;
    vec xc[2] = {totals->xc[1], totals->xc[0]};
    vec uc[2] = {-totals->uc[1], -totals->uc[0]};
    struct totals out;
    clear_totals(&out);
    add_end(&out, &ahead, length);
    for (int i = 0; i < 2; i++) {
        out.xc[i] += xc[i];
        out.uc[i] += 2.0 * length * xc[i] + uc[i];
        out.cc[2 * i] += totals->cc[2 - 2 * i];
    }
    vec c0[2] = {2.0 * third * xc[0] + half * uc[0],
                 2.0 * third * xc[1] + half * uc[1]};
    vec c1[2];
    c1[0] = third * xc[0] + half * uc[0];
    c1[1] = third * xc[1] + half * uc[1];
    out.cc[0] += 2.0 * c0[0];
    out.cc[1] += c0[1] + c1[0] + totals->cc[1];
    out.cc[2] += 2.0 * c1[1];
    *totals = out;
}

/* Those of block i as the solver's recursion takes them. */
static inline void store_slopes(const struct problem *problem,
                                int i,
                                struct slopes *slopes,
                                const struct stage_grad *to) {
    int k = i * LANES;
    if (k < problem->middle) {
        turn_slopes(slopes, load(problem->lengths + k));
    }
    store(to->x + k, slopes->x);
    store(to->accel + k, slopes->accel);
    store(to->input[0] + k, slopes->input[0]);
    store(to->input[1] + k, slopes->input[1]);
}

static inline void store_totals(struct problem *problem,
                                int i,
                                struct totals *totals) {
    const struct stage_cost *cost = &problem->cost;
    int k = i * LANES;
    store_slopes(problem, i, &totals->slopes, &problem->grad);
    if (k < problem->middle) {
        turn_totals(totals, load(problem->lengths + k));
    }
    store(cost->xx + k, totals->xx);
    store(cost->xu + k, totals->xu);
    store(cost->uu + k, totals->uu);
    for (int n = 0; n < 2; n++) {
        store(cost->xc[n] + k, totals->xc[n]);
        store(cost->uc[n] + k, totals->uc[n]);
    }
    for (int n = 0; n < 3; n++) {
        store(cost->cc[n] + k, totals->cc[n]);
    }
}

/* In the middle of the stages: x + h u + h^2 (5 c0 + c1) / 24, and the middle
 * control point of u, u + h c0 / 2: with the limit at both ends and there u
 * keeps it everywhere between. */
static inline void middle_state(vec length,
                                vec x,
                                vec accel,
                                const vec input[2],
                                vec *xm,
                                vec *um) {
    *xm = x + length * accel
          + (1.0 / 24.0) * length * length * (5.0 * input[0] + input[1]);
    *um = accel + 0.5 * length * input[0];
}

/* The same of states whose index 0 is the start. */
static inline void middle_of(vec length,
                             const vec x[2],
                             const vec accel[2],
                             const vec input[2],
                             vec *xm,
                             vec *um) {
    middle_state(length, x[0], accel[0], input, xm, um);
}

static inline void add_middle(struct totals *totals,
                              const struct sums *sums,
                              vec length) {
    vec ax[2] = {(5.0 / 24.0) * length * length,
                 (1.0 / 24.0) * length * length};
    vec au[2] = {0.5 * length, set1(0.0)};
    vec x[2], accel[2];
    for (int count = 0; count < 2; count++) {
        x[count] = ax[count] * sums->xx + au[count] * sums->xu;
        accel[count] = ax[count] * sums->xu + au[count] * sums->uu;
        totals->xc[count] += x[count];
        totals->uc[count] += length * x[count] + accel[count];
    }
    totals->xx += sums->xx;
    totals->xu += length * sums->xx + sums->xu;
    totals->uu += length * (length * sums->xx + 2.0 * sums->xu) + sums->uu;
    totals->cc[0] += ax[0] * x[0] + au[0] * accel[0];
    totals->cc[1] += ax[1] * x[0] + au[1] * accel[0];
    totals->cc[2] += ax[1] * x[1] + au[1] * accel[1];
}

static inline void add_middle_slope(struct slopes *slopes,
                                    const struct slope *slope,
                                    vec length) {
    slopes->x += slope->x;
    slopes->accel += length * slope->x + slope->accel;
    slopes->input[0] +=
        length * ((5.0 / 24.0) * length * slope->x + 0.5 * slope->accel);
    slopes->input[1] += (1.0 / 24.0) * length * length * slope->x;
}
#endif
