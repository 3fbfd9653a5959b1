/* The predictor's and the corrector's step in all rows. */
#ifndef JERK_IPM_STEP_H
#define JERK_IPM_STEP_H
#include <math.h>
#include "jerk/solver/interior_point_stage.h"
#include "jerk/solver/interior_point_gather.h"

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
#endif
