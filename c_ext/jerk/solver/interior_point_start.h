/* Slacks and multipliers that the solver starts with, or goes on with. */
#ifndef JERK_IPM_START_H
#define JERK_IPM_START_H
#include <math.h>
#include "jerk/solver/interior_point_gather.h"

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
#endif
