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

/* Both sides of a row; the corrector's ds dl / s waits in dual_step. */
static inline void predict_sides(two_sided *row,
                                 const vec dq[2],
                                 struct scan *scan) {
    for (int k = 0; k < 2; k++) {
        side_predict(dq[k],
                     row->residual[k],
                     row->slack[k],
                     row->dual[k],
                     row->inverse[k],
                     scan,
                     &row->slack_step[k],
                     &row->dual_step[k]);
    }
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

static void predict_jerk_end(struct problem *problem,
                             int i,
                             int end,
                             const struct block *block,
                             const struct change *dz,
                             struct scan *scan,
                             struct sums *corr,
                             struct sums *cent) {
    two_sided *row = jerk_rows_of(problem, i, end);
    vec root = block->root[end];
    vec tm = {0};
    vec zm = {0};
    vec dm = block->half[end] * dz->x[end];
    for (int axis = 0; axis < problem->axes; axis++, row++) {
        vec form =
            root * jerk_value(row, dz->x[end], dz->accel[end], dz->input[end]);
        const vec dq[2] = {dm + form, dm - form};
        predict_sides(row, dq, scan);
        const vec *step = row->dual_step;
        const vec *inverse = row->inverse;
        two_gradients(row->coef,
                      root * (step[1] - step[0]),
                      root * (inverse[0] - inverse[1]),
                      corr,
                      cent);
        tm -= step[0] + step[1];
        zm += inverse[0] + inverse[1];
    }
    corr->x += tm * block->half[end];
    cent->x += zm * block->half[end];
}

static void predict_jerk(struct problem *problem,
                         int i,
                         const struct block *block,
                         const struct change *dz,
                         struct scan *scan,
                         struct totals *corr,
                         struct totals *cent) {
    struct sums one = {0};
    struct sums two = {0};
    predict_jerk_end(problem, i, 0, block, dz, scan, &one, &two);
    add_start_gradient(corr, &one);
    add_start_gradient(cent, &two);
    one = two = (struct sums){0};
    predict_jerk_end(problem, i, 1, block, dz, scan, &one, &two);
    add_end_gradient(corr, &one, block->length);
    add_end_gradient(cent, &two, block->length);
}

static void predict_acc(struct problem *problem,
                        int i,
                        const struct change *dz,
                        struct scan *scan,
                        struct totals *corr,
                        struct totals *cent) {
    int rows = problem->acc_sets * problem->axes;
    two_sided *row = acc_rows_of(problem, i);
    for (int k = 0; k < rows; k++, row++) {
        vec form = acc_value(row, dz->x[0], dz->accel[0]);
        const vec dq[2] = {form, -form};
        predict_sides(row, dq, scan);
        vec t = row->dual_step[1] - row->dual_step[0];
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
    two_sided *row = mid_rows_of(problem, i);
    struct sums one = {0};
    struct sums two = {0};
    vec x, accel;
    middle_of(block->length, dz->x, dz->accel, dz->input, &x, &accel);
    for (int axis = 0; axis < problem->axes; axis++, row++) {
        vec form = acc_value(row, x, accel);
        const vec dq[2] = {form, -form};
        predict_sides(row, dq, scan);
        two_gradients(row->coef,
                      row->dual_step[1] - row->dual_step[0],
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
    struct one_sided *row = one_rows_of(problem, i);
    for (int axis = 0; axis < ONE_SIDED_ROWS; axis++, row++) {
        vec dq = one_value(row, dz->x[0], dz->accel[0], dz->input);
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
        for (int k = 0; k < 2; k++) {
            corr->input[k] -= k1 * row->coef[2 + k];
            cent->input[k] += row->inverse * row->coef[2 + k];
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
}

static inline void correct_sides(two_sided *row,
                                 const vec dq[2],
                                 vec mu,
                                 struct scan *scan) {
    for (int k = 0; k < 2; k++) {
        side_correct(dq[k],
                     row->residual[k],
                     row->dual[k],
                     row->inverse[k],
                     mu,
                     scan,
                     &row->slack_step[k],
                     &row->dual_step[k]);
    }
}

static void correct_jerk(struct problem *problem,
                         int i,
                         const struct change *dz,
                         vec mu,
                         struct scan *scan) {
    const struct block *block = &problem->block[i];
    for (int end = 0; end < 2; end++) {
        two_sided *row = jerk_rows_of(problem, i, end);
        vec dm = block->half[end] * dz->x[end];
        for (int axis = 0; axis < problem->axes; axis++, row++) {
            vec form =
                block->root[end]
                * jerk_value(row, dz->x[end], dz->accel[end], dz->input[end]);
            const vec dq[2] = {dm + form, dm - form};
            correct_sides(row, dq, mu, scan);
        }
    }
}

/* So many acceleration rows, for the change (x, accel) of the state they read.
 */
static inline void correct_acc(two_sided *row,
                               int count,
                               vec x,
                               vec accel,
                               vec mu,
                               struct scan *scan) {
    for (int k = 0; k < count; k++, row++) {
        vec form = acc_value(row, x, accel);
        const vec dq[2] = {form, -form};
        correct_sides(row, dq, mu, scan);
    }
}

static void correct_one(struct problem *problem,
                        int i,
                        const struct change *dz,
                        vec mu,
                        struct scan *scan) {
    struct one_sided *row = one_rows_of(problem, i);
    for (int k = 0; k < ONE_SIDED_ROWS; k++, row++) {
        side_correct(one_value(row, dz->x[0], dz->accel[0], dz->input),
                     row->residual,
                     row->dual,
                     row->inverse,
                     mu,
                     scan,
                     &row->slack_step,
                     &row->dual_step);
    }
}

static struct scan correct(struct problem *problem, double sigma_mu) {
    struct scan scan = {0};
    const vec mu = set1(sigma_mu);
    int axes = problem->axes;
    for (int i = 0; i < problem->blocks; i++) {
        vec length = problem->block[i].length;
        const struct change dz = change_at(problem, i * LANES, length);
        correct_jerk(problem, i, &dz, mu, &scan);
        correct_acc(acc_rows_of(problem, i),
                    problem->acc_sets * axes,
                    dz.x[0],
                    dz.accel[0],
                    mu,
                    &scan);
        vec x, accel;
        middle_of(length, dz.x, dz.accel, dz.input, &x, &accel);
        correct_acc(mid_rows_of(problem, i), axes, x, accel, mu, &scan);
        correct_one(problem, i, &dz, mu, &scan);
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
