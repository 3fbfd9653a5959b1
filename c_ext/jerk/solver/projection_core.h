/* The nearest profile to a guess that meets the dynamics: least squares of the
 * squared speed against the guess, of the path acceleration and of the axes'
 * jerks.  It is one linear-quadratic problem.
 *
 * PROJECTION(name): the build's name of what projection.h declares. */
#include <math.h>
#include "jerk/solver/interior_point_stage.h"
#include "jerk/solver/projection.h"
#include "jerk/solver/riccati.h"
#include "jerk/state/tuning.h"

/* Squares of the axes' jerks at the ends of the stages of block i. */
static void jerk_cost(const struct problem *problem,
                      int i,
                      const vec *weight,
                      struct totals *totals) {
    vec length = load(problem->lengths + i * LANES);
    for (int end = 0; end < 2; end++) {
        const two_sided *row = jerk_rows_of(problem, i, end);
        struct sums sums;
        clear_sums(&sums);
        for (int n = 0; n < problem->used[i].jerk; n++, row++) {
            add_square(&sums, *weight, row->coef);
        }
        if (end == 0) {
            add_start(totals, &sums);
        } else {
            add_end(totals, &sums, length);
        }
    }
}

static void stage_costs(struct problem *problem, double stiffness) {
    const struct stage_cost *cost = &problem->cost;
    for (int i = 0; i < problem->blocks; i++) {
        int k = i * LANES;
        vec guess = vmax(load(problem->guess + k), set1(TINY));
        struct totals all;
        clear_totals(&all);
        all.xx = 1.0 / (guess * guess);
        all.uu = stiffness * load(problem->brake + k);
        vec length = load(problem->lengths + k);
        vec area = length * length / guess;
        vec least = GUESS_SHARE * area * area;
        all.cc[0] = all.cc[2] = GUESS_LEAST_COST * problem->convex + least;
        vec weight = 0.5 * stiffness * guess;
        jerk_cost(problem, i, &weight, &all);
        store(cost->xx + k, all.xx);
        store(cost->xu + k, all.xu);
        store(cost->uu + k, all.uu);
        store(cost->cc[1] + k, all.cc[1]);
        for (int n = 0; n < 2; n++) {
            store(cost->xc[n] + k, all.xc[n]);
            store(cost->uc[n] + k, all.uc[n]);
            store(cost->cc[2 * n] + k, all.cc[2 * n]);
        }
    }
}

/* Slope of that cost at the present x, accel and inputs. */
static void stage_slopes(struct problem *problem) {
    const struct stage_cost *cost = &problem->cost;
    for (int k = 0; k < problem->blocks * LANES; k += LANES) {
        vec x = load(problem->x + k);
        vec accel = load(problem->accel + k);
        vec c0 = load(problem->input[0] + k);
        vec c1 = load(problem->input[1] + k);
        vec guess = load(problem->guess + k);
        vec most = vmax(guess, set1(TINY));
        vec xu = load(cost->xu + k);
        vec by_x = load(cost->xx + k) * x + xu * accel;
        vec by_accel = xu * x + load(cost->uu + k) * accel;
        vec both = load(cost->cc[1] + k);
        vec by_c0 = load(cost->cc[0] + k) * c0 + both * c1;
        vec by_c1 = both * c0 + load(cost->cc[2] + k) * c1;
        vec xc0 = load(cost->xc[0] + k);
        vec xc1 = load(cost->xc[1] + k);
        vec uc0 = load(cost->uc[0] + k);
        vec uc1 = load(cost->uc[1] + k);
        by_x += xc0 * c0 + xc1 * c1 - guess / (most * most);
        by_accel += uc0 * c0 + uc1 * c1;
        store(problem->grad.x + k, by_x);
        store(problem->grad.accel + k, by_accel);
        store(problem->grad.input[0] + k, by_c0 + xc0 * x + uc0 * accel);
        store(problem->grad.input[1] + k, by_c1 + xc1 * x + uc1 * accel);
    }
}

/* From the start without inputs: what meets the dynamics, and the rest at the
 * end. */
static void roll_out(struct problem *problem) {
    bool stands = problem->from_standstill;
    double x = stands ? 0.0 : problem->x0;
    double accel = stands ? 0.0 : problem->u0;
    int last = problem->count - 1;
    for (int k = problem->first; k <= last; k++) {
        problem->x[k] = x;
        problem->accel[k] = accel;
        double length = problem->lengths[k];
        double input = 0.0;
        if (k == last - 1) {
            const struct gain *gain = &problem->gain[k];
            input = gain->kx[0] * x + gain->ku[0] * accel;
        }
        problem->input[0][k] = problem->input[1][k] = input;
        x += 2.0 * length * accel + length * length * input;
        accel += length * input;
    }
}

static void step(struct problem *problem) {
    stage_slopes(problem);
    riccati_solve(problem, &problem->grad);
    for (int k = problem->first; k < problem->count; k++) {
        problem->x[k] += problem->dx[k];
        problem->accel[k] += problem->du[k];
        for (int i = 0; i < 2; i++) {
            problem->input[i][k] += problem->dc[i][k];
        }
    }
    if (problem->from_standstill) {
        problem->x[0] = 0.0;
        problem->accel[0] = 0.0;
        problem->input[0][0] = 0.0;
        problem->input[1][0] = 0.0;
    }
}

bool PROJECTION(nearest_profile)(struct problem *problem,
                                 double stiffness,
                                 bool goes_on) {
    stage_costs(problem, stiffness);
    if (!riccati_factor(problem)) {
        return false;
    }
    if (!goes_on) {
        roll_out(problem);
    }
    step(problem);
    return true;
}
