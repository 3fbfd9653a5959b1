/* Distances between polylines; see polyline_distance.h. */
#include <math.h>
#include <stdbool.h>
#include <stdlib.h>
#include "stages/polyline_distance.h"
#include "stages/square.h"

enum {
    GROUP = 16,
    BESIDE = 3,
    HALVINGS = 48
};

typedef struct {
    double *low, *high; /* n x dim */
    int64_t count;
} boxes;

typedef struct {
    const double *at; /* m x dim */
    int64_t points;   /* points; m - 1 segments, one of no length if m is 1 */
    int dim;
    boxes lower, upper; /* around GROUP segments, around GROUP of those */
} line;

typedef struct {
    double distance;
    int64_t segment;
} near;

static int64_t segments(const line *line) {
    return line->points > 1 ? line->points - 1 : 1;
}

static bool make(boxes *boxes, int64_t count, int dim) {
    boxes->count = count;
    boxes->low = malloc(2 * (size_t)(count * dim) * sizeof *boxes->low);
    if (!boxes->low) {
        return false;
    }
    boxes->high = boxes->low + count * dim;
    for (int64_t i = 0; i < count * dim; i++) {
        boxes->low[i] = INFINITY;
        boxes->high[i] = -INFINITY;
    }
    return true;
}

static void widen(boxes *boxes,
                  int dim,
                  int64_t box,
                  const double *low,
                  const double *high) {
    for (int axis = 0; axis < dim; axis++) {
        boxes->low[box * dim + axis] =
            fmin(boxes->low[box * dim + axis], low[axis]);
        boxes->high[box * dim + axis] =
            fmax(boxes->high[box * dim + axis], high[axis]);
    }
}

static void drop(line *line) {
    free(line->lower.low);
    free(line->upper.low);
}

static bool prepare(line *line) {
    int64_t groups = (segments(line) + GROUP - 1) / GROUP;
    if (!make(&line->lower, groups, line->dim)
        || !make(&line->upper, (groups + GROUP - 1) / GROUP, line->dim)) {
        return false;
    }
    for (int64_t i = 0; i < line->points; i++) {
        const double *point = line->at + i * line->dim;
        if (i < segments(line)) {
            widen(&line->lower, line->dim, i / GROUP, point, point);
        }
        if (i) {
            widen(&line->lower, line->dim, (i - 1) / GROUP, point, point);
        }
    }
    for (int64_t group = 0; group < groups; group++) {
        widen(&line->upper,
              line->dim,
              group / GROUP,
              line->lower.low + group * line->dim,
              line->lower.high + group * line->dim);
    }
    return true;
}

/* Square of the distance to one segment. */
static double to_segment(const line *line, int64_t i, const double *point) {
    const double *from = line->at + i * line->dim;
    const double *to = i + 1 < line->points ? from + line->dim : from;
    double way = 0.0;
    double along = 0.0;
    double square = 0.0;
    for (int k = 0; k < line->dim; k++) {
        double difference = to[k] - from[k];
        way += difference * difference;
        along += (point[k] - from[k]) * difference;
    }
    double share = way > 0.0 ? fmin(fmax(along / way, 0.0), 1.0) : 0.0;
    for (int k = 0; k < line->dim; k++) {
        double way_k = to[k] - from[k];
        double remainder = point[k] - from[k] - share * way_k;
        square += remainder * remainder;
    }
    return square;
}

static double to_box(const boxes *boxes,
                     int dim,
                     int64_t box,
                     const double *point) {
    double square = 0.0;
    for (int k = 0; k < dim; k++) {
        double out = fmax(boxes->low[box * dim + k] - point[k],
                          point[k] - boxes->high[box * dim + k]);
        if (out > 0.0) {
            square += out * out;
        }
    }
    return square;
}

static void look(const line *line,
                 int64_t first,
                 int64_t end,
                 const double *point,
                 double *best,
                 int64_t *segment) {
    for (int64_t i = first < 0 ? 0 : first; i < end && i < segments(line);
         i++) {
        double square = to_segment(line, i, point);
        if (square < *best) {
            *best = square;
            *segment = i;
        }
    }
}

/* The nearest segment, or one near `hint` if that is no farther than `enough`.
 */
static near nearest(const line *line,
                    const double *point,
                    int64_t hint,
                    double enough) {
    double best = INFINITY;
    int64_t segment = hint;
    look(line, hint - BESIDE, hint + BESIDE + 1, point, &best, &segment);
    for (int64_t super = 0; super < line->upper.count && best > enough * enough;
         super++) {
        if (to_box(&line->upper, line->dim, super, point) >= best) {
            continue;
        }
        for (int64_t group = super * GROUP;
             group < (super + 1) * GROUP && group < line->lower.count;
             group++) {
            if (to_box(&line->lower, line->dim, group, point) < best) {
                look(line,
                     group * GROUP,
                     (group + 1) * GROUP,
                     point,
                     &best,
                     &segment);
            }
        }
    }
    return (near){sqrt(best), segment};
}

/* Neighbouring segments: up to the point next to their common vertex the one
 * counts, behind it the other. */
static double around_vertex(const line *line,
                            const double *from,
                            const double *to,
                            near at_a,
                            near at_b) {
    const double *vertex =
        line->at
        + (at_a.segment > at_b.segment ? at_a.segment : at_b.segment)
              * line->dim;
    double way = 0.0;
    double along = 0.0;
    double middle[NC_AXES];
    for (int k = 0; k < line->dim; k++) {
        double way_k = to[k] - from[k];
        way += square(way_k);
        along += (vertex[k] - from[k]) * way_k;
    }
    double share = way > 0.0 ? fmin(fmax(along / way, 0.0), 1.0) : 0.0;
    for (int k = 0; k < line->dim; k++) {
        middle[k] = from[k] + share * (to[k] - from[k]);
    }
    double both = fmax(to_segment(line, at_a.segment, middle),
                       to_segment(line, at_b.segment, middle));
    return fmax(sqrt(both), fmax(at_a.distance, at_b.distance));
}

/* What no distance between a and b exceeds. */
static double bound(const line *line,
                    const double *from,
                    const double *to,
                    near at_a,
                    near at_b) {
    double way2 = 0.0;
    for (int k = 0; k < line->dim; k++) {
        way2 += square(to[k] - from[k]);
    }
    double most = (at_a.distance + at_b.distance + sqrt(way2)) / 2.0;
    if (at_a.segment == at_b.segment) {
        return fmin(most, fmax(at_a.distance, at_b.distance));
    }
    if (llabs(at_a.segment - at_b.segment) == 1) {
        most = fmin(most, around_vertex(line, from, to, at_a, at_b));
    }
    most = fmin(most,
                fmax(at_a.distance, sqrt(to_segment(line, at_a.segment, to))));
    return fmin(
        most,
        fmax(at_b.distance, sqrt(to_segment(line, at_b.segment, from))));
}

static void halve(const line *line,
                  const double *from,
                  const double *to,
                  near at_a,
                  near at_b,
                  int left,
                  double close,
                  double *most) {
    if (!left || bound(line, from, to, at_a, at_b) <= *most + close) {
        return;
    }
    double middle[NC_AXES];
    for (int k = 0; k < line->dim; k++) {
        middle[k] = 0.5 * (from[k] + to[k]);
    }
    near at = nearest(line, middle, at_a.segment, *most);
    *most = fmax(*most, at.distance);
    halve(line, from, middle, at_a, at, left - 1, close, most);
    halve(line, middle, to, at, at_b, left - 1, close, most);
}

double nc_farthest(const double *mine,
                   int64_t count,
                   const double *other,
                   int64_t others,
                   int32_t dim,
                   double known,
                   double close) {
    line line = {.at = other, .points = others, .dim = dim};
    near *found = malloc((size_t)(count + 1) * sizeof *found);
    double most = found && prepare(&line) ? known : -1.0;
    for (int64_t i = 0; most >= 0.0 && i < count; i++) {
        found[i] =
            nearest(&line, mine + i * dim, i ? found[i - 1].segment : 0, most);
        most = fmax(most, found[i].distance);
    }
    for (int64_t i = 0; most >= 0.0 && i + 1 < count; i++) {
        halve(&line,
              mine + i * dim,
              mine + (i + 1) * dim,
              found[i],
              found[i + 1],
              HALVINGS,
              close,
              &most);
    }
    free(found);
    drop(&line);
    return most;
}

int nc_distances(const double *points,
                 int64_t count,
                 const double *other,
                 int64_t others,
                 int32_t dim,
                 double *out) {
    line line = {.at = other, .points = others, .dim = dim};
    bool ready = prepare(&line);
    int64_t segment = 0;
    for (int64_t i = 0; ready && i < count; i++) {
        near at = nearest(&line, points + i * dim, segment, 0.0);
        out[i] = at.distance;
        segment = at.segment;
    }
    drop(&line);
    return ready ? 0 : -1;
}
