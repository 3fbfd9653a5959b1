/* Hessian and gradient of all rows at the present iterate, stage by stage. */
#ifndef JERK_IPM_GATHER_H
#define JERK_IPM_GATHER_H
#include <math.h>
#include "jerk/solver/interior_point_stage.h"
#include "jerk/state/tuning.h"

static inline void block_at(const struct problem *problem,
                            int i,
                            struct block *out) {
    int k = i * LANES;
    struct block block;
    block.length = load(problem->lengths + k);
    block.x[0] = load(problem->x + k);
    block.accel[0] = load(problem->accel + k);
    block.input[0] = load(problem->input[0] + k);
    block.input[1] = load(problem->input[1] + k);
    end_state(block.length,
              block.x[0],
              block.accel[0],
              block.input,
              &block.x[1],
              &block.accel[1]);
    vec bow = load(problem->bow + k);
    vec on = load(problem->on + k);
    vec off = 1.0 - on;
    vec low = LOWEST * load(problem->guess + k);
    for (int end = 0; end < 2; end++) {
        block.bent[end] = block.input[end] - bow;
        vec x = vmax(block.x[end], low) * on + off;
        vec t = 1.0 / root_of(x);
        block.root[end] = load(problem->root[end] + k);
        block.half[end] = 0.5 * on * block.root[end] * t / x;
        block.bound[end] = 1.5 * block.root[end] * t;
    }
    *out = block;
}

/* Start of an iteration for one side of a row: residual, 1/slack; returns the
 * weight, `t` gets the gradient. */
static inline vec side(vec value,
                       vec bound,
                       vec slack,
                       vec *dual,
                       vec least,
                       vec *inverse,
                       vec *residual,
                       vec *gradient) {
    *residual = value - bound + slack;
    *inverse = 1.0 / slack;
    *dual = vmax(*dual, least * *inverse);
    vec weight = *dual * *inverse;
    *gradient = weight * *residual;
    return weight;
}

/* The same for both sides of a row. */
static inline void sides(two_sided *row,
                         const vec value[2],
                         vec bound,
                         vec least,
                         vec weight[2],
                         vec gradient[2]) {
    for (int k = 0; k < 2; k++) {
        weight[k] = side(value[k],
                         bound,
                         row->slack[k],
                         &row->dual[k],
                         least,
                         &row->inverse[k],
                         &row->residual[k],
                         &gradient[k]);
    }
}

/* Adds a row's gradient by the state at one end and the input there. */
static inline void add_slope(struct slope *slope, vec t, const vec *coef) {
    slope->x += t * coef[0];
    slope->accel += t * coef[1];
    slope->input += t * coef[2];
}

/* Linear forms of a jerk row pair: q = root * (b . z), m = half * x. */
static inline void gather_jerk_end(const struct problem *problem,
                                   int i,
                                   int end,
                                   const struct block *block,
                                   struct sums *sums,
                                   vec least) {
    two_sided *row = jerk_rows_of(problem, i, end);
    vec half = block->half[end];
    vec tangent = half * block->x[end];
    vec bound = block->bound[end];
    vec root = block->root[end];
    vec wm = {0};
    vec px = {0};
    vec pu = {0};
    vec pc = {0};
    vec tm = {0};
    for (int k = 0; k < problem->used[i].jerk; k++, row++) {
        vec form = root
                   * jerk_value(row,
                                block->x[end],
                                block->accel[end],
                                block->bent[end]);
        const vec value[2] = {tangent + form, tangent - form};
        vec weight[2], gradient[2];
        sides(row, value, bound, least, weight, gradient);
        vec both = weight[0] + weight[1];
        vec difference = root * (weight[0] - weight[1]);
        vec t = root * (gradient[0] - gradient[1]);
        add_square(sums, root * root * both, row->coef);
        px += difference * row->coef[0];
        pu += difference * row->coef[1];
        pc += difference * row->coef[2];
        add_slope(&sums->slope, t, row->coef);
        wm += both;
        tm += gradient[0] + gradient[1];
    }
    sums->xx += half * (half * wm + 2.0 * px);
    sums->xu += pu * half;
    sums->xc += pc * half;
    sums->slope.x += tm * half;
}

static inline void gather_jerk(const struct problem *problem,
                               int i,
                               const struct block *block,
                               struct totals *all,
                               vec least) {
    struct sums first, last;
    clear_sums(&first);
    gather_jerk_end(problem, i, 0, block, &first, least);
    add_start(all, &first);
    add_start_slope(&all->slopes, &first.slope);
    clear_sums(&last);
    gather_jerk_end(problem, i, 1, block, &last, least);
    add_end(all, &last, block->length);
    add_end_slope(&all->slopes, &last.slope, block->length);
}

/* Adds an acceleration row's Hessian and gradient by the state that it reads.
 */
static inline void add_acc(struct sums *sums,
                           two_sided *row,
                           vec form,
                           vec least) {
    const vec value[2] = {form, -form};
    vec weight[2], gradient[2];
    sides(row, value, set1(1.0), least, weight, gradient);
    vec both = weight[0] + weight[1];
    vec t = gradient[0] - gradient[1];
    sums->xx += both * row->coef[0] * row->coef[0];
    sums->xu += both * row->coef[0] * row->coef[1];
    sums->uu += both * row->coef[1] * row->coef[1];
    sums->slope.x += t * row->coef[0];
    sums->slope.accel += t * row->coef[1];
}

static inline void gather_mid(const struct problem *problem,
                              int i,
                              const struct block *block,
                              struct totals *all,
                              vec least) {
    vec x, accel;
    struct sums sums;
    clear_sums(&sums);
    two_sided *row = mid_rows_of(problem, i);
    middle_of(block->length, block->x, block->accel, block->input, &x, &accel);
    for (int k = 0; k < mid_used(&problem->used[i]); k++, row++) {
        add_acc(&sums, row, acc_value(row, x, accel), least);
    }
    add_middle(all, &sums, block->length);
    add_middle_slope(&all->slopes, &sums.slope, block->length);
}

static inline void gather_acc(const struct problem *problem,
                              int i,
                              const struct block *block,
                              struct totals *totals,
                              vec least) {
    int rows = acc_used(&problem->used[i]);
    two_sided *row = acc_rows_of(problem, i);
    struct sums sums = {.xx = totals->xx, .xu = totals->xu, .uu = totals->uu};
    sums.slope.x = totals->slopes.x;
    sums.slope.accel = totals->slopes.accel;
    for (int k = 0; k < rows; k++, row++) {
        vec form = acc_value(row, block->x[0], block->accel[0]);
        add_acc(&sums, row, form, least);
    }
    totals->xx = sums.xx;
    totals->xu = sums.xu;
    totals->uu = sums.uu;
    totals->slopes.x = sums.slope.x;
    totals->slopes.accel = sums.slope.accel;
}

/* Adds what a row has by the inputs; `coef`: of both of them. */
static inline void add_input_row(struct totals *totals,
                                 const vec *coef,
                                 vec wx,
                                 vec wu,
                                 vec weight,
                                 vec t) {
    for (int k = 0; k < 2; k++) {
        totals->xc[k] += wx * coef[k];
        totals->uc[k] += wu * coef[k];
        totals->slopes.input[k] += t * coef[k];
    }
    totals->cc[0] += weight * coef[0] * coef[0];
    totals->cc[1] += weight * coef[0] * coef[1];
    totals->cc[2] += weight * coef[1] * coef[1];
}

static inline void gather_one(const struct problem *problem,
                              int i,
                              const struct block *block,
                              struct totals *totals,
                              vec least) {
    const struct used *used = &problem->used[i];
    struct one_sided *row = one_rows_of(problem, i) + used->first;
    for (int k = used->first; k < used->end; k++, row++) {
        vec value = one_value(row, block->x[0], block->accel[0], block->input);
        vec t;
        vec weight = side(value,
                          row->bound,
                          row->slack,
                          &row->dual,
                          least,
                          &row->inverse,
                          &row->residual,
                          &t);
        vec wx = weight * row->coef[0];
        vec wu = weight * row->coef[1];
        totals->xx += wx * row->coef[0];
        totals->xu += wx * row->coef[1];
        totals->uu += wu * row->coef[1];
        totals->slopes.x += t * row->coef[0];
        totals->slopes.accel += t * row->coef[1];
        if (k >= FIRST_C_ROW) {
            add_input_row(totals, row->coef + 2, wx, wu, weight, t);
        }
    }
}

/* What more of x saves of the time from knot k on, and how fast that falls with
 * x: slope and curvature for Newton's method. */
static inline void saved_by(const struct problem *problem,
                            int k,
                            vec at,
                            vec *gain,
                            vec *curvature) {
    vec x = vmax(at, LOWEST * load(problem->guess + k));
    x = vmax(x, set1(TINY));
    vec slope = load(problem->slope + k) / (x * root_of(x));
    *gain = slope + load(problem->weight + k);
    *curvature = 1.5 * slope / x;
}

/* Hessian and the gradient of the predictor (no centring). `floor`: least
 * product of slack and multiplier. */
static void gather(struct problem *problem, double floor) {
    const vec least = set1(floor);
    for (int i = 0; i < problem->blocks; i++) {
        int k = i * LANES;
        struct block bl;
        struct totals totals;
        block_at(problem, i, &bl);
        clear_totals(&totals);
        problem->block[i] = bl;
        gather_jerk(problem, i, &bl, &totals, least);
        gather_acc(problem, i, &bl, &totals, least);
        gather_mid(problem, i, &bl, &totals, least);
        gather_one(problem, i, &bl, &totals, least);
        vec pull = load(problem->pull + k);
        vec gain, curvature;
        saved_by(problem, k, bl.x[0], &gain, &curvature);
        totals.xx += curvature + pull;
        totals.slopes.x += pull * bl.x[0] - gain;
        vec calm = load(problem->calm + k);
        vec even = EVEN * calm;
        for (int n = 0; n < 2; n++) {
            totals.cc[2 * n] +=
                calm + even + STAGE_LEAST_COST * problem->convex;
            totals.slopes.input[n] +=
                calm * bl.input[n] + even * (bl.input[n] - bl.input[1 - n]);
        }
        totals.cc[1] -= even;
        store_totals(problem, i, &totals);
    }
}
#endif
