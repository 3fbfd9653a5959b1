/* A guess that uses more of the limits.
 *
 * Caps from the derivatives at a place know nothing of the path jerk that
 * cancels what a bend asks for.  So they are several times too low where jerk
 * decides: in the squared speed twice at corners, up to 100 times at single
 * knots between axes of unequal limits.  From there the solver needs many short
 * steps, since the tangents of its jerk rows hold near the iterate only.
 *
 * Here each knot is made faster by what the jerks and accelerations beside it
 * leave, then the nearest profile is looked for, some times over.  A knot is
 * never made slower: where a limit is exceeded, the neighbours are as much to
 * blame.
 */
#include <math.h>
#include "jerk/solver/faster_guess.h"
#include "jerk/solver/projection_core.h"
#include "maths/order.h"

/* Largest jerk of an axis at the ends of the stages of block i, over its limit.
 */
static vec largest_jerk(const struct problem *problem, int i) {
    int k = i * LANES;
    vec x[2] = {load(problem->x + k)};
    vec accel[2] = {load(problem->accel + k)};
    const vec input[2] = {load(problem->input[0] + k),
                          load(problem->input[1] + k)};
    vec length = load(problem->lengths + k);
    end_state(length, x[0], accel[0], input, &x[1], &accel[1]);
    vec most = set1(TINY);
    for (int end = 0; end < 2; end++) {
        const two_sided *row = jerk_rows_of(problem, i, end);
        vec root = root_of(vmax(x[end], set1(TINY)));
        for (int n = 0; n < problem->used[i].jerk; n++, row++) {
            vec form = jerk_value(row, x[end], accel[end], input[end]);
            most = vmax(most, root * size_of(form));
        }
    }
    return most;
}

/* The same of the accelerations at their starts. */
static vec largest_acceleration(const struct problem *problem, int i) {
    vec x = load(problem->x + i * LANES);
    vec accel = load(problem->accel + i * LANES);
    const two_sided *row = acc_rows_of(problem, i);
    vec most = set1(TINY);
    for (int n = 0; n < problem->used[i].acc; n++, row++) {
        most = vmax(most, size_of(acc_value(row, x, accel)));
    }
    return most;
}

/* Factors by which the squared speed may grow on the stages of block i.
 * Accelerations grow with it, jerks with the power 3/2 of it; 3/4 instead of
 * 2/3 takes no cube root. */
static vec may_grow(const struct problem *problem, int i) {
    vec by_jerk = root_of(GROW_GOAL / largest_jerk(problem, i));
    vec by_acc = GROW_GOAL / largest_acceleration(problem, i);
    by_jerk *= root_of(by_jerk);
    vec least = -vmax(-by_jerk, -by_acc);
    return -vmax(set1(-GROW_MOST), -vmax(least, set1(1.0)));
}

/* Growth of the stages, which changes little from one to the next. */
static void find_growth(const struct problem *problem, double *growth) {
    int last = problem->count - 1;
    for (int i = 0; i < problem->blocks; i++) {
        store(growth + i * LANES, may_grow(problem, i));
    }
    growth[last] = GROW_MOST; /* without rows: it follows from the one before */
    if (problem->first > 0) {
        growth[0] = GROW_MOST;
    }
    for (int k = 1; k <= last; k++) {
        growth[k] = lesser(growth[k], GROW_STEP * growth[k - 1]);
    }
    for (int k = last - 1; k >= 0; k--) {
        growth[k] = lesser(growth[k], GROW_STEP * growth[k + 1]);
    }
}

/* The profile where it is neither far below the guess nor above what a guess
 * may be. */
static double start_of_growth(const struct problem *problem, int k) {
    return lesser(problem->most[k],
                  greater(problem->x[k], GROW_LEAST * problem->guess[k]));
}

/* One more round; returns the mean change. */
static double grow(struct problem *problem, double *growth) {
    double change = 0.0;
    find_growth(problem, growth);
    for (int k = 1; k < problem->count; k++) {
        double x = start_of_growth(problem, k);
        double by = lesser(growth[k - 1], growth[k]);
        double to = lesser(x * by, greater(problem->cap[k], x));
        to = greater(lesser(to, problem->most[k]), TINY);
        change += fabs(to / problem->guess[k] - 1.0);
        problem->guess[k] = to;
    }
    return change / problem->count;
}

/* How much x changes at the most from knot k to the next one. */
static double most_change(const struct problem *problem, int k) {
    return 2.0 * problem->lengths[k] / sqrt(problem->brake[k]);
}

/* The nearest profile passes over low caps of single knots.  Beside them the
 * guess is as fast as all of the acceleration makes it. */
static void keep_caps(struct problem *problem) {
    double *guess = problem->guess;
    int last = problem->count - 1;
    for (int k = 1; k < last; k++) {
        double most = guess[k] + most_change(problem, k);
        guess[k + 1] = lesser(guess[k + 1], most);
    }
    for (int k = last - 1; k >= 1; k--) {
        double most = guess[k + 1] + most_change(problem, k);
        guess[k] = lesser(guess[k], most);
    }
}

bool PROJECTION(faster_guess)(struct problem *problem, double *growth) {
    for (int i = 0; i < GROW_ROUNDS && grow(problem, growth) > GROWN; i++) {
        if (!PROJECTION(nearest_profile)(problem, STIFFNESS, true)) {
            return false;
        }
    }
    for (int k = 1; k < problem->count; k++) {
        problem->guess[k] = greater(start_of_growth(problem, k), TINY);
    }
    keep_caps(problem);
    return true;
}
