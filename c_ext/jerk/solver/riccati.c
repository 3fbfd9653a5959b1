/* The Newton step of the window: a linear-quadratic problem with two states and
 * two inputs, solved by recursion from both ends at once.
 *
 * x+ = x + 2 h u + h^2 (2 c0 + c1) / 3, u+ = u + h (c0 + c1) / 2.  Driven
 * backwards, -u takes the place of u, c1 that of c0, and the same equations
 * hold.  So the stages ahead of the middle are written that way
 * (turn_totals), and one recursion eliminates both halves, from their outer
 * ends to the middle.  A pair holds a stage of each: lane AHEAD, lane BEHIND.
 */
#include <math.h>
#include "jerk/solver/riccati.h"
#include "jerk/state/state.h"

enum {
    AHEAD,
    BEHIND
};

/* Cost of all stages further out, by the state between them and the next. */
typedef struct cost_to_go {
    pair xx, xu, uu;
} cost_to_go;

/* The stages of pair p, counted from the ends.  Where a half has no more of
 * them its stage is `none`: no length, no cost. */
typedef struct stages {
    int of[2];
} stages;

static inline struct stages stages_of(const struct problem *problem, int p) {
    int ahead = problem->first + p;
    int behind = problem->count - 2 - p;
    int none = problem->blocks * LANES;
    return (struct stages){{ahead < problem->middle ? ahead : none,
                            behind >= problem->middle ? behind : none}};
}

static inline int count_pairs(const struct problem *problem) {
    int ahead = problem->middle - problem->first;
    int behind = problem->count - 1 - problem->middle;
    return ahead > behind ? ahead : behind;
}

static inline pair both(const double *array, struct stages at) {
    return (pair){array[at.of[AHEAD]], array[at.of[BEHIND]]};
}

/* c0 and c1, in the order in which each half is driven. */
static inline pair input_of(double *const array[2], int i, struct stages at) {
    return (pair){array[i][at.of[AHEAD]], array[i][at.of[BEHIND]]};
}

static void write_none(struct problem *problem) {
    int k = problem->blocks * LANES;
    struct stage_cost *cost = &problem->cost;
    problem->lengths[k] = 0.0;
    cost->xx[k] = cost->xu[k] = cost->uu[k] = 0.0;
    for (int i = 0; i < 2; i++) {
        cost->xc[i][k] = cost->uc[i][k] = 0.0;
        cost->cc[2 * i][k] = 1.0;
        problem->grad.input[i][k] = 0.0;
    }
    cost->cc[1][k] = 0.0;
    problem->grad.x[k] = problem->grad.accel[k] = 0.0;
}

/* A stage whose inputs follow from its state: c = k (x, u). */
typedef struct tied {
    double kx[2], ku[2];
} tied;

static void set_gain(struct gain *gain,
                     int lane,
                     double length,
                     const struct tied *tied) {
    double third = THIRD * length * length;
    const double *kx = tied->kx;
    const double *ku = tied->ku;
    gain->length[lane] = length;
    for (int i = 0; i < 2; i++) {
        gain->kx[i][lane] = kx[i];
        gain->ku[i][lane] = ku[i];
    }
    for (int i = 0; i < 3; i++) {
        gain->inverse[i][lane] = 0.0;
    }
    double by_x = 2.0 * kx[0] + kx[1];
    double by_accel = 2.0 * ku[0] + ku[1];
    gain->xx[lane] = 1.0 + third * by_x;
    gain->xu[lane] = 2.0 * length + third * by_accel;
    gain->ux[lane] = 0.5 * length * (kx[0] + kx[1]);
    gain->uu[lane] = 1.0 + 0.5 * length * (ku[0] + ku[1]);
}

/* Cost of a tied stage by its state, and c^T cc k by x and by u. */
typedef struct tied_cost {
    double xx, xu, uu, by_x[2], by_u[2];
} tied_cost;

static struct tied_cost cost_of_tied(const struct problem *problem,
                                     int k,
                                     const struct tied *tied) {
    const struct stage_cost *cost = &problem->cost;
    const double *kx = tied->kx;
    const double *ku = tied->ku;
    struct tied_cost out;
    out.xx = cost->xx[k];
    out.xu = cost->xu[k];
    out.uu = cost->uu[k];
    for (int i = 0; i < 2; i++) {
        double xc = cost->xc[i][k];
        double uc = cost->uc[i][k];
        double c0 = cost->cc[i][k];
        double c1 = cost->cc[i + 1][k];
        out.by_x[i] = xc + c0 * kx[0] + c1 * kx[1];
        out.by_u[i] = uc + c0 * ku[0] + c1 * ku[1];
        out.xx += kx[i] * (xc + out.by_x[i]);
        out.xu += kx[i] * uc + ku[i] * out.by_x[i];
        out.uu += ku[i] * (uc + out.by_u[i]);
    }
    return out;
}

void tie_to_rest(const struct problem *problem, double kx[2], double ku[2]) {
    double length = problem->lengths[problem->count - 2];
    double t = problem->terminal;
    double den = length * length + t * length;
    kx[0] = kx[1] = -1.0 / den;
    ku[0] = ku[1] = -(2.0 * length + t) / den;
}

/* The last interval ends at rest with constant path jerk, which ties x + 1.5 h
 * u = 0 at its start.  It takes the inputs of the stage before it, which are
 * one: c0 = c1. */
static void factor_last(struct problem *problem, struct cost_to_go *to_go) {
    int k = problem->count - 2;
    const struct stage_cost *cost = &problem->cost;
    struct gain *gain = &problem->gain[0];
    struct tied tied;
    tie_to_rest(problem, tied.kx, tied.ku);
    set_gain(gain, BEHIND, problem->lengths[k], &tied);
    struct tied_cost own = cost_of_tied(problem, k, &tied);
    double xx = cost->xx[k + 1];
    double xu = cost->xu[k + 1];
    double uu = cost->uu[k + 1];
    double axx = gain->xx[BEHIND];
    double axu = gain->xu[BEHIND];
    double aux = gain->ux[BEHIND];
    double auu = gain->uu[BEHIND];
    to_go->xx[BEHIND] =
        own.xx + xx * axx * axx + 2.0 * xu * axx * aux + uu * aux * aux;
    to_go->xu[BEHIND] =
        own.xu + xx * axx * axu + xu * (axx * auu + aux * axu) + uu * aux * auu;
    to_go->uu[BEHIND] =
        own.uu + xx * axu * axu + 2.0 * xu * axu * auu + uu * auu * auu;
}

static double product_of(const double one[2], const double other[2]) {
    return one[0] * other[0] + one[1] * other[1];
}

/* Driven backwards the first stage ends at the state where the window begins,
 * or, behind an interval that starts at rest, at x = 1.5 h v, u = v for any v.
 */
static bool factor_first(struct problem *problem, struct cost_to_go *to_go) {
    int k = problem->first;
    double by_length = 1.0 / problem->lengths[k];
    double squared = 3.0 * by_length * by_length;
    struct tied tied = {{-squared, squared},
                        {-4.0 * by_length, 2.0 * by_length}};
    struct gain *gain = &problem->gain[0];
    struct tied_cost own = cost_of_tied(problem, k, &tied);
    if (problem->from_standstill) {
        double t = squared * 1.5 * problem->lengths[0];
        double by_v[2] = {t + 2.0 * by_length, -t - 4.0 * by_length};
        double *const *cc = problem->cost.cc;
        double vv = by_v[0] * by_v[0] * cc[0][k]
                    + 2.0 * by_v[0] * by_v[1] * cc[1][k]
                    + by_v[1] * by_v[1] * cc[2][k];
        double vx = product_of(by_v, own.by_x);
        double vu = product_of(by_v, own.by_u);
        if (!(vv > 0.0)) {
            return false;
        }
        double inverse = 1.0 / vv;
        own.xx -= vx * vx * inverse;
        own.xu -= vx * vu * inverse;
        own.uu -= vu * vu * inverse;
        for (int i = 0; i < 2; i++) {
            tied.kx[i] -= by_v[i] * vx * inverse;
            tied.ku[i] -= by_v[i] * vu * inverse;
        }
        set_gain(gain, AHEAD, problem->lengths[k], &tied);
        gain->inverse[0][AHEAD] = by_v[0] * by_v[0] * inverse;
        gain->inverse[1][AHEAD] = by_v[0] * by_v[1] * inverse;
        gain->inverse[2][AHEAD] = by_v[1] * by_v[1] * inverse;
    } else {
        set_gain(gain, AHEAD, problem->lengths[k], &tied);
    }
    to_go->xx[AHEAD] = own.xx;
    to_go->xu[AHEAD] = own.xu;
    to_go->uu[AHEAD] = own.uu;
    return true;
}

/* Each stage waits for the one before it.  So what that decides is divided
 * once, and everything else is ready by then. */
static bool factor_pair(struct problem *problem,
                        int p,
                        struct cost_to_go *to_go) {
    const struct stage_cost *cost = &problem->cost;
    const struct stages at = stages_of(problem, p);
    pair length = both(problem->lengths, at);
    pair along = 0.5 * length;
    pair third = THIRD * length * length;
    pair twice = 2.0 * length;
    pair bx[2] = {2.0 * third, third};
    pair px[2], pu[2], sx[2], su[2];
    for (int i = 0; i < 2; i++) {
        px[i] = to_go->xx * bx[i] + to_go->xu * along;
        pu[i] = to_go->xu * bx[i] + to_go->uu * along;
        sx[i] = input_of(cost->xc, i, at) + px[i];
        su[i] = input_of(cost->uc, i, at) + twice * px[i];
        su[i] += pu[i];
    }
    pair p00 = bx[0] * px[0] + along * pu[0];
    pair p01 = bx[0] * px[1] + along * pu[1];
    pair p11 = bx[1] * px[1] + along * pu[1];
    pair r00 = both(cost->cc[0], at) + p00;
    pair r01 = both(cost->cc[1], at) + p01;
    pair r11 = both(cost->cc[2], at) + p11;
    pair det = r00 * r11 - r01 * r01;
    bool convex = r00[AHEAD] > 0.0 && det[AHEAD] > 0.0;
    if (!(convex && r00[BEHIND] > 0.0 && det[BEHIND] > 0.0)) {
        return false;
    }
    pair inverse = 1.0 / det;
    pair x0 = r11 * sx[0] - r01 * sx[1];
    pair x1 = r00 * sx[1] - r01 * sx[0];
    pair u0 = r11 * su[0] - r01 * su[1];
    pair u1 = r00 * su[1] - r01 * su[0];
    pair less_xx = sx[0] * x0 + sx[1] * x1;
    pair less_xu = sx[0] * u0 + sx[1] * u1;
    pair less_uu = su[0] * u0 + su[1] * u1;
    pair xx = both(cost->xx, at) + to_go->xx;
    pair xu = both(cost->xu, at) + (twice * to_go->xx + to_go->xu);
    pair uu = both(cost->uu, at)
              + (twice * (twice * to_go->xx + 2.0 * to_go->xu) + to_go->uu);
    to_go->xx = xx - less_xx * inverse;
    to_go->xu = xu - less_xu * inverse;
    to_go->uu = uu - less_uu * inverse;
    struct gain *gain = &problem->gain[p];
    pair kx[2] = {-x0 * inverse, -x1 * inverse};
    pair ku[2] = {-u0 * inverse, -u1 * inverse};
    gain->length = length;
    gain->kx[0] = kx[0];
    gain->kx[1] = kx[1];
    gain->ku[0] = ku[0];
    gain->ku[1] = ku[1];
    gain->inverse[0] = r11 * inverse;
    gain->inverse[1] = -r01 * inverse;
    gain->inverse[2] = r00 * inverse;
    gain->xx = 1.0 + bx[0] * kx[0];
    gain->xx += bx[1] * kx[1];
    gain->xu = twice + bx[0] * ku[0];
    gain->xu += bx[1] * ku[1];
    gain->ux = along * (kx[0] + kx[1]);
    gain->uu = 1.0 + along * (ku[0] + ku[1]);
    return true;
}

/* The state in the middle by the gradients of both halves there.  A window that
 * is too short for two halves has its start there. */
static bool factor_middle(struct problem *problem,
                          const struct cost_to_go *to_go) {
    double xx = to_go->xx[AHEAD] + to_go->xx[BEHIND];
    double xu = to_go->xu[BEHIND] - to_go->xu[AHEAD];
    double uu = to_go->uu[AHEAD] + to_go->uu[BEHIND];
    struct joined *joined = &problem->joined;
    if (problem->middle > problem->first) {
        double det = xx * uu - xu * xu;
        double inverse = 1.0 / det;
        *joined = (struct joined){uu * inverse, -xu * inverse, xx * inverse};
        return xx > 0.0 && det > 0.0 && isfinite(det);
    }
    *joined = (struct joined){0.0, 0.0, 0.0};
    if (problem->from_standstill) {
        double t = 1.5 * problem->lengths[0];
        double vv = t * t * xx + 2.0 * t * xu + uu;
        *joined = (struct joined){t * t / vv, t / vv, 1.0 / vv};
        return vv > 0.0 && isfinite(vv);
    }
    return isfinite(xx) && isfinite(uu);
}

/* Gains of all stages; false if the cost is not convex (or not a number). */
bool riccati_factor(struct problem *problem) {
    struct cost_to_go to_go = {{0.0, 0.0}, {0.0, 0.0}, {0.0, 0.0}};
    write_none(problem);
    if (problem->middle == problem->first) {
        static const struct tied free = {{0.0, 0.0}, {0.0, 0.0}};
        set_gain(&problem->gain[0], AHEAD, 0.0, &free);
    } else if (!factor_first(problem, &to_go)) {
        return false;
    }
    factor_last(problem, &to_go);
    int pairs = count_pairs(problem);
    for (int p = 1; p < pairs; p++) {
        if (!factor_pair(problem, p, &to_go)) {
            return false;
        }
    }
    return factor_middle(problem, &to_go);
}

/* From the ends to the middle: the gradients of the cost to go there, x and u.
 * What waits for the stage before is two products only. */
static void gather_gradients(struct problem *problem,
                             const struct stage_grad *gradient,
                             pair *x,
                             pair *accel) {
    int last = problem->count - 1;
    int pairs = count_pairs(problem);
    pair px = {0.0, gradient->x[last]};
    pair pu = {0.0, gradient->accel[last]};
    for (int p = 0; p < pairs; p++) {
        const struct gain *gain = &problem->gain[p];
        const struct stages at = stages_of(problem, p);
        pair g0 = input_of(gradient->input, 0, at);
        pair g1 = input_of(gradient->input, 1, at);
        pair length = gain->length;
        pair half = 0.5 * length * pu;
        pair third = THIRD * length * length * px;
        pair r0 = g0 + 2.0 * third + half;
        pair r1 = g1 + third + half;
        const pair *inverse = gain->inverse;
        pair c0 = inverse[0] * r0 + inverse[1] * r1;
        pair c1 = inverse[1] * r0 + inverse[2] * r1;
        problem->free[p][0] = -c0;
        problem->free[p][1] = -c1;
        pair by_x = gain->kx[0] * g0 + gain->kx[1] * g1;
        pair by_accel = gain->ku[0] * g0 + gain->ku[1] * g1;
        pair nx =
            both(gradient->x, at) + by_x + (gain->xx * px + gain->ux * pu);
        pu = both(gradient->accel, at) + by_accel
             + (gain->xu * px + gain->uu * pu);
        px = nx;
    }
    *x = px;
    *accel = pu;
}

/* dx, du, dc for the gradient g. */
void riccati_solve(struct problem *problem, const struct stage_grad *gradient) {
    int last = problem->count - 1;
    pair px, pu;
    gather_gradients(problem, gradient, &px, &pu);
    const struct joined *joined = &problem->joined;
    double by_x = px[AHEAD] + px[BEHIND];
    double by_accel = pu[BEHIND] - pu[AHEAD];
    double middle_x = -(joined->xx * by_x + joined->xu * by_accel);
    double middle_accel = -(joined->xu * by_x + joined->uu * by_accel);
    pair x = {middle_x, middle_x};
    pair accel = {-middle_accel, middle_accel};
    for (int p = count_pairs(problem) - 1; p >= 0; p--) {
        const struct gain *gain = &problem->gain[p];
        const struct stages at = stages_of(problem, p);
        const pair d0 = problem->free[p][0];
        const pair d1 = problem->free[p][1];
        pair length = gain->length;
        pair c0 = gain->kx[0] * x + gain->ku[0] * accel + d0;
        pair c1 = gain->kx[1] * x + gain->ku[1] * accel + d1;
        pair nx = THIRD * length * length * (2.0 * d0 + d1)
                  + (gain->xx * x + gain->xu * accel);
        pair fed_back = gain->ux * x + gain->uu * accel;
        pair nu = 0.5 * length * (d0 + d1) + fed_back;
        problem->dx[at.of[AHEAD]] = nx[AHEAD];
        problem->du[at.of[AHEAD]] = -nu[AHEAD];
        problem->dc[0][at.of[AHEAD]] = c1[AHEAD];
        problem->dc[1][at.of[AHEAD]] = c0[AHEAD];
        problem->dx[at.of[BEHIND]] = x[BEHIND];
        problem->du[at.of[BEHIND]] = accel[BEHIND];
        problem->dc[0][at.of[BEHIND]] = c0[BEHIND];
        problem->dc[1][at.of[BEHIND]] = c1[BEHIND];
        x = nx;
        accel = nu;
    }
    problem->dx[last] = x[BEHIND];
    problem->du[last] = accel[BEHIND];
    problem->dc[0][last] = 0.0;
    problem->dc[1][last] = 0.0;
    problem->dx[0] = 0.0;
    if (problem->from_standstill) {
        problem->dc[0][0] = 0.0;
        problem->dc[1][0] = 0.0;
        problem->dx[1] = 1.5 * problem->lengths[0] * problem->du[1];
    }
    problem->du[0] = 0.0;
}
