/* The law of motion over a window: y = ln v is a spline with the knots of the
 * curve. With derivatives by the contour parameter the jerk of an axis is
 *
 *     e^3y (q''' + 3 y' q'' + (y'' + 2 y'^2) q')
 *
 * What is made small is the integral of e^-y (1 + C sum of r^4), r the jerk of
 * an axis over its limit: the time, and a substitute for the largest jerk that
 * is smooth in y and in the curve.
 */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* loops of fixed length are written out */
#endif
#include "stages/smoothing/spline_fit.h"
#include "stages/smoothing/state.h"
#include "stages/square.h"
#include "maths/order.h"
#include "maths/plain.h"

/* The motion at one place. */
typedef struct motion {
    const struct pace *pace;
    const struct rates *rates;
    const double *penalty;
    double jerk[NC_AXES]; /* of the axes that move, over the limit of each */
    double sum;           /* of the fourth powers of these, with penalties */
} motion;

typedef double basis_row[ORDER];

/* Gauss's places in 0..1 and their weights. */
static const double place_at[LAW_PLACES] = {
    0.1127016653792583,
    0.5,
    0.8872983346207417,
};
static const double place_weight[LAW_PLACES] = {
    5.0 / 18.0,
    8.0 / 18.0,
    5.0 / 18.0,
};

static double span_length(const struct window *window, int span) {
    return window->tau[span + 6] - window->tau[span + 5];
}

/* Derivatives 0..3 of a basis function by t. */
static void derivatives(const double basis[ORDER],
                        double x,
                        double length,
                        double out[4]) {
    double coef[ORDER];
    double scale = 1.0;
    memcpy(coef, basis, sizeof coef);
    for (int order = 0; order < 4; order++) {
        double sum = 0.0;
        for (int k = ORDER - 1 - order; k >= 0; k--) {
            sum = sum * x + coef[k];
        }
        out[order] = sum / scale;
        scale *= length;
        for (int k = 0; k + 1 < ORDER - order; k++) {
            coef[k] = (k + 1) * coef[k + 1];
        }
    }
}

static void lay_places(struct window *window) {
    for (int k = 0; k < window->spans; k++) {
        double length = span_length(window, k);
        for (int g = 0; g < LAW_PLACES; g++) {
            for (int j = 0; j < ORDER; j++) {
                double out[4];
                derivatives(window->basis[k][j], place_at[g], length, out);
                for (int order = 0; order < 4; order++) {
                    window->place[k][g][order][j] = out[order];
                }
            }
        }
    }
}

void curve_changed(nc_smooth *smooth) {
    struct window *window = &smooth->window;
    for (int span = 0; span < window->spans; span++) {
        const double (*control)[AXES_EVEN] = window->control + span;
        for (int place = 0; place < LAW_PLACES; place++) {
            const basis_row *basis = window->place[span][place];
            struct rates *out = &window->rates[span][place];
            for (int axis = 0; axis < smooth->cfg.axes; axis += 2) {
                pair q1 = {0.0, 0.0};
                pair q2 = q1;
                pair q3 = q1;
                for (int j = 0; j < ORDER; j++) {
                    pair at = *(const pair *)(control[j] + axis);
                    q1 += basis[1][j] * at;
                    q2 += basis[2][j] * at;
                    q3 += basis[3][j] * at;
                }
                *(pair *)(out->q1 + axis) = q1;
                *(pair *)(out->q2 + axis) = q2;
                *(pair *)(out->q3 + axis) = q3;
            }
        }
    }
}

static void motion_at(const nc_smooth *smooth,
                      int span,
                      int place,
                      struct motion *out) {
    const struct window *window = &smooth->window;
    const struct pace *pace = &window->pace[span][place];
    const struct rates *rates = &window->rates[span][place];
    out->pace = pace;
    out->rates = rates;
    out->penalty = window->penalty[span][place];
    out->sum = 0.0;
    for (int k = 0; k < window->moving_n; k++) {
        int axis = window->moving[k];
        double by_law =
            3.0 * pace->y1 * rates->q2[axis] + pace->bend * rates->q1[axis];
        double jerk = pace->cube * (rates->q3[axis] + by_law);
        out->jerk[k] = jerk * smooth->slowness[axis];
        out->sum += out->penalty[k] * square(square(out->jerk[k]));
    }
}

void law_changed(nc_smooth *smooth) {
    struct window *window = &smooth->window;
    for (int k = 0; k < window->spans; k++) {
        const double *law = window->law + k;
        for (int place = 0; place < LAW_PLACES; place++) {
            const basis_row *basis = window->place[k][place];
            struct pace *pace = &window->pace[k][place];
            double y = dot(basis[0], law, ORDER);
            double slow = plain_exp(-y);
            pace->y1 = dot(basis[1], law, ORDER);
            pace->bend = dot(basis[2], law, ORDER) + 2.0 * square(pace->y1);
            pace->cube = 1.0 / (slow * slow * slow * smooth->jerk);
            pace->weight = place_weight[place] * span_length(window, k) * slow;
            pace->over = greater(0.0, y - window->law_top[k]);
        }
    }
}

static double cost_at(const struct motion *at) {
    return 1.0 + LAW_JERK * at->sum + LAW_TOP * square(at->pace->over);
}

double law_cost(const nc_smooth *smooth) {
    double cost = 0.0;
    for (int k = 0; k < smooth->window.spans; k++) {
        for (int place = 0; place < LAW_PLACES; place++) {
            struct motion at;
            motion_at(smooth, k, place, &at);
            cost += at.pace->weight * cost_at(&at);
        }
    }
    return cost;
}

/* Equations of a step; zeros stand before and behind them. */
typedef struct law_system {
    double band[ORDER + CONTROLS + ORDER][ORDER];
    pair right[ORDER + CONTROLS + ORDER];
} law_system;

/* How the jerk of an axis, the k-th of those that move, changes with the
 * control points of y. */
static void jerk_along(const struct motion *at,
                       int k,
                       int axis,
                       double slowness,
                       const basis_row *basis,
                       double *out) {
    double cube = slowness * at->pace->cube;
    double q1 = cube * at->rates->q1[axis];
    double first = 3.0 * cube * at->rates->q2[axis] + 4.0 * at->pace->y1 * q1;
    for (int j = 0; j < ORDER; j++) {
        out[j] = 3.0 * at->jerk[k] * basis[0][j] + first * basis[1][j]
                 + q1 * basis[2][j];
    }
}

/* band += weight (left right'), the upper half. */
static void add_product(double (*band)[ORDER],
                        double weight,
                        const double *left,
                        const double *right) {
    for (int i = 0; i < ORDER; i++) {
        double factor = weight * left[i];
        for (int j = i; j < ORDER; j++) {
            band[i][j - i] += factor * right[j];
        }
    }
}

/* Gradient and curvature of what one place costs, without the part that could
 * make the curvature negative. */
static void add_place(const nc_smooth *smooth,
                      struct law_system *system,
                      int span,
                      int place) {
    const struct window *window = &smooth->window;
    const basis_row *basis = window->place[span][place];
    double (*band)[ORDER] = system->band + ORDER + span;
    struct motion at;
    motion_at(smooth, span, place, &at);
    double weight = at.pace->weight;
    double along[ORDER];
    double all[ORDER] = {0.0};
    for (int k = 0; k < window->moving_n; k++) {
        double heavy = 4.0 * LAW_JERK * at.penalty[k] * square(at.jerk[k]);
        int axis = window->moving[k];
        jerk_along(&at, k, axis, smooth->slowness[axis], basis, along);
        add_product(band, 3.0 * heavy * weight, along, along);
        for (int j = 0; j < ORDER; j++) {
            all[j] += heavy * at.jerk[k] * along[j];
        }
    }
    double cost = cost_at(&at);
    double steep = at.pace->over > 0.0 ? 2.0 * LAW_TOP : 0.0;
    add_product(band, weight * (cost + steep), basis[0], basis[0]);
    for (int j = 0; j < ORDER; j++) {
        double slope = (cost - steep * at.pace->over) * basis[0][j] - all[j];
        system->right[ORDER + span + j][0] += weight * slope;
    }
}

static void fix_law(struct law_system *system, int k) {
    for (int off = 0; off < ORDER; off++) {
        system->band[ORDER + k][off] = 0.0;
        system->band[ORDER + k - off][off] = 0.0;
    }
    system->band[ORDER + k][0] = 1.0;
    system->right[ORDER + k] = (pair){0.0, 0.0};
}

/* The step of every control point of y; returns the largest, not finite: there
 * is no step. */
static double solve_step(const nc_smooth *smooth, struct law_system *system) {
    const struct window *window = &smooth->window;
    int count = window->spans + 5;
    memset(system, 0, sizeof *system);
    for (int k = 0; k < window->spans; k++) {
        for (int place = 0; place < LAW_PLACES; place++) {
            add_place(smooth, system, k, place);
        }
    }
    for (int k = 0; k < count; k++) {
        system->band[ORDER + k][0] *= 1.0 + LAW_DAMP;
        if (k < window->law_head || k >= count - window->law_tail) {
            fix_law(system, k);
        }
    }
    spline_band_solve(system->band, system->right, count);
    double most = 0.0;
    double all = 0.0;
    for (int k = 0; k < count; k++) {
        double step = system->right[ORDER + k][0];
        most = fmax(most, fabs(step));
        all += step;
    }
    return isfinite(all) ? most : all;
}

/* A step of Newton's method; false: there is none. */
static bool move(nc_smooth *smooth) {
    struct law_system system;
    double most = solve_step(smooth, &system);
    if (!isfinite(most)) {
        return false;
    }
    double share = most > LAW_STEP ? LAW_STEP / most : 1.0;
    for (int k = 0; k < smooth->window.spans + 5; k++) {
        smooth->window.law[k] += share * system.right[ORDER + k][0];
    }
    law_changed(smooth);
    return true;
}

bool law_step(nc_smooth *smooth, double *cost) {
    struct window *window = &smooth->window;
    double before[CONTROLS];
    memcpy(before, window->law, sizeof before);
    bool good = move(smooth);
    for (int i = 0; i < LAW_TRIES && good; i++) {
        double now = law_cost(smooth);
        if (now < *cost) {
            *cost = now;
            return true;
        }
        for (int k = 0; k < window->spans + 5; k++) {
            window->law[k] = 0.5 * (window->law[k] + before[k]);
        }
        law_changed(smooth);
    }
    memcpy(window->law, before, sizeof before);
    law_changed(smooth);
    return false;
}

/* A fourth power is made small by steps of a weighted square: its own slope and
 * curvature at the jerk that is there, and a little more curvature where there
 * is none. */
static void roughness_at(nc_smooth *smooth, int span, int place) {
    struct window *window = &smooth->window;
    const basis_row *basis = window->place[span][place];
    double *row = window->row[span][place];
    struct motion at;
    motion_at(smooth, span, place, &at);
    for (int j = 0; j < ORDER; j++) {
        row[j] = basis[3][j] + 3.0 * at.pace->y1 * basis[2][j]
                 + at.pace->bend * basis[1][j];
    }
    for (int k = 0; k < window->moving_n; k++) {
        int axis = window->moving[k];
        double jerk = at.jerk[k];
        double heavy = square(jerk) + LAW_FLOOR;
        double aim = jerk - jerk * square(jerk) / (3.0 * heavy);
        double cube = smooth->slowness[axis] * at.pace->cube;
        double weight =
            12.0 * LAW_JERK * at.penalty[k] * at.pace->weight * square(cube);
        double pull = weight * heavy * aim / cube;
        window->heavy[span][place][axis] = weight * heavy;
        for (int j = 0; j < ORDER; j++) {
            window->pull[span + j][axis] += pull * row[j];
        }
    }
}

void law_roughness(nc_smooth *smooth) {
    struct window *window = &smooth->window;
    memset(window->pull, 0, sizeof window->pull);
    for (int k = 0; k < window->spans; k++) {
        for (int place = 0; place < LAW_PLACES; place++) {
            roughness_at(smooth, k, place);
        }
    }
}

double kept_share(const struct window *window, int control) {
    double share = fmin(1.0, 2.0 - 2.0 * control / window->kept);
    return share * share * (3.0 - 2.0 * share);
}

/* Speed at which a span may be driven, from its bend and third derivative. */
static double speed_of(const nc_smooth *smooth, int span) {
    const struct window *window = &smooth->window;
    double second = 0.0;
    double third = 0.0;
    for (int place = 0; place < LAW_PLACES; place++) {
        struct motion at;
        motion_at(smooth, span, place, &at);
        second =
            fmax(second, dot(at.rates->q2, at.rates->q2, smooth->cfg.axes));
        for (int k = 0; k < window->moving_n; k++) {
            int axis = window->moving[k];
            double slowness = smooth->slowness[axis];
            third +=
                place_weight[place] * square(slowness * at.rates->q3[axis]);
        }
    }
    double v = plain_exp(window->law_top[span]);
    v = fmin(v, sqrt(smooth->cfg.accel / (sqrt(second) + 1e-9)));
    return fmin(v, plain_cbrt(smooth->jerk / (sqrt(third) + 1e-9)));
}

/* Jerk of the slowest axis that moves. */
static double slowest_jerk(const nc_smooth *smooth) {
    const struct window *window = &smooth->window;
    double most = 1.0;
    for (int k = 0; k < window->moving_n; k++) {
        most = fmax(most, smooth->slowness[window->moving[k]]);
    }
    return smooth->jerk / most;
}

/* Between two speeds v^1.5 changes along the way by at most so much: it is
 * linear where the jerk is constant from rest on. */
static void reach(const nc_smooth *smooth, double *power) {
    const struct window *window = &smooth->window;
    double slope = LAW_SLOPE * sqrt(slowest_jerk(smooth));
    for (int k = 1; k < window->spans; k++) {
        double way = window->tau[k + 6] - window->tau[k + 4];
        power[k] = fmin(power[k], power[k - 1] + slope * way);
    }
    for (int k = window->spans - 1; k-- > 0;) {
        double way = window->tau[k + 7] - window->tau[k + 5];
        power[k] = fmin(power[k], power[k + 1] + slope * way);
    }
}

/* The feed of every span. */
static void lay_tops(nc_smooth *smooth, int end) {
    struct window *window = &smooth->window;
    int node = 1;
    for (int k = 0; k < window->spans; k++) {
        double middle = 0.5 * (window->tau[k + 5] + window->tau[k + 6]);
        while (node < end && smooth->nodes[node].t <= middle) {
            node++;
        }
        double feed = smooth->nodes[node].feed;
        double most = smooth->nodes[node].most;
        window->law_top[k] =
            plain_log(fmax(feed > 0.0 ? fmin(feed, most) : most, 1e-3));
    }
}

/* Axes that move in this window. */
static void lay_moving(nc_smooth *smooth) {
    struct window *window = &smooth->window;
    window->moving_n = 0;
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        double most = 0.0;
        for (int k = 1; k < window->spans + 5; k++) {
            double off = window->control[k][axis] - window->control[0][axis];
            most = fmax(most, fabs(off));
        }
        if (most > ZERO) {
            window->moving[window->moving_n++] = axis;
        }
    }
}

/* ln v at which the path leaves a standstill over a span of this length. */
static double rest(const nc_smooth *smooth, double length) {
    return plain_log(LAW_REST
                     * plain_cbrt(slowest_jerk(smooth) * square(length)));
}

static void first_guess(nc_smooth *smooth, bool rests, bool stops) {
    struct window *window = &smooth->window;
    double power[SPANS_ROOM];
    int last = window->spans - 1;
    double root = sqrt(slowest_jerk(smooth));
    for (int k = 0; k <= last; k++) {
        double v = speed_of(smooth, k);
        power[k] = v * sqrt(v);
    }
    if (rests) {
        power[0] = fmin(power[0], root * span_length(window, 0));
    }
    if (stops) {
        power[last] = fmin(power[last], root * span_length(window, last));
    }
    reach(smooth, power);
    for (int j = window->law_head; j < last + 6; j++) {
        int k = j < 2 ? 0 : j - 2 < last ? j - 2 : last;
        window->law[j] = plain_log(fmax(power[k], 1e-6)) / 1.5 - LAW_SLOWER;
    }
    for (int j = window->law_head; j < window->kept; j++) {
        double off = smooth->keep.law[j] - window->law[j];
        window->law[j] += kept_share(window, j) * off;
    }
}

static void lay_penalties(struct window *window) {
    for (int k = 0; k < window->spans; k++) {
        for (int place = 0; place < LAW_PLACES; place++) {
            for (int i = 0; i < window->moving_n; i++) {
                window->penalty[k][place][i] = 1.0;
            }
        }
    }
}

/* Whether the cost is little more than the time: law and curve suit each other.
 */
static bool settled(const struct window *window, double cost) {
    double time = 0.0;
    for (int k = 0; k < window->spans; k++) {
        for (int place = 0; place < LAW_PLACES; place++) {
            time += window->pace[k][place].weight;
        }
    }
    return cost < LAW_SUITS * time;
}

/* Lawson's way to the least maximum: a weight grows by what it weighs. At a
 * line the law may be too fast: no jerk becomes cheaper. Between two nothing
 * changes.
 */
double law_reweigh(nc_smooth *smooth, double cost) {
    struct window *window = &smooth->window;
    int lines = (window->fixed_head == 3) + (window->fixed_tail == 3);
    if (lines == 2 || !settled(window, cost)) {
        return cost;
    }
    cost = 0.0;
    for (int k = 0; k < window->spans; k++) {
        for (int place = 0; place < LAW_PLACES; place++) {
            struct motion at;
            motion_at(smooth, k, place, &at);
            at.sum = 0.0;
            for (int i = 0; i < window->moving_n; i++) {
                double *penalty = &window->penalty[k][place][i];
                double wanted = *penalty * sqrt(fabs(at.jerk[i]));
                double least = smooth->penalty_least[window->moving[i]];
                *penalty = greater(wanted, lines > 0 ? 1.0 : least);
                at.sum += *penalty * square(square(at.jerk[i]));
            }
            cost += at.pace->weight * cost_at(&at);
        }
    }
    return cost;
}

bool law_begin(nc_smooth *smooth, int end, bool final) {
    struct window *window = &smooth->window;
    int last = window->spans - 1;
    bool rests = window->law_head == 0 && smooth->nodes[0].kind == NODE_BREAK;
    bool stops = final && smooth->nodes[end].kind == NODE_BREAK;
    lay_places(window);
    lay_tops(smooth, end);
    lay_moving(smooth);
    curve_changed(smooth);
    for (int j = window->law_head; j < last + 6; j++) {
        window->law[j] = 0.0;
    }
    law_changed(smooth);
    lay_penalties(window);
    first_guess(smooth, rests, stops);
    if (rests) {
        window->law_head = 1;
        window->law[0] = rest(smooth, span_length(window, 0));
    }
    window->law_tail = stops;
    if (stops) {
        window->law[last + 5] = rest(smooth, span_length(window, last));
    }
    law_changed(smooth);
    double cost = law_cost(smooth);
    bool going = isfinite(cost);
    for (int i = 0; i < LAW_STEPS && going; i++) {
        double before = cost;
        going = law_step(smooth, &cost) && cost < (1.0 - LAW_SETTLED) * before;
    }
    return isfinite(cost);
}
