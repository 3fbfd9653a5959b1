/* Slacks and multipliers that the solver starts with, or goes on with. */
#ifndef JERK_IPM_START_H
#define JERK_IPM_START_H
#include <math.h>
#include "jerk/solver/interior_point_gather.h"
#include "maths/order.h"

/* Scale of the jerk rows: sqrt(x) of the guess. */
static void set_scale(struct problem *problem) {
    for (int k = 0; k < problem->blocks * LANES; k++) {
        problem->root[0][k] = problem->root[1][k] = 1.0;
        if (problem->on[k] == 0.0) {
            continue;
        }
        const double *guess = problem->guess + k;
        const double *x = problem->x + k;
        problem->root[0][k] = sqrt(greater(x[0], guess[0]));
        problem->root[1][k] = sqrt(greater(x[1], guess[1]));
    }
}

static inline void start_side(vec value,
                              vec bound,
                              double mu,
                              vec *slack,
                              vec *dual) {
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
        * jerk_value(row, block->x[end], block->accel[end], block->bent[end]);
    side[0] = tangent + value;
    side[1] = tangent - value;
}

static inline void start_sides(two_sided *row,
                               const vec value[2],
                               vec bound,
                               double mu) {
    for (int k = 0; k < 2; k++) {
        vec *dual = &row->dual[k];
        start_side(value[k], bound, mu, &row->slack[k], dual);
    }
}

static void start_jerk(const struct problem *problem,
                       int i,
                       const struct block *block,
                       double mu) {
    for (int end = 0; end < 2; end++) {
        two_sided *row = jerk_rows_of(problem, i, end);
        for (int k = 0; k < problem->used[i].jerk; k++, row++) {
            vec value[2];
            jerk_sides(block, end, row, value);
            start_sides(row, value, block->bound[end], mu);
        }
    }
}

/* So many acceleration rows that read the state (x, accel). */
static inline void start_acc(two_sided *row,
                             int count,
                             vec x,
                             vec accel,
                             double mu) {
    for (int k = 0; k < count; k++, row++) {
        vec form = acc_value(row, x, accel);
        const vec value[2] = {form, -form};
        start_sides(row, value, set1(1.0), mu);
    }
}

/* The one-sided rows from..to of block i begin. */
static void start_one(const struct problem *problem,
                      int i,
                      const struct block *block,
                      int from,
                      int to,
                      double mu) {
    struct one_sided *row = one_rows_of(problem, i) + from;
    for (int k = from; k < to; k++, row++) {
        vec value = one_value(row, block->x[0], block->accel[0], block->input);
        start_side(value, row->bound, mu, &row->slack, &row->dual);
    }
}

/* Whether one of the rows from..to has come above so many times its bound. */
static inline bool above(const struct problem *problem,
                         int i,
                         const struct block *block,
                         int from,
                         int to,
                         double times) {
    const struct one_sided *row = one_rows_of(problem, i) + from;
    vec most = set1(-1.0);
    for (int k = from; k < to; k++, row++) {
        vec value = one_value(row, block->x[0], block->accel[0], block->input);
        most = vmax(most, value - times * row->bound);
    }
    return top(most) > 0.0;
}

/* Caps that were left out begin where x has come above such a share of them,
 * floors where it is below them over that share; false: neither. */
static inline bool take_in_one(const struct problem *problem,
                               int i,
                               const struct block *block,
                               double share,
                               double mu) {
    struct used *used = &problem->used[i];
    bool caps =
        used->first > 0 && above(problem, i, block, 0, FIRST_FLOOR, share);
    bool floors =
        used->end < ONE_SIDED_ROWS
        && above(problem, i, block, FIRST_FLOOR, ONE_SIDED_ROWS, 1.0 / share);
    if (caps) {
        start_one(problem, i, block, 0, FIRST_FLOOR, mu);
        used->first = 0;
    }
    if (floors) {
        start_one(problem, i, block, FIRST_FLOOR, ONE_SIDED_ROWS, mu);
        used->end = ONE_SIDED_ROWS;
    }
    return caps || floors;
}

/* Largest acceleration of block i over its limits: at the starts of its stages
 * and in their middles, at (x, accel). */
static inline double most_acc(const struct problem *problem,
                              int i,
                              const struct block *block,
                              vec x,
                              vec accel) {
    const struct used *used = &problem->used[i];
    const two_sided *row = acc_rows_of(problem, i);
    vec most = {0};
    for (int k = 0; k < used->acc; k++, row++) {
        vec form = acc_value(row, block->x[0], block->accel[0]);
        most = vmax(most, size_of(form));
    }
    row = mid_rows_of(problem, i);
    for (int k = 0; k < used->mid; k++, row++) {
        most = vmax(most, size_of(acc_value(row, x, accel)));
    }
    return top(most);
}

/* The rows of acceleration of block i begin. */
static inline void start_accs(const struct problem *problem,
                              int i,
                              const struct block *block,
                              vec x,
                              vec accel,
                              double mu) {
    const struct used *used = &problem->used[i];
    start_acc(acc_rows_of(problem, i),
              used->acc,
              block->x[0],
              block->accel[0],
              mu);
    start_acc(mid_rows_of(problem, i), used->mid, x, accel, mu);
}

/* Slacks of the guess, kept off the boundary, and multipliers on the central
 * path. */
static void start(struct problem *problem, double mu) {
    for (int i = 0; i < problem->blocks; i++) {
        struct block block;
        block_at(problem, i, &block);
        vec x, accel;
        middle_of(block.length, block.x, block.accel, block.input, &x, &accel);
        struct used *used = &problem->used[i];
        used->far = (problem->stops || !used->quick)
                    && most_acc(problem, i, &block, x, accel) < ROWS_FAR;
        if (!used->far) {
            start_accs(problem, i, &block, x, accel, mu);
        }
        start_jerk(problem, i, &block, mu);
        used->first = problem->whole ? 0 : FIRST_FLOOR;
        used->end = problem->whole ? ONE_SIDED_ROWS : FIRST_FLOOR;
        start_one(problem, i, &block, used->first, used->end, mu);
        take_in_one(problem, i, &block, ROWS_FAR, mu);
    }
}

/* Rows that were left out begin where the iterate has come above such a share
 * of their limits; false: nowhere. */
static bool take_in(struct problem *problem, double share, double mu) {
    bool any = false;
    for (int i = 0; i < problem->blocks; i++) {
        struct used *used = &problem->used[i];
        struct block block;
        vec x, accel;
        if (!used->far && used->first == 0 && used->end == ONE_SIDED_ROWS) {
            continue;
        }
        block_at(problem, i, &block);
        any = take_in_one(problem, i, &block, share, mu) || any;
        if (!used->far) {
            continue;
        }
        middle_of(block.length, block.x, block.accel, block.input, &x, &accel);
        used->far = !(most_acc(problem, i, &block, x, accel) > share);
        if (!used->far) {
            start_accs(problem, i, &block, x, accel, mu);
            any = true;
        }
    }
    if (any) {
        problem->missed = fmax(problem->missed, MISSED_SO);
    }
    return any;
}

/* Floors that were left out begin where x has fallen to where the tangents end;
 * false: nowhere. */
static bool catch_falling(struct problem *problem, double mu) {
    bool any = false;
    for (int i = 0; i < problem->blocks; i++) {
        struct used *used = &problem->used[i];
        int k = i * LANES;
        if (used->end == ONE_SIDED_ROWS) {
            continue;
        }
        vec low = LOWEST * load(problem->guess + k) * load(problem->on + k);
        if (top(low - load(problem->x + k)) > 0.0) {
            struct block block;
            block_at(problem, i, &block);
            start_one(problem, i, &block, FIRST_FLOOR, ONE_SIDED_ROWS, mu);
            used->end = ONE_SIDED_ROWS;
            any = true;
        }
    }
    return any;
}

/* Where the iterate misses a row of the jerk, its slack is as large as what is
 * missed: rows were tightened, or steps have become short. Left as small as
 * they are, such slacks would stop every step. */
static void reopen(struct problem *problem) {
    for (int i = 0; i < problem->blocks; i++) {
        struct block block;
        block_at(problem, i, &block);
        for (int end = 0; end < 2; end++) {
            two_sided *row = jerk_rows_of(problem, i, end);
            for (int k = 0; k < problem->used[i].jerk; k++, row++) {
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
#endif
