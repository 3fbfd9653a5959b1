/* One window of a smooth section: knots, weights, iteration, acceptance; what
 * is not accepted falls back to what was. */
#include "stages/smoothing/state.h"

#define NODES_PER_SPAN 8
#define ITERATIONS 40
#define SETTLE 5 /* iterations before a solution is looked at */
#define POINT                                                                  \
    0.01 /* share of the tolerance that points of smooth dense data get at the \
            least */
#define POINT_MAX 1e-4 /* ... and this in mm */
#define NOISE 2.0      /* and how much of what they scatter */
#define SHARE                                                                  \
    0.92 /* share of it that all other points get: humps lie between them */
#define STIFF 300.0 /* first weight of a span's points against its fairness */
#define WISH_FAILED                                                            \
    0.3 /* share that the points of a span that fails get at the least */
#define HUMP_WEIGHT                                                            \
    10.0 /* of the largest weight in its span: more is not given to a point    \
            where a hump was */
#define GROWTH 100.0 /* of a weight from one solution to the next */
#define GIVE_FROM                                                              \
    11 /* solutions from which on weights grow by what the curve gives;        \
          before, too much changes at a time */
#define WEIGHT_SPREAD 1e7 /* a weight's largest factor over its first */
#define RELAX                                                                  \
    1.5 /* growth of a target that is not met although more would be allowed   \
         */
#define RELEASE 1.0     /* least factor on a weight once the window settles */
#define WISH_LEAST 0.9  /* what is only wished lets go at any time, ... */
#define WISH_SPREAD 1e4 /* ... and never pulls more than this */
#define NEAR                                                                   \
    1.5 /* of what is allowed: more at a point, and the spans need not be      \
           looked at */
#define RHO_MIN 1e-5
#define HEAD_KNOTS                                                             \
    10 /* what is written, and the control points it shares with what follows, \
          feel no later knot */

/* ---- knots
 * ----------------------------------------------------------------------------------------------------
 */

/* Span lengths wanted at the nodes, grown away from the small ones. */
static void node_sizes(nc_smooth *smooth, int end, double *size) {
    for (int i = 0; i <= end; i++) {
        size[i] = smooth->finer * smooth->nodes[i].size;
    }
    for (int i = end; i-- > 0;) {
        size[i] = fmin(
            size[i],
            size[i + 1]
                + SIZE_GROWTH * (smooth->nodes[i + 1].t - smooth->nodes[i].t));
    }
    for (int i = 1; i <= end; i++) {
        size[i] = fmin(
            size[i],
            size[i - 1]
                + SIZE_GROWTH * (smooth->nodes[i].t - smooth->nodes[i - 1].t));
    }
}

typedef struct knot_maker {
    double *tau;
    int count, room, passed;
    double rest; /* of a span still to go */
} knot_maker;

/* Knots where the integral of 1 / size has grown by one, size linear with slope
 * `g` from `size` on, over `length`. */
static void ramp(struct knot_maker *knot_maker,
                 double t,
                 double length,
                 double size,
                 double growth) {
    double at = 0.0;
    while (knot_maker->count < knot_maker->room) {
        double left =
            growth == 0.0
                ? (length - at) / size
                : log((size + growth * length) / (size + growth * at)) / growth;
        if (left < knot_maker->rest) {
            knot_maker->rest -= left;
            return;
        }
        at =
            growth == 0.0
                ? at + knot_maker->rest * size
                : ((size + growth * at) * exp(growth * knot_maker->rest) - size)
                      / growth;
        knot_maker->tau[knot_maker->count++] = t + at;
        knot_maker->rest = 1.0;
        knot_maker->passed = 0;
    }
}

static void chord_knots(struct knot_maker *knot_maker,
                        double t,
                        double from,
                        double length,
                        double size_from,
                        double size_to) {
    double top = fmin(
        fmax((size_to - size_from + SIZE_GROWTH * length) / (2.0 * SIZE_GROWTH),
             0.0),
        length); /* the largest size is here */
    if (from < top) {
        ramp(knot_maker,
             t + from,
             top - from,
             size_from + SIZE_GROWTH * from,
             SIZE_GROWTH);
    }
    double begin = fmax(from, top);
    double high = size_to + SIZE_GROWTH * (length - begin);
    if (begin < length) {
        ramp(knot_maker, t + begin, length - begin, high, -SIZE_GROWTH);
    }
}

/* Append knots behind tau[n - 1] up to nodes[end], or as far as there is room;
 * returns the node reached. */
static int make_knots(nc_smooth *smooth,
                      double *tau,
                      int *count,
                      int room,
                      int end) {
    double size[NODES];
    node_sizes(smooth, end, size);
    struct knot_maker knot_maker = {tau, *count, room, 0, 1.0};
    double at = tau[*count - 1];
    int i = 0;
    while (i < end && smooth->nodes[i + 1].t <= at) {
        i++;
    }
    for (; i < end && knot_maker.count < room; i++) {
        const struct node *node = &smooth->nodes[i];
        const struct node *behind = node + 1;
        chord_knots(&knot_maker,
                    node->t,
                    fmax(at - node->t, 0.0),
                    behind->t - node->t,
                    size[i],
                    size[i + 1]);
        if (++knot_maker.passed >= NODES_PER_SPAN && knot_maker.count < room
            && behind->t > tau[knot_maker.count - 1]) {
            tau[knot_maker.count++] = behind->t;
            knot_maker.passed = 0;
            knot_maker.rest = 1.0;
        }
    }
    if (knot_maker.count
        == room) { /* end at the last node that the knots cover */
        while (i > 1 && smooth->nodes[i].t > tau[knot_maker.count - 1]) {
            i--;
        }
    }
    double stop = smooth->nodes[i].t;
    while (knot_maker.count > *count
           && tau[knot_maker.count - 1]
                  > stop - 0.5 * (stop - tau[knot_maker.count - 2])) {
        knot_maker.count--;
    }
    tau[knot_maker.count++] = stop;
    *count = knot_maker.count;
    return i;
}

/* ---- the window
 * ------------------------------------------------------------------------------------------------
 */

static void on_chord(const nc_smooth *smooth,
                     int i,
                     double t,
                     double *position) {
    const struct node *node = &smooth->nodes[i];
    const struct node *behind = node + 1;
    double share = (t - node->t) / (behind->t - node->t);
    for (int k = 0; k < smooth->cfg.axes; k++) {
        position[k] = node->position[k]
                      + share * (behind->position[k] - node->position[k]);
    }
}

/* The first or last three control points on the line: position, direction, no
 * curvature. */
static void clamp(nc_smooth *smooth, int chord, int first) {
    struct window *window = &smooth->window;
    for (int j = first; j < first + 3; j++) {
        double t = 0.0;
        for (int k = 1; k <= 5; k++) {
            t += 0.2 * window->tau[j + k];
        }
        on_chord(smooth, chord, t, window->control[j]);
    }
}

/* Knots, spans and fixed control points from where the section is written to
 * nodes[end]; returns the node reached. */
static int lay_out(nc_smooth *smooth, int end, bool final) {
    struct window *window = &smooth->window;
    int count; /* knots up to and with the last one, once */
    if (smooth->keep.valid) {
        count = smooth->keep.spans + 6 < HEAD_KNOTS ? smooth->keep.spans + 6
                                                    : HEAD_KNOTS;
        memcpy(window->tau, smooth->keep.tau, sizeof(double) * (size_t)count);
        memcpy(window->control,
               smooth->keep.control,
               sizeof(window->control[0]) * 5);
        window->fixed_head = 5;
    } else {
        for (count = 0; count < 6; count++) {
            window->tau[count] = smooth->out_t;
        }
        window->fixed_head = smooth->nodes[0].kind == NODE_HEAD ? 3 : 1;
    }
    if (window->tau[count - 1] < smooth->nodes[end].t) {
        int reached =
            make_knots(smooth, window->tau, &count, SPANS_ROOM + 5, end);
        if (reached < end) {
            final = false;
        }
        end = reached;
    }
    window->spans = count - 6;
    for (int k = 0; k < 5; k++) {
        window->tau[count + k] = window->tau[count - 1];
    }
    window->fixed_tail = final && smooth->nodes[end].kind == NODE_TAIL ? 3 : 1;
    if (window->fixed_head == 3) {
        clamp(smooth, 0, 0);
    }
    if (window->fixed_head == 1) {
        memcpy(window->control[0],
               smooth->nodes[0].position,
               sizeof smooth->nodes[0].position);
    }
    if (window->fixed_tail == 3) {
        clamp(smooth, end - 1, window->spans + 2);
    }
    memcpy(window->control[window->spans + 4],
           smooth->nodes[end].position,
           sizeof smooth->nodes[0].position);
    for (int k = 0; k < window->spans; k++) {
        spline_span(window, k);
    }
    return end;
}

static void add_point(struct window *window,
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
        double left = 2.0 * (rate[1] - rate[0]) / (node->t - node[-2].t);
        double right = 2.0 * (rate[3] - rate[2]) / (node[2].t - node->t);
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

/* Smooth dense data: the chord leaves a curve through its points by little, so
 * the points can be kept as closely as they are known; more buys nothing, and
 * less would follow their rounding. */
static double target_of(const nc_smooth *smooth, int i, double noise) {
    const struct node *node = &smooth->nodes[i];
    double sagitta = 0.125 * node->turn * fmax(node->len, node[1].len);
    double allowed = allowed_at(smooth, i);
    if (node->turn > 0.3 || sagitta > 0.3 * smooth->tol) {
        return SHARE * allowed;
    }
    return fmin(fmax(fmin(POINT * allowed, POINT_MAX), NOISE * noise),
                SHARE * allowed);
}

/* Points of the contour that pull: nodes, and the middle of every span that
 * holds none. */
static void lay_sites(nc_smooth *smooth, int end) {
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
            add_point(window,
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
            add_point(window,
                      position,
                      t,
                      SHARE * allowed,
                      allowed,
                      k,
                      smooth->cfg.axes);
        }
        double length = to - from;
        double weight = STIFF / (length * length * length * length * length)
                        / (double)(window->sites_n - first);
        for (int j = first; j < window->sites_n; j++) {
            window->sites[j].weight = weight;
        }
        window->rho[k] = 1.0;
    }
}

/* ---- iteration
 * --------------------------------------------------------------------------------------------------
 */

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
            first += window->middle[k][0][j] * window->control[k + j][axis];
            second += window->middle[k][1][j] * window->control[k + j][axis];
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
static void weigh_by_speed(nc_smooth *smooth) {
    struct window *window = &smooth->window;
    double v2[SPANS_ROOM];
    double top = smooth->cfg.feed * smooth->cfg.feed;
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
        double miss = sqrt(sum[0] > sum[1] ? sum[0] : sum[1]);
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
    on_chord(smooth, chord, verdict.t, position);
    add_point(window,
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

static bool iterate(nc_smooth *smooth, int end, double *deviation) {
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
            weigh_by_speed(smooth);
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

/* ---- acceptance
 * -------------------------------------------------------------------------------------------------
 */

static int node_behind(const nc_smooth *smooth, double t, int end) {
    int i = 1;
    while (i < end && smooth->nodes[i].t <= t) {
        i++;
    }
    return i;
}

/* Write spans first..last - 1. */
static void write_spans(nc_smooth *smooth,
                        double pieces[][NC_AXES][ORDER],
                        const double *tau,
                        int last,
                        int end) {
    for (int k = 0; k < last; k++) {
        emit_curve(smooth,
                   pieces[k],
                   tau[k + 5],
                   tau[k + 6],
                   &smooth->nodes[node_behind(smooth, tau[k + 5], end)]);
    }
}

static void keep_tail(nc_smooth *smooth, int from) {
    struct window *window = &smooth->window;
    int count = window->spans - from;
    smooth->keep.valid = true;
    smooth->keep.spans = count;
    memcpy(smooth->keep.tau,
           window->tau + from,
           sizeof(double) * (size_t)(count + 11));
    memcpy(smooth->keep.control,
           window->control + from,
           sizeof window->control[0] * (size_t)(count + 5));
}

/* Forget the nodes that end at or before what is written. */
static void forget_nodes(nc_smooth *smooth) {
    int count = 0;
    while (count + 1 < smooth->n_nodes
           && smooth->nodes[count + 1].t <= smooth->out_t) {
        count++;
    }
    drop_nodes(smooth, count);
}

/* The tail that an earlier window left is certified and ends on a node:
 * written, and the section begins anew behind it. */
static void use_tail(nc_smooth *smooth) {
    struct window *window = &smooth->window;
    double pieces[SPANS_ROOM][NC_AXES][ORDER];
    window->spans = smooth->keep.spans;
    memcpy(window->tau,
           smooth->keep.tau,
           sizeof(double) * (size_t)(window->spans + 11));
    memcpy(window->control,
           smooth->keep.control,
           sizeof window->control[0] * (size_t)(window->spans + 5));
    for (int k = 0; k < window->spans; k++) {
        spline_span(window, k);
        spline_piece(window, k, smooth->cfg.axes, pieces[k]);
    }
    write_spans(smooth,
                pieces,
                window->tau,
                window->spans,
                smooth->n_nodes - 1);
    smooth->keep.valid = false;
    forget_nodes(smooth);
    smooth->nodes[0].kind = NODE_BREAK;
}

static void fall_back(nc_smooth *smooth, int end) {
    smooth->stats.fallbacks++;
    if (smooth->keep.valid) {
        use_tail(smooth);
        return;
    }
    int to = end > 4 ? end / 2 : end;
    corner_path(smooth, to);
    drop_nodes(smooth, to);
    if (smooth->nodes[0].kind == NODE_VERTEX) {
        smooth->nodes[0].kind = NODE_BREAK;
    }
}

/* Smooth from what is written towards nodes[end]: everything if that is the
 * section's end, else the spans that later nodes hardly change; nothing if more
 * nodes are needed to know them. */
void window_advance(nc_smooth *smooth, int end, bool final) {
    double pieces[SPANS_ROOM][NC_AXES][ORDER], deviation[SPANS_ROOM];
    static const double finer[] = {1.0, 0.5};
    int reached = end;
    bool good = false;
    for (size_t k = 0; !good && k < sizeof finer / sizeof *finer; k++) {
        smooth->finer = finer[k];
        reached = lay_out(smooth, end, final);
        if (!final && reached == end && smooth->window.spans < SPANS_LEAST
            && smooth->n_nodes <= NODES_FULL) {
            smooth->measure =
                smooth->window.spans; /* too much of it would be fixed before
                                    what follows is known */
            return;
        }
        lay_sites(smooth, reached);
        good = iterate(smooth, reached, deviation);
    }
    if (!good) {
        fall_back(smooth, reached);
        smooth->measure =
            fmin(smooth->measure - COMMIT_SPANS, (double)SPANS_FULL - 20.0);
        return;
    }
    final = final && reached == end;
    int commit = smooth->window.spans;
    if (!final && commit > 6) {
        commit = commit - 5 < COMMIT_SPANS   ? commit - 5
                 : commit > 2 * COMMIT_SPANS ? commit - COMMIT_SPANS
                                             : COMMIT_SPANS;
    }
    for (int k = 0; k < commit; k++) {
        note_deviation(smooth, deviation[k]);
    }
    for (int k = 0; k < commit; k++) {
        spline_piece(&smooth->window, k, smooth->cfg.axes, pieces[k]);
    }
    write_spans(smooth, pieces, smooth->window.tau, commit, reached);
    smooth->keep.valid = false;
    smooth->measure = smooth->window.spans - commit;
    if (commit < smooth->window.spans) {
        keep_tail(smooth, commit);
    }
    if (final) {
        drop_nodes(smooth, reached);
        return;
    }
    forget_nodes(smooth);
    if (!smooth->keep.valid) {
        smooth->nodes[0].kind = NODE_BREAK;
    }
}
