/* Interior-point solver of the window (Mehrotra's predictor and corrector), LANES stages at a time: the code, included
 * once per instruction set (IPM_SOLVE names the function).  Every lane does the same operations in the same order, so
 * the results do not depend on the instruction set.
 *
 * Maximise sum weight x under the rows of jerk_rows.c.  The one nonlinear term, x^(-1/2) of the jerk rows, is replaced
 * by its tangent at the present iterate: an inner approximation, since x^(-1/2) is convex.  The iterate meets the
 * dynamics at all times; only the rows may be missed on the way.
 */
#include <math.h>
#include "jerk_internal.h"

#define LOWEST       0.6 /* share of the guess at which tangents are taken at the least: slower never gains */
#define TO_BOUNDARY 0.995
#define START_MU     2.0 /* of the objective: barrier of the first iterate, over all rows */
#define START_SLACK  0.3 
#define CENTRED 0.1     /* least product of slack and multiplier, over what the step aims at */
#define GAP          3e-4 /* of the objective */
#define HOPELESS 1e6
#define LEAST_COST 1e-14
#define ROWS_MET 1e-6

static inline vec set1(double v) { return (vec){v, v, v, v}; }
static inline vec load(const double *p) { return *(const vec *)p; }
static inline void store(double *p, vec v) { *(vec *)p = v; }
static inline vec vmax(vec a, vec b) {
    ivec m = a > b;
    return (vec)((m & (ivec)a) | (~m & (ivec)b));
}
static double top(vec v) { return fmax(fmax(v[0], v[1]), fmax(v[2], v[3])); }
static double sum(vec v) { return (v[0] + v[1]) + (v[2] + v[3]); }

static vec root_of(vec x) {
    vec out;
    for (int l = 0; l < LANES; l++) out[l] = sqrt(x[l]);
    return out;
}

static block block_at(const problem *b, int i) {
    int k = i * LANES;
    block o;
    o.h = load(b->h + k);
    o.hh = o.h * o.h;
    o.x = load(b->x + k);
    o.u = load(b->u + k);
    o.c = load(b->c + k);
    o.x1 = o.x + 2.0 * o.h * o.u + o.hh * o.c;
    vec on = load(b->on + k), off = 1.0 - on, low = LOWEST * load(b->guess + k);
    vec x[2] = {vmax(o.x, low) * on + off, vmax(o.x1, low) * on + off};
    for (int e = 0; e < 2; e++) {
        vec t = 1.0 / root_of(x[e]);
        o.root[e] = load(b->root[e] + k);
        o.half[e] = 0.5 * on * o.root[e] * t / x[e];
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

/* Linear forms of a jerk row pair: q = root * (b . z), m = half * x_t. */
typedef struct sums {
    vec xx, xu, uu, xc, uc, cc; /* Hessian */
    vec x, u, c;                /* gradient */
} sums;

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

static void gather_jerk(const problem *b, int i, const block *k, sums *s, vec least) {
    for (int e = 0; e < 2; e++) {
        two_sided *row = &b->jerk[i * 2 * b->axes + e * b->axes];
        vec m = k->half[e] * (e ? k->x1 : k->x), bound = k->bound[e], wm = {0}, px = {0}, pu = {0}, pc = {0}, tm = {0}, root = k->root[e];
        for (int a = 0; a < b->axes; a++, row++) {
            vec q = root * (row->b[0] * k->x + row->b[1] * k->u + row->b[2] * k->c), t1, t2;
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
        vec g[3] = {k->half[e], {0}, {0}};
        if (e) {
            g[1] = 2.0 * k->h * k->half[e];
            g[2] = k->hh * k->half[e];
        }
        add_square(s, wm, g);
        s->xx += 2.0 * px * g[0];
        s->xu += px * g[1] + pu * g[0];
        s->uu += 2.0 * pu * g[1];
        s->xc += px * g[2] + pc * g[0];
        s->uc += pu * g[2] + pc * g[1];
        s->cc += 2.0 * pc * g[2];
        s->x += tm * g[0];
        s->u += tm * g[1];
        s->c += tm * g[2];
    }
}

static void gather_acc(const problem *b, int i, const block *k, sums *s, vec least) {
    const vec one = set1(1.0);
    two_sided *row = &b->acc[i * b->acc_sets * b->axes];
    for (int a = 0; a < b->acc_sets * b->axes; a++, row++) {
        vec q = row->b[0] * k->x + row->b[1] * k->u, t1, t2;
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

static void gather_one(const problem *b, int i, const block *k, sums *s, vec least) {
    one_sided *row = &b->one[i * ONE_SIDED_ROWS];
    for (int a = 0; a < ONE_SIDED_ROWS; a++, row++) {
        vec q = row->b[0] * k->x + row->b[1] * k->u + row->b[2] * k->c, t;
        vec w = side(q, row->bound, row->s, &row->l, least, &row->is, &row->r, &t);
        add_square(s, w, row->b);
        s->x += t * row->b[0];
        s->u += t * row->b[1];
        s->c += t * row->b[2];
    }
}

/* Hessian and the gradient of the predictor (no centring). */
static void gather(problem *b, vec least) {
    for (int i = 0; i < b->blocks; i++) {
        int k = i * LANES;
        block bl = block_at(b, i);
        sums s = {0};
        b->block[i] = bl;
        gather_jerk(b, i, &bl, &s, least);
        gather_acc(b, i, &bl, &s, least);
        gather_one(b, i, &bl, &s, least);
        store(b->cost.xx + k, s.xx);
        store(b->cost.xu + k, s.xu);
        store(b->cost.uu + k, s.uu);
        store(b->cost.xc + k, s.xc);
        store(b->cost.uc + k, s.uc);
        store(b->cost.cc + k, s.cc + load(b->calm + k) + LEAST_COST * b->convex);
        store(b->grad.x + k, s.x - load(b->weight + k));
        store(b->grad.u + k, s.u);
        store(b->grad.c + k, s.c + load(b->calm + k) * bl.c);
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
static inline void two_gradients(const vec *b, int n, vec t, vec z, sums *corr, sums *cent) {
    corr->x += t * b[0];
    corr->u += t * b[1];
    cent->x += z * b[0];
    cent->u += z * b[1];
    if (n < 3) return;
    corr->c += t * b[2];
    cent->c += z * b[2];
}

static void predict_jerk(problem *b, int i, const block *k, const vec *dz, scan *o, sums *corr, sums *cent) {
    for (int e = 0; e < 2; e++) {
        two_sided *row = &b->jerk[i * 2 * b->axes + e * b->axes];
        vec root = k->root[e], tm = {0}, zm = {0};
        vec g[3] = {k->half[e], e ? 2.0 * k->h * k->half[e] : set1(0), e ? k->hh * k->half[e] : set1(0)};
        vec dm = g[0] * dz[0] + g[1] * dz[1] + g[2] * dz[2];
        for (int a = 0; a < b->axes; a++, row++) {
            vec dq = root * (row->b[0] * dz[0] + row->b[1] * dz[1] + row->b[2] * dz[2]), k1, k2;
            side_predict(dm + dq, row->r[0], row->s[0], row->l[0], row->is[0], o, &row->ds[0], &k1);
            side_predict(dm - dq, row->r[1], row->s[1], row->l[1], row->is[1], o, &row->ds[1], &k2);
            row->dl[0] = k1;
            row->dl[1] = k2;
            two_gradients(row->b, 3, root * (k2 - k1), root * (row->is[0] - row->is[1]), corr, cent);
            tm -= k1 + k2;
            zm += row->is[0] + row->is[1];
        }
        two_gradients(g, 3, tm, zm, corr, cent);
    }
}

static void predict_acc(problem *b, int i, const vec *dz, scan *o, sums *corr, sums *cent) {
    two_sided *row = &b->acc[i * b->acc_sets * b->axes];
    for (int a = 0; a < b->acc_sets * b->axes; a++, row++) {
        vec dq = row->b[0] * dz[0] + row->b[1] * dz[1], k1, k2;
        side_predict(dq, row->r[0], row->s[0], row->l[0], row->is[0], o, &row->ds[0], &k1);
        side_predict(-dq, row->r[1], row->s[1], row->l[1], row->is[1], o, &row->ds[1], &k2);
        row->dl[0] = k1;
        row->dl[1] = k2;
        two_gradients(row->b, 2, k2 - k1, row->is[0] - row->is[1], corr, cent);
    }
}

static void predict_one(problem *b, int i, const vec *dz, scan *o, sums *corr, sums *cent) {
    one_sided *row = &b->one[i * ONE_SIDED_ROWS];
    for (int a = 0; a < ONE_SIDED_ROWS; a++, row++) {
        vec dq = row->b[0] * dz[0] + row->b[1] * dz[1] + row->b[2] * dz[2], k1;
        side_predict(dq, row->r, row->s, row->l, row->is, o, &row->ds, &k1);
        row->dl = k1;
        two_gradients(row->b, 3, -k1, row->is, corr, cent);
    }
}

/* The predictor's step in all rows, and the gradients that corrector and centring add. */
static scan predict(problem *b) {
    scan o = {0};
    for (int i = 0; i < b->blocks; i++) {
        int k = i * LANES;
        const block bl = b->block[i];
        const vec dz[3] = {load(b->dx + k), load(b->du + k), load(b->dc + k)};
        sums corr = {0}, cent = {0};
        predict_jerk(b, i, &bl, dz, &o, &corr, &cent);
        predict_acc(b, i, dz, &o, &corr, &cent);
        predict_one(b, i, dz, &o, &corr, &cent);
        store(b->corr.x + k, corr.x);
        store(b->corr.u + k, corr.u);
        store(b->corr.c + k, corr.c);
        store(b->cent.x + k, cent.x);
        store(b->cent.u + k, cent.u);
        store(b->cent.c + k, cent.c);
    }
    return o;
}

static void combine(problem *b, double sigma_mu) {
    for (int i = 0; i < b->blocks * LANES; i++) {
        b->grad.x[i] += b->corr.x[i] + sigma_mu * b->cent.x[i];
        b->grad.u[i] += b->corr.u[i] + sigma_mu * b->cent.u[i];
        b->grad.c[i] += b->corr.c[i] + sigma_mu * b->cent.c[i];
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
        const vec dz[3] = {load(b->dx + k), load(b->du + k), load(b->dc + k)};
        for (int e = 0; e < 2; e++) {
            two_sided *row = &b->jerk[i * 2 * b->axes + e * b->axes];
            vec dm = bl.half[e] * (e ? dz[0] + 2.0 * bl.h * dz[1] + bl.hh * dz[2] : dz[0]);
            for (int a = 0; a < b->axes; a++, row++) {
                vec dq = bl.root[e] * (row->b[0] * dz[0] + row->b[1] * dz[1] + row->b[2] * dz[2]);
                side_correct(dm + dq, row->r[0], row->s[0], row->l[0], row->is[0], mu, &o, &row->ds[0], &row->dl[0]);
                side_correct(dm - dq, row->r[1], row->s[1], row->l[1], row->is[1], mu, &o, &row->ds[1], &row->dl[1]);
            }
        }
        two_sided *row = &b->acc[i * b->acc_sets * b->axes];
        for (int a = 0; a < b->acc_sets * b->axes; a++, row++) {
            vec dq = row->b[0] * dz[0] + row->b[1] * dz[1];
            side_correct(dq, row->r[0], row->s[0], row->l[0], row->is[0], mu, &o, &row->ds[0], &row->dl[0]);
            side_correct(-dq, row->r[1], row->s[1], row->l[1], row->is[1], mu, &o, &row->ds[1], &row->dl[1]);
        }
        one_sided *one = &b->one[i * ONE_SIDED_ROWS];
        for (int a = 0; a < ONE_SIDED_ROWS; a++, one++) {
            vec dq = one->b[0] * dz[0] + one->b[1] * dz[1] + one->b[2] * dz[2];
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
        b->c[i] += ap * b->dc[i];
    }
    int two = b->blocks * 2 * b->axes, acc = b->blocks * b->acc_sets * b->axes, one = b->blocks * ONE_SIDED_ROWS;
    vec gap = {0};
    for (int i = 0; i < two + acc; i++) {
        two_sided *row = i < two ? &b->jerk[i] : &b->acc[i - two];
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
    vec m = k->half[e] * (e ? k->x1 : k->x), q = k->root[e] * (row->b[0] * k->x + row->b[1] * k->u + row->b[2] * k->c);
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
            vec q = row->b[0] * k.x + row->b[1] * k.u;
            start_side(q, set1(1.0), mu, &row->s[0], &row->l[0]);
            start_side(-q, set1(1.0), mu, &row->s[1], &row->l[1]);
        }
        one_sided *one = &b->one[i * ONE_SIDED_ROWS];
        for (int a = 0; a < ONE_SIDED_ROWS; a++, one++)
            start_side(one->b[0] * k.x + one->b[1] * k.u + one->b[2] * k.c, one->bound, mu, &one->s, &one->l);
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
    int rows = b->blocks * LANES * (2 * (2 + b->acc_sets) * b->axes + ONE_SIDED_ROWS);
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
