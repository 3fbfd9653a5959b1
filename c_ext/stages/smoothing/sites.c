/* Points that pull: how close each has to be, and how much it weighs at first.
 */
#include "stages/smoothing/nodes.h"
#include "stages/smoothing/sites.h"
#include "stages/smoothing/spline_fit.h"
#include "stages/smoothing/state.h"

void site_add(struct window *window,
              const double *position,
              double t,
              double target,
              double allowed,
              int span,
              int axes) {
    struct site *site = &window->sites[window->sites_n++];
    memcpy(site->position, position, sizeof(double) * (size_t)axes);
    site->t = t;
    site->target = target;
    site->allowed = allowed;
    site->span = span;
    site->wish = target < SHARE * allowed;
    double length = window->tau[span + 6] - window->tau[span + 5];
    spline_basis_at(window->basis[span],
                    (t - window->tau[span + 5]) / length,
                    site->basis);
}

static double allowed_at(const nc_smooth *smooth, int i) {
    const struct node *node = &smooth->nodes[i];
    return fmax(smooth->tol - fmax(node->slack, node[1].slack),
                0.1 * smooth->tol);
}

/* How far node i lies off a smooth curve through its neighbours: its bend
 * against that of the nodes beside it. */
static double scatter_at(const nc_smooth *smooth, int i) {
    const struct node *node = &smooth->nodes[i];
    double sum = 0.0;
    double before = node->t - node[-1].t;
    double behind = node[1].t - node->t;
    double share = before / (before + behind);
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        double rate[4];
        for (int k = 0; k < 4; k++) {
            rate[k] = (node[k - 1].position[axis] - node[k - 2].position[axis])
                      / (node[k - 1].t - node[k - 2].t);
        }
        double from = node->t - node[-2].t;
        double left = 2.0 * (rate[1] - rate[0]) / from;
        double to = node[2].t - node->t;
        double right = 2.0 * (rate[3] - rate[2]) / to;
        double own = 2.0 * (rate[2] - rate[1]) / (before + behind);
        double off = own - (1.0 - share) * left - share * right;
        sum += off * off;
    }
    return 0.5 * sqrt(sum) * before * behind;
}

/* The same for all nodes up to `end`, the mean of seven: rounding and noise of
 * the data. */
static void scatter(const nc_smooth *smooth, int end, double *out) {
    double sum[NODES + 1] = {0.0};
    for (int i = 0; i <= end; i++) {
        sum[i + 1] =
            sum[i] + (i >= 2 && i + 2 <= end ? scatter_at(smooth, i) : 0.0);
    }
    for (int i = 0; i <= end; i++) {
        int from = i - 3 > 2 ? i - 3 : 2;
        int to = i + 3 < end - 2 ? i + 3 : end - 2;
        if (from > to) {
            from = to = i < 2 ? 2 : end - 2;
        }
        out[i] = end < 4 ? INFINITY
                         : (sum[to + 1] - sum[from]) / (double)(to + 1 - from);
    }
}

/* How far from a point the curve is sought. */
static double sought_within(const nc_smooth *smooth, double allowed) {
    return smooth->closer * SHARE * allowed;
}

/* Smooth dense data: the chord leaves a curve through its points by little, so
 * the points can be kept as closely as they are known; more buys nothing, and
 * less would follow their rounding. */
static double target_of(const nc_smooth *smooth, int i, double noise) {
    const struct node *node = &smooth->nodes[i];
    double sagitta = 0.125 * node->turn * fmax(node->len, node[1].len);
    double allowed = allowed_at(smooth, i);
    if (node->turn > 0.3 || sagitta > 0.3 * smooth->tol) {
        return sought_within(smooth, allowed);
    }
    return fmin(fmax(fmin(POINT * allowed, POINT_MAX), NOISE * noise),
                sought_within(smooth, allowed));
}

/* Points of the contour that pull: nodes, and the middle of every span that
 * holds none. Behind a failure all of them have to be met. */
void lay_sites(nc_smooth *smooth, int end) {
    struct window *window = &smooth->window;
    int i = 0;
    double noise[NODES];
    scatter(smooth, end, noise);
    window->sites_n = 0;
    while (i < end && smooth->nodes[i].t <= window->tau[5]) {
        i++;
    }
    for (int k = 0; k < window->spans; k++) {
        double from = window->tau[k + 5];
        double to = window->tau[k + 6];
        int first = window->sites_n;
        for (; i < end && smooth->nodes[i].t < to; i++) {
            site_add(window,
                     smooth->nodes[i].position,
                     smooth->nodes[i].t,
                     target_of(smooth, i, noise[i]),
                     allowed_at(smooth, i),
                     k,
                     smooth->cfg.axes);
        }
        double gap = window->sites_n > first ? 0.0 : 0.5;
        if (gap > 0.0 && window->sites_n < SITES) {
            double position[NC_AXES];
            double t = from + gap * (to - from);
            on_chord(smooth, i - 1, t, position);
            double allowed =
                fmax(smooth->tol - smooth->nodes[i].slack, 0.1 * smooth->tol);
            site_add(window,
                     position,
                     t,
                     sought_within(smooth, allowed),
                     allowed,
                     k,
                     smooth->cfg.axes);
        }
        double length = to - from;
        double weight = STIFF / (length * length * length * length * length)
                        / (double)(window->sites_n - first);
        for (int j = first; j < window->sites_n; j++) {
            struct site *site = &window->sites[j];
            site->weight = weight;
            site->wish = site->wish && !(smooth->closer < 1.0);
        }
        window->rho[k] = 1.0;
    }
}
