/* The window's optimisation problem: states, inputs and rows of each stage.
 *
 * Scaled quantities: x = v^2/F^2, accel = a/F^2 and input = (d a/ds)/F^2, with
 * F the speed scale of the machine; docs/explanation/planner.md calls them x, u
 * and c. Lengths stay mm.  Over an interval the input changes linearly from
 * input[0] to input[1], which are free: the jerk limit can hold at both ends.
 * A bow is given beside them: at the share z of the interval the input has
 * bow (6 z (1 - z) - 1) more.  The state behind the interval does not depend
 * on it.
 */
#ifndef JERK_PROBLEM_H
#define JERK_PROBLEM_H
#include <stdbool.h>
#include "jerk/state/api.h"

#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define JERK_AVX2 /* some code is also built for AVX2 */
#endif
#define LANES 4
#define THIRD (1.0 / 3.0) /* in loops: a division takes longer */
typedef double vec __attribute__((vector_size(32)));
typedef long long ivec __attribute__((vector_size(32)));
typedef double pair __attribute__((vector_size(16)));

/* What the rows of LANES stages share.  At either end the jerk rows read root
 * (b z) + half x_t <= bound, with the tangent of root x^(-1/2) at the present
 * x_t. */
typedef struct block {
    vec length, x[2], accel[2],
        input[2]; /* at the start and the end of the stages */
    vec bent[2];  /* input there, less the bow */
    vec root[2], half[2], bound[2];
} block;

typedef struct two_sided { /* |b z| <= 1 (accelerations), +-b z + m <= 1.5
                              (jerks); z: x, u, c at one end */
    vec coef[3];
    vec slack[2];
    vec dual[2];
    vec inverse[2];
    vec residual[2];
    vec slack_drop[2];
    vec dual_step[2];
} two_sided;

/* Rows of a block that say something: of jerk at either end of its stages, of
 * acceleration at their starts and in their middles, caps and floors.  All but
 * those of jerk are left out as long as the motion is far from their limits. */
typedef struct used {
    int jerk, acc, mid;
    bool quick;     /* acceleration may jump from interval to interval: its rows
                       are there from the start */
    bool far;       /* acceleration: its rows are left out */
    int first, end; /* one-sided rows: caps are left out where x is far below
                       them, floors where it is far above */
} used;

/* Rows of acceleration that are there. */
static inline int acc_used(const used *used) {
    return used->far ? 0 : used->acc;
}
static inline int mid_used(const used *used) {
    return used->far ? 0 : used->mid;
}

typedef struct one_sided { /* b (x, u, c0, c1) <= bound */
    vec coef[4], bound, slack, dual, inverse, residual, slack_drop, dual_step;
} one_sided;

/* Caps of x at the start and at the control points behind it and ahead of the
 * end: x keeps them everywhere between. */
enum {
    ROW_CAP,
    ROW_RISE,
    FIRST_C_ROW,
    ROW_FALL = FIRST_C_ROW,
    FIRST_FLOOR,
    ROW_MID_FLOOR = FIRST_FLOOR,
    ROW_FLOOR,
    ONE_SIDED_ROWS
};

/* Stage cost of the Newton step. */
typedef struct stage_cost {
    double *xx;
    double *xu;
    double *uu;
    double *xc[2];
    double *uc[2];
    double *cc[3]; /* c0 c0, c0 c1, c1 c1 */
} stage_cost;

typedef struct stage_grad {
    double *x, *accel, *input[2];
} stage_grad;

/* Feedback of two stages, one of each half: dc = k (dx, du) + what is free. */
typedef struct gain {
    pair length, kx[2], ku[2];
    pair xx, xu, ux, uu; /* of the state further out, by the state */
    pair inverse[3];     /* of the Hessian by dc, as cc */
} gain;

/* The state in the middle of the window by the gradients there: the inverse of
 * the Hessian. */
typedef struct joined {
    double xx, xu, uu;
} joined;

typedef struct problem {
    int count, first, blocks, axes; /* intervals; first stage with rows; blocks
                                       of LANES stages; axes that move */
    int middle; /* the stages ahead of it have costs and gradients as they are
                   driven backwards: turn_totals; a whole block, or `first` */
    int axis[JERK_AXES]; /* which they are */
    bool from_standstill;
    double *lengths, *x, *accel, *input[2]; /* stages */
    double *dx, *du, *dc[2];
    double *bow;         /* stages: what the input has more in the middle */
    double *guess;       /* knots: x the floors refer to */
    double *cap;         /* knots: x of a guess by feed, machine and joints */
    double *most;        /* knots: a guess is no faster: caps, and the bend */
    double *brake;       /* 1 over the square of the acceleration that all axes
                            can follow */
    double *slope;       /* objective: minus its gradient by x, times x^(3/2) */
    double *weight;      /* ... and the rest of it, at x = 0 */
    double *pull;        /* objective: towards x = weight / pull; 0: none */
    double *root[2];     /* scale of the jerk rows at both ends */
    double *calm;        /* quadratic cost of c0 and c1 */
    double *on;          /* 1 where a stage has jerk rows */
    struct block *block; /* of the present iterate */
    struct used *used;
    two_sided *jerk, *acc,
        *mid; /* [block][rows]; mid: accelerations in the middle of stages */
    struct one_sided *one;
    struct stage_cost cost;
    struct stage_grad grad, corr,
        cent; /* affine gradient; corrector and centring parts */
    struct gain *gain;
    pair (*free)[2]; /* of as many: c without feedback */
    struct joined joined;
    double x0, u0;
    double terminal; /* 1.5 h of the last interval */
    double convex;   /* what keeps a cost of c^2 positive: 1, less where c is
                        large (very slow machines) */
    int iterations;
    double pause; /* the solver stops once at this gap; 0: it does not */
    bool paused;  /* it has, and goes on from there */
    double ends;  /* it has ended below this gap */
    bool stops;   /* the way to rest is looked for, not the fastest motion */
    bool whole;   /* all caps and floors: a stop, or many windows fail */
    double missed, dual; /* shares of the first residuals that are left */
    bool solved;
    double gap;
} problem;

/* Rows of block i: of jerk at one end of the stages, of acceleration, of
 * acceleration in the middle, and caps and floors. */
static inline two_sided *jerk_rows_of(const struct problem *problem,
                                      int i,
                                      int end) {
    int first = i * 2 * problem->axes;
    return &problem->jerk[first + end * problem->axes];
}
static inline two_sided *acc_rows_of(const struct problem *problem, int i) {
    return &problem->acc[i * 2 * problem->axes];
}
static inline two_sided *mid_rows_of(const struct problem *problem, int i) {
    return &problem->mid[i * problem->axes];
}
static inline struct one_sided *one_rows_of(const struct problem *problem,
                                            int i) {
    return &problem->one[i * ONE_SIDED_ROWS];
}

/* What c0 and c1 make of the state at the start of an interval h. */
static inline double x_after(double length,
                             double x,
                             double accel,
                             double c0,
                             double c1) {
    return x + 2.0 * length * accel + length * length * (2.0 * c0 + c1) / 3.0;
}
static inline double accel_after(double length,
                                 double accel,
                                 double c0,
                                 double c1) {
    return accel + 0.5 * length * (c0 + c1);
}

/* The other way round: c0 and c1 that lead from one state to the other. */
static inline void inputs_between(double length,
                                  double x,
                                  double accel,
                                  double x1,
                                  double accel1,
                                  double input[2]) {
    double mean = (x1 - x) / length;
    double rise = 3.0 * (mean - 2.0 * accel) / length;
    double both = 2.0 * (accel1 - accel) / length;
    input[0] = rise - both;
    input[1] = 2.0 * both - rise;
}
#endif
