/* Hessian and gradient of all rows at the present iterate, stage by stage. */
#ifndef JERK_IPM_GATHER_H
#define JERK_IPM_GATHER_H
#include <math.h>
#include "jerk/solver/interior_point_stage.h"
#include "jerk/tuning.h"

static struct block block_at(const struct problem *problem, int i) {
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
    vec on = load(problem->on + k);
    vec off = 1.0 - on;
    vec low = LOWEST * load(problem->guess + k);
    for (int end = 0; end < 2; end++) {
        vec x = vmax(block.x[end], low) * on + off;
        vec t = 1.0 / root_of(x);
        block.root[end] = load(problem->root[end] + k);
        block.half[end] = 0.5 * on * block.root[end] * t / x;
        block.bound[end] = 1.5 * block.root[end] * t;
    }
    return block;
}

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

/* Linear forms of a jerk row pair: q = root * (b . z), m = half * x. */
static void gather_jerk(const struct problem *problem,
                        int i,
                        const struct block *block,
                        struct totals *all,
                        vec least) {
    for (int end = 0; end < 2; end++) {
        struct sums both = {0};
        struct sums *sums = &both;
        two_sided *row =
            &problem->jerk[i * 2 * problem->axes + end * problem->axes];
        vec tangent = block->half[end] * block->x[end];
        vec bound = block->bound[end];
        vec wm = {0};
        vec px = {0};
        vec pu = {0};
        vec pc = {0};
        vec tm = {0};
        vec root = block->root[end];
        for (int axis = 0; axis < problem->axes; axis++, row++) {
            vec value = root
                        * (row->coef[0] * block->x[end]
                           + row->coef[1] * block->accel[end]
                           + row->coef[2] * block->input[end]);
            vec t1, t2;
            vec w1 = side(tangent + value,
                          bound,
                          row->slack[0],
                          &row->dual[0],
                          least,
                          &row->inverse[0],
                          &row->residual[0],
                          &t1);
            vec w2 = side(tangent - value,
                          bound,
                          row->slack[1],
                          &row->dual[1],
                          least,
                          &row->inverse[1],
                          &row->residual[1],
                          &t2);
            vec difference = root * (w1 - w2);
            vec t = root * (t1 - t2);
            add_square(sums, root * root * (w1 + w2), row->coef);
            px += difference * row->coef[0];
            pu += difference * row->coef[1];
            pc += difference * row->coef[2];
            sums->x += t * row->coef[0];
            sums->accel += t * row->coef[1];
            sums->input += t * row->coef[2];
            wm += w1 + w2;
            tm += t1 + t2;
        }
        sums->xx += block->half[end] * (block->half[end] * wm + 2.0 * px);
        sums->xu += pu * block->half[end];
        sums->xc += pc * block->half[end];
        sums->x += tm * block->half[end];
        if (end) {
            add_end(all, sums, block->length);
            add_end_gradient(all, sums, block->length);
        } else {
            add_start(all, sums);
            add_start_gradient(all, sums);
        }
    }
}

static void gather_mid(const struct problem *problem,
                       int i,
                       const struct block *block,
                       struct totals *all,
                       vec least) {
    const vec one = set1(1.0);
    vec x, accel;
    struct sums sums = {0};
    two_sided *row = &problem->mid[i * problem->axes];
    middle_state(block->length,
                 block->x[0],
                 block->accel[0],
                 block->input,
                 &x,
                 &accel);
    for (int axis = 0; axis < problem->axes; axis++, row++) {
        vec value = row->coef[0] * x + row->coef[1] * accel;
        vec t1, t2;
        vec w1 = side(value,
                      one,
                      row->slack[0],
                      &row->dual[0],
                      least,
                      &row->inverse[0],
                      &row->residual[0],
                      &t1);
        vec w2 = side(-value,
                      one,
                      row->slack[1],
                      &row->dual[1],
                      least,
                      &row->inverse[1],
                      &row->residual[1],
                      &t2);
        vec weight = w1 + w2;
        vec t = t1 - t2;
        sums.xx += weight * row->coef[0] * row->coef[0];
        sums.xu += weight * row->coef[0] * row->coef[1];
        sums.uu += weight * row->coef[1] * row->coef[1];
        sums.x += t * row->coef[0];
        sums.accel += t * row->coef[1];
    }
    add_middle(all, &sums, block->length);
    add_middle_gradient(all, &sums, block->length);
}

static void gather_acc(const struct problem *problem,
                       int i,
                       const struct block *block,
                       struct totals *totals,
                       vec least) {
    const vec one = set1(1.0);
    two_sided *row = &problem->acc[i * problem->acc_sets * problem->axes];
    for (int axis = 0; axis < problem->acc_sets * problem->axes;
         axis++, row++) {
        vec value = row->coef[0] * block->x[0] + row->coef[1] * block->accel[0];
        vec t1, t2;
        vec w1 = side(value,
                      one,
                      row->slack[0],
                      &row->dual[0],
                      least,
                      &row->inverse[0],
                      &row->residual[0],
                      &t1);
        vec w2 = side(-value,
                      one,
                      row->slack[1],
                      &row->dual[1],
                      least,
                      &row->inverse[1],
                      &row->residual[1],
                      &t2);
        vec weight = w1 + w2;
        vec t = t1 - t2;
        totals->xx += weight * row->coef[0] * row->coef[0];
        totals->xu += weight * row->coef[0] * row->coef[1];
        totals->uu += weight * row->coef[1] * row->coef[1];
        totals->x += t * row->coef[0];
        totals->accel += t * row->coef[1];
    }
}

static inline vec one_value(const struct one_sided *row,
                            vec x,
                            vec accel,
                            vec c0,
                            vec c1) {
    return row->coef[0] * x + row->coef[1] * accel + row->coef[2] * c0
           + row->coef[3] * c1;
}

static void gather_one(const struct problem *problem,
                       int i,
                       const struct block *block,
                       struct totals *totals,
                       vec least) {
    struct one_sided *row = &problem->one[i * ONE_SIDED_ROWS];
    for (int axis = 0; axis < ONE_SIDED_ROWS; axis++, row++) {
        vec value = one_value(row,
                              block->x[0],
                              block->accel[0],
                              block->input[0],
                              block->input[1]);
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
        totals->x += t * row->coef[0];
        totals->accel += t * row->coef[1];
        if (axis < FIRST_C_ROW) {
            continue;
        }
        for (int count = 0; count < 2; count++) {
            totals->xc[count] += wx * row->coef[2 + count];
            totals->uc[count] += wu * row->coef[2 + count];
            totals->input[count] += t * row->coef[2 + count];
        }
        totals->cc[0] += weight * row->coef[2] * row->coef[2];
        totals->cc[1] += weight * row->coef[2] * row->coef[3];
        totals->cc[2] += weight * row->coef[3] * row->coef[3];
    }
}

/* Hessian and the gradient of the predictor (no centring). */
static void gather(struct problem *problem, vec least) {
    for (int i = 0; i < problem->blocks; i++) {
        int k = i * LANES;
        struct block bl = block_at(problem, i);
        struct totals totals = {0};
        problem->block[i] = bl;
        gather_jerk(problem, i, &bl, &totals, least);
        gather_acc(problem, i, &bl, &totals, least);
        gather_mid(problem, i, &bl, &totals, least);
        gather_one(problem, i, &bl, &totals, least);
        store(problem->cost.xx + k, totals.xx);
        store(problem->cost.xu + k, totals.xu);
        store(problem->cost.uu + k, totals.uu);
        vec calm = load(problem->calm + k);
        vec even = EVEN * calm;
        for (int count = 0; count < 2; count++) {
            store(problem->cost.xc[count] + k, totals.xc[count]);
            store(problem->cost.uc[count] + k, totals.uc[count]);
            store(problem->cost.cc[2 * count] + k,
                  totals.cc[2 * count] + calm + even
                      + STAGE_LEAST_COST * problem->convex);
            store(problem->grad.input[count] + k,
                  totals.input[count] + calm * bl.input[count]
                      + even * (bl.input[count] - bl.input[1 - count]));
        }
        store(problem->cost.cc[1] + k, totals.cc[1] - even);
        store(problem->grad.x + k, totals.x - load(problem->weight + k));
        store(problem->grad.accel + k, totals.accel);
    }
}
#endif
