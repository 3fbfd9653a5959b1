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
#include "jerk/interior_point_stage.h"

#define LOWEST                                                                 \
    0.6 /* share of the guess at which tangents are taken at the least: slower \
           never gains */
#define TO_BOUNDARY 0.995
#define START_MU                                                               \
    2.0 /* of the objective: barrier of the first iterate, over all rows */
#define START_SLACK 0.3
#define CENTRED                                                                \
    0.1 /* least product of slack and multiplier, over what the step aims at   \
         */
#define GAP 3e-4 /* of the objective */
#define HOPELESS 1e6
#define EVEN                                                                   \
    10.0 /* of `calm`: cost of c1 - c0, so that c does not change within every \
            interval where nothing is gained by it */
#define LEAST_COST 1e-14
#define ROWS_MET 1e-6

static struct block block_at(const struct problem *problem, int i) {
    int k = i * LANES;
    struct block block;
    block.h = load(problem->h + k);
    block.x[0] = load(problem->x + k);
    block.u[0] = load(problem->u + k);
    block.c[0] = load(problem->c[0] + k);
    block.c[1] = load(problem->c[1] + k);
    end_state(block.h,
              block.x[0],
              block.u[0],
              block.c,
              &block.x[1],
              &block.u[1]);
    vec on = load(problem->on + k), off = 1.0 - on,
        low = LOWEST * load(problem->guess + k);
    for (int e = 0; e < 2; e++) {
        vec x = vmax(block.x[e], low) * on + off, t = 1.0 / root_of(x);
        block.root[e] = load(problem->root[e] + k);
        block.half[e] = 0.5 * on * block.root[e] * t / x;
        block.bound[e] = 1.5 * block.root[e] * t;
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

static inline void add_square(struct sums *sums, vec w, const vec *b) {
    vec wx = w * b[0], wu = w * b[1], wc = w * b[2];
    sums->xx += wx * b[0];
    sums->xu += wx * b[1];
    sums->uu += wu * b[1];
    sums->xc += wx * b[2];
    sums->uc += wu * b[2];
    sums->cc += wc * b[2];
}

/* Start of an iteration for one side of a row: residual, 1/slack; returns the
 * weight, `t` gets the gradient. */
static inline vec side(vec value,
                       vec bound,
                       vec s,
                       vec *l,
                       vec least,
                       vec *is,
                       vec *r,
                       vec *t) {
    *r = value - bound + s;
    *is = 1.0 / s;
    *l = vmax(*l, least * *is);
    vec w = *l * *is;
    *t = w * *r;
    return w;
}

/* Linear forms of a jerk row pair: q = root * (b . z), m = half * x. */
static void gather_jerk(const struct problem *problem,
                        int i,
                        const struct block *block,
                        struct totals *all,
                        vec least) {
    for (int e = 0; e < 2; e++) {
        struct sums both = {0}, *sums = &both;
        two_sided *row =
            &problem->jerk[i * 2 * problem->axes + e * problem->axes];
        vec m = block->half[e] * block->x[e], bound = block->bound[e], wm = {0},
            px = {0}, pu = {0}, pc = {0}, tm = {0}, root = block->root[e];
        for (int axis = 0; axis < problem->axes; axis++, row++) {
            vec q = root
                    * (row->b[0] * block->x[e] + row->b[1] * block->u[e]
                       + row->b[2] * block->c[e]),
                t1, t2;
            vec w1 = side(m + q,
                          bound,
                          row->s[0],
                          &row->l[0],
                          least,
                          &row->is[0],
                          &row->r[0],
                          &t1);
            vec w2 = side(m - q,
                          bound,
                          row->s[1],
                          &row->l[1],
                          least,
                          &row->is[1],
                          &row->r[1],
                          &t2);
            vec d = root * (w1 - w2), t = root * (t1 - t2);
            add_square(sums, root * root * (w1 + w2), row->b);
            px += d * row->b[0];
            pu += d * row->b[1];
            pc += d * row->b[2];
            sums->x += t * row->b[0];
            sums->u += t * row->b[1];
            sums->c += t * row->b[2];
            wm += w1 + w2;
            tm += t1 + t2;
        }
        sums->xx += block->half[e] * (block->half[e] * wm + 2.0 * px);
        sums->xu += pu * block->half[e];
        sums->xc += pc * block->half[e];
        sums->x += tm * block->half[e];
        if (e) {
            add_end(all, sums, block->h);
            add_end_gradient(all, sums, block->h);
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
    vec x, u;
    struct sums sums = {0};
    two_sided *row = &problem->mid[i * problem->axes];
    middle_state(block->h, block->x[0], block->u[0], block->c, &x, &u);
    for (int axis = 0; axis < problem->axes; axis++, row++) {
        vec q = row->b[0] * x + row->b[1] * u, t1, t2;
        vec w1 = side(q,
                      one,
                      row->s[0],
                      &row->l[0],
                      least,
                      &row->is[0],
                      &row->r[0],
                      &t1);
        vec w2 = side(-q,
                      one,
                      row->s[1],
                      &row->l[1],
                      least,
                      &row->is[1],
                      &row->r[1],
                      &t2);
        vec w = w1 + w2, t = t1 - t2;
        sums.xx += w * row->b[0] * row->b[0];
        sums.xu += w * row->b[0] * row->b[1];
        sums.uu += w * row->b[1] * row->b[1];
        sums.x += t * row->b[0];
        sums.u += t * row->b[1];
    }
    add_middle(all, &sums, block->h);
    add_middle_gradient(all, &sums, block->h);
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
        vec q = row->b[0] * block->x[0] + row->b[1] * block->u[0], t1, t2;
        vec w1 = side(q,
                      one,
                      row->s[0],
                      &row->l[0],
                      least,
                      &row->is[0],
                      &row->r[0],
                      &t1);
        vec w2 = side(-q,
                      one,
                      row->s[1],
                      &row->l[1],
                      least,
                      &row->is[1],
                      &row->r[1],
                      &t2);
        vec w = w1 + w2, t = t1 - t2;
        totals->xx += w * row->b[0] * row->b[0];
        totals->xu += w * row->b[0] * row->b[1];
        totals->uu += w * row->b[1] * row->b[1];
        totals->x += t * row->b[0];
        totals->u += t * row->b[1];
    }
}

static inline vec one_value(const struct one_sided *row,
                            vec x,
                            vec u,
                            vec c0,
                            vec c1) {
    return row->b[0] * x + row->b[1] * u + row->b[2] * c0 + row->b[3] * c1;
}

static void gather_one(const struct problem *problem,
                       int i,
                       const struct block *block,
                       struct totals *totals,
                       vec least) {
    struct one_sided *row = &problem->one[i * ONE_SIDED_ROWS];
    for (int axis = 0; axis < ONE_SIDED_ROWS; axis++, row++) {
        vec q = one_value(row,
                          block->x[0],
                          block->u[0],
                          block->c[0],
                          block->c[1]),
            t;
        vec w = side(q,
                     row->bound,
                     row->s,
                     &row->l,
                     least,
                     &row->is,
                     &row->r,
                     &t),
            wx = w * row->b[0], wu = w * row->b[1];
        totals->xx += wx * row->b[0];
        totals->xu += wx * row->b[1];
        totals->uu += wu * row->b[1];
        totals->x += t * row->b[0];
        totals->u += t * row->b[1];
        if (axis < FIRST_C_ROW) {
            continue;
        }
        for (int count = 0; count < 2; count++) {
            totals->xc[count] += wx * row->b[2 + count];
            totals->uc[count] += wu * row->b[2 + count];
            totals->c[count] += t * row->b[2 + count];
        }
        totals->cc[0] += w * row->b[2] * row->b[2];
        totals->cc[1] += w * row->b[2] * row->b[3];
        totals->cc[2] += w * row->b[3] * row->b[3];
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
        vec calm = load(problem->calm + k), even = EVEN * calm;
        for (int count = 0; count < 2; count++) {
            store(problem->cost.xc[count] + k, totals.xc[count]);
            store(problem->cost.uc[count] + k, totals.uc[count]);
            store(problem->cost.cc[2 * count] + k,
                  totals.cc[2 * count] + calm + even
                      + LEAST_COST * problem->convex);
            store(problem->grad.c[count] + k,
                  totals.c[count] + calm * bl.c[count]
                      + even * (bl.c[count] - bl.c[1 - count]));
        }
        store(problem->cost.cc[1] + k, totals.cc[1] - even);
        store(problem->grad.x + k, totals.x - load(problem->weight + k));
        store(problem->grad.u + k, totals.u);
    }
}

/* Step of one side: slack and multiplier for a change `dq` of the row; centring
 * `sigma_mu`, old product in ds. */
typedef struct scan {
    vec ps, pl;             /* largest -ds/s, -dl/l */
    vec sl, dsl, sdl, dsdl; /* sums of products */
} scan;

static inline void side_predict(vec dq,
                                vec r,
                                vec s,
                                vec l,
                                vec is,
                                struct scan *scan,
                                vec *ds,
                                vec *corr) {
    vec d = -r - dq, rs = d * is, dl = -l - l * rs;
    *ds = d;
    *corr = d * dl * is;
    scan->ps = vmax(scan->ps, -rs);
    scan->pl = vmax(scan->pl, 1.0 + rs);
    scan->sl += s * l;
    scan->dsl += d * l;
    scan->sdl += s * dl;
    scan->dsdl += d * dl;
}

/* Adds to the gradients of corrector (k) and centring (z). */
static inline void two_gradients(const vec *b,
                                 vec t,
                                 vec z,
                                 struct sums *corr,
                                 struct sums *cent) {
    corr->x += t * b[0];
    corr->u += t * b[1];
    corr->c += t * b[2];
    cent->x += z * b[0];
    cent->u += z * b[1];
    cent->c += z * b[2];
}

/* A step of the states and inputs: index 0 of x, u at the start, 1 at the end.
 */
typedef struct change {
    vec x[2], u[2], c[2];
} change;

static inline struct change change_at(const struct problem *problem,
                                      int k,
                                      vec h) {
    struct change change = {
        .x = {load(problem->dx + k)},
        .u = {load(problem->du + k)},
        .c = {load(problem->dc[0] + k), load(problem->dc[1] + k)}};
    end_state(h,
              change.x[0],
              change.u[0],
              change.c,
              &change.x[1],
              &change.u[1]);
    return change;
}

static void predict_jerk(struct problem *problem,
                         int i,
                         const struct block *block,
                         const struct change *dz,
                         struct scan *scan,
                         struct totals *corr,
                         struct totals *cent) {
    for (int e = 0; e < 2; e++) {
        struct sums one = {0}, two = {0};
        two_sided *row =
            &problem->jerk[i * 2 * problem->axes + e * problem->axes];
        vec root = block->root[e], tm = {0}, zm = {0};
        vec dm = block->half[e] * dz->x[e];
        for (int axis = 0; axis < problem->axes; axis++, row++) {
            vec dq = root
                     * (row->b[0] * dz->x[e] + row->b[1] * dz->u[e]
                        + row->b[2] * dz->c[e]),
                k1, k2;
            side_predict(dm + dq,
                         row->r[0],
                         row->s[0],
                         row->l[0],
                         row->is[0],
                         scan,
                         &row->ds[0],
                         &k1);
            side_predict(dm - dq,
                         row->r[1],
                         row->s[1],
                         row->l[1],
                         row->is[1],
                         scan,
                         &row->ds[1],
                         &k2);
            row->dl[0] = k1;
            row->dl[1] = k2;
            two_gradients(row->b,
                          root * (k2 - k1),
                          root * (row->is[0] - row->is[1]),
                          &one,
                          &two);
            tm -= k1 + k2;
            zm += row->is[0] + row->is[1];
        }
        one.x += tm * block->half[e];
        two.x += zm * block->half[e];
        if (e) {
            add_end_gradient(corr, &one, block->h);
            add_end_gradient(cent, &two, block->h);
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
        vec dq = row->b[0] * dz->x[0] + row->b[1] * dz->u[0], k1, k2;
        side_predict(dq,
                     row->r[0],
                     row->s[0],
                     row->l[0],
                     row->is[0],
                     scan,
                     &row->ds[0],
                     &k1);
        side_predict(-dq,
                     row->r[1],
                     row->s[1],
                     row->l[1],
                     row->is[1],
                     scan,
                     &row->ds[1],
                     &k2);
        row->dl[0] = k1;
        row->dl[1] = k2;
        vec t = k2 - k1, z = row->is[0] - row->is[1];
        corr->x += t * row->b[0];
        corr->u += t * row->b[1];
        cent->x += z * row->b[0];
        cent->u += z * row->b[1];
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
    struct sums one = {0}, two = {0};
    vec x, u;
    middle_state(block->h, dz->x[0], dz->u[0], dz->c, &x, &u);
    for (int axis = 0; axis < problem->axes; axis++, row++) {
        vec dq = row->b[0] * x + row->b[1] * u, k1, k2;
        side_predict(dq,
                     row->r[0],
                     row->s[0],
                     row->l[0],
                     row->is[0],
                     scan,
                     &row->ds[0],
                     &k1);
        side_predict(-dq,
                     row->r[1],
                     row->s[1],
                     row->l[1],
                     row->is[1],
                     scan,
                     &row->ds[1],
                     &k2);
        row->dl[0] = k1;
        row->dl[1] = k2;
        two_gradients(row->b, k2 - k1, row->is[0] - row->is[1], &one, &two);
    }
    add_middle_gradient(corr, &one, block->h);
    add_middle_gradient(cent, &two, block->h);
}

static void predict_one(struct problem *problem,
                        int i,
                        const struct change *dz,
                        struct scan *scan,
                        struct totals *corr,
                        struct totals *cent) {
    struct one_sided *row = &problem->one[i * ONE_SIDED_ROWS];
    for (int axis = 0; axis < ONE_SIDED_ROWS; axis++, row++) {
        vec dq = one_value(row, dz->x[0], dz->u[0], dz->c[0], dz->c[1]), k1;
        side_predict(dq, row->r, row->s, row->l, row->is, scan, &row->ds, &k1);
        row->dl = k1;
        corr->x -= k1 * row->b[0];
        corr->u -= k1 * row->b[1];
        cent->x += row->is * row->b[0];
        cent->u += row->is * row->b[1];
        for (int count = 0; count < 2; count++) {
            corr->c[count] -= k1 * row->b[2 + count];
            cent->c[count] += row->is * row->b[2 + count];
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
        const struct change dz = change_at(problem, k, bl.h);
        struct totals corr = {0}, cent = {0};
        predict_jerk(problem, i, &bl, &dz, &scan, &corr, &cent);
        predict_acc(problem, i, &dz, &scan, &corr, &cent);
        predict_mid(problem, i, &bl, &dz, &scan, &corr, &cent);
        predict_one(problem, i, &dz, &scan, &corr, &cent);
        store(problem->corr.x + k, corr.x);
        store(problem->corr.u + k, corr.u);
        store(problem->cent.x + k, cent.x);
        store(problem->cent.u + k, cent.u);
        for (int count = 0; count < 2; count++) {
            store(problem->corr.c[count] + k, corr.c[count]);
            store(problem->cent.c[count] + k, cent.c[count]);
        }
    }
    return scan;
}

static void combine(struct problem *problem, double sigma_mu) {
    for (int i = 0; i < problem->blocks * LANES; i++) {
        problem->grad.x[i] +=
            problem->corr.x[i] + sigma_mu * problem->cent.x[i];
        problem->grad.u[i] +=
            problem->corr.u[i] + sigma_mu * problem->cent.u[i];
        for (int count = 0; count < 2; count++) {
            problem->grad.c[count][i] += problem->corr.c[count][i]
                                         + sigma_mu * problem->cent.c[count][i];
        }
    }
}

/* The combined step of one side; `dl` holds the corrector's ds dl / s. */
static inline void side_correct(vec dq,
                                vec r,
                                vec s,
                                vec l,
                                vec is,
                                vec mu,
                                struct scan *scan,
                                vec *ds,
                                vec *dl) {
    vec d = -r - dq;
    vec e = -l - l * d * is + mu * is - *dl;
    *ds = d;
    *dl = e;
    scan->ps = vmax(scan->ps, -d * is);
    scan->pl = vmax(scan->pl, -e / l);
    (void)s;
}

static struct scan correct(struct problem *problem, double sigma_mu) {
    struct scan scan = {0};
    const vec mu = set1(sigma_mu);
    for (int i = 0; i < problem->blocks; i++) {
        int k = i * LANES;
        const struct block bl = problem->block[i];
        const struct change dz = change_at(problem, k, bl.h);
        for (int e = 0; e < 2; e++) {
            two_sided *row =
                &problem->jerk[i * 2 * problem->axes + e * problem->axes];
            vec dm = bl.half[e] * dz.x[e];
            for (int axis = 0; axis < problem->axes; axis++, row++) {
                vec dq = bl.root[e]
                         * (row->b[0] * dz.x[e] + row->b[1] * dz.u[e]
                            + row->b[2] * dz.c[e]);
                side_correct(dm + dq,
                             row->r[0],
                             row->s[0],
                             row->l[0],
                             row->is[0],
                             mu,
                             &scan,
                             &row->ds[0],
                             &row->dl[0]);
                side_correct(dm - dq,
                             row->r[1],
                             row->s[1],
                             row->l[1],
                             row->is[1],
                             mu,
                             &scan,
                             &row->ds[1],
                             &row->dl[1]);
            }
        }
        two_sided *row = &problem->acc[i * problem->acc_sets * problem->axes];
        for (int axis = 0; axis < problem->acc_sets * problem->axes;
             axis++, row++) {
            vec dq = row->b[0] * dz.x[0] + row->b[1] * dz.u[0];
            side_correct(dq,
                         row->r[0],
                         row->s[0],
                         row->l[0],
                         row->is[0],
                         mu,
                         &scan,
                         &row->ds[0],
                         &row->dl[0]);
            side_correct(-dq,
                         row->r[1],
                         row->s[1],
                         row->l[1],
                         row->is[1],
                         mu,
                         &scan,
                         &row->ds[1],
                         &row->dl[1]);
        }
        vec xm, um;
        middle_state(bl.h, dz.x[0], dz.u[0], dz.c, &xm, &um);
        row = &problem->mid[i * problem->axes];
        for (int axis = 0; axis < problem->axes; axis++, row++) {
            vec dq = row->b[0] * xm + row->b[1] * um;
            side_correct(dq,
                         row->r[0],
                         row->s[0],
                         row->l[0],
                         row->is[0],
                         mu,
                         &scan,
                         &row->ds[0],
                         &row->dl[0]);
            side_correct(-dq,
                         row->r[1],
                         row->s[1],
                         row->l[1],
                         row->is[1],
                         mu,
                         &scan,
                         &row->ds[1],
                         &row->dl[1]);
        }
        struct one_sided *one = &problem->one[i * ONE_SIDED_ROWS];
        for (int axis = 0; axis < ONE_SIDED_ROWS; axis++, one++) {
            vec dq = one_value(one, dz.x[0], dz.u[0], dz.c[0], dz.c[1]);
            side_correct(dq,
                         one->r,
                         one->s,
                         one->l,
                         one->is,
                         mu,
                         &scan,
                         &one->ds,
                         &one->dl);
        }
    }
    return scan;
}

/* The step; returns the gap behind it. */
static double move(struct problem *problem, double ap, double ad) {
    for (int i = 0; i < problem->blocks * LANES; i++) {
        problem->x[i] += ap * problem->dx[i];
        problem->u[i] += ap * problem->du[i];
        problem->c[0][i] += ap * problem->dc[0][i];
        problem->c[1][i] += ap * problem->dc[1][i];
    }
    int two = problem->blocks * 2 * problem->axes,
        acc = problem->blocks * problem->acc_sets * problem->axes,
        one = problem->blocks * ONE_SIDED_ROWS;
    vec gap = {0};
    int mid = problem->blocks * problem->axes;
    for (int i = 0; i < two + acc + mid; i++) {
        two_sided *row = i < two         ? &problem->jerk[i]
                         : i < two + acc ? &problem->acc[i - two]
                                         : &problem->mid[i - two - acc];
        for (int side = 0; side < 2; side++) {
            row->s[side] += ap * row->ds[side];
            row->l[side] += ad * row->dl[side];
            gap += row->s[side] * row->l[side];
        }
    }
    for (int i = 0; i < one; i++) {
        problem->one[i].s += ap * problem->one[i].ds;
        problem->one[i].l += ad * problem->one[i].dl;
        gap += problem->one[i].s * problem->one[i].l;
    }
    return sum(gap);
}

static void start_side(vec value, vec bound, double mu, vec *s, vec *l) {
    *s = vmax(bound - value, set1(START_SLACK));
    *l = mu / *s;
}

/* Sides of an axis' jerk row at one end of the stages of a block: both at most
 * the bound. */
static inline void jerk_sides(const struct block *block,
                              int e,
                              const two_sided *row,
                              vec side[2]) {
    vec m = block->half[e] * block->x[e],
        q = block->root[e]
            * (row->b[0] * block->x[e] + row->b[1] * block->u[e]
               + row->b[2] * block->c[e]);
    side[0] = m + q;
    side[1] = m - q;
}

/* Slacks of the guess, kept off the boundary, and multipliers on the central
 * path. */
static void start(struct problem *problem, double mu) {
    for (int i = 0; i < problem->blocks; i++) {
        struct block block = block_at(problem, i);
        for (int e = 0; e < 2; e++) {
            two_sided *row =
                &problem->jerk[i * 2 * problem->axes + e * problem->axes];
            for (int axis = 0; axis < problem->axes; axis++, row++) {
                vec side[2];
                jerk_sides(&block, e, row, side);
                for (int count = 0; count < 2; count++) {
                    start_side(side[count],
                               block.bound[e],
                               mu,
                               &row->s[count],
                               &row->l[count]);
                }
            }
        }
        two_sided *row = &problem->acc[i * problem->acc_sets * problem->axes];
        for (int axis = 0; axis < problem->acc_sets * problem->axes;
             axis++, row++) {
            vec q = row->b[0] * block.x[0] + row->b[1] * block.u[0];
            start_side(q, set1(1.0), mu, &row->s[0], &row->l[0]);
            start_side(-q, set1(1.0), mu, &row->s[1], &row->l[1]);
        }
        vec xm, um;
        middle_state(block.h, block.x[0], block.u[0], block.c, &xm, &um);
        row = &problem->mid[i * problem->axes];
        for (int axis = 0; axis < problem->axes; axis++, row++) {
            vec q = row->b[0] * xm + row->b[1] * um;
            start_side(q, set1(1.0), mu, &row->s[0], &row->l[0]);
            start_side(-q, set1(1.0), mu, &row->s[1], &row->l[1]);
        }
        struct one_sided *one = &problem->one[i * ONE_SIDED_ROWS];
        for (int axis = 0; axis < ONE_SIDED_ROWS; axis++, one++) {
            start_side(
                one_value(one, block.x[0], block.u[0], block.c[0], block.c[1]),
                one->bound,
                mu,
                &one->s,
                &one->l);
        }
    }
}

/* Rows were tightened: where the iterate misses one, its slack is as large as
 * what is missed. Left as small as they were, they would stop every step. */
static void reopen(struct problem *problem) {
    for (int i = 0; i < problem->blocks; i++) {
        struct block block = block_at(problem, i);
        for (int e = 0; e < 2; e++) {
            two_sided *row =
                &problem->jerk[i * 2 * problem->axes + e * problem->axes];
            for (int axis = 0; axis < problem->axes; axis++, row++) {
                vec side[2];
                jerk_sides(&block, e, row, side);
                for (int count = 0; count < 2; count++) {
                    row->s[count] =
                        vmax(row->s[count], side[count] - block.bound[e]);
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
bool IPM_SOLVE(struct problem *b, int max_iterations) {
    int rows =
        b->blocks * LANES * (2 * (3 + b->acc_sets) * b->axes + ONE_SIDED_ROWS);
    double least = 0.0;
    if (!b->paused) {
        set_scale(b);
        start(b, START_MU / rows);
        b->iterations = 0;
        b->missed = b->dual = 1.0;
    } else {
        reopen(b);
    }
    b->paused = false;
    for (; b->iterations < max_iterations; b->iterations++) {
        gather(b, set1(least));
        if (!riccati_factor(b)) {
            return false;
        }
        riccati_solve(b, &b->grad);
        struct scan o = predict(b);
        double gap = sum(o.sl), mu = gap / rows;
        if (!(gap < HOPELESS)) {
            return false;
        }
        double ap = fmin(1.0, 1.0 / fmax(1e-9, top(o.ps))),
               ad = fmin(1.0, 1.0 / fmax(1e-9, top(o.pl)));
        double after =
            (gap + ap * sum(o.dsl) + ad * sum(o.sdl) + ap * ad * sum(o.dsdl))
            / rows;
        double ratio = fmax(after, 0.0) / mu, sigma = ratio * ratio * ratio;
        combine(b, sigma * mu);
        riccati_solve(b, &b->grad);
        o = correct(b, sigma * mu);
        ap = step_length(o.ps);
        ad = step_length(o.pl);
        if (!isfinite(ap + ad)) {
            return false;
        }
        b->gap = move(b, ap, ad);
        least = CENTRED * sigma * mu;
        b->missed *= 1.0 - ap;
        b->dual *= 1.0 - ad;
        if (b->gap < GAP && b->missed < ROWS_MET && b->dual < 1e-2) {
            b->iterations++;
            return true;
        }
        if (gap < b->pause) {
            b->pause = 0.0;
            b->paused = true;
            b->iterations++;
            return false;
        }
    }
    return false;
}
