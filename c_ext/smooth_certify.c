/* Is a polynomial within the tolerance of the programmed contour? On the part of it that belongs to one chord the difference
 * of the two is a polynomial again, and the hull of its Bernstein coefficients bounds it. The same parameter value on both
 * sides bounds the Frechet distance, so neither curve leaves the other one's tube. */
#include "smooth_internal.h"

#define DEPTH 4         /* times a part is halved when the hull is too wide */
#define FORWARD 0.02    /* smallest speed along the chord, as a share of its length */

typedef struct part {
    double b[NC_AXES][ORDER]; /* Bernstein coefficients of the curve */
    double from[NC_AXES], to[NC_AXES]; /* the chord beside it */
    double allowed;
} part;

/* Bernstein coefficients over a..b of the polynomial c over 0..1. */
static void restrict_to(const double *c, double a, double b, double *out) {
    static const double up[ORDER][ORDER] = {{1},
                                            {1, 0.2},
                                            {1, 0.4, 0.1},
                                            {1, 0.6, 0.3, 0.1},
                                            {1, 0.8, 0.6, 0.4, 0.2},
                                            {1, 1, 1, 1, 1, 1}};
    double p[ORDER], h = b - a, scale = h;
    memcpy(p, c, sizeof p);
    for (int i = 0; i < 5; i++)
        for (int k = 4; k >= i; k--) p[k] += a * p[k + 1];
    for (int k = 1; k < ORDER; k++, scale *= h) p[k] *= scale;
    for (int j = 0; j < ORDER; j++) {
        out[j] = 0.0;
        for (int i = 0; i <= j; i++) out[j] += up[j][i] * p[i];
    }
}

/* Largest deviation of the hull, and whether the curve goes forward; squares. */
static double hull(const nc_smooth *s, const part *p, bool *forward) {
    double most = 0.0, u[NC_AXES], length2 = 0.0;
    int n = s->cfg.axes;
    for (int a = 0; a < n; a++) {
        u[a] = in_main(s, a) ? p->to[a] - p->from[a] : 0.0;
        length2 += u[a] * u[a];
    }
    *forward = true;
    for (int j = 0; j < ORDER; j++) {
        double linear = 0.0, rotary = 0.0, step = 0.0;
        for (int a = 0; a < n; a++) {
            double miss = p->b[a][j] - (p->from[a] + (p->to[a] - p->from[a]) * (0.2 * j));
            if (s->cfg.rotary >> a & 1) rotary += miss * miss;
            else linear += miss * miss;
            if (j) step += u[a] * (p->b[a][j] - p->b[a][j - 1]);
        }
        most = fmax(most, fmax(linear, rotary));
        if (j && step * 5.0 < FORWARD * length2) *forward = false;
    }
    return most;
}

static void halve(const double *b, double *left, double *right) {
    double now[ORDER];
    memcpy(now, b, sizeof now);
    for (int k = 0; k < ORDER; k++) {
        left[k] = now[0];
        right[5 - k] = now[5 - k];
        for (int j = 0; j + k < 5; j++) now[j] = 0.5 * (now[j] + now[j + 1]);
    }
}

static double part_deviation(const nc_smooth *s, const part *p, int depth) {
    bool forward;
    double most = sqrt(hull(s, p, &forward));
    if (most <= p->allowed && forward) return most / p->allowed;
    if (depth == DEPTH) return fmax(most / p->allowed, forward ? 0.0 : 2.0);
    part left = {.allowed = p->allowed}, right = {.allowed = p->allowed};
    for (int a = 0; a < s->cfg.axes; a++) {
        halve(p->b[a], left.b[a], right.b[a]);
        left.from[a] = p->from[a];
        left.to[a] = right.from[a] = 0.5 * (p->from[a] + p->to[a]);
        right.to[a] = p->to[a];
    }
    double first = part_deviation(s, &left, depth + 1);
    return first > 1.0 ? first : fmax(first, part_deviation(s, &right, depth + 1));
}

static void chord_point(const contour *path, int i, double t, int axes, double *q) {
    const node *a = &path->nodes[i], *b = a + 1;
    double r = (t - a->t) / (b->t - a->t);
    for (int k = 0; k < axes; k++) q[k] = a->q[k] + r * (b->q[k] - a->q[k]);
}

/* Deviation of the piece c over contour parameters t0..t1; `chord`: where to begin looking, left where the piece ends. */
verdict certify_piece(nc_smooth *s, double c[][ORDER], double t0, double t1, const contour *path, int *chord) {
    verdict v = {0.0, t0};
    double at = t0;
    while (*chord + 2 < path->n && path->nodes[*chord + 1].t <= t0) (*chord)++;
    for (int i = *chord;; i++) {
        bool last = i + 2 >= path->n || path->nodes[i + 1].t >= t1;
        double end = last ? t1 : path->nodes[i + 1].t;
        part p;
        p.allowed = fmax(s->tol - path->nodes[i + 1].slack, 0.05 * s->tol);
        for (int a = 0; a < s->cfg.axes; a++) restrict_to(c[a], (at - t0) / (t1 - t0), (end - t0) / (t1 - t0), p.b[a]);
        chord_point(path, i, at, s->cfg.axes, p.from);
        chord_point(path, i, end, s->cfg.axes, p.to);
        double d = part_deviation(s, &p, 0);
        if (d > v.worst) v = (verdict){d, 0.5 * (at + end)};
        *chord = i;
        if (last) return v;
        at = end;
    }
}
