/* Is a polynomial within the tolerance of the programmed contour? On the part of it that belongs to one chord the difference
 * of the two is a polynomial again, and the hull of its Bernstein coefficients bounds it. The same parameter value on both
 * sides bounds the Frechet distance, so neither curve leaves the other one's tube. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* loops of fixed length are written out */
#endif
#include "stages/smoothing/state.h"

#define DEPTH 4         /* times a part is halved when the hull is too wide */
#define FORWARD 0.02    /* smallest speed along the chord, as a share of its length */

typedef struct part {
    double b[NC_AXES][ORDER]; /* Bernstein coefficients of the curve */
    double from[NC_AXES], to[NC_AXES]; /* the chord beside it */
    double allowed;
} part;

/* Largest deviation of the hull, and whether the curve goes forward; squares. */
static double hull(const nc_smooth *s, const part *p, bool *forward) {
    pair off[2][PAIRS] = {{{0.0}}}, step[PAIRS] = {{0.0}};
    double length2 = 0.0, most = 0.0, least = INFINITY, all = 0.0;
    for (int a = 0; a < s->cfg.axes; a++) {
        const double *b = p->b[a];
        double from = p->from[a], d = p->to[a] - from, d5 = 0.2 * d;
        pair line = {from, from + d5}, *sum = off[s->cfg.rotary >> a & 1];
        for (int k = 0; k < PAIRS; k++, line += 2.0 * d5) {
            pair miss = *(const pair *)(b + 2 * k) - line;
            sum[k] += miss * miss;
        }
        if (!in_main(s, a)) continue;
        length2 += d * d;
        step[0] += d * (*(const pair *)(b + 1) - *(const pair *)b);
        step[1] += d * (*(const pair *)(b + 3) - *(const pair *)(b + 2));
        step[2][0] += d * (b[5] - b[4]);
    }
    for (int j = 0; j < ORDER; j++) {
        double linear = off[0][j / 2][j % 2], rotary = off[1][j / 2][j % 2];
        all += linear + rotary;
        if (linear > most) most = linear;
        if (rotary > most) most = rotary;
        if (j < 5 && step[j / 2][j % 2] < least) least = step[j / 2][j % 2];
    }
    *forward = least * 5.0 >= FORWARD * length2;
    return isfinite(all) ? most : INFINITY;
}

/* Bernstein coefficients of both parts of a curve that is cut at r. */
static void cut_at(const double *b, double r, double *left, double *right) {
    double now[ORDER];
    memcpy(now, b, sizeof now);
    for (int k = 0; k < ORDER; k++) {
        left[k] = now[0];
        right[5 - k] = now[5 - k];
        for (int j = 0; j + k < 5; j++) now[j] += r * (now[j + 1] - now[j]);
    }
}

/* `t`: where on the part, 0..1, it is too much. */
static double part_deviation(const nc_smooth *s, const part *p, int depth, double *t) {
    bool forward;
    double most = sqrt(hull(s, p, &forward));
    *t = 0.5;
    if (most <= p->allowed && forward) return most / p->allowed;
    if (depth == DEPTH) return fmax(most / p->allowed, forward ? 0.0 : 2.0);
    part left = {.allowed = p->allowed}, right = {.allowed = p->allowed};
    for (int a = 0; a < s->cfg.axes; a++) {
        cut_at(p->b[a], 0.5, left.b[a], right.b[a]);
        left.from[a] = p->from[a];
        left.to[a] = right.from[a] = 0.5 * (p->from[a] + p->to[a]);
        right.to[a] = p->to[a];
    }
    double first = part_deviation(s, &left, depth + 1, t);
    *t *= 0.5;
    if (first > 1.0) return first;
    double u, second = part_deviation(s, &right, depth + 1, &u);
    if (!(second > first)) return first;
    *t = 0.5 + 0.5 * u;
    return second;
}

static void chord_point(const contour *path, int i, double t, int axes, double *q) {
    const node *a = &path->nodes[i], *b = a + 1;
    double r = (t - a->t) / (b->t - a->t);
    for (int k = 0; k < axes; k++) q[k] = a->q[k] + r * (b->q[k] - a->q[k]);
}

/* Deviation of the piece with the Bernstein coefficients b over contour parameters t0..t1; `chord`: where to begin looking, left
 * where the piece ends. The coefficients are used up. */
verdict certify_piece(nc_smooth *s, double b[][ORDER], double t0, double t1, const contour *path, int *chord) {
    verdict v = {0.0, t0, 0.0};
    double at = t0;
    while (*chord + 2 < path->n && path->nodes[*chord + 1].t <= t0) (*chord)++;
    for (int i = *chord;; i++) {
        bool last = i + 2 >= path->n || path->nodes[i + 1].t >= t1;
        double end = last ? t1 : path->nodes[i + 1].t;
        part p;
        p.allowed = fmax(s->tol - path->nodes[i + 1].slack, 0.05 * s->tol);
        for (int a = 0; a < s->cfg.axes; a++) {
            if (last) memcpy(p.b[a], b[a], sizeof p.b[a]);
            else cut_at(b[a], (end - at) / (t1 - at), p.b[a], b[a]);
        }
        chord_point(path, i, at, s->cfg.axes, p.from);
        chord_point(path, i, end, s->cfg.axes, p.to);
        double t, d = part_deviation(s, &p, 0, &t);
        if (d > v.worst) v = (verdict){d, at + t * (end - at), v.distance};
        v.distance = fmax(v.distance, d * p.allowed + path->nodes[i + 1].slack);
        *chord = i;
        if (last) return v;
        at = end;
    }
}
