/* Interior-point solver of the window (Mehrotra's predictor and corrector),
 * LANES stages at a time: the code, included once per instruction set
 * (IPM_SOLVE names the function).  Every lane does the same operations in the
 * same order, so the results do not depend on the instruction set.
 *
 * Minimise the time under the rows of constraints.c.  In the time x^(-1/2) has
 * its slope and its curvature at the present iterate.  In the jerk rows it is
 * replaced by its tangent there: an inner approximation, since it is convex.
 * The iterate meets the dynamics at all times; only the rows may be missed on
 * the way.
 */
#include <math.h>
#include "jerk/solver/interior_point_start.h"
#include "jerk/solver/interior_point_step.h"
#include "jerk/solver/riccati.h"
#include "jerk/state/tuning.h"

static int count_sides(const struct problem *problem) {
    int sides = 0;
    for (int i = 0; i < problem->blocks; i++) {
        const struct used *used = &problem->used[i];
        int two_sided = 2 * used->jerk + acc_used(used) + mid_used(used);
        sides += LANES * (2 * two_sided + used->end - used->first);
    }
    return sides;
}

static inline double step_length(vec most) {
    double m = top(most);
    return m > TO_BOUNDARY ? TO_BOUNDARY / m : 1.0;
}

/* From the guess in x, u, c to the optimum, or on from where it has paused.
 * With b->pause it stops once at that gap, so that rows may be changed.  false:
 * no convergence (or paused); the checker judges what is there all the same. */
bool IPM_SOLVE(struct problem *problem, int max_iterations) {
    int rows = count_sides(problem);
    double least = 0.0;
    double lowest = INFINITY; /* gap so far */
    if (!problem->paused) {
        set_scale(problem);
        start(problem, START_MU / rows);
        problem->iterations = 0;
        problem->missed = problem->dual = 1.0;
    } else {
        reopen(problem);
        take_in(problem, ROWS_NEAR, problem->gap / rows);
        rows = count_sides(problem);
    }
    problem->paused = false;
    for (; problem->iterations < max_iterations; problem->iterations++) {
        if (problem->iterations > 0
            && catch_falling(problem, problem->gap / rows)) {
            rows = count_sides(problem);
        }
        gather(problem, least);
        if (!riccati_factor(problem)) {
            return false;
        }
        riccati_solve(problem, &problem->grad);
        struct scan scan = predict(problem);
        double gap = sum(scan.sl);
        double mu = gap / rows;
        lowest = fmin(lowest, gap);
        if (!(gap < HOPELESS)
            || (problem->stops && gap > STOP_GAP_RISES * lowest)) {
            return false;
        }
        double ap = fmin(1.0, 1.0 / fmax(1e-9, top(scan.ps)));
        double ad = fmin(1.0, 1.0 / fmax(1e-9, 1.0 + top(scan.pl)));
        double dsl = -sum(scan.dsl); /* s dl = -s l - ds l */
        double dsdl = -dsl - sum(scan.dsdsl);
        double after =
            (gap + ap * dsl - ad * (gap + dsl) + ap * ad * dsdl) / rows;
        double ratio = fmax(after, 0.0) / mu;
        double sigma = ratio * ratio * ratio;
        combine(problem, sigma * mu);
        riccati_solve(problem, &problem->grad);
        scan = correct(problem, sigma * mu);
        ap = step_length(scan.ps);
        ad = step_length(scan.pl);
        if (!isfinite(ap + ad)) {
            return false;
        }
        ad = fmin(ad, DUAL_STEP * ap);
        problem->gap = move(problem, ap, ad);
        least = CENTRED * sigma * mu;
        problem->missed *= 1.0 - ap;
        problem->dual *= 1.0 - ad;
        if (problem->gap < problem->ends && problem->missed < ROWS_MET
            && problem->dual < 1e-2) {
            if (take_in(problem, 1.0, problem->gap / rows)) {
                rows = count_sides(problem);
                continue;
            }
            problem->iterations++;
            return true;
        }
        if (ap < STUCK) {
            reopen(problem);
        }
        if (gap < problem->pause) {
            problem->pause = 0.0;
            problem->paused = true;
            problem->iterations++;
            return false;
        }
    }
    return false;
}
