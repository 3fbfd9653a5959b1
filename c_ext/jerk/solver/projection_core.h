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

/* Their slopes at x, accel and the inputs, and that of the distance. */
static inline void stage_slopes(const struct problem *problem,
                                int k,
                                vec guess,
                                struct totals *all) {
    vec x = load(problem->x + k);
    vec accel = load(problem->accel + k);
    vec input[2];
    input[0] = load(problem->input[0] + k);
    input[1] = load(problem->input[1] + k);
    vec most = vmax(guess, set1(TINY));
    all->slopes.x = all->xx * x + all->xu * accel - guess / (most * most);
    all->slopes.accel = all->xu * x + all->uu * accel;
    for (int n = 0; n < 2; n++) {
        all->slopes.x += all->xc[n] * input[n];
        all->slopes.accel += all->uc[n] * input[n];
        all->slopes.input[n] = all->cc[n] * input[0] + all->cc[n + 1] * input[1]
                               + all->xc[n] * x + all->uc[n] * accel;
    }
}

static void stage_costs(struct problem *problem, double stiffness) {
    for (int i = 0; i < problem->blocks; i++) {
        int k = i * LANES;
        vec at = load(problem->guess + k);
        vec guess = vmax(at, set1(TINY));
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
        stage_slopes(problem, k, at, &all);
        store_totals(problem, i, &all);
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
            double kx[2], ku[2];
            tie_to_rest(problem, kx, ku);
            input = kx[0] * x + ku[0] * accel;
        }
        problem->input[0][k] = problem->input[1][k] = input;
        x += 2.0 * length * accel + length * length * input;
        accel += length * input;
    }
}

static void step(struct problem *problem) {
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
    if (!goes_on) {
        roll_out(problem);
    }
    stage_costs(problem, stiffness);
    if (!riccati_factor(problem)) {
        return false;
    }
    step(problem);
    return true;
}
