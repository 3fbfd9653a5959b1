/* Interior-point solver of the window (Mehrotra's predictor and corrector), LANES stages at a time: the code, included
 * once per instruction set (IPM_SOLVE names the function).  Every lane does the same operations in the same order, so
 * the results do not depend on the instruction set.
 *
 * Maximise sum weight x under the rows of constraints.c.  The one nonlinear term, x^(-1/2) of the jerk rows, is replaced
 * by its tangent at the present iterate: an inner approximation, since x^(-1/2) is convex.  The iterate meets the
 * dynamics at all times; only the rows may be missed on the way.
 */
#include <math.h>
#include "jerk/interior_point_stage.h"

#define LOWEST       0.6 /* share of the guess at which tangents are taken at the least: slower never gains */
#define TO_BOUNDARY 0.995
#define START_MU     2.0 /* of the objective: barrier of the first iterate, over all rows */
#define START_SLACK  0.3 
#define CENTRED 0.1     /* least product of slack and multiplier, over what the step aims at */
#define GAP          3e-4 /* of the objective */
#define HOPELESS 1e6
#define EVEN 10.0       /* of `calm`: cost of c1 - c0, so that c does not change within every interval where nothing is gained by it */
#define LEAST_COST 1e-14
#define ROWS_MET 1e-6

static block block_at(const problem *b, int i) {
    int k = i * LANES;
    block o;
    o.h = load(b->h + k);
    o.x[0] = load(b->x + k);
    o.u[0] = load(b->u + k);
    o.c[0] = load(b->c[0] + k);
    o.c[1] = load(b->c[1] + k);
    end_state(o.h, o.x[0], o.u[0], o.c, &o.x[1], &o.u[1]);
    vec on = load(b->on + k), off = 1.0 - on, low = LOWEST * load(b->guess + k);
    for (int e = 0; e < 2; e++) {
        vec x = vmax(o.x[e], low) * on + off, t = 1.0 / root_of(x);
        o.root[e] = load(b->root[e] + k);
        o.half[e] = 0.5 * on * o.root[e] * t / x;
        o.bound[e] = 1.5 * o.root[e] * t;
    }
    return o;
}

/* Scale of the jerk rows: sqrt(x) of the guess. */
static void set_scale(problem *b) {
    for (int k = 0; k < b->blocks * LANES; k++) {
        b->root[0][k] = b->root[1][k] = 1.0;
        if (b->on[k] == 0.0) continue;
        b->root[0][k] = sqrt(fmax(b->guess[k], b->x[k]));
        b->root[1][k] = sqrt(fmax(b->guess[k + 1], b->x[k + 1]));
    }
}

static inline void add_square(sums *s, vec w, const vec *b) {
    vec wx = w * b[0], wu = w * b[1], wc = w * b[2];
    s->xx += wx * b[0];
    s->xu += wx * b[1];
    s->uu += wu * b[1];
    s->xc += wx * b[2];
    s->uc += wu * b[2];
    s->cc += wc * b[2];
}

/* Start of an iteration for one side of a row: residual, 1/slack; returns the weight, `t` gets the gradient. */
static inline vec side(vec value, vec bound, vec s, vec *l, vec least, vec *is, vec *r, vec *t) {
    *r = value - bound + s;
    *is = 1.0 / s;
    *l = vmax(*l, least * *is);
    vec w = *l * *is;
    *t = w * *r;
    return w;
}

/* Linear forms of a jerk row pair: q = root * (b . z), m = half * x. */
static void gather_jerk(const problem *b, int i, const block *k, totals *all, vec least) {
    for (int e = 0; e < 2; e++) {
        sums both = {0}, *s = &both;
        two_sided *row = &b->jerk[i * 2 * b->axes + e * b->axes];
        vec m = k->half[e] * k->x[e], bound = k->bound[e], wm = {0}, px = {0}, pu = {0}, pc = {0}, tm = {0}, root = k->root[e];
        for (int a = 0; a < b->axes; a++, row++) {
            vec q = root * (row->b[0] * k->x[e] + row->b[1] * k->u[e] + row->b[2] * k->c[e]), t1, t2;
            vec w1 = side(m + q, bound, row->s[0], &row->l[0], least, &row->is[0], &row->r[0], &t1);
            vec w2 = side(m - q, bound, row->s[1], &row->l[1], least, &row->is[1], &row->r[1], &t2);
            vec d = root * (w1 - w2), t = root * (t1 - t2);
            add_square(s, root * root * (w1 + w2), row->b);
            px += d * row->b[0];
            pu += d * row->b[1];
            pc += d * row->b[2];
            s->x += t * row->b[0];
            s->u += t * row->b[1];
            s->c += t * row->b[2];
            wm += w1 + w2;
            tm += t1 + t2;
        }
        s->xx += k->half[e] * (k->half[e] * wm + 2.0 * px);
        s->xu += pu * k->half[e];
        s->xc += pc * k->half[e];
        s->x += tm * k->half[e];
        if (e) {
            add_end(all, s, k->h);
            add_end_gradient(all, s, k->h);
        } else {
            add_start(all, s);
            add_start_gradient(all, s);
        }
    }
}

static void gather_mid(const problem *b, int i, const block *k, totals *all, vec least) {
    const vec one = set1(1.0);
    vec x, u;
    sums s = {0};
    two_sided *row = &b->mid[i * b->axes];
    middle_state(k->h, k->x[0], k->u[0], k->c, &x, &u);
    for (int a = 0; a < b->axes; a++, row++) {
        vec q = row->b[0] * x + row->b[1] * u, t1, t2;
        vec w1 = side(q, one, row->s[0], &row->l[0], least, &row->is[0], &row->r[0], &t1);
        vec w2 = side(-q, one, row->s[1], &row->l[1], least, &row->is[1], &row->r[1], &t2);
        vec w = w1 + w2, t = t1 - t2;
        s.xx += w * row->b[0] * row->b[0];
        s.xu += w * row->b[0] * row->b[1];
        s.uu += w * row->b[1] * row->b[1];
        s.x += t * row->b[0];
        s.u += t * row->b[1];
    }
    add_middle(all, &s, k->h);
    add_middle_gradient(all, &s, k->h);
}

static void gather_acc(const problem *b, int i, const block *k, totals *s, vec least) {
    const vec one = set1(1.0);
    two_sided *row = &b->acc[i * b->acc_sets * b->axes];
    for (int a = 0; a < b->acc_sets * b->axes; a++, row++) {
        vec q = row->b[0] * k->x[0] + row->b[1] * k->u[0], t1, t2;
        vec w1 = side(q, one, row->s[0], &row->l[0], least, &row->is[0], &row->r[0], &t1);
        vec w2 = side(-q, one, row->s[1], &row->l[1], least, &row->is[1], &row->r[1], &t2);
        vec w = w1 + w2, t = t1 - t2;
        s->xx += w * row->b[0] * row->b[0];
        s->xu += w * row->b[0] * row->b[1];
        s->uu += w * row->b[1] * row->b[1];
        s->x += t * row->b[0];
        s->u += t * row->b[1];
    }
}

static inline vec one_value(const one_sided *row, vec x, vec u, vec c0, vec c1) { return row->b[0] * x + row->b[1] * u + row->b[2] * c0 + row->b[3] * c1; }

static void gather_one(const problem *b, int i, const block *k, totals *s, vec least) {
    one_sided *row = &b->one[i * ONE_SIDED_ROWS];
    for (int a = 0; a < ONE_SIDED_ROWS; a++, row++) {
        vec q = one_value(row, k->x[0], k->u[0], k->c[0], k->c[1]), t;
        vec w = side(q, row->bound, row->s, &row->l, least, &row->is, &row->r, &t), wx = w * row->b[0], wu = w * row->b[1];
        s->xx += wx * row->b[0];
        s->xu += wx * row->b[1];
        s->uu += wu * row->b[1];
        s->x += t * row->b[0];
        s->u += t * row->b[1];
        if (a < FIRST_C_ROW) continue;
        for (int n = 0; n < 2; n++) {
            s->xc[n] += wx * row->b[2 + n];
            s->uc[n] += wu * row->b[2 + n];
            s->c[n] += t * row->b[2 + n];
        }
        s->cc[0] += w * row->b[2] * row->b[2];
        s->cc[1] += w * row->b[2] * row->b[3];
        s->cc[2] += w * row->b[3] * row->b[3];
    }
}

/* Hessian and the gradient of the predictor (no centring). */
static void gather(problem *b, vec least) {
    for (int i = 0; i < b->blocks; i++) {
        int k = i * LANES;
        block bl = block_at(b, i);
        totals s = {0};
        b->block[i] = bl;
        gather_jerk(b, i, &bl, &s, least);
        gather_acc(b, i, &bl, &s, least);
        gather_mid(b, i, &bl, &s, least);
        gather_one(b, i, &bl, &s, least);
        store(b->cost.xx + k, s.xx);
        store(b->cost.xu + k, s.xu);
        store(b->cost.uu + k, s.uu);
        vec calm = load(b->calm + k), even = EVEN * calm;
        for (int n = 0; n < 2; n++) {
            store(b->cost.xc[n] + k, s.xc[n]);
            store(b->cost.uc[n] + k, s.uc[n]);
            store(b->cost.cc[2 * n] + k, s.cc[2 * n] + calm + even + LEAST_COST * b->convex);
            store(b->grad.c[n] + k, s.c[n] + calm * bl.c[n] + even * (bl.c[n] - bl.c[1 - n]));
        }
        store(b->cost.cc[1] + k, s.cc[1] - even);
        store(b->grad.x + k, s.x - load(b->weight + k));
        store(b->grad.u + k, s.u);
    }
}

/* Step of one side: slack and multiplier for a change `dq` of the row; centring `sigma_mu`, old product in ds. */
typedef struct scan {
    vec ps, pl;                 /* largest -ds/s, -dl/l */
    vec sl, dsl, sdl, dsdl;     /* sums of products */
} scan;

static inline void side_predict(vec dq, vec r, vec s, vec l, vec is, scan *o, vec *ds, vec *corr) {
    vec d = -r - dq, rs = d * is, dl = -l - l * rs;
    *ds = d;
    *corr = d * dl * is;
    o->ps = vmax(o->ps, -rs);
    o->pl = vmax(o->pl, 1.0 + rs);
    o->sl += s * l;
    o->dsl += d * l;
    o->sdl += s * dl;
    o->dsdl += d * dl;
}

/* Adds to the gradients of corrector (k) and centring (z). */
static inline void two_gradients(const vec *b, vec t, vec z, sums *corr, sums *cent) {
    corr->x += t * b[0];
    corr->u += t * b[1];
    corr->c += t * b[2];
    cent->x += z * b[0];
    cent->u += z * b[1];
    cent->c += z * b[2];
}

/* A step of the states and inputs: index 0 of x, u at the start, 1 at the end. */
typedef struct change {
    vec x[2], u[2], c[2];
} change;

static inline change change_at(const problem *b, int k, vec h) {
    change d = {.x = {load(b->dx + k)}, .u = {load(b->du + k)}, .c = {load(b->dc[0] + k), load(b->dc[1] + k)}};
    end_state(h, d.x[0], d.u[0], d.c, &d.x[1], &d.u[1]);
    return d;
}

static void predict_jerk(problem *b, int i, const block *k, const change *dz, scan *o, totals *corr, totals *cent) {
    for (int e = 0; e < 2; e++) {
        sums one = {0}, two = {0};
        two_sided *row = &b->jerk[i * 2 * b->axes + e * b->axes];
        vec root = k->root[e], tm = {0}, zm = {0};
        vec dm = k->half[e] * dz->x[e];
        for (int a = 0; a < b->axes; a++, row++) {
            vec dq = root * (row->b[0] * dz->x[e] + row->b[1] * dz->u[e] + row->b[2] * dz->c[e]), k1, k2;
            side_predict(dm + dq, row->r[0], row->s[0], row->l[0], row->is[0], o, &row->ds[0], &k1);
            side_predict(dm - dq, row->r[1], row->s[1], row->l[1], row->is[1], o, &row->ds[1], &k2);
            row->dl[0] = k1;
            row->dl[1] = k2;
            two_gradients(row->b, root * (k2 - k1), root * (row->is[0] - row->is[1]), &one, &two);
            tm -= k1 + k2;
            zm += row->is[0] + row->is[1];
        }
        one.x += tm * k->half[e];
        two.x += zm * k->half[e];
        if (e) {
            add_end_gradient(corr, &one, k->h);
            add_end_gradient(cent, &two, k->h);
        } else {
            add_start_gradient(corr, &one);
            add_start_gradient(cent, &two);
        }
    }
}

static void predict_acc(problem *b, int i, const change *dz, scan *o, totals *corr, totals *cent) {
    two_sided *row = &b->acc[i * b->acc_sets * b->axes];
    for (int a = 0; a < b->acc_sets * b->axes; a++, row++) {
        vec dq = row->b[0] * dz->x[0] + row->b[1] * dz->u[0], k1, k2;
        side_predict(dq, row->r[0], row->s[0], row->l[0], row->is[0], o, &row->ds[0], &k1);
        side_predict(-dq, row->r[1], row->s[1], row->l[1], row->is[1], o, &row->ds[1], &k2);
        row->dl[0] = k1;
        row->dl[1] = k2;
        vec t = k2 - k1, z = row->is[0] - row->is[1];
        corr->x += t * row->b[0];
        corr->u += t * row->b[1];
        cent->x += z * row->b[0];
        cent->u += z * row->b[1];
    }
}

static void predict_mid(problem *b, int i, const block *k, const change *dz, scan *o, totals *corr, totals *cent) {
    two_sided *row = &b->mid[i * b->axes];
    sums one = {0}, two = {0};
    vec x, u;
    middle_state(k->h, dz->x[0], dz->u[0], dz->c, &x, &u);
    for (int a = 0; a < b->axes; a++, row++) {
        vec dq = row->b[0] * x + row->b[1] * u, k1, k2;
        side_predict(dq, row->r[0], row->s[0], row->l[0], row->is[0], o, &row->ds[0], &k1);
        side_predict(-dq, row->r[1], row->s[1], row->l[1], row->is[1], o, &row->ds[1], &k2);
        row->dl[0] = k1;
        row->dl[1] = k2;
        two_gradients(row->b, k2 - k1, row->is[0] - row->is[1], &one, &two);
    }
    add_middle_gradient(corr, &one, k->h);
    add_middle_gradient(cent, &two, k->h);
}

static void predict_one(problem *b, int i, const change *dz, scan *o, totals *corr, totals *cent) {
    one_sided *row = &b->one[i * ONE_SIDED_ROWS];
    for (int a = 0; a < ONE_SIDED_ROWS; a++, row++) {
        vec dq = one_value(row, dz->x[0], dz->u[0], dz->c[0], dz->c[1]), k1;
        side_predict(dq, row->r, row->s, row->l, row->is, o, &row->ds, &k1);
        row->dl = k1;
        corr->x -= k1 * row->b[0];
        corr->u -= k1 * row->b[1];
        cent->x += row->is * row->b[0];
        cent->u += row->is * row->b[1];
        for (int n = 0; n < 2; n++) {
            corr->c[n] -= k1 * row->b[2 + n];
            cent->c[n] += row->is * row->b[2 + n];
        }
    }
}

/* The predictor's step in all rows, and the gradients that corrector and centring add. */
static scan predict(problem *b) {
    scan o = {0};
    for (int i = 0; i < b->blocks; i++) {
        int k = i * LANES;
        const block bl = b->block[i];
        const change dz = change_at(b, k, bl.h);
        totals corr = {0}, cent = {0};
        predict_jerk(b, i, &bl, &dz, &o, &corr, &cent);
        predict_acc(b, i, &dz, &o, &corr, &cent);
        predict_mid(b, i, &bl, &dz, &o, &corr, &cent);
        predict_one(b, i, &dz, &o, &corr, &cent);
        store(b->corr.x + k, corr.x);
        store(b->corr.u + k, corr.u);
        store(b->cent.x + k, cent.x);
        store(b->cent.u + k, cent.u);
        for (int n = 0; n < 2; n++) {
            store(b->corr.c[n] + k, corr.c[n]);
            store(b->cent.c[n] + k, cent.c[n]);
        }
    }
    return o;
}

static void combine(problem *b, double sigma_mu) {
    for (int i = 0; i < b->blocks * LANES; i++) {
        b->grad.x[i] += b->corr.x[i] + sigma_mu * b->cent.x[i];
        b->grad.u[i] += b->corr.u[i] + sigma_mu * b->cent.u[i];
        for (int n = 0; n < 2; n++) b->grad.c[n][i] += b->corr.c[n][i] + sigma_mu * b->cent.c[n][i];
    }
}

/* The combined step of one side; `dl` holds the corrector's ds dl / s. */
static inline void side_correct(vec dq, vec r, vec s, vec l, vec is, vec mu, scan *o, vec *ds, vec *dl) {
    vec d = -r - dq;
    vec e = -l - l * d * is + mu * is - *dl;
    *ds = d;
    *dl = e;
    o->ps = vmax(o->ps, -d * is);
    o->pl = vmax(o->pl, -e / l);
    (void)s;
}

static scan correct(problem *b, double sigma_mu) {
    scan o = {0};
    const vec mu = set1(sigma_mu);
    for (int i = 0; i < b->blocks; i++) {
        int k = i * LANES;
        const block bl = b->block[i];
        const change dz = change_at(b, k, bl.h);
        for (int e = 0; e < 2; e++) {
            two_sided *row = &b->jerk[i * 2 * b->axes + e * b->axes];
            vec dm = bl.half[e] * dz.x[e];
            for (int a = 0; a < b->axes; a++, row++) {
                vec dq = bl.root[e] * (row->b[0] * dz.x[e] + row->b[1] * dz.u[e] + row->b[2] * dz.c[e]);
                side_correct(dm + dq, row->r[0], row->s[0], row->l[0], row->is[0], mu, &o, &row->ds[0], &row->dl[0]);
                side_correct(dm - dq, row->r[1], row->s[1], row->l[1], row->is[1], mu, &o, &row->ds[1], &row->dl[1]);
            }
        }
        two_sided *row = &b->acc[i * b->acc_sets * b->axes];
        for (int a = 0; a < b->acc_sets * b->axes; a++, row++) {
            vec dq = row->b[0] * dz.x[0] + row->b[1] * dz.u[0];
            side_correct(dq, row->r[0], row->s[0], row->l[0], row->is[0], mu, &o, &row->ds[0], &row->dl[0]);
            side_correct(-dq, row->r[1], row->s[1], row->l[1], row->is[1], mu, &o, &row->ds[1], &row->dl[1]);
        }
        vec xm, um;
        middle_state(bl.h, dz.x[0], dz.u[0], dz.c, &xm, &um);
        row = &b->mid[i * b->axes];
        for (int a = 0; a < b->axes; a++, row++) {
            vec dq = row->b[0] * xm + row->b[1] * um;
            side_correct(dq, row->r[0], row->s[0], row->l[0], row->is[0], mu, &o, &row->ds[0], &row->dl[0]);
            side_correct(-dq, row->r[1], row->s[1], row->l[1], row->is[1], mu, &o, &row->ds[1], &row->dl[1]);
        }
        one_sided *one = &b->one[i * ONE_SIDED_ROWS];
        for (int a = 0; a < ONE_SIDED_ROWS; a++, one++) {
            vec dq = one_value(one, dz.x[0], dz.u[0], dz.c[0], dz.c[1]);
            side_correct(dq, one->r, one->s, one->l, one->is, mu, &o, &one->ds, &one->dl);
        }
    }
    return o;
}

/* The step; returns the gap behind it. */
static double move(problem *b, double ap, double ad) {
    for (int i = 0; i < b->blocks * LANES; i++) {
        b->x[i] += ap * b->dx[i];
        b->u[i] += ap * b->du[i];
        b->c[0][i] += ap * b->dc[0][i];
        b->c[1][i] += ap * b->dc[1][i];
    }
    int two = b->blocks * 2 * b->axes, acc = b->blocks * b->acc_sets * b->axes, one = b->blocks * ONE_SIDED_ROWS;
    vec gap = {0};
    int mid = b->blocks * b->axes;
    for (int i = 0; i < two + acc + mid; i++) {
        two_sided *row = i < two ? &b->jerk[i] : i < two + acc ? &b->acc[i - two] : &b->mid[i - two - acc];
        for (int side = 0; side < 2; side++) {
            row->s[side] += ap * row->ds[side];
            row->l[side] += ad * row->dl[side];
            gap += row->s[side] * row->l[side];
        }
    }
    for (int i = 0; i < one; i++) {
        b->one[i].s += ap * b->one[i].ds;
        b->one[i].l += ad * b->one[i].dl;
        gap += b->one[i].s * b->one[i].l;
    }
    return sum(gap);
}

static void start_side(vec value, vec bound, double mu, vec *s, vec *l) {
    *s = vmax(bound - value, set1(START_SLACK));
    *l = mu / *s;
}

/* Sides of an axis' jerk row at one end of the stages of a block: both at most the bound. */
static inline void jerk_sides(const block *k, int e, const two_sided *row, vec side[2]) {
    vec m = k->half[e] * k->x[e], q = k->root[e] * (row->b[0] * k->x[e] + row->b[1] * k->u[e] + row->b[2] * k->c[e]);
    side[0] = m + q;
    side[1] = m - q;
}

/* Slacks of the guess, kept off the boundary, and multipliers on the central path. */
static void start(problem *b, double mu) {
    for (int i = 0; i < b->blocks; i++) {
        block k = block_at(b, i);
        for (int e = 0; e < 2; e++) {
            two_sided *row = &b->jerk[i * 2 * b->axes + e * b->axes];
            for (int a = 0; a < b->axes; a++, row++) {
                vec side[2];
                jerk_sides(&k, e, row, side);
                for (int n = 0; n < 2; n++) start_side(side[n], k.bound[e], mu, &row->s[n], &row->l[n]);
            }
        }
        two_sided *row = &b->acc[i * b->acc_sets * b->axes];
        for (int a = 0; a < b->acc_sets * b->axes; a++, row++) {
            vec q = row->b[0] * k.x[0] + row->b[1] * k.u[0];
            start_side(q, set1(1.0), mu, &row->s[0], &row->l[0]);
            start_side(-q, set1(1.0), mu, &row->s[1], &row->l[1]);
        }
        vec xm, um;
        middle_state(k.h, k.x[0], k.u[0], k.c, &xm, &um);
        row = &b->mid[i * b->axes];
        for (int a = 0; a < b->axes; a++, row++) {
            vec q = row->b[0] * xm + row->b[1] * um;
            start_side(q, set1(1.0), mu, &row->s[0], &row->l[0]);
            start_side(-q, set1(1.0), mu, &row->s[1], &row->l[1]);
        }
        one_sided *one = &b->one[i * ONE_SIDED_ROWS];
        for (int a = 0; a < ONE_SIDED_ROWS; a++, one++)
            start_side(one_value(one, k.x[0], k.u[0], k.c[0], k.c[1]), one->bound, mu, &one->s, &one->l);
    }
}

/* Rows were tightened: where the iterate misses one, its slack is as large as what is missed. Left as small as they were, they would
 * stop every step. */
static void reopen(problem *b) {
    for (int i = 0; i < b->blocks; i++) {
        block k = block_at(b, i);
        for (int e = 0; e < 2; e++) {
            two_sided *row = &b->jerk[i * 2 * b->axes + e * b->axes];
            for (int a = 0; a < b->axes; a++, row++) {
                vec side[2];
                jerk_sides(&k, e, row, side);
                for (int n = 0; n < 2; n++) row->s[n] = vmax(row->s[n], side[n] - k.bound[e]);
            }
        }
    }
}

static double step_length(vec most) {
    double m = top(most);
    return m > TO_BOUNDARY ? TO_BOUNDARY / m : 1.0;
}

/* From the guess in x, u, c to the optimum, or on from where it has paused.  With b->pause it stops once at that gap, so that
 * rows may be changed.  false: no convergence (or paused); the checker judges what is there all the same. */
bool IPM_SOLVE(problem *b, int max_iterations) {
    int rows = b->blocks * LANES * (2 * (3 + b->acc_sets) * b->axes + ONE_SIDED_ROWS);
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
        if (!riccati_factor(b)) return false;
        riccati_solve(b, &b->grad);
        scan o = predict(b);
        double gap = sum(o.sl), mu = gap / rows;
        if (!(gap < HOPELESS)) return false;
        double ap = fmin(1.0, 1.0 / fmax(1e-9, top(o.ps))), ad = fmin(1.0, 1.0 / fmax(1e-9, top(o.pl)));
        double after = (gap + ap * sum(o.dsl) + ad * sum(o.sdl) + ap * ad * sum(o.dsdl)) / rows;
        double ratio = fmax(after, 0.0) / mu, sigma = ratio * ratio * ratio;
        combine(b, sigma * mu);
        riccati_solve(b, &b->grad);
        o = correct(b, sigma * mu);
        ap = step_length(o.ps);
        ad = step_length(o.pl);
        if (!isfinite(ap + ad)) return false;
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
