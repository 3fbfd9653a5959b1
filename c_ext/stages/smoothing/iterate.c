/* Weights of a window: solve, look, and weigh again until the curve fits. */
#include "stages/smoothing/certify.h"
#include "stages/smoothing/iterate.h"
#include "stages/smoothing/nodes.h"
#include "stages/smoothing/sites.h"
#include "stages/smoothing/spline_fit.h"
#include "stages/smoothing/state.h"

/* Square of the curvature of span k at its middle, over all axes. */
static double bend2(const struct window *window, int k, int axes) {
    double length = window->tau[k + 6] - window->tau[k + 5];
    double d1 = 0.0;
    double d2 = 0.0;
    double both = 0.0;
    for (int axis = 0; axis < axes; axis++) {
        double first = 0.0;
        double second = 0.0;
        for (int j = 0; j < ORDER; j++) {
            double control = window->control[k + j][axis];
            first += window->middle[k][0][j] * control;
            second += window->middle[k][1][j] * control;
        }
        first /= length;
        second /= length * length;
        d1 += first * first;
        d2 += second * second;
        both += first * second;
    }
    d1 = fmax(d1, 1e-6);
    return fmax(d2 * d1 - both * both, 0.0) / (d1 * d1 * d1);
}

/* Fairness counts with the sixth power of the speed that the curve found so far
 * allows: jerk is q''' v^3. */
static void weigh_by_speed(nc_smooth *smooth, int end) {
    struct window *window = &smooth->window;
    double v2[SPANS_ROOM];
    double most = 0.0;
    for (int i = 1; i <= end; i++) {
        most = fmax(most, smooth->nodes[i].most);
    }
    double top = most * most;
    for (int k = 0; k < window->spans; k++) {
        v2[k] = fmin(top,
                     smooth->cfg.accel
                         / sqrt(bend2(window, k, smooth->cfg.axes) + 1e-18));
    }
    for (int k = 1; k < window->spans; k++) {
        v2[k] = fmin(v2[k],
                     v2[k - 1]
                         + 2.0 * smooth->cfg.accel
                               * (window->tau[k + 6] - window->tau[k + 5]));
    }
    for (int k = window->spans - 1; k-- > 0;) {
        v2[k] = fmin(v2[k],
                     v2[k + 1]
                         + 2.0 * smooth->cfg.accel
                               * (window->tau[k + 7] - window->tau[k + 6]));
    }
    for (int k = 0; k < window->spans; k++) {
        double share = v2[k] / top;
        window->rho[k] = fmax(RHO_MIN, share * share * share);
    }
}

/* Residual of every point over its target; returns the largest over what is
 * allowed, NaN if any is none. */
static double residuals(nc_smooth *smooth) {
    struct window *window = &smooth->window;
    double most = 0.0;
    double all = 0.0;
    int axes = smooth->cfg.axes;
    for (int k = 0; k < window->sites_n; k++) {
        struct site *site = &window->sites[k];
        double sum[2] = {0.0, 0.0};
        for (int axis = 0; axis < axes; axis += 2) {
            pair miss2 = -*(const pair *)(site->position + axis);
            for (int j = 0; j < ORDER; j++) {
                miss2 +=
                    site->basis[j]
                    * *(const pair *)(window->control[site->span + j] + axis);
            }
            miss2 *= miss2;
            sum[smooth->cfg.rotary >> axis & 1] += miss2[0];
            if (axis + 1 < axes) {
                sum[smooth->cfg.rotary >> (axis + 1) & 1] += miss2[1];
            }
        }
        double most2 = sum[0] > sum[1] ? sum[0] : sum[1];
        double miss = sqrt(most2);
        double share = miss / site->allowed;
        site->miss = miss / site->target;
        all += share;
        if (share > most) {
            most = share;
        }
    }
    return isfinite(all) ? most : all;
}

/* Weights for the next solution. `relax`: closeness that was wanted and is not
 * had is given up, up to what is allowed. `exact`: weights grow to what would
 * do if no other changed; where the curve is soft that is much more than the
 * square of the miss. */
static void reweigh(struct window *window,
                    double least,
                    bool relax,
                    bool exact) {
    for (int k = 0; k < window->sites_n; k++) {
        struct site *site = &window->sites[k];
        if (relax && site->wish && site->miss > 1.0) {
            double target = fmin(RELAX * site->target, SHARE * site->allowed);
            site->miss *= site->target / target;
            site->target = target;
        }
        double factor =
            fmax(site->miss, site->wish ? fmin(least, WISH_LEAST) : least);
        if (site->miss > 1.0) {
            factor = site->miss * site->miss;
            if (exact) {
                factor = fmax(
                    factor,
                    1.0
                        + (site->miss - 1.0)
                              / fmin(site->weight * spline_give(window, site),
                                     1.0));
            }
            factor = fmin(factor, GROWTH);
        }
        double length =
            window->tau[site->span + 6] - window->tau[site->span + 5];
        double first = STIFF * window->rho[site->span]
                       / (length * length * length * length * length);
        site->weight = fmin(site->weight * factor,
                            (site->wish ? WISH_SPREAD : WEIGHT_SPREAD) * first);
    }
}

/* Humps stand between points: one more there, with the weight that makes its
 * deviation what is aimed at. */
static void add_where_it_fails(nc_smooth *smooth,
                               int span,
                               struct verdict verdict,
                               const contour *path,
                               int chord) {
    struct window *window = &smooth->window;
    if (window->sites_n >= SITES - SPANS_ROOM) {
        return;
    }
    while (chord > 0 && path->nodes[chord].t > verdict.t) {
        chord--;
    }
    double position[NC_AXES];
    double weight = 0.0;
    double allowed =
        fmax(smooth->tol - path->nodes[chord + 1].slack, 0.1 * smooth->tol);
    for (int k = 0; k < window->sites_n; k++) {
        if (window->sites[k].span != span) {
            continue;
        }
        window->sites[k].target =
            fmax(window->sites[k].target, WISH_FAILED * allowed);
        window->sites[k].wish = false;
        if (fabs(window->sites[k].t - verdict.t)
            < 1e-3 * (window->tau[span + 6] - window->tau[span + 5])) {
            return;
        }
        weight = fmax(weight, window->sites[k].weight);
    }
    verdict.t = whole_parameter(verdict.t);
    on_chord(smooth, chord, verdict.t, position);
    site_add(window,
             position,
             verdict.t,
             SHARE * allowed,
             allowed,
             span,
             smooth->cfg.axes);
    struct site *site = &window->sites[window->sites_n - 1];
    site->weight =
        fmin(HUMP_WEIGHT * weight,
             (verdict.worst / SHARE - 1.0) / spline_give(window, site));
    site->wish = false;
    site->miss = 1.0;
}

/* All spans against the contour; spans that fail get a point where they do.
 * Returns the largest deviation. */
static double certify_window(nc_smooth *smooth, int end, double *deviation) {
    struct window *window = &smooth->window;
    contour path = {smooth->nodes, end + 1};
    int chord = 0;
    double worst = 0.0;
    for (int k = 0; k < window->spans; k++) {
        double hull[NC_AXES][ORDER];
        spline_hull(window, k, smooth->cfg.axes, hull);
        struct verdict verdict = certify_piece(smooth,
                                               hull,
                                               window->tau[k + 5],
                                               window->tau[k + 6],
                                               &path,
                                               &chord);
        deviation[k] = verdict.distance;
        if (verdict.worst > 1.0) {
            if (!(worst > 1.0)) {
                spline_invert(window);
            }
            add_where_it_fails(smooth, k, verdict, &path, chord);
        }
        worst = fmax(worst, verdict.worst);
    }
    return worst;
}

bool iterate(nc_smooth *smooth, int end, double *deviation) {
    struct window *window = &smooth->window;
    bool failed = false;
    smooth->stats.windows++;
    for (int i = 0; i < ITERATIONS; i++) {
        spline_solve(window, smooth->cfg.axes);
        smooth->stats.solves++;
        double most = residuals(smooth);
        if (!isfinite(most)) {
            return false;
        }
        bool near = i >= SETTLE && (most < 1.0 || (failed && most < NEAR));
        if (near) {
            if (certify_window(smooth, end, deviation) <= 1.0) {
                return true;
            }
            failed = true;
        }
        if (i < SETTLE) {
            double before[SPANS_ROOM];
            memcpy(before, window->rho, sizeof before);
            weigh_by_speed(smooth, end);
            for (int k = 0; k < window->sites_n; k++) {
                window->sites[k].weight *= window->rho[window->sites[k].span]
                                           / before[window->sites[k].span];
            }
        }
        bool exact = i >= GIVE_FROM;
        if (exact) {
            spline_invert(window);
        }
        reweigh(window,
                i < 8 && !failed    ? 0.1
                : i < 14 && !failed ? 0.5
                                    : RELEASE,
                i >= SETTLE,
                exact);
    }
    return false;
}
