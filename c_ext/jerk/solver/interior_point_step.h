/* The predictor's and the corrector's step in all rows. */
#ifndef JERK_IPM_STEP_H
#define JERK_IPM_STEP_H
#include <math.h>
#include "jerk/solver/interior_point_stage.h"
#include "jerk/solver/interior_point_gather.h"

/* Step of one side: slack and multiplier for a change `dq` of the row; centring
 * `sigma_mu`, old product in ds. */
typedef struct scan {
    vec ps, pl;         /* largest -ds/s, -dl/l */
    vec sl, dsl, dsdsl; /* sums of s l, -ds l, ds ds l / s */
} scan;

static inline void side_predict(vec dq,
                                vec residual,
                                vec slack,
                                vec dual,
                                vec inverse,
                                struct scan *scan,
                                vec *corr) {
    vec drop = (residual + dq) * inverse; /* -ds/s; dl = -l - l ds/s */
    vec product = slack * dual;
    vec change = product * drop;
    *corr = (dual - dual * drop) * drop;
    scan->ps = vmax(scan->ps, drop);
    scan->pl = vmax(scan->pl, -drop);
    scan->sl += product;
    scan->dsl += change;
    scan->dsdsl += change * drop;
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
                     &row->dual_step[k]);
    }
}

/* Gradients of corrector and centring. */
typedef struct two_slopes {
    struct slopes corr, cent;
} two_slopes;

/* The same by the state at one end. */
typedef struct end_slopes {
    struct slope corr, cent;
} end_slopes;

static inline void add_two(const vec *coef,
                           vec t,
                           vec z,
                           struct end_slopes *slopes) {
    add_slope(&slopes->corr, t, coef);
    add_slope(&slopes->cent, z, coef);
}

static inline void clear_two(struct end_slopes *slopes) {
    clear_slope(&slopes->corr);
    clear_slope(&slopes->cent);
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

static inline void predict_jerk_end(struct problem *problem,
                                    int i,
                                    int end,
                                    const struct block *block,
                                    const struct change *dz,
                                    struct scan *scan,
                                    struct end_slopes *slopes) {
    two_sided *row = jerk_rows_of(problem, i, end);
    vec root = block->root[end];
    vec tm = {0};
    vec zm = {0};
    vec dm = block->half[end] * dz->x[end];
    for (int k = 0; k < problem->used[i].jerk; k++, row++) {
        vec form =
            root * jerk_value(row, dz->x[end], dz->accel[end], dz->input[end]);
        const vec dq[2] = {dm + form, dm - form};
        predict_sides(row, dq, scan);
        const vec *step = row->dual_step;
        const vec *inverse = row->inverse;
        add_two(row->coef,
                root * (step[1] - step[0]),
                root * (inverse[0] - inverse[1]),
                slopes);
        tm -= step[0] + step[1];
        zm += inverse[0] + inverse[1];
    }
    slopes->corr.x += tm * block->half[end];
    slopes->cent.x += zm * block->half[end];
}

static inline void predict_jerk(struct problem *problem,
                                int i,
                                const struct block *block,
                                const struct change *dz,
                                struct scan *scan,
                                struct two_slopes *all) {
    struct end_slopes first, last;
    clear_two(&first);
    predict_jerk_end(problem, i, 0, block, dz, scan, &first);
    add_start_slope(&all->corr, &first.corr);
    add_start_slope(&all->cent, &first.cent);
    clear_two(&last);
    predict_jerk_end(problem, i, 1, block, dz, scan, &last);
    add_end_slope(&all->corr, &last.corr, block->length);
    add_end_slope(&all->cent, &last.cent, block->length);
}

/* So many acceleration rows, for the change (x, accel) of the state they read.
 */
static inline void predict_acc(two_sided *row,
                               int count,
                               vec x,
                               vec accel,
                               struct scan *scan,
                               struct end_slopes *slopes) {
    for (int k = 0; k < count; k++, row++) {
        vec form = acc_value(row, x, accel);
        const vec dq[2] = {form, -form};
        predict_sides(row, dq, scan);
        vec t = row->dual_step[1] - row->dual_step[0];
        vec z = row->inverse[0] - row->inverse[1];
        slopes->corr.x += t * row->coef[0];
        slopes->corr.accel += t * row->coef[1];
        slopes->cent.x += z * row->coef[0];
        slopes->cent.accel += z * row->coef[1];
    }
}

static inline void predict_accs(struct problem *problem,
                                int i,
                                vec length,
                                const struct change *dz,
                                struct scan *scan,
                                struct two_slopes *all) {
    const struct used *used = &problem->used[i];
    struct end_slopes start, middle;
    vec x, accel;
    clear_two(&start);
    predict_acc(acc_rows_of(problem, i),
                acc_used(used),
                dz->x[0],
                dz->accel[0],
                scan,
                &start);
    add_start_slope(&all->corr, &start.corr);
    add_start_slope(&all->cent, &start.cent);
    clear_two(&middle);
    middle_of(length, dz->x, dz->accel, dz->input, &x, &accel);
    predict_acc(mid_rows_of(problem, i),
                mid_used(used),
                x,
                accel,
                scan,
                &middle);
    add_middle_slope(&all->corr, &middle.corr, length);
    add_middle_slope(&all->cent, &middle.cent, length);
}

static inline void predict_one(struct problem *problem,
                               int i,
                               const struct change *dz,
                               struct scan *scan,
                               struct two_slopes *all) {
    const struct used *used = &problem->used[i];
    struct one_sided *row = one_rows_of(problem, i) + used->first;
    for (int n = used->first; n < used->end; n++, row++) {
        vec dq = one_value(row, dz->x[0], dz->accel[0], dz->input);
        vec k1;
        side_predict(dq,
                     row->residual,
                     row->slack,
                     row->dual,
                     row->inverse,
                     scan,
                     &k1);
        row->dual_step = k1;
        all->corr.x -= k1 * row->coef[0];
        all->corr.accel -= k1 * row->coef[1];
        all->cent.x += row->inverse * row->coef[0];
        all->cent.accel += row->inverse * row->coef[1];
        for (int k = 0; k < 2 && n >= FIRST_C_ROW; k++) {
            all->corr.input[k] -= k1 * row->coef[2 + k];
            all->cent.input[k] += row->inverse * row->coef[2 + k];
        }
    }
}

/* The predictor's step in all rows, and the gradients that corrector and
 * centring add. */
static struct scan predict(struct problem *problem) {
    struct scan scan = {.pl = set1(-1.0)};
    for (int i = 0; i < problem->blocks; i++) {
        int k = i * LANES;
        const struct block *block = &problem->block[i];
        const struct change dz = change_at(problem, k, block->length);
        struct two_slopes all;
        clear_slopes(&all.corr);
        clear_slopes(&all.cent);
        predict_jerk(problem, i, block, &dz, &scan, &all);
        predict_accs(problem, i, block->length, &dz, &scan, &all);
        predict_one(problem, i, &dz, &scan, &all);
        store_slopes(problem, i, &all.corr, &problem->corr);
        store_slopes(problem, i, &all.cent, &problem->cent);
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
                                vec *slack_drop,
                                vec *dual_step) {
    vec drop = residual + dq;
    vec dual_change = dual * drop * inverse - dual + mu * inverse - *dual_step;
    *slack_drop = drop;
    *dual_step = dual_change;
    scan->ps = vmax(scan->ps, drop * inverse);
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
                     &row->slack_drop[k],
                     &row->dual_step[k]);
    }
}

static inline void correct_jerk(struct problem *problem,
                                int i,
                                const struct change *dz,
                                vec mu,
                                struct scan *scan) {
    const struct block *block = &problem->block[i];
    for (int end = 0; end < 2; end++) {
        two_sided *row = jerk_rows_of(problem, i, end);
        vec dm = block->half[end] * dz->x[end];
        for (int k = 0; k < problem->used[i].jerk; k++, row++) {
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

static inline void correct_one(struct problem *problem,
                               int i,
                               const struct change *dz,
                               vec mu,
                               struct scan *scan) {
    const struct used *used = &problem->used[i];
    struct one_sided *row = one_rows_of(problem, i) + used->first;
    for (int k = used->first; k < used->end; k++, row++) {
        side_correct(one_value(row, dz->x[0], dz->accel[0], dz->input),
                     row->residual,
                     row->dual,
                     row->inverse,
                     mu,
                     scan,
                     &row->slack_drop,
                     &row->dual_step);
    }
}

static struct scan correct(struct problem *problem, double sigma_mu) {
    struct scan scan = {0};
    const vec mu = set1(sigma_mu);
    for (int i = 0; i < problem->blocks; i++) {
        vec length = problem->block[i].length;
        const struct used *used = &problem->used[i];
        const struct change dz = change_at(problem, i * LANES, length);
        correct_jerk(problem, i, &dz, mu, &scan);
        correct_acc(acc_rows_of(problem, i),
                    acc_used(used),
                    dz.x[0],
                    dz.accel[0],
                    mu,
                    &scan);
        vec x, accel;
        middle_of(length, dz.x, dz.accel, dz.input, &x, &accel);
        correct_acc(mid_rows_of(problem, i),
                    mid_used(used),
                    x,
                    accel,
                    mu,
                    &scan);
        correct_one(problem, i, &dz, mu, &scan);
    }
    return scan;
}

static inline void move_rows(two_sided *row,
                             int count,
                             double ap,
                             double ad,
                             vec *gap) {
    for (int k = 0; k < count; k++, row++) {
        for (int side = 0; side < 2; side++) {
            row->slack[side] -= ap * row->slack_drop[side];
            row->dual[side] += ad * row->dual_step[side];
            *gap += row->slack[side] * row->dual[side];
        }
    }
}

/* The step; returns the gap behind it. */
static double move(struct problem *problem, double ap, double ad) {
    for (int i = 0; i < problem->blocks * LANES; i++) {
        problem->x[i] += ap * problem->dx[i];
        problem->accel[i] += ap * problem->du[i];
        problem->input[0][i] += ap * problem->dc[0][i];
        problem->input[1][i] += ap * problem->dc[1][i];
    }
    vec gap = {0};
    for (int i = 0; i < problem->blocks; i++) {
        const struct used *used = &problem->used[i];
        move_rows(jerk_rows_of(problem, i, 0), used->jerk, ap, ad, &gap);
        move_rows(jerk_rows_of(problem, i, 1), used->jerk, ap, ad, &gap);
        move_rows(acc_rows_of(problem, i), acc_used(used), ap, ad, &gap);
        move_rows(mid_rows_of(problem, i), mid_used(used), ap, ad, &gap);
        struct one_sided *one = one_rows_of(problem, i) + used->first;
        for (int k = used->first; k < used->end; k++, one++) {
            one->slack -= ap * one->slack_drop;
            one->dual += ad * one->dual_step;
            gap += one->slack * one->dual;
        }
    }
    return sum(gap);
}
#endif
