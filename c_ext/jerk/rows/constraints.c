/* The window's problem: its dimensions, caps, floors and the objective. */
#include <math.h>
#include <string.h>
#include "jerk/rows/axis_rows.h"
#include "jerk/rows/constraints.h"
#include "jerk/state/state.h"
#include "maths/order.h"

/* Index of a row's coefficient for stage k. */
static inline double *lane(vec *v, int k) {
    return (double *)v + k % LANES;
}

static two_sided *jerk_row(struct problem *problem, int k, int end, int i) {
    return jerk_rows_of(problem, k / LANES, end) + i;
}

/* The rest of a row is set where the solver begins with it. */
static void clear_coefficients(two_sided *rows, int count) {
    for (int i = 0; i < count; i++) {
        memset(rows[i].coef, 0, sizeof rows[i].coef);
    }
}

static void clear_rows(struct problem *problem) {
    int rows = problem->blocks * problem->axes;
    clear_coefficients(problem->jerk, 2 * rows);
    clear_coefficients(problem->acc, 2 * rows);
    clear_coefficients(problem->mid, rows);
    memset(problem->used, 0, sizeof *problem->used * (size_t)problem->blocks);
    memset(problem->one,
           0,
           sizeof *problem->one * (size_t)(problem->blocks * ONE_SIDED_ROWS));
    for (int i = 0; i < problem->blocks * ONE_SIDED_ROWS; i++) {
        problem->one[i].bound = (vec){1.0, 1.0, 1.0, 1.0};
    }
    for (int k = 0; k < problem->blocks * LANES; k++) {
        problem->on[k] = 0.0;
        problem->slope[k] = 0.0;
        problem->weight[k] = 0.0;
        problem->pull[k] = 0.0;
        problem->calm[k] = 0.0;
        problem->lengths[k] = 1.0;
        problem->guess[k] = 1.0;
        problem->x[k] = 1.0;
        problem->accel[k] = 0.0;
        problem->input[0][k] = 0.0;
        problem->input[1][k] = 0.0;
        problem->dx[k] = 0.0;
        problem->du[k] = 0.0;
        problem->dc[0][k] = 0.0;
        problem->dc[1][k] = 0.0;
        problem->bow[k] = 0.0;
    }
}

static bool moves(const jerk_planner *planner,
                  const jerk_interval *interval,
                  int end,
                  int axis) {
    double v = 3.0 * planner->scale;
    return fabs(interval->d1[end][axis]) * v > IDLE * planner->cfg.v_max[axis]
           || fabs(interval->d2[end][axis]) * v * v
                  > IDLE * acc_max(planner, interval, axis)
           || fabs(interval->d3[end][axis]) * v * v * v
                  > IDLE * jerk_max(planner, interval, axis);
}

/* Axes that move somewhere in the window; one at the least, whose rows keep the
 * tangents near the iterate. */
static void find_axes(const jerk_planner *planner,
                      const struct grid *grid,
                      struct problem *problem) {
    problem->axes = 0;
    for (int axis = 0; axis < planner->axes; axis++) {
        bool any = false;
        for (int k = 0; k < grid->count && !any; k++) {
            any = moves(planner, grid->seg[k].interval, 0, axis)
                  || moves(planner, grid->seg[k].interval, 1, axis);
        }
        if (any) {
            problem->axis[problem->axes++] = axis;
        }
    }
    if (problem->axes == 0) {
        problem->axis[problem->axes++] = 0;
    }
}

/* Stage k has less of the jerk limit from now on. */
void tighten_rows(struct problem *problem, int k, double by) {
    for (int end = 0; end < 2; end++) {
        for (int n = 0; n < problem->used[k / LANES].jerk; n++) {
            for (int i = 0; i < 3; i++) {
                *lane(&jerk_row(problem, k, end, n)->coef[i], k) /= by;
            }
        }
    }
}

/* What the caps of knot k come to: hard, feed, and the rest intervals beside
 * it. */
static double cap_at(const struct grid *grid, int k) {
    double cap = lesser(grid->knot_cap[k],
                        lesser(grid->seg[k - 1].soft, grid->seg[k].soft));
    if (k == 1 && grid->from_standstill) {
        double length = grid->seg[0].length;
        double accel =
            cbrt(6.0 * length * grid->seg[0].jerk_up * grid->seg[0].jerk_up);
        cap = lesser(cap, 1.5 * length * accel);
    }
    if (k == grid->count - 1) {
        double length = grid->seg[k].length;
        double accel = cbrt(6.0 * length * grid->seg[k].jerk_down
                            * grid->seg[k].jerk_down);
        cap = lesser(cap, 1.5 * length * accel);
    }
    return cap;
}

static void one_row(struct problem *problem,
                    int row,
                    int k,
                    double bx,
                    double bu,
                    double c0,
                    double c1,
                    double bound) {
    struct one_sided *one_sided =
        &problem->one[(k / LANES) * ONE_SIDED_ROWS + row];
    *lane(&one_sided->coef[0], k) = bx;
    *lane(&one_sided->coef[1], k) = bu;
    *lane(&one_sided->coef[2], k) = c0;
    *lane(&one_sided->coef[3], k) = c1;
    *lane(&one_sided->bound, k) = bound;
}

/* The share of the least costs of c^2 that does not outweigh the rows: with low
 * speeds and much jerk c is large. */
static double convex_share(const jerk_planner *planner) {
    double least = ORDINARY;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        least = lesser(least,
                       planner->scale * planner->scale * planner->scale
                           / planner->cfg.j_max[axis]);
    }
    return least * least / (ORDINARY * ORDINARY);
}

/* Dimensions and rows of the problem over a grid; caps and floors follow when
 * the guess is known (`bound_rows`). */
void problem_from_grid(jerk_planner *planner,
                       const struct grid *grid,
                       double x0,
                       double u0) {
    struct problem *problem = &planner->prob;
    problem->count = grid->count;
    find_axes(planner, grid, problem);
    problem->from_standstill = grid->from_standstill;
    problem->paused = false;
    problem->first = grid->from_standstill ? 1 : 0;
    problem->blocks = (grid->count + 1 + LANES - 1) / LANES;
    int half = grid->count / (2 * LANES) * LANES;
    problem->middle = half > 0 ? half : problem->first;
    problem->x0 = x0;
    problem->u0 = u0;
    problem->terminal = 1.5 * grid->seg[grid->count - 1].length;
    problem->convex = convex_share(planner);
    problem->ends = grid->sinks && !grid->stops ? FALL_GAP : GAP;
    problem->stops = grid->stops;
    problem->whole = grid->stops || planner->scarce;
    clear_rows(problem);
    for (int k = 0; k < grid->count; k++) {
        problem->lengths[k] = grid->seg[k].length;
        problem->bow[k] = grid->seg[k].bow;
    }
    axis_rows(planner, grid, problem);
}

/* With the jerk at its limit at both ends and c linear between, the path jerk
 * is larger inside where the speed changes much. */
static double swell(double x0, double x1) {
    return x0 > 0.0 && x1 > 0.0
               ? 0.5 * sqrt(0.5 * (x0 + x1)) * (1.0 / sqrt(x0) + 1.0 / sqrt(x1))
               : 1.0;
}

/* Squared speed that is asked for at knot k, where more of it should fall to
 * that; else 0. */
static double falls_to(const struct grid *grid, int k) {
    double asked = lesser(grid->seg[k - 1].asked, grid->seg[k].asked);
    bool falls = grid->sinks && cap_at(grid, k) > ABOVE_ASKED * asked;
    return falls ? asked : 0.0;
}

/* What is minimised: the time.  Around knot k it is the mean of both lengths
 * times x^(-1/2).  Where speeds are to fall it is a square instead, least at
 * the speed that is asked for.  A millimetre counts about the same there
 * whatever the speed: else high speeds fall at the expense of low ones. Returns
 * what all is divided by, so that the slope at the guess times the guess is 1
 * in the sum. */
static double set_objective(jerk_planner *planner, const struct grid *grid) {
    struct problem *problem = &planner->prob;
    double sum = 0.0;
    double top = 0.0;
    for (int k = 1; k < grid->count; k++) {
        top = greater(top, problem->guess[k]);
    }
    for (int k = 1; k < grid->count; k++) {
        double x = greater(problem->guess[k] / top, SLOWEST);
        problem->weight[k] = 0.5
                             * (grid->seg[k - 1].length + grid->seg[k].length)
                             / (x * sqrt(x));
        sum += problem->weight[k] * problem->guess[k];
    }
    for (int k = 1; k < grid->count; k++) {
        double weight = problem->weight[k] / sum;
        double x = problem->guess[k];
        double asked = falls_to(grid, k);
        bool falls = asked > 0.0;
        double pull = PULL * weight / greater(asked, x);
        problem->slope[k] = falls ? 0.0 : weight * x * sqrt(x);
        problem->weight[k] = falls ? pull * asked : 0.0;
        problem->pull[k] = falls ? pull : 0.0;
    }
    return sum;
}

/* Caps, floors and the objective, from the guess at the knots. */
void bound_rows(jerk_planner *planner, const struct grid *grid) {
    struct problem *problem = &planner->prob;
    double sum = set_objective(planner, grid);
    for (int k = 1; k < grid->count; k++) {
        double cap = cap_at(grid, k);
        double guess = problem->guess[k];
        double fallen = lesser(falls_to(grid, k), guess);
        double floor = greater(GUESS_FLOOR * guess, FALL_FLOOR * fallen);
        one_row(problem, ROW_CAP, k, 1.0 / cap, 0.0, 0.0, 0.0, 1.0);
        one_row(problem, ROW_FLOOR, k, -1.0 / floor, 0.0, 0.0, 0.0, -1.0);
    }
    for (int k = problem->first; k <= grid->count - 2; k++) {
        double most = 0.0;
        for (int i = 0; i < problem->used[k / LANES].jerk; i++) {
            most =
                greater(most,
                        fabs(*lane(&jerk_row(problem, k, 0, i)->coef[2], k)));
        }
        problem->calm[k] = 0.5 * CALM * problem->lengths[k] / sum * most * most
                           * problem->guess[k] * problem->guess[k + 1];
    }
    for (int k = problem->first; k <= grid->count - 2; k++) {
        double more = swell(problem->guess[k], problem->guess[k + 1]);
        if (more > SWELLS) {
            tighten_rows(problem, k, SWELLS / lesser(more, SWELLS_MOST));
        }
        double length = problem->lengths[k];
        double xf = lesser(problem->guess[k], problem->guess[k + 1]);
        double c0 = 5.0 / 24.0 * length * length;
        double c1 =
            length * length / 24.0; /* x in the middle: x + h u + c0 + c1 */
        one_row(problem,
                ROW_MID_FLOOR,
                k,
                -1.0 / xf,
                -length / xf,
                -c0 / xf,
                -c1 / xf,
                -0.5 * GUESS_FLOOR);
        double cap = lesser(grid->seg[k].soft, grid->seg[k].cap);
        if (k > 0) {
            one_row(problem,
                    ROW_RISE,
                    k,
                    1.0 / cap,
                    2.0 / 3.0 * length / cap,
                    0.0,
                    0.0,
                    1.0);
        }
        one_row(problem,
                ROW_FALL,
                k,
                1.0 / cap,
                4.0 / 3.0 * length / cap,
                length * length / 3.0 / cap,
                0.0,
                1.0);
    }
}
