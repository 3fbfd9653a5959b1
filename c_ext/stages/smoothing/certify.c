/* Is a polynomial within the tolerance of the programmed contour? On the part
 * of it that belongs to one chord the difference of the two is a polynomial
 * again, and the hull of its Bernstein coefficients bounds it. The same
 * parameter value on both sides bounds the Frechet distance, so each
 * curve stays near the other one. */
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC optimize("O3") /* loops of fixed length are written out */
#endif
#include "stages/smoothing/certify.h"
#include "stages/smoothing/state.h"

typedef struct part {
    double hull[NC_AXES][ORDER];       /* Bernstein coefficients of the curve */
    double from[NC_AXES], to[NC_AXES]; /* the chord beside it */
    double allowed;
} part;

/* Square of the largest deviation of the hull; where it is, 0..1; and whether
 * the curve goes forward. */
static double hull(const nc_smooth *smooth,
                   const struct part *part,
                   double *t,
                   bool *forward) {
    pair off[2][PAIRS] = {{{0.0}}};
    pair step[PAIRS] = {{0.0}};
    double length2 = 0.0;
    double most = 0.0;
    double least = INFINITY;
    double all = 0.0;
    int place = 0;
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        const double *hull_axis = part->hull[axis];
        double from = part->from[axis];
        double chord = part->to[axis] - from;
        double step_line = 0.2 * chord;
        pair line = {from, from + step_line};
        pair *sum = off[smooth->cfg.rotary >> axis & 1];
        for (int k = 0; k < PAIRS; k++, line += 2.0 * step_line) {
            pair miss = *(const pair *)(hull_axis + 2 * k) - line;
            sum[k] += miss * miss;
        }
        if (!in_main(smooth, axis)) {
            continue;
        }
        length2 += chord * chord;
        step[0] +=
            chord * (*(const pair *)(hull_axis + 1) - *(const pair *)hull_axis);
        step[1] +=
            chord
            * (*(const pair *)(hull_axis + 3) - *(const pair *)(hull_axis + 2));
        step[2][0] += chord * (hull_axis[5] - hull_axis[4]);
    }
    for (int j = 0; j < ORDER; j++) {
        double linear = off[0][j / 2][j % 2];
        double rotary = off[1][j / 2][j % 2];
        all += linear + rotary;
        double more = linear > rotary ? linear : rotary;
        if (more > most) {
            most = more;
            place = j;
        }
        if (j < 5 && step[j / 2][j % 2] < least) {
            least = step[j / 2][j % 2];
        }
    }
    *t = 0.2 * place;
    *forward = least * 5.0 >= FORWARD * length2;
    return isfinite(all) ? most : INFINITY;
}

/* Bernstein coefficients of both parts of a curve that is cut at r. */
static void cut_at(const double *whole,
                   double share,
                   double *left,
                   double *right) {
    double now[ORDER];
    memcpy(now, whole, sizeof now);
    for (int k = 0; k < ORDER; k++) {
        left[k] = now[0];
        right[5 - k] = now[5 - k];
        for (int j = 0; j + k < 5; j++) {
            now[j] += share * (now[j + 1] - now[j]);
        }
    }
}

/* `t`: where on the part, 0..1, it is too much. */
static double part_deviation(const nc_smooth *smooth,
                             const struct part *part,
                             int depth,
                             double *t) {
    bool forward;
    double most = sqrt(hull(smooth, part, t, &forward));
    if (most <= part->allowed && forward) {
        return most / part->allowed;
    }
    if (depth == DEPTH) {
        return fmax(most / part->allowed, forward ? 0.0 : 2.0);
    }
    struct part left = {.allowed = part->allowed};
    struct part right = {.allowed = part->allowed};
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        double *behind = right.hull[axis];
        cut_at(part->hull[axis], 0.5, left.hull[axis], behind);
        left.from[axis] = part->from[axis];
        left.to[axis] = right.from[axis] =
            0.5 * (part->from[axis] + part->to[axis]);
        right.to[axis] = part->to[axis];
    }
    double first = part_deviation(smooth, &left, depth + 1, t);
    *t *= 0.5;
    if (first > 1.0) {
        return first;
    }
    double second_at;
    double second = part_deviation(smooth, &right, depth + 1, &second_at);
    if (!(second > first)) {
        return first;
    }
    *t = 0.5 + 0.5 * second_at;
    return second;
}

static void chord_point(const contour *path,
                        int i,
                        double t,
                        int axes,
                        double *position) {
    const struct node *node = &path->nodes[i];
    const struct node *behind = node + 1;
    double share = (t - node->t) / (behind->t - node->t);
    for (int k = 0; k < axes; k++) {
        position[k] = node->position[k]
                      + share * (behind->position[k] - node->position[k]);
    }
}

/* Deviation of the piece with the Bernstein coefficients b over contour
 * parameters t0..t1; `chord`: where to begin looking, left where the piece
 * ends. The coefficients are used up. */
struct verdict certify_piece(nc_smooth *smooth,
                             double hull[][ORDER],
                             double t0,
                             double t1,
                             const contour *path,
                             int *chord) {
    struct verdict verdict = {0.0, t0, 0.0};
    double at = t0;
    while (*chord + 2 < path->count && path->nodes[*chord + 1].t <= t0) {
        (*chord)++;
    }
    for (int i = *chord;; i++) {
        bool last = i + 2 >= path->count || path->nodes[i + 1].t >= t1;
        double end = last ? t1 : path->nodes[i + 1].t;
        struct part part;
        part.allowed =
            fmax(smooth->tol - path->nodes[i + 1].slack, 0.05 * smooth->tol);
        for (int axis = 0; axis < smooth->cfg.axes; axis++) {
            if (last) {
                memcpy(part.hull[axis], hull[axis], sizeof part.hull[axis]);
            } else {
                cut_at(hull[axis],
                       (end - at) / (t1 - at),
                       part.hull[axis],
                       hull[axis]);
            }
        }
        chord_point(path, i, at, smooth->cfg.axes, part.from);
        chord_point(path, i, end, smooth->cfg.axes, part.to);
        double t;
        double deviation = part_deviation(smooth, &part, 0, &t);
        if (deviation > verdict.worst) {
            verdict = (struct verdict){deviation,
                                       at + t * (end - at),
                                       verdict.distance};
        }
        verdict.distance =
            fmax(verdict.distance,
                 deviation * part.allowed + path->nodes[i + 1].slack);
        *chord = i;
        if (last) {
            return verdict;
        }
        at = end;
    }
}
