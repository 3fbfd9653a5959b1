/* Distances between polylines; see polyline_distance.h. */
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include "stages/polyline_distance.h"

enum { GROUP = 16, BESIDE = 3, HALVINGS = 48 };

typedef struct {
    double *low, *high; /* n x dim */
    int64_t n;
} boxes;

typedef struct {
    const double *at; /* m x dim */
    int64_t m;        /* points; m - 1 segments, one of no length if m is 1 */
    int dim;
    boxes lower, upper; /* around GROUP segments, around GROUP of those */
} line;

typedef struct {
    double distance;
    int64_t segment;
} near;

static int64_t segments(const line *l) { return l->m > 1 ? l->m - 1 : 1; }

static bool make(boxes *b, int64_t n, int dim) {
    b->n = n;
    b->low = malloc(2 * (size_t)(n * dim) * sizeof *b->low);
    if (!b->low) return false;
    b->high = b->low + n * dim;
    for (int64_t i = 0; i < n * dim; i++) {
        b->low[i] = INFINITY;
        b->high[i] = -INFINITY;
    }
    return true;
}

static void widen(boxes *b, int dim, int64_t box, const double *low, const double *high) {
    for (int a = 0; a < dim; a++) {
        b->low[box * dim + a] = fmin(b->low[box * dim + a], low[a]);
        b->high[box * dim + a] = fmax(b->high[box * dim + a], high[a]);
    }
}

static void drop(line *l) {
    free(l->lower.low);
    free(l->upper.low);
}

static bool prepare(line *l) {
    int64_t groups = (segments(l) + GROUP - 1) / GROUP;
    if (!make(&l->lower, groups, l->dim) || !make(&l->upper, (groups + GROUP - 1) / GROUP, l->dim)) return false;
    for (int64_t i = 0; i < l->m; i++) {
        const double *p = l->at + i * l->dim;
        if (i < segments(l)) widen(&l->lower, l->dim, i / GROUP, p, p);
        if (i) widen(&l->lower, l->dim, (i - 1) / GROUP, p, p);
    }
    for (int64_t g = 0; g < groups; g++)
        widen(&l->upper, l->dim, g / GROUP, l->lower.low + g * l->dim, l->lower.high + g * l->dim);
    return true;
}

/* Square of the distance to one segment. */
static double to_segment(const line *l, int64_t i, const double *p) {
    const double *a = l->at + i * l->dim, *b = i + 1 < l->m ? a + l->dim : a;
    double way = 0.0, along = 0.0, square = 0.0;
    for (int k = 0; k < l->dim; k++) {
        double d = b[k] - a[k];
        way += d * d;
        along += (p[k] - a[k]) * d;
    }
    double share = way > 0.0 ? fmin(fmax(along / way, 0.0), 1.0) : 0.0;
    for (int k = 0; k < l->dim; k++) {
        double rest = p[k] - a[k] - share * (b[k] - a[k]);
        square += rest * rest;
    }
    return square;
}

static double to_box(const boxes *b, int dim, int64_t box, const double *p) {
    double square = 0.0;
    for (int k = 0; k < dim; k++) {
        double out = fmax(b->low[box * dim + k] - p[k], p[k] - b->high[box * dim + k]);
        if (out > 0.0) square += out * out;
    }
    return square;
}

static void look(const line *l, int64_t first, int64_t end, const double *p, double *best, int64_t *segment) {
    for (int64_t i = first < 0 ? 0 : first; i < end && i < segments(l); i++) {
        double square = to_segment(l, i, p);
        if (square < *best) {
            *best = square;
            *segment = i;
        }
    }
}

/* The nearest segment, or one near `hint` if that is no farther than `enough`. */
static near nearest(const line *l, const double *p, int64_t hint, double enough) {
    double best = INFINITY;
    int64_t segment = hint;
    look(l, hint - BESIDE, hint + BESIDE + 1, p, &best, &segment);
    for (int64_t s = 0; s < l->upper.n && best > enough * enough; s++) {
        if (to_box(&l->upper, l->dim, s, p) >= best) continue;
        for (int64_t g = s * GROUP; g < (s + 1) * GROUP && g < l->lower.n; g++)
            if (to_box(&l->lower, l->dim, g, p) < best) look(l, g * GROUP, (g + 1) * GROUP, p, &best, &segment);
    }
    return (near){sqrt(best), segment};
}

/* Neighbouring segments: up to the point next to their common vertex the one counts, behind it the other. */
static double around_vertex(const line *l, const double *a, const double *b, near at_a, near at_b) {
    const double *v = l->at + (at_a.segment > at_b.segment ? at_a.segment : at_b.segment) * l->dim;
    double way = 0.0, along = 0.0, middle[NC_AXES];
    for (int k = 0; k < l->dim; k++) {
        way += (b[k] - a[k]) * (b[k] - a[k]);
        along += (v[k] - a[k]) * (b[k] - a[k]);
    }
    double share = way > 0.0 ? fmin(fmax(along / way, 0.0), 1.0) : 0.0;
    for (int k = 0; k < l->dim; k++) middle[k] = a[k] + share * (b[k] - a[k]);
    double both = fmax(to_segment(l, at_a.segment, middle), to_segment(l, at_b.segment, middle));
    return fmax(sqrt(both), fmax(at_a.distance, at_b.distance));
}

/* What no distance between a and b exceeds. */
static double bound(const line *l, const double *a, const double *b, near at_a, near at_b) {
    double square = 0.0;
    for (int k = 0; k < l->dim; k++) square += (b[k] - a[k]) * (b[k] - a[k]);
    double most = (at_a.distance + at_b.distance + sqrt(square)) / 2.0;
    if (at_a.segment == at_b.segment) return fmin(most, fmax(at_a.distance, at_b.distance));
    if (llabs(at_a.segment - at_b.segment) == 1) most = fmin(most, around_vertex(l, a, b, at_a, at_b));
    most = fmin(most, fmax(at_a.distance, sqrt(to_segment(l, at_a.segment, b))));
    return fmin(most, fmax(at_b.distance, sqrt(to_segment(l, at_b.segment, a))));
}

static void halve(const line *l, const double *a, const double *b, near at_a, near at_b, int left, double close, double *most) {
    if (!left || bound(l, a, b, at_a, at_b) <= *most + close) return;
    double middle[NC_AXES];
    for (int k = 0; k < l->dim; k++) middle[k] = 0.5 * (a[k] + b[k]);
    near at = nearest(l, middle, at_a.segment, *most);
    *most = fmax(*most, at.distance);
    halve(l, a, middle, at_a, at, left - 1, close, most);
    halve(l, middle, b, at, at_b, left - 1, close, most);
}

double nc_farthest(const double *mine, int64_t n, const double *other, int64_t m, int32_t dim, double known, double close) {
    line l = {.at = other, .m = m, .dim = dim};
    near *found = malloc((size_t)(n + 1) * sizeof *found);
    double most = found && prepare(&l) ? known : -1.0;
    for (int64_t i = 0; most >= 0.0 && i < n; i++) {
        found[i] = nearest(&l, mine + i * dim, i ? found[i - 1].segment : 0, most);
        most = fmax(most, found[i].distance);
    }
    for (int64_t i = 0; most >= 0.0 && i + 1 < n; i++)
        halve(&l, mine + i * dim, mine + (i + 1) * dim, found[i], found[i + 1], HALVINGS, close, &most);
    free(found);
    drop(&l);
    return most;
}

int nc_distances(const double *points, int64_t n, const double *other, int64_t m, int32_t dim, double *out) {
    line l = {.at = other, .m = m, .dim = dim};
    bool ready = prepare(&l);
    int64_t segment = 0;
    for (int64_t i = 0; ready && i < n; i++) {
        near at = nearest(&l, points + i * dim, segment, 0.0);
        out[i] = at.distance;
        segment = at.segment;
    }
    drop(&l);
    return ready ? 0 : -1;
}
