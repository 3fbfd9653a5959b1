/* Rows of the window's problem: limits of axes written over (x, u, c) of each stage. */
#include <math.h>
#include <string.h>
#include "jerk/state.h"

#define SWELLS 1.003     /* path jerk inside an interval over that at its ends that is left to the checker, ... */
#define SWELLS_MOST 1.1  /* ... and the most that is set aside, by the guess */
#define CALM 1e-2
#define ENTRY_STAGES 8   /* stages behind the start ... */
#define ENTRY_SLACK 0.01 /* ... and what may be added to the limits at the first of them */
#define SLOW_GAINS 1.5   /* power of x by which a gain of it counts less: that of the time */
#define SLOWEST 1e-5     /* share of the largest x below which it counts no more */
#define LANDING 0.96 /* share of the cap that a ramp down must keep */
#define IDLE 1e-7 /* of its limit, that an axis needs at full speed: it has no rows */
#define ORDINARY 1e-3 /* of rows by c: those of a machine that does 10 mm/s */
#define FLOOR 0.2 /* share of the guess below which x may not fall */

/* Index of a row's coefficient for stage k. */
static inline double *lane(vec *v, int k) { return (double *)v + k % LANES; }

static two_sided *jerk_row(problem *b, int k, int end, int a) { return &b->jerk[(k / LANES) * 2 * b->axes + end * b->axes + a]; }

static two_sided *acc_row(problem *b, int k, int set, int a) {
    return &b->acc[(k / LANES) * b->acc_sets * b->axes + set * b->axes + a];
}

static void clear_rows(problem *b) {
    memset(b->jerk, 0, sizeof *b->jerk * (size_t)(b->blocks * 2 * b->axes));
    memset(b->acc, 0, sizeof *b->acc * (size_t)(b->blocks * b->acc_sets * b->axes));
    memset(b->mid, 0, sizeof *b->mid * (size_t)(b->blocks * b->axes));
    memset(b->one, 0, sizeof *b->one * (size_t)(b->blocks * ONE_SIDED_ROWS));
    for (int i = 0; i < b->blocks * ONE_SIDED_ROWS; i++) b->one[i].bound = (vec){1.0, 1.0, 1.0, 1.0};
    for (int k = 0; k < b->blocks * LANES; k++) {
        b->on[k] = b->weight[k] = b->calm[k] = 0.0;
        b->h[k] = 1.0;
        b->guess[k] = 1.0;
        b->x[k] = 1.0;
        b->u[k] = b->c[0][k] = b->c[1][k] = b->dx[k] = b->du[k] = b->dc[0][k] = b->dc[1][k] = 0.0;
    }
}

/* The state that a window starts with was checked, not planned, to lie within the limits: between the knots of that plan
 * it may lie a little above what is planned with. */
static double entry_slack(const problem *b, int k) { return b->rest_start || k >= ENTRY_STAGES ? 1.0 : 1.0 + ENTRY_SLACK * (1.0 - (double)k / ENTRY_STAGES); }

static bool moves(const jerk_planner *p, const jerk_interval *q, int end, int a) {
    double v = 3.0 * p->scale;
    return fabs(q->d1[end][a]) * v > IDLE * p->cfg.v_max[a] || fabs(q->d2[end][a]) * v * v > IDLE * acc_max(p, q, a) ||
           fabs(q->d3[end][a]) * v * v * v > IDLE * jerk_max(p, q, a);
}

/* Axes that move somewhere in the window; one at the least, whose rows keep the tangents near the iterate. */
static void find_axes(const jerk_planner *p, const grid *g, problem *b) {
    b->axes = 0;
    for (int a = 0; a < p->cfg.axes; a++) {
        bool any = false;
        for (int k = 0; k < g->n && !any; k++) any = moves(p, g->seg[k].q, 0, a) || moves(p, g->seg[k].q, 1, a);
        if (any) b->axis[b->axes++] = a;
    }
    if (b->axes == 0) b->axis[b->axes++] = 0;
}

/* Axis jerk over sqrt(x), at the start and at the end of the stage. */
static void jerk_rows(const jerk_planner *p, problem *b, const segment *s, int k) {
    double f3 = p->scale * p->scale * p->scale;
    for (int i = 0; i < b->axes; i++) {
        int a = b->axis[i];
        double w = f3 / (s->share * JERK_USABLE * jerk_max(p, s->q, a) * entry_slack(b, k));
        const jerk_interval *q = s->q;
        for (int end = 0; end < 2; end++) {
            two_sided *row = jerk_row(b, k, end, i);
            *lane(&row->b[0], k) = w * q->d3[end][a];
            *lane(&row->b[1], k) = w * 3.0 * q->d2[end][a];
            *lane(&row->b[2], k) = w * q->d1[end][a];
        }
    }
}

/* Stage k has less of the jerk limit from now on. */
void tighten_rows(problem *b, int k, double by) {
    for (int end = 0; end < 2; end++)
        for (int a = 0; a < b->axes; a++)
            for (int i = 0; i < 3; i++) *lane(&jerk_row(b, k, end, a)->b[i], k) /= by;
}

static void acc_rows(const jerk_planner *p, problem *b, const segment *s, int end, int set, int k) {
    const jerk_interval *q = s->q;
    for (int i = 0; i < b->axes; i++) {
        int a = b->axis[i];
        double w = p->scale * p->scale / (ACC_USABLE * s->acc[a] * acc_max(p, q, a) * entry_slack(b, k));
        two_sided *row = acc_row(b, k, set, i);
        *lane(&row->b[0], k) = w * q->d2[end][a];
        *lane(&row->b[1], k) = w * q->d1[end][a];
    }
}

/* Between its ends the acceleration may go beyond what it is there: c changes. */
static void mid_rows(const jerk_planner *p, problem *b, const segment *s, int k) {
    const jerk_interval *q = s->q;
    double h = q->length;
    for (int i = 0; i < b->axes; i++) {
        int a = b->axis[i];
        double w = p->scale * p->scale / (ACC_USABLE * s->acc[a] * acc_max(p, q, a) * entry_slack(b, k));
        double d1 = 0.5 * (q->d1[0][a] + q->d1[1][a]) + h * (5.0 / 32.0 * (q->d2[0][a] - q->d2[1][a]) + h / 64.0 * (q->d3[0][a] + q->d3[1][a]));
        double d2 = 15.0 / 8.0 * (q->d1[1][a] - q->d1[0][a]) / h - 7.0 / 16.0 * (q->d2[0][a] + q->d2[1][a]) + h / 32.0 * (q->d3[1][a] - q->d3[0][a]);
        two_sided *row = &b->mid[(k / LANES) * b->axes + i];
        *lane(&row->b[0], k) = w * d2;
        *lane(&row->b[1], k) = w * d1;
    }
}

/* What the caps of knot k come to: hard, feed, and the rest intervals beside it. */
static double cap_at(const jerk_planner *p, const grid *g, int k) {
    double cap = fmin(g->knot_cap[k], fmin(g->seg[k - 1].soft, g->seg[k].soft));
    (void)p;
    if (k == 1 && g->rest_start) {
        double h = g->seg[0].h, u = cbrt(6.0 * h * g->seg[0].jerk_up * g->seg[0].jerk_up);
        cap = fmin(cap, 1.5 * h * u);
    }
    if (k == g->n - 1) {
        double h = g->seg[k].h, u = cbrt(6.0 * h * g->seg[k].jerk_down * g->seg[k].jerk_down);
        cap = fmin(cap, 1.5 * h * u);
    }
    return cap;
}

static void one_row(problem *b, int row, int k, double bx, double bu, double c0, double c1, double bound) {
    one_sided *o = &b->one[(k / LANES) * ONE_SIDED_ROWS + row];
    *lane(&o->b[0], k) = bx;
    *lane(&o->b[1], k) = bu;
    *lane(&o->b[2], k) = c0;
    *lane(&o->b[3], k) = c1;
    *lane(&o->bound, k) = bound;
}

static bool has_kinks(const jerk_planner *p, const grid *g) {
    for (int k = 1; k < g->n; k++)
        for (int a = 0; a < p->cfg.axes; a++) {
            const jerk_interval *l = g->seg[k - 1].q, *r = g->seg[k].q;
            if (l->acc_share[a] != r->acc_share[a] || g->seg[k - 1].acc[a] != g->seg[k].acc[a]) return true;
            if (fabs(l->d2[1][a] - r->d2[0][a]) > 1e-9 + 1e-6 * fabs(r->d2[0][a])) return true;
        }
    return false;
}

/* The share of the least costs of c^2 that does not outweigh the rows: with low speeds and much jerk c is large. */
static double convex_share(const jerk_planner *p) {
    double least = ORDINARY;
    for (int a = 0; a < p->cfg.axes; a++) least = fmin(least, p->scale * p->scale * p->scale / p->cfg.j_max[a]);
    return least * least / (ORDINARY * ORDINARY);
}

/* Dimensions and rows of the problem over a grid; caps and floors follow when the guess is known (`bound_rows`). */
void problem_from_grid(jerk_planner *p, const grid *g, double x0, double u0) {
    problem *b = &p->prob;
    b->n = g->n;
    find_axes(p, g, b);
    b->rest_start = g->rest_start;
    b->paused = false;
    b->first = g->rest_start ? 1 : 0;
    b->blocks = (g->n + 1 + LANES - 1) / LANES;
    b->acc_sets = has_kinks(p, g) ? 2 : 1;
    b->x0 = x0;
    b->u0 = u0;
    b->terminal = 1.5 * g->seg[g->n - 1].h;
    b->convex = convex_share(p);
    clear_rows(b);
    for (int k = 0; k < g->n; k++) {
        b->h[k] = g->seg[k].h;
        if (k >= 1) acc_rows(p, b, &g->seg[k], 0, 0, k);
        if (k >= 1 && b->acc_sets == 2) acc_rows(p, b, &g->seg[k - 1], 1, 1, k);
        if (k < b->first || k > g->n - 2) continue;
        jerk_rows(p, b, &g->seg[k], k);
        mid_rows(p, b, &g->seg[k], k);
        b->on[k] = 1.0;
    }
}

/* With the jerk at its limit at both ends and c linear between, the path jerk is larger inside where the speed changes much. */
static double swell(double x0, double x1) { return x0 > 0.0 && x1 > 0.0 ? 0.5 * sqrt(0.5 * (x0 + x1)) * (1.0 / sqrt(x0) + 1.0 / sqrt(x1)) : 1.0; }

/* Caps, floors and weights, from the guess at the knots.  The time over an interval h falls with x like h x^(-3/2) / 2: that is
 * the weight of x, taken at the guess. */
void bound_rows(jerk_planner *p, const grid *g) {
    problem *b = &p->prob;
    double sum = 0.0, top = 0.0;
    for (int k = 1; k < g->n; k++) top = fmax(top, b->guess[k]);
    for (int k = 1; k < g->n; k++) {
        b->weight[k] = 0.5 * (g->seg[k - 1].h + g->seg[k].h) * pow(fmax(b->guess[k] / top, SLOWEST), -SLOW_GAINS);
        sum += b->weight[k] * b->guess[k];
    }
    for (int k = 1; k < g->n; k++) {
        double cap = cap_at(p, g, k), xf = b->guess[k];
        b->weight[k] /= sum;
        one_row(b, ROW_CAP, k, 1.0 / cap, 0.0, 0.0, 0.0, 1.0);
        double floor = FLOOR * xf;
        if (g->from_start[k] >= g->land_from && g->from_start[k] <= g->land_to && xf > 0.5 * cap) floor = LANDING * cap;
        one_row(b, ROW_FLOOR, k, -1.0 / floor, 0.0, 0.0, 0.0, -1.0);
    }
    for (int k = b->first; k <= g->n - 2; k++) {
        double most = 0.0;
        for (int a = 0; a < b->axes; a++) most = fmax(most, fabs(*lane(&jerk_row(b, k, 0, a)->b[2], k)));
        b->calm[k] = 0.5 * CALM * b->h[k] / sum * most * most * b->guess[k] * b->guess[k + 1];
    }
    for (int k = b->first; k <= g->n - 2; k++) {
        double more = swell(b->guess[k], b->guess[k + 1]);
        if (more > SWELLS) tighten_rows(b, k, SWELLS / fmin(more, SWELLS_MOST));
        double h = b->h[k], xf = fmin(b->guess[k], b->guess[k + 1]);
        double c0 = 5.0 / 24.0 * h * h, c1 = h * h / 24.0; /* x in the middle: x + h u + c0 + c1 */
        one_row(b, ROW_MID_FLOOR, k, -1.0 / xf, -h / xf, -c0 / xf, -c1 / xf, -0.5 * FLOOR);
        double cap = fmin(g->seg[k].soft, g->seg[k].cap);
        if (k > 0) one_row(b, ROW_RISE, k, 1.0 / cap, 2.0 / 3.0 * h / cap, 0.0, 0.0, 1.0);
        one_row(b, ROW_FALL, k, 1.0 / cap, 4.0 / 3.0 * h / cap, h * h / 3.0 / cap, 0.0, 1.0);
    }
}
