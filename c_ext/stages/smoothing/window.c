/* One window of a smooth section: knots, weights, iteration, acceptance; what is not accepted falls back to what was. */
#include "stages/smoothing/state.h"

#define NODES_PER_SPAN 8
#define ITERATIONS 40
#define SETTLE 5         /* iterations before a solution is looked at */
#define POINT 0.01       /* share of the tolerance that points of smooth dense data get at the least */
#define POINT_MAX 1e-4   /* ... and this in mm */
#define NOISE 2.0        /* and how much of what they scatter */
#define SHARE 0.92       /* share of it that all other points get: humps lie between them */
#define STIFF 300.0       /* first weight of a span's points against its fairness */
#define WISH_FAILED 0.3   /* share that the points of a span that fails get at the least */
#define HUMP_WEIGHT 10.0  /* of the largest weight in its span: more is not given to a point where a hump was */
#define GROWTH 100.0      /* of a weight from one solution to the next */
#define GIVE_FROM 11      /* solutions from which on weights grow by what the curve gives; before, too much changes at a time */
#define WEIGHT_SPREAD 1e7 /* a weight's largest factor over its first */
#define RELAX 1.5         /* growth of a target that is not met although more would be allowed */
#define RELEASE 1.0       /* least factor on a weight once the window settles */
#define WISH_LEAST 0.9    /* what is only wished lets go at any time, ... */
#define WISH_SPREAD 1e4   /* ... and never pulls more than this */
#define NEAR 1.5          /* of what is allowed: more at a point, and the spans need not be looked at */
#define RHO_MIN 1e-5
#define HEAD_KNOTS 10 /* what is written, and the control points it shares with what follows, feel no later knot */

/* ---- knots ---------------------------------------------------------------------------------------------------- */

/* Span lengths wanted at the nodes, grown away from the small ones. */
static void node_sizes(nc_smooth *s, int end, double *size) {
    for (int i = 0; i <= end; i++) size[i] = s->finer * s->nodes[i].size;
    for (int i = end; i-- > 0;) size[i] = fmin(size[i], size[i + 1] + SIZE_GROWTH * (s->nodes[i + 1].t - s->nodes[i].t));
    for (int i = 1; i <= end; i++) size[i] = fmin(size[i], size[i - 1] + SIZE_GROWTH * (s->nodes[i].t - s->nodes[i - 1].t));
}

typedef struct knot_maker {
    double *tau;
    int n, room, passed;
    double rest; /* of a span still to go */
} knot_maker;

/* Knots where the integral of 1 / size has grown by one, size linear with slope `g` from `size` on, over `length`. */
static void ramp(knot_maker *k, double t, double length, double size, double g) {
    double at = 0.0;
    while (k->n < k->room) {
        double left = g == 0.0 ? (length - at) / size : log((size + g * length) / (size + g * at)) / g;
        if (left < k->rest) {
            k->rest -= left;
            return;
        }
        at = g == 0.0 ? at + k->rest * size : ((size + g * at) * exp(g * k->rest) - size) / g;
        k->tau[k->n++] = t + at;
        k->rest = 1.0;
        k->passed = 0;
    }
}

static void chord_knots(knot_maker *k, double t, double from, double length, double a, double b) {
    double top = fmin(fmax((b - a + SIZE_GROWTH * length) / (2.0 * SIZE_GROWTH), 0.0), length); /* the largest size is here */
    if (from < top) ramp(k, t + from, top - from, a + SIZE_GROWTH * from, SIZE_GROWTH);
    double begin = fmax(from, top), high = b + SIZE_GROWTH * (length - begin);
    if (begin < length) ramp(k, t + begin, length - begin, high, -SIZE_GROWTH);
}

/* Append knots behind tau[n - 1] up to nodes[end], or as far as there is room; returns the node reached. */
static int make_knots(nc_smooth *s, double *tau, int *n, int room, int end) {
    double size[NODES];
    node_sizes(s, end, size);
    knot_maker k = {tau, *n, room, 0, 1.0};
    double at = tau[*n - 1];
    int i = 0;
    while (i < end && s->nodes[i + 1].t <= at) i++;
    for (; i < end && k.n < room; i++) {
        const node *a = &s->nodes[i], *b = a + 1;
        chord_knots(&k, a->t, fmax(at - a->t, 0.0), b->t - a->t, size[i], size[i + 1]);
        if (++k.passed >= NODES_PER_SPAN && k.n < room && b->t > tau[k.n - 1]) {
            tau[k.n++] = b->t;
            k.passed = 0;
            k.rest = 1.0;
        }
    }
    if (k.n == room) { /* end at the last node that the knots cover */
        while (i > 1 && s->nodes[i].t > tau[k.n - 1]) i--;
    }
    double stop = s->nodes[i].t;
    while (k.n > *n && tau[k.n - 1] > stop - 0.5 * (stop - tau[k.n - 2])) k.n--;
    tau[k.n++] = stop;
    *n = k.n;
    return i;
}

/* ---- the window ------------------------------------------------------------------------------------------------ */

static void on_chord(const nc_smooth *s, int i, double t, double *q) {
    const node *a = &s->nodes[i], *b = a + 1;
    double r = (t - a->t) / (b->t - a->t);
    for (int k = 0; k < s->cfg.axes; k++) q[k] = a->q[k] + r * (b->q[k] - a->q[k]);
}

/* The first or last three control points on the line: position, direction, no curvature. */
static void clamp(nc_smooth *s, int chord, int first) {
    window *w = &s->w;
    for (int j = first; j < first + 3; j++) {
        double t = 0.0;
        for (int k = 1; k <= 5; k++) t += 0.2 * w->tau[j + k];
        on_chord(s, chord, t, w->c[j]);
    }
}

/* Knots, spans and fixed control points from where the section is written to nodes[end]; returns the node reached. */
static int lay_out(nc_smooth *s, int end, bool final) {
    window *w = &s->w;
    int n; /* knots up to and with the last one, once */
    if (s->keep.valid) {
        n = s->keep.spans + 6 < HEAD_KNOTS ? s->keep.spans + 6 : HEAD_KNOTS;
        memcpy(w->tau, s->keep.tau, sizeof(double) * (size_t)n);
        memcpy(w->c, s->keep.c, sizeof(w->c[0]) * 5);
        w->fixed_head = 5;
    } else {
        for (n = 0; n < 6; n++) w->tau[n] = s->out_t;
        w->fixed_head = s->nodes[0].kind == NODE_HEAD ? 3 : 1;
    }
    if (w->tau[n - 1] < s->nodes[end].t) {
        int reached = make_knots(s, w->tau, &n, SPANS_ROOM + 5, end);
        if (reached < end) final = false;
        end = reached;
    }
    w->spans = n - 6;
    for (int k = 0; k < 5; k++) w->tau[n + k] = w->tau[n - 1];
    w->fixed_tail = final && s->nodes[end].kind == NODE_TAIL ? 3 : 1;
    if (w->fixed_head == 3) clamp(s, 0, 0);
    if (w->fixed_head == 1) memcpy(w->c[0], s->nodes[0].q, sizeof s->nodes[0].q);
    if (w->fixed_tail == 3) clamp(s, end - 1, w->spans + 2);
    memcpy(w->c[w->spans + 4], s->nodes[end].q, sizeof s->nodes[0].q);
    for (int k = 0; k < w->spans; k++) spline_span(w, k);
    return end;
}

static void add_point(window *w, const double *q, double t, double target, double allowed, int span, int axes) {
    site *p = &w->sites[w->sites_n++];
    memcpy(p->q, q, sizeof(double) * (size_t)axes);
    p->t = t;
    p->target = target;
    p->allowed = allowed;
    p->span = span;
    p->wish = target < SHARE * allowed;
    double h = w->tau[span + 6] - w->tau[span + 5];
    spline_basis_at(w->m[span], (t - w->tau[span + 5]) / h, p->basis);
}

static double allowed_at(const nc_smooth *s, int i) {
    const node *n = &s->nodes[i];
    return fmax(s->tol - fmax(n->slack, n[1].slack), 0.1 * s->tol);
}

/* How far node i lies off a smooth curve through its neighbours: its bend against that of the nodes beside it. */
static double scatter_at(const nc_smooth *s, int i) {
    const node *n = &s->nodes[i];
    double sum = 0.0, before = n->t - n[-1].t, behind = n[1].t - n->t, r = before / (before + behind);
    for (int a = 0; a < s->cfg.axes; a++) {
        double rate[4];
        for (int k = 0; k < 4; k++) rate[k] = (n[k - 1].q[a] - n[k - 2].q[a]) / (n[k - 1].t - n[k - 2].t);
        double left = 2.0 * (rate[1] - rate[0]) / (n->t - n[-2].t), right = 2.0 * (rate[3] - rate[2]) / (n[2].t - n->t);
        double own = 2.0 * (rate[2] - rate[1]) / (before + behind), off = own - (1.0 - r) * left - r * right;
        sum += off * off;
    }
    return 0.5 * sqrt(sum) * before * behind;
}

/* The same for all nodes up to `end`, the mean of seven: rounding and noise of the data. */
static void scatter(const nc_smooth *s, int end, double *out) {
    double sum[NODES + 1] = {0.0};
    for (int i = 0; i <= end; i++) sum[i + 1] = sum[i] + (i >= 2 && i + 2 <= end ? scatter_at(s, i) : 0.0);
    for (int i = 0; i <= end; i++) {
        int from = i - 3 > 2 ? i - 3 : 2, to = i + 3 < end - 2 ? i + 3 : end - 2;
        if (from > to) from = to = i < 2 ? 2 : end - 2;
        out[i] = end < 4 ? INFINITY : (sum[to + 1] - sum[from]) / (double)(to + 1 - from);
    }
}

/* Smooth dense data: the chord leaves a curve through its points by little, so the points can be kept as closely as they
 * are known; more buys nothing, and less would follow their rounding. */
static double target_of(const nc_smooth *s, int i, double noise) {
    const node *n = &s->nodes[i];
    double sagitta = 0.125 * n->turn * fmax(n->len, n[1].len), allowed = allowed_at(s, i);
    if (n->turn > 0.3 || sagitta > 0.3 * s->tol) return SHARE * allowed;
    return fmin(fmax(fmin(POINT * allowed, POINT_MAX), NOISE * noise), SHARE * allowed);
}

/* Points of the contour that pull: nodes, and the middle of every span that holds none. */
static void lay_sites(nc_smooth *s, int end) {
    window *w = &s->w;
    int i = 0;
    double noise[NODES];
    scatter(s, end, noise);
    w->sites_n = 0;
    while (i < end && s->nodes[i].t <= w->tau[5]) i++;
    for (int k = 0; k < w->spans; k++) {
        double from = w->tau[k + 5], to = w->tau[k + 6];
        int first = w->sites_n;
        for (; i < end && s->nodes[i].t < to; i++) add_point(w, s->nodes[i].q, s->nodes[i].t, target_of(s, i, noise[i]), allowed_at(s, i), k, s->cfg.axes);
        double gap = w->sites_n > first ? 0.0 : 0.5;
        if (gap > 0.0 && w->sites_n < SITES) {
            double q[NC_AXES], t = from + gap * (to - from);
            on_chord(s, i - 1, t, q);
            double allowed = fmax(s->tol - s->nodes[i].slack, 0.1 * s->tol);
            add_point(w, q, t, SHARE * allowed, allowed, k, s->cfg.axes);
        }
        double h = to - from, weight = STIFF / (h * h * h * h * h) / (double)(w->sites_n - first);
        for (int j = first; j < w->sites_n; j++) w->sites[j].weight = weight;
        w->rho[k] = 1.0;
    }
}

/* ---- iteration -------------------------------------------------------------------------------------------------- */

/* Square of the curvature of span k at its middle, over all axes. */
static double bend2(const window *w, int k, int axes) {
    double h = w->tau[k + 6] - w->tau[k + 5], d1 = 0.0, d2 = 0.0, both = 0.0;
    for (int a = 0; a < axes; a++) {
        double v = 0.0, b = 0.0;
        for (int j = 0; j < ORDER; j++) {
            v += w->middle[k][0][j] * w->c[k + j][a];
            b += w->middle[k][1][j] * w->c[k + j][a];
        }
        v /= h;
        b /= h * h;
        d1 += v * v;
        d2 += b * b;
        both += v * b;
    }
    d1 = fmax(d1, 1e-6);
    return fmax(d2 * d1 - both * both, 0.0) / (d1 * d1 * d1);
}

/* Fairness counts with the sixth power of the speed that the curve found so far allows: jerk is q''' v^3. */
static void weigh_by_speed(nc_smooth *s) {
    window *w = &s->w;
    double v2[SPANS_ROOM], top = s->cfg.feed * s->cfg.feed;
    for (int k = 0; k < w->spans; k++) v2[k] = fmin(top, s->cfg.accel / sqrt(bend2(w, k, s->cfg.axes) + 1e-18));
    for (int k = 1; k < w->spans; k++) v2[k] = fmin(v2[k], v2[k - 1] + 2.0 * s->cfg.accel * (w->tau[k + 6] - w->tau[k + 5]));
    for (int k = w->spans - 1; k-- > 0;) v2[k] = fmin(v2[k], v2[k + 1] + 2.0 * s->cfg.accel * (w->tau[k + 7] - w->tau[k + 6]));
    for (int k = 0; k < w->spans; k++) {
        double share = v2[k] / top;
        w->rho[k] = fmax(RHO_MIN, share * share * share);
    }
}

/* Residual of every point over its target; returns the largest over what is allowed, NaN if any is none. */
static double residuals(nc_smooth *s) {
    window *w = &s->w;
    double most = 0.0, all = 0.0;
    int axes = s->cfg.axes;
    for (int k = 0; k < w->sites_n; k++) {
        site *p = &w->sites[k];
        double sum[2] = {0.0, 0.0};
        for (int a = 0; a < axes; a += 2) {
            pair q = -*(const pair *)(p->q + a);
            for (int j = 0; j < ORDER; j++) q += p->basis[j] * *(const pair *)(w->c[p->span + j] + a);
            q *= q;
            sum[s->cfg.rotary >> a & 1] += q[0];
            if (a + 1 < axes) sum[s->cfg.rotary >> (a + 1) & 1] += q[1];
        }
        double miss = sqrt(sum[0] > sum[1] ? sum[0] : sum[1]), share = miss / p->allowed;
        p->miss = miss / p->target;
        all += share;
        if (share > most) most = share;
    }
    return isfinite(all) ? most : all;
}

/* Weights for the next solution. `relax`: closeness that was wanted and is not had is given up, up to what is allowed. `exact`: weights
 * grow to what would do if no other changed; where the curve is soft that is much more than the square of the miss. */
static void reweigh(window *w, double least, bool relax, bool exact) {
    for (int k = 0; k < w->sites_n; k++) {
        site *p = &w->sites[k];
        if (relax && p->wish && p->miss > 1.0) {
            double target = fmin(RELAX * p->target, SHARE * p->allowed);
            p->miss *= p->target / target;
            p->target = target;
        }
        double factor = fmax(p->miss, p->wish ? fmin(least, WISH_LEAST) : least);
        if (p->miss > 1.0) {
            factor = p->miss * p->miss;
            if (exact) factor = fmax(factor, 1.0 + (p->miss - 1.0) / fmin(p->weight * spline_give(w, p), 1.0));
            factor = fmin(factor, GROWTH);
        }
        double h = w->tau[p->span + 6] - w->tau[p->span + 5], first = STIFF * w->rho[p->span] / (h * h * h * h * h);
        p->weight = fmin(p->weight * factor, (p->wish ? WISH_SPREAD : WEIGHT_SPREAD) * first);
    }
}

/* Humps stand between points: one more there, with the weight that makes its deviation what is aimed at. */
static void add_where_it_fails(nc_smooth *s, int span, verdict v, const contour *path, int chord) {
    window *w = &s->w;
    if (w->sites_n >= SITES - SPANS_ROOM) return;
    while (chord > 0 && path->nodes[chord].t > v.t) chord--;
    double q[NC_AXES], weight = 0.0, allowed = fmax(s->tol - path->nodes[chord + 1].slack, 0.1 * s->tol);
    for (int k = 0; k < w->sites_n; k++) {
        if (w->sites[k].span != span) continue;
        w->sites[k].target = fmax(w->sites[k].target, WISH_FAILED * allowed);
        w->sites[k].wish = false;
        if (fabs(w->sites[k].t - v.t) < 1e-3 * (w->tau[span + 6] - w->tau[span + 5])) return;
        weight = fmax(weight, w->sites[k].weight);
    }
    on_chord(s, chord, v.t, q);
    add_point(w, q, v.t, SHARE * allowed, allowed, span, s->cfg.axes);
    site *p = &w->sites[w->sites_n - 1];
    p->weight = fmin(HUMP_WEIGHT * weight, (v.worst / SHARE - 1.0) / spline_give(w, p));
    p->wish = false;
    p->miss = 1.0;
}

/* All spans against the contour; spans that fail get a point where they do. Returns the largest deviation. */
static double certify_window(nc_smooth *s, int end, double *deviation) {
    window *w = &s->w;
    contour path = {s->nodes, end + 1};
    int chord = 0;
    double worst = 0.0;
    for (int k = 0; k < w->spans; k++) {
        double hull[NC_AXES][ORDER];
        spline_hull(w, k, s->cfg.axes, hull);
        verdict v = certify_piece(s, hull, w->tau[k + 5], w->tau[k + 6], &path, &chord);
        deviation[k] = v.distance;
        if (v.worst > 1.0) {
            if (!(worst > 1.0)) spline_invert(w);
            add_where_it_fails(s, k, v, &path, chord);
        }
        worst = fmax(worst, v.worst);
    }
    return worst;
}

static bool iterate(nc_smooth *s, int end, double *deviation) {
    window *w = &s->w;
    bool failed = false;
    s->stats.windows++;
    for (int i = 0; i < ITERATIONS; i++) {
        spline_solve(w, s->cfg.axes);
        s->stats.solves++;
        double most = residuals(s);
        if (!isfinite(most)) return false;
        bool near = i >= SETTLE && (most < 1.0 || (failed && most < NEAR));
        if (near) {
            if (certify_window(s, end, deviation) <= 1.0) return true;
            failed = true;
        }
        if (i < SETTLE) {
            double before[SPANS_ROOM];
            memcpy(before, w->rho, sizeof before);
            weigh_by_speed(s);
            for (int k = 0; k < w->sites_n; k++) w->sites[k].weight *= w->rho[w->sites[k].span] / before[w->sites[k].span];
        }
        bool exact = i >= GIVE_FROM;
        if (exact) spline_invert(w);
        reweigh(w, i < 8 && !failed ? 0.1 : i < 14 && !failed ? 0.5 : RELEASE, i >= SETTLE, exact);
    }
    return false;
}

/* ---- acceptance ------------------------------------------------------------------------------------------------- */

static int node_behind(const nc_smooth *s, double t, int end) {
    int i = 1;
    while (i < end && s->nodes[i].t <= t) i++;
    return i;
}

/* Write spans first..last - 1. */
static void write_spans(nc_smooth *s, double pieces[][NC_AXES][ORDER], const double *tau, int last, int end) {
    for (int k = 0; k < last; k++)
        emit_curve(s, pieces[k], tau[k + 5], tau[k + 6], &s->nodes[node_behind(s, tau[k + 5], end)]);
}

static void keep_tail(nc_smooth *s, int from) {
    window *w = &s->w;
    int n = w->spans - from;
    s->keep.valid = true;
    s->keep.spans = n;
    memcpy(s->keep.tau, w->tau + from, sizeof(double) * (size_t)(n + 11));
    memcpy(s->keep.c, w->c + from, sizeof w->c[0] * (size_t)(n + 5));
}

/* Forget the nodes that end at or before what is written. */
static void forget_nodes(nc_smooth *s) {
    int n = 0;
    while (n + 1 < s->n_nodes && s->nodes[n + 1].t <= s->out_t) n++;
    drop_nodes(s, n);
}

/* The tail that an earlier window left is certified and ends on a node: written, and the section begins anew behind it. */
static void use_tail(nc_smooth *s) {
    window *w = &s->w;
    double pieces[SPANS_ROOM][NC_AXES][ORDER];
    w->spans = s->keep.spans;
    memcpy(w->tau, s->keep.tau, sizeof(double) * (size_t)(w->spans + 11));
    memcpy(w->c, s->keep.c, sizeof w->c[0] * (size_t)(w->spans + 5));
    for (int k = 0; k < w->spans; k++) {
        spline_span(w, k);
        spline_piece(w, k, s->cfg.axes, pieces[k]);
    }
    write_spans(s, pieces, w->tau, w->spans, s->n_nodes - 1);
    s->keep.valid = false;
    forget_nodes(s);
    s->nodes[0].kind = NODE_BREAK;
}

static void fall_back(nc_smooth *s, int end) {
    s->stats.fallbacks++;
    if (s->keep.valid) {
        use_tail(s);
        return;
    }
    int to = end > 4 ? end / 2 : end;
    corner_path(s, to);
    drop_nodes(s, to);
    if (s->nodes[0].kind == NODE_VERTEX) s->nodes[0].kind = NODE_BREAK;
}

/* Smooth from what is written towards nodes[end]: everything if that is the section's end, else the spans that later nodes
 * hardly change; nothing if more nodes are needed to know them. */
void window_advance(nc_smooth *s, int end, bool final) {
    double pieces[SPANS_ROOM][NC_AXES][ORDER], deviation[SPANS_ROOM];
    static const double finer[] = {1.0, 0.5};
    int reached = end;
    bool good = false;
    for (size_t k = 0; !good && k < sizeof finer / sizeof *finer; k++) {
        s->finer = finer[k];
        reached = lay_out(s, end, final);
        if (!final && reached == end && s->w.spans < SPANS_LEAST && s->n_nodes <= NODES_FULL) {
            s->measure = s->w.spans; /* too much of it would be fixed before what follows is known */
            return;
        }
        lay_sites(s, reached);
        good = iterate(s, reached, deviation);
    }
    if (!good) {
        fall_back(s, reached);
        s->measure = fmin(s->measure - COMMIT_SPANS, (double)SPANS_FULL - 20.0);
        return;
    }
    final = final && reached == end;
    int commit = s->w.spans;
    if (!final && commit > 6) commit = commit - 5 < COMMIT_SPANS ? commit - 5 : commit > 2 * COMMIT_SPANS ? commit - COMMIT_SPANS : COMMIT_SPANS;
    for (int k = 0; k < commit; k++) note_deviation(s, deviation[k]);
    for (int k = 0; k < commit; k++) spline_piece(&s->w, k, s->cfg.axes, pieces[k]);
    write_spans(s, pieces, s->w.tau, commit, reached);
    s->keep.valid = false;
    s->measure = s->w.spans - commit;
    if (commit < s->w.spans) keep_tail(s, commit);
    if (final) {
        drop_nodes(s, reached);
        return;
    }
    forget_nodes(s);
    if (!s->keep.valid) s->nodes[0].kind = NODE_BREAK;
}
