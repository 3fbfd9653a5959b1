/* Interior-point solver of the window (Mehrotra's predictor and corrector),
 * LANES stages at a time: the code, included once per instruction set
 * (IPM_SOLVE names the function).  Every lane does the same operations in the
 * same order, so the results do not depend on the instruction set.
 *
 * Maximise sum weight x under the rows of constraints.c.  The one nonlinear
 * term, x^(-1/2) of the jerk rows, is replaced by its tangent at the present
 * iterate: an inner approximation, since x^(-1/2) is convex.  The iterate meets
 * the dynamics at all times; only the rows may be missed on the way.
 */
#include <math.h>
#include "jerk/solver/interior_point_stage.h"

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

/* Scale of the jerk rows: sqrt(x) of the guess. */
static void set_scale(struct problem *problem) {
    for (int k = 0; k < problem->blocks * LANES; k++) {
        problem->root[0][k] = problem->root[1][k] = 1.0;
        if (problem->on[k] == 0.0) {
            continue;
        }
        problem->root[0][k] = sqrt(fmax(problem->guess[k], problem->x[k]));
        problem->root[1][k] =
            sqrt(fmax(problem->guess[k + 1], problem->x[k + 1]));
    }
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

/* Step of one side: slack and multiplier for a change `dq` of the row; centring
 * `sigma_mu`, old product in ds. */
typedef struct scan {
    vec ps, pl;             /* largest -ds/s, -dl/l */
    vec sl, dsl, sdl, dsdl; /* sums of products */
} scan;

static inline void side_predict(vec dq,
                                vec residual,
                                vec slack,
                                vec dual,
                                vec inverse,
                                struct scan *scan,
                                vec *slack_step,
                                vec *corr) {
    vec step = -residual - dq;
    vec rs = step * inverse;
    vec dual_step = -dual - dual * rs;
    *slack_step = step;
    *corr = step * dual_step * inverse;
    scan->ps = vmax(scan->ps, -rs);
    scan->pl = vmax(scan->pl, 1.0 + rs);
    scan->sl += slack * dual;
    scan->dsl += step * dual;
    scan->sdl += slack * dual_step;
    scan->dsdl += step * dual_step;
}

/* Adds to the gradients of corrector (k) and centring (z). */
static inline void two_gradients(const vec *coef,
                                 vec t,
                                 vec z,
                                 struct sums *corr,
                                 struct sums *cent) {
    corr->x += t * coef[0];
    corr->accel += t * coef[1];
    corr->input += t * coef[2];
    cent->x += z * coef[0];
    cent->accel += z * coef[1];
    cent->input += z * coef[2];
}

/* A step of the states and inputs: index 0 of x, u at the start, 1 at the end.
 */
typedef struct change {
    vec x[2], accel[2], input[2];
} change;

static inline struct change change_at(const struct problem *problem,
                                      int k,
                                      vec length) {
    struct change change = {
        .x = {load(problem->dx + k)},
        .accel = {load(problem->du + k)},
        .input = {load(problem->dc[0] + k), load(problem->dc[1] + k)}};
    end_state(length,
              change.x[0],
              change.accel[0],
              change.input,
              &change.x[1],
              &change.accel[1]);
    return change;
}

static void predict_jerk(struct problem *problem,
                         int i,
                         const struct block *block,
                         const struct change *dz,
                         struct scan *scan,
                         struct totals *corr,
                         struct totals *cent) {
    for (int end = 0; end < 2; end++) {
        struct sums one = {0};
        struct sums two = {0};
        two_sided *row =
            &problem->jerk[i * 2 * problem->axes + end * problem->axes];
        vec root = block->root[end];
        vec tm = {0};
        vec zm = {0};
        vec dm = block->half[end] * dz->x[end];
        for (int axis = 0; axis < problem->axes; axis++, row++) {
            vec dq =
                root
                * (row->coef[0] * dz->x[end] + row->coef[1] * dz->accel[end]
                   + row->coef[2] * dz->input[end]);
            vec k1, k2;
            side_predict(dm + dq,
                         row->residual[0],
                         row->slack[0],
                         row->dual[0],
                         row->inverse[0],
                         scan,
                         &row->slack_step[0],
                         &k1);
            side_predict(dm - dq,
                         row->residual[1],
                         row->slack[1],
                         row->dual[1],
                         row->inverse[1],
                         scan,
                         &row->slack_step[1],
                         &k2);
            row->dual_step[0] = k1;
            row->dual_step[1] = k2;
            two_gradients(row->coef,
                          root * (k2 - k1),
                          root * (row->inverse[0] - row->inverse[1]),
                          &one,
                          &two);
            tm -= k1 + k2;
            zm += row->inverse[0] + row->inverse[1];
        }
        one.x += tm * block->half[end];
        two.x += zm * block->half[end];
        if (end) {
            add_end_gradient(corr, &one, block->length);
            add_end_gradient(cent, &two, block->length);
        } else {
            add_start_gradient(corr, &one);
            add_start_gradient(cent, &two);
        }
    }
}

static void predict_acc(struct problem *problem,
                        int i,
                        const struct change *dz,
                        struct scan *scan,
                        struct totals *corr,
                        struct totals *cent) {
    two_sided *row = &problem->acc[i * problem->acc_sets * problem->axes];
    for (int axis = 0; axis < problem->acc_sets * problem->axes;
         axis++, row++) {
        vec dq = row->coef[0] * dz->x[0] + row->coef[1] * dz->accel[0];
        vec k1, k2;
        side_predict(dq,
                     row->residual[0],
                     row->slack[0],
                     row->dual[0],
                     row->inverse[0],
                     scan,
                     &row->slack_step[0],
                     &k1);
        side_predict(-dq,
                     row->residual[1],
                     row->slack[1],
                     row->dual[1],
                     row->inverse[1],
                     scan,
                     &row->slack_step[1],
                     &k2);
        row->dual_step[0] = k1;
        row->dual_step[1] = k2;
        vec t = k2 - k1;
        vec z = row->inverse[0] - row->inverse[1];
        corr->x += t * row->coef[0];
        corr->accel += t * row->coef[1];
        cent->x += z * row->coef[0];
        cent->accel += z * row->coef[1];
    }
}

static void predict_mid(struct problem *problem,
                        int i,
                        const struct block *block,
                        const struct change *dz,
                        struct scan *scan,
                        struct totals *corr,
                        struct totals *cent) {
    two_sided *row = &problem->mid[i * problem->axes];
    struct sums one = {0};
    struct sums two = {0};
    vec x, accel;
    middle_state(block->length, dz->x[0], dz->accel[0], dz->input, &x, &accel);
    for (int axis = 0; axis < problem->axes; axis++, row++) {
        vec dq = row->coef[0] * x + row->coef[1] * accel;
        vec k1, k2;
        side_predict(dq,
                     row->residual[0],
                     row->slack[0],
                     row->dual[0],
                     row->inverse[0],
                     scan,
                     &row->slack_step[0],
                     &k1);
        side_predict(-dq,
                     row->residual[1],
                     row->slack[1],
                     row->dual[1],
                     row->inverse[1],
                     scan,
                     &row->slack_step[1],
                     &k2);
        row->dual_step[0] = k1;
        row->dual_step[1] = k2;
        two_gradients(row->coef,
                      k2 - k1,
                      row->inverse[0] - row->inverse[1],
                      &one,
                      &two);
    }
    add_middle_gradient(corr, &one, block->length);
    add_middle_gradient(cent, &two, block->length);
}

static void predict_one(struct problem *problem,
                        int i,
                        const struct change *dz,
                        struct scan *scan,
                        struct totals *corr,
                        struct totals *cent) {
    struct one_sided *row = &problem->one[i * ONE_SIDED_ROWS];
    for (int axis = 0; axis < ONE_SIDED_ROWS; axis++, row++) {
        vec dq =
            one_value(row, dz->x[0], dz->accel[0], dz->input[0], dz->input[1]);
        vec k1;
        side_predict(dq,
                     row->residual,
                     row->slack,
                     row->dual,
                     row->inverse,
                     scan,
                     &row->slack_step,
                     &k1);
        row->dual_step = k1;
        corr->x -= k1 * row->coef[0];
        corr->accel -= k1 * row->coef[1];
        cent->x += row->inverse * row->coef[0];
        cent->accel += row->inverse * row->coef[1];
        for (int count = 0; count < 2; count++) {
            corr->input[count] -= k1 * row->coef[2 + count];
            cent->input[count] += row->inverse * row->coef[2 + count];
        }
    }
}

/* The predictor's step in all rows, and the gradients that corrector and
 * centring add. */
static struct scan predict(struct problem *problem) {
    struct scan scan = {0};
    for (int i = 0; i < problem->blocks; i++) {
        int k = i * LANES;
        const struct block bl = problem->block[i];
        const struct change dz = change_at(problem, k, bl.length);
        struct totals corr = {0};
        struct totals cent = {0};
        predict_jerk(problem, i, &bl, &dz, &scan, &corr, &cent);
        predict_acc(problem, i, &dz, &scan, &corr, &cent);
        predict_mid(problem, i, &bl, &dz, &scan, &corr, &cent);
        predict_one(problem, i, &dz, &scan, &corr, &cent);
        store(problem->corr.x + k, corr.x);
        store(problem->corr.accel + k, corr.accel);
        store(problem->cent.x + k, cent.x);
        store(problem->cent.accel + k, cent.accel);
        for (int count = 0; count < 2; count++) {
            store(problem->corr.input[count] + k, corr.input[count]);
            store(problem->cent.input[count] + k, cent.input[count]);
        }
    }
    return scan;
}

static void combine(struct problem *problem, double sigma_mu) {
    for (int i = 0; i < problem->blocks * LANES; i++) {
        problem->grad.x[i] +=
            problem->corr.x[i] + sigma_mu * problem->cent.x[i];
        problem->grad.accel[i] +=
            problem->corr.accel[i] + sigma_mu * problem->cent.accel[i];
        for (int count = 0; count < 2; count++) {
            problem->grad.input[count][i] +=
                problem->corr.input[count][i]
                + sigma_mu * problem->cent.input[count][i];
        }
    }
}

/* The combined step of one side; `dl` holds the corrector's ds dl / s. */
static inline void side_correct(vec dq,
                                vec residual,
                                vec slack,
                                vec dual,
                                vec inverse,
                                vec mu,
                                struct scan *scan,
                                vec *slack_step,
                                vec *dual_step) {
    vec step = -residual - dq;
    vec dual_change = -dual - dual * step * inverse + mu * inverse - *dual_step;
    *slack_step = step;
    *dual_step = dual_change;
    scan->ps = vmax(scan->ps, -step * inverse);
    scan->pl = vmax(scan->pl, -dual_change / dual);
    (void)slack;
}

static struct scan correct(struct problem *problem, double sigma_mu) {
    struct scan scan = {0};
    const vec mu = set1(sigma_mu);
    for (int i = 0; i < problem->blocks; i++) {
        int k = i * LANES;
        const struct block bl = problem->block[i];
        const struct change dz = change_at(problem, k, bl.length);
        for (int end = 0; end < 2; end++) {
            two_sided *row =
                &problem->jerk[i * 2 * problem->axes + end * problem->axes];
            vec dm = bl.half[end] * dz.x[end];
            for (int axis = 0; axis < problem->axes; axis++, row++) {
                vec dq =
                    bl.root[end]
                    * (row->coef[0] * dz.x[end] + row->coef[1] * dz.accel[end]
                       + row->coef[2] * dz.input[end]);
                side_correct(dm + dq,
                             row->residual[0],
                             row->slack[0],
                             row->dual[0],
                             row->inverse[0],
                             mu,
                             &scan,
                             &row->slack_step[0],
                             &row->dual_step[0]);
                side_correct(dm - dq,
                             row->residual[1],
                             row->slack[1],
                             row->dual[1],
                             row->inverse[1],
                             mu,
                             &scan,
                             &row->slack_step[1],
                             &row->dual_step[1]);
            }
        }
        two_sided *row = &problem->acc[i * problem->acc_sets * problem->axes];
        for (int axis = 0; axis < problem->acc_sets * problem->axes;
             axis++, row++) {
            vec dq = row->coef[0] * dz.x[0] + row->coef[1] * dz.accel[0];
            side_correct(dq,
                         row->residual[0],
                         row->slack[0],
                         row->dual[0],
                         row->inverse[0],
                         mu,
                         &scan,
                         &row->slack_step[0],
                         &row->dual_step[0]);
            side_correct(-dq,
                         row->residual[1],
                         row->slack[1],
                         row->dual[1],
                         row->inverse[1],
                         mu,
                         &scan,
                         &row->slack_step[1],
                         &row->dual_step[1]);
        }
        vec xm, um;
        middle_state(bl.length, dz.x[0], dz.accel[0], dz.input, &xm, &um);
        row = &problem->mid[i * problem->axes];
        for (int axis = 0; axis < problem->axes; axis++, row++) {
            vec dq = row->coef[0] * xm + row->coef[1] * um;
            side_correct(dq,
                         row->residual[0],
                         row->slack[0],
                         row->dual[0],
                         row->inverse[0],
                         mu,
                         &scan,
                         &row->slack_step[0],
                         &row->dual_step[0]);
            side_correct(-dq,
                         row->residual[1],
                         row->slack[1],
                         row->dual[1],
                         row->inverse[1],
                         mu,
                         &scan,
                         &row->slack_step[1],
                         &row->dual_step[1]);
        }
        struct one_sided *one = &problem->one[i * ONE_SIDED_ROWS];
        for (int axis = 0; axis < ONE_SIDED_ROWS; axis++, one++) {
            vec dq =
                one_value(one, dz.x[0], dz.accel[0], dz.input[0], dz.input[1]);
            side_correct(dq,
                         one->residual,
                         one->slack,
                         one->dual,
                         one->inverse,
                         mu,
                         &scan,
                         &one->slack_step,
                         &one->dual_step);
        }
    }
    return scan;
}

/* The step; returns the gap behind it. */
static double move(struct problem *problem, double ap, double ad) {
    for (int i = 0; i < problem->blocks * LANES; i++) {
        problem->x[i] += ap * problem->dx[i];
        problem->accel[i] += ap * problem->du[i];
        problem->input[0][i] += ap * problem->dc[0][i];
        problem->input[1][i] += ap * problem->dc[1][i];
    }
    int two = problem->blocks * 2 * problem->axes;
    int acc = problem->blocks * problem->acc_sets * problem->axes;
    int one = problem->blocks * ONE_SIDED_ROWS;
    vec gap = {0};
    int mid = problem->blocks * problem->axes;
    for (int i = 0; i < two + acc + mid; i++) {
        two_sided *row = i < two         ? &problem->jerk[i]
                         : i < two + acc ? &problem->acc[i - two]
                                         : &problem->mid[i - two - acc];
        for (int side = 0; side < 2; side++) {
            row->slack[side] += ap * row->slack_step[side];
            row->dual[side] += ad * row->dual_step[side];
            gap += row->slack[side] * row->dual[side];
        }
    }
    for (int i = 0; i < one; i++) {
        problem->one[i].slack += ap * problem->one[i].slack_step;
        problem->one[i].dual += ad * problem->one[i].dual_step;
        gap += problem->one[i].slack * problem->one[i].dual;
    }
    return sum(gap);
}

static void start_side(vec value, vec bound, double mu, vec *slack, vec *dual) {
    *slack = vmax(bound - value, set1(START_SLACK));
    *dual = mu / *slack;
}

/* Sides of an axis' jerk row at one end of the stages of a block: both at most
 * the bound. */
static inline void jerk_sides(const struct block *block,
                              int end,
                              const two_sided *row,
                              vec side[2]) {
    vec tangent = block->half[end] * block->x[end];
    vec value =
        block->root[end]
        * (row->coef[0] * block->x[end] + row->coef[1] * block->accel[end]
           + row->coef[2] * block->input[end]);
    side[0] = tangent + value;
    side[1] = tangent - value;
}

/* Slacks of the guess, kept off the boundary, and multipliers on the central
 * path. */
static void start(struct problem *problem, double mu) {
    for (int i = 0; i < problem->blocks; i++) {
        struct block block = block_at(problem, i);
        for (int end = 0; end < 2; end++) {
            two_sided *row =
                &problem->jerk[i * 2 * problem->axes + end * problem->axes];
            for (int axis = 0; axis < problem->axes; axis++, row++) {
                vec side[2];
                jerk_sides(&block, end, row, side);
                for (int count = 0; count < 2; count++) {
                    start_side(side[count],
                               block.bound[end],
                               mu,
                               &row->slack[count],
                               &row->dual[count]);
                }
            }
        }
        two_sided *row = &problem->acc[i * problem->acc_sets * problem->axes];
        for (int axis = 0; axis < problem->acc_sets * problem->axes;
             axis++, row++) {
            vec value =
                row->coef[0] * block.x[0] + row->coef[1] * block.accel[0];
            start_side(value, set1(1.0), mu, &row->slack[0], &row->dual[0]);
            start_side(-value, set1(1.0), mu, &row->slack[1], &row->dual[1]);
        }
        vec xm, um;
        middle_state(block.length,
                     block.x[0],
                     block.accel[0],
                     block.input,
                     &xm,
                     &um);
        row = &problem->mid[i * problem->axes];
        for (int axis = 0; axis < problem->axes; axis++, row++) {
            vec value = row->coef[0] * xm + row->coef[1] * um;
            start_side(value, set1(1.0), mu, &row->slack[0], &row->dual[0]);
            start_side(-value, set1(1.0), mu, &row->slack[1], &row->dual[1]);
        }
        struct one_sided *one = &problem->one[i * ONE_SIDED_ROWS];
        for (int axis = 0; axis < ONE_SIDED_ROWS; axis++, one++) {
            start_side(one_value(one,
                                 block.x[0],
                                 block.accel[0],
                                 block.input[0],
                                 block.input[1]),
                       one->bound,
                       mu,
                       &one->slack,
                       &one->dual);
        }
    }
}

/* Rows were tightened: where the iterate misses one, its slack is as large as
 * what is missed. Left as small as they were, they would stop every step. */
static void reopen(struct problem *problem) {
    for (int i = 0; i < problem->blocks; i++) {
        struct block block = block_at(problem, i);
        for (int end = 0; end < 2; end++) {
            two_sided *row =
                &problem->jerk[i * 2 * problem->axes + end * problem->axes];
            for (int axis = 0; axis < problem->axes; axis++, row++) {
                vec side[2];
                jerk_sides(&block, end, row, side);
                for (int count = 0; count < 2; count++) {
                    row->slack[count] =
                        vmax(row->slack[count], side[count] - block.bound[end]);
                }
            }
        }
    }
}

static double step_length(vec most) {
    double m = top(most);
    return m > TO_BOUNDARY ? TO_BOUNDARY / m : 1.0;
}

/* From the guess in x, u, c to the optimum, or on from where it has paused.
 * With b->pause it stops once at that gap, so that rows may be changed.  false:
 * no convergence (or paused); the checker judges what is there all the same. */
bool IPM_SOLVE(struct problem *problem, int max_iterations) {
    int rows = problem->blocks * LANES
               * (2 * (3 + problem->acc_sets) * problem->axes + ONE_SIDED_ROWS);
    double least = 0.0;
    if (!problem->paused) {
        set_scale(problem);
        start(problem, START_MU / rows);
        problem->iterations = 0;
        problem->missed = problem->dual = 1.0;
    } else {
        reopen(problem);
    }
    problem->paused = false;
    for (; problem->iterations < max_iterations; problem->iterations++) {
        gather(problem, set1(least));
        if (!riccati_factor(problem)) {
            return false;
        }
        riccati_solve(problem, &problem->grad);
        struct scan scan = predict(problem);
        double gap = sum(scan.sl);
        double mu = gap / rows;
        if (!(gap < HOPELESS)) {
            return false;
        }
        double ap = fmin(1.0, 1.0 / fmax(1e-9, top(scan.ps)));
        double ad = fmin(1.0, 1.0 / fmax(1e-9, top(scan.pl)));
        double after = (gap + ap * sum(scan.dsl) + ad * sum(scan.sdl)
                        + ap * ad * sum(scan.dsdl))
                       / rows;
        double ratio = fmax(after, 0.0) / mu;
        double sigma = ratio * ratio * ratio;
        combine(problem, sigma * mu);
        riccati_solve(problem, &problem->grad);
        scan = correct(problem, sigma * mu);
        ap = step_length(scan.ps);
        ad = step_length(scan.pl);
        if (!isfinite(ap + ad)) {
            return false;
        }
        problem->gap = move(problem, ap, ad);
        least = CENTRED * sigma * mu;
        problem->missed *= 1.0 - ap;
        problem->dual *= 1.0 - ad;
        if (problem->gap < GAP && problem->missed < ROWS_MET
            && problem->dual < 1e-2) {
            problem->iterations++;
            return true;
        }
        if (gap < problem->pause) {
            problem->pause = 0.0;
            problem->paused = true;
            problem->iterations++;
            return false;
        }
    }
    return false;
}
