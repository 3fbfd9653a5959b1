/* A certified curve made faster: Newton's steps on the cost of the motion, with
 * walls at the tolerance. Every step that is taken is certified, so the curve
 * at hand is always good, and work may end at any time. */
#include "stages/smoothing/certify.h"
#include "stages/smoothing/spline_fit.h"
#include "stages/smoothing/nodes.h"
#include "stages/smoothing/iterate.h"
#include "stages/smoothing/sites.h"
#include "stages/smoothing/state.h"
#include "stages/square.h"
#include "maths/plain.h"

/* The best curve so far, certified. */
typedef struct best {
    double control[CONTROLS][AXES_EVEN], deviation[SPANS_ROOM];
    double cost;  /* of the motion */
    double walls; /* how close it is to them */
} best;

/* Where the curve passes every wall, and squares of the residuals of linear and
 * rotary axes there. */
static void look_at_walls(nc_smooth *smooth) {
    struct window *window = &smooth->window;
    for (int k = 0; k < window->sites_n; k++) {
        struct site *site = &window->sites[k];
        const double (*control)[AXES_EVEN] = window->control + site->span;
        site->off[0] = site->off[1] = 0.0;
        for (int axis = 0; axis < smooth->cfg.axes; axis += 2) {
            pair at = {0.0, 0.0};
            for (int j = 0; j < ORDER; j++) {
                at += site->basis[j] * *(const pair *)(control[j] + axis);
            }
            *(pair *)(site->passed + axis) = at;
        }
        for (int axis = 0; axis < smooth->cfg.axes; axis++) {
            site->off[smooth->cfg.rotary >> axis & 1] +=
                square(site->passed[axis] - site->position[axis]);
        }
    }
}

/* Minus the logarithms of the shares of room that are left; infinite: the curve
 * is behind a wall. */
static double walls(const struct window *window) {
    double product = 1.0;
    double sum = 0.0;
    for (int k = 0; k < window->sites_n; k++) {
        const struct site *site = &window->sites[k];
        for (int group = 0; group < 2; group++) {
            double room = 1.0 - site->off[group] / square(site->target);
            if (!(room > 0.0)) {
                return INFINITY;
            }
            product *= room;
        }
        if (product < 1e-200) {
            sum -= plain_log(product);
            product = 1.0;
        }
    }
    return sum - plain_log(product);
}

static double wall_share(const struct site *site, int join) {
    bool near = join && site->span >= join - JOIN_BEFORE
                && site->span < join + JOIN_BEHIND;
    return near ? WALL_JOIN : WALL;
}

/* Where a wall stands: behind the curve in any case, but not beyond the
 * tolerance, where the certificate would refuse what it lets pass. */
static double wall_for(const struct site *site, int join) {
    double most = sqrt(fmax(site->off[0], site->off[1]));
    double behind = WALL_BEHIND * most;
    if (most < site->allowed) {
        behind = fmin(behind, 0.5 * (most + site->allowed));
    }
    return fmax(wall_share(site, join) * site->allowed, behind);
}

/* Walls as springs, with their slope and curvature at the present curve. */
static void set_walls(nc_smooth *smooth, int join, double weight) {
    struct window *window = &smooth->window;
    double share[2];
    for (int k = 0; k < window->sites_n; k++) {
        struct site *site = &window->sites[k];
        const double *off = site->off;
        site->target = wall_for(site, join);
        for (int group = 0; group < 2; group++) {
            double room = square(site->target) - off[group];
            double slope = 2.0 * weight / room;
            share[group] = 1.0 / (1.0 + 2.0 * off[group] / room);
            site->force[group] = slope / share[group];
        }
        for (int axis = 0; axis < smooth->cfg.axes; axis++) {
            double at = site->passed[axis];
            double miss = at - site->position[axis];
            int group = smooth->cfg.rotary >> axis & 1;
            site->aim[axis] = at - share[group] * miss;
        }
    }
}

/* One more wall on the chord behind node i. */
static void add_wall(nc_smooth *smooth, int i, double t, int span) {
    struct window *window = &smooth->window;
    double position[NC_AXES];
    t = whole_parameter(t);
    double slack = smooth->nodes[i + 1].slack;
    double allowed = fmax(smooth->tol - slack, 0.1 * smooth->tol);
    if (window->sites_n < SITES) {
        on_chord(smooth, i, t, position);
        site_add(window, position, t, allowed, allowed, span, smooth->cfg.axes);
    }
}

/* Walls besides the points that pull. */
static void lay_walls(nc_smooth *smooth, int end) {
    struct window *window = &smooth->window;
    int i = 0;
    for (int k = 0; k < window->spans; k++) {
        double from = window->tau[k + 5];
        double length = window->tau[k + 6] - from;
        for (int part = 0; part < WALLS; part++) {
            double t = from + (part + 0.5) / WALLS * length;
            while (i + 1 < end && smooth->nodes[i + 1].t <= t) {
                i++;
            }
            add_wall(smooth, i, t, k);
        }
    }
}

/* A wall where a span has failed, unless there is one. */
static void wall_at(nc_smooth *smooth, int span, double t, int chord) {
    const struct window *window = &smooth->window;
    double apart =
        WALLS_APART * (window->tau[span + 6] - window->tau[span + 5]);
    for (int k = 0; k < window->sites_n; k++) {
        if (fabs(window->sites[k].t - t) < apart) {
            return;
        }
    }
    while (chord > 0 && smooth->nodes[chord].t > t) {
        chord--;
    }
    add_wall(smooth, chord, t, span);
}

/* Is the curve ahead of all walls? */
static bool inside_walls(const struct window *window) {
    for (int k = 0; k < window->sites_n; k++) {
        const struct site *site = &window->sites[k];
        if (!(fmax(site->off[0], site->off[1]) < square(site->target))) {
            return false;
        }
    }
    return true;
}

/* Is the curve within the tolerance? Spans that fail get a wall where they do.
 */
static bool certified(nc_smooth *smooth, int end, double *deviation) {
    const struct window *window = &smooth->window;
    contour path = {smooth->nodes, end + 1};
    int chord = 0;
    bool good = true;
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
        if (!(verdict.worst <= 1.0)) {
            wall_at(smooth, k, verdict.t, chord);
            good = false;
        }
    }
    return good;
}

/* A share of the way from the best curve to another one. */
static void part_way(struct window *window,
                     const struct best *best,
                     double full[CONTROLS][AXES_EVEN],
                     double share) {
    for (int k = 0; k < window->spans + 5; k++) {
        for (int i = 0; i < window->moving_n; i++) {
            int axis = window->moving[i];
            double from = best->control[k][axis];
            window->control[k][axis] = from + share * (full[k][axis] - from);
        }
    }
}

static void back(nc_smooth *smooth, const struct best *best) {
    memcpy(smooth->window.control, best->control, sizeof best->control);
    curve_changed(smooth);
    look_at_walls(smooth);
}

/* As much of a step as is faster and certified. The share is the same
 * everywhere: with less of it at one place the curve would meet walls that the
 * whole step keeps off. */
static bool take_step(nc_smooth *smooth,
                      struct best *best,
                      int end,
                      double weight) {
    struct window *window = &smooth->window;
    double full[CONTROLS][AXES_EVEN], deviation[SPANS_ROOM];
    double share = 1.0;
    memcpy(full, window->control, sizeof full);
    for (int i = 0; i < TRIES; i++, share *= TRY_NEXT) {
        int known = window->sites_n;
        part_way(window, best, full, share);
        look_at_walls(smooth);
        if (!inside_walls(window)) {
            continue;
        }
        curve_changed(smooth);
        double cost = law_cost(smooth);
        if (!(cost + weight * walls(window)
              < best->cost + weight * best->walls)) {
            continue;
        }
        if (certified(smooth, end, deviation)) {
            memcpy(best->control, window->control, sizeof best->control);
            memcpy(best->deviation, deviation, sizeof deviation);
            best->cost = cost;
            return true;
        }
        /* the new walls are for the next solution */
        for (int k = known; k < window->sites_n; k++) {
            window->sites[k].target = INFINITY;
        }
    }
    back(smooth, best);
    return false;
}

bool take_up(nc_smooth *smooth, int end, double *deviation) {
    struct window *window = &smooth->window;
    double control[CONTROLS][AXES_EVEN], found[SPANS_ROOM];
    int sites = window->sites_n;
    memcpy(control, window->control, sizeof control);
    for (; window->kept > window->fixed_head; window->kept -= KEPT_LESS) {
        for (int k = 0; k < window->kept; k++) {
            double share = kept_share(window, k);
            for (int axis = 0; axis < smooth->cfg.axes; axis++) {
                double now = control[k][axis];
                double off = smooth->keep.control[k][axis] - now;
                window->control[k][axis] = now + share * off;
            }
        }
        bool good = certified(smooth, end, found);
        window->sites_n = sites;
        if (good) {
            memcpy(deviation, found, sizeof found);
            return true;
        }
        memcpy(window->control, control, sizeof control);
    }
    window->kept = 0;
    return false;
}

void refine_window(nc_smooth *smooth,
                   int end,
                   int join,
                   bool coarse,
                   double *deviation) {
    struct window *window = &smooth->window;
    struct best best;
    double smoothest[CONTROLS][AXES_EVEN];
    if (!law_begin(smooth, end, !join)) {
        return;
    }
    window->timed = true;
    lay_walls(smooth, end);
    look_at_walls(smooth);
    memcpy(smoothest, window->control, sizeof smoothest);
    memcpy(best.control, window->control, sizeof best.control);
    memcpy(best.deviation, deviation, sizeof best.deviation);
    best.cost = law_cost(smooth);
    double worth = (1.0 - WORTH) * best.cost;
    double share = WALL_FIRST;
    for (int i = 0; i < REFINE; i++) {
        if (i == TRIAL && !coarse && best.cost > worth) {
            memcpy(window->control, smoothest, sizeof smoothest);
            window->timed = false;
            return;
        }
        double weight = share * best.cost;
        law_roughness(smooth);
        set_walls(smooth, join, weight);
        best.walls = walls(window);
        spline_solve_timed(window, smooth->cfg.rotary);
        smooth->stats.solves++;
        take_step(smooth, &best, end, weight);
        law_step(smooth, &best.cost);
        if (i >= REWEIGH_FROM) {
            best.cost = law_reweigh(smooth, best.cost);
        }
        share = fmax(WALL_LAST, WALL_NEXT * share);
    }
    memcpy(deviation,
           best.deviation,
           sizeof *deviation * (size_t)window->spans);
}
