/* Points, tangents, intersections of offset elements. */
#include "stages/compensation/intersect.h"
#include "maths/plain.h"

#include <math.h>

/* rad: turns this near to a half turn have no inner side */
#define REVERSAL 1e-9

double offset_turn(const double from[2], const double to[2]) {
    return plain_atan2(from[0] * to[1] - from[1] * to[0],
                       from[0] * to[0] + from[1] * to[1]);
}

void offset_point(const double point[2],
                  const double t[2],
                  double distance,
                  double out[2]) {
    out[0] = point[0] - distance * t[1];
    out[1] = point[1] + distance * t[0];
}

int offset_is_outer(const struct corner *corner) {
    return corner->distance * corner->turn < 0.0
           || fabs(corner->turn) > OFFSET_PI - REVERSAL;
}

/* Intersection of the two offset elements nearest to the corner; 0 if they do
 * not meet.
 *
 * With the corner as origin, n1 and n2 the left normals and u = |x|^2 - d^2, a
 * point x of offset element i (line or circle of signed curvature k) fulfils
 * x.n_i = d + k_i u / 2. Along bisector (a) and mean tangent (b), with s and c
 * sine and cosine of half the turn: a = (d + (k1 + k2) u / 4) / c, b = (k1 -
 * k2) u / (4 s). Setting u = s^2 y leaves a quadratic equation for y whose
 * terms stay of one size when the turn vanishes, so tangential joins come out
 * exactly. */
int offset_meet(const struct corner *corner, double out[2]) {
    double sine = plain_sin(0.5 * corner->turn);
    double cosine = plain_cos(0.5 * corner->turn);
    double sum = corner->curvature[0] + corner->curvature[1];
    double difference = corner->curvature[0] - corner->curvature[1];
    double quadratic =
        sum * sum * sine * sine + difference * difference * cosine * cosine;
    double linear = 2.0 * cosine * cosine - corner->distance * sum;
    double root =
        linear * linear - corner->distance * corner->distance * quadratic;
    double mean[2] = {corner->t[0][0] + corner->t[1][0],
                      corner->t[0][1] + corner->t[1][1]};
    double width = hypot(mean[0], mean[1]);
    if (!(root >= 0.0) || !(linear > 0.0) || !(width > 0.0)) {
        return 0;
    }
    double y =
        4.0 * corner->distance * corner->distance / (linear + sqrt(root));
    double along = (corner->distance + 0.25 * sum * sine * sine * y) / cosine;
    double across = 0.25 * difference * sine * y;
    mean[0] /= width;
    mean[1] /= width;
    offset_point(corner->point, mean, along, out);
    out[0] += across * mean[0];
    out[1] += across * mean[1];
    return 1;
}

/* Angle at the centre from one point to another, -pi..pi. */
static double angle_between(const double centre[2],
                            const double from[2],
                            const double to[2]) {
    double start[2] = {
        from[0] - centre[0],
        from[1] - centre[1],
    };
    double end[2] = {
        to[0] - centre[0],
        to[1] - centre[1],
    };
    return offset_turn(start, end);
}

/* Swept angle, without sign, of an arc whose offset runs from `start` to `end`;
 * negative: it has vanished. */
double offset_sweep(const nc_element *element,
                    const double start[2],
                    const double end[2]) {
    double sense = element->row.angle > 0.0 ? 1.0 : -1.0;
    double cut = angle_between(element->row.center, element->p[0], start)
                 + angle_between(element->row.center, end, element->p[1]);
    return fabs(element->row.angle) - sense * cut;
}

/* The one arc (or line) between two points that has tangent `t` at its end or
 * at its start, into `row`; 0: there is none. */
int offset_tangent_arc(const double from[2],
                       const double to[2],
                       const double t[2],
                       int at_end,
                       nc_block *row) {
    double chord[2] = {
        to[0] - from[0],
        to[1] - from[1],
    };
    double width = hypot(chord[0], chord[1]);
    double half = at_end ? offset_turn(chord, t) : offset_turn(t, chord);
    row->type = NC_LINEAR;
    if (width < OFFSET_ZERO_MM || fabs(half) < 1e-9) {
        return 1;
    }
    if (fabs(half) > OFFSET_PI - 1e-3) {
        return 0;
    }
    double radius = 0.5 * width / plain_sin(half);
    offset_point(at_end ? to : from, t, radius, row->center);
    row->type = NC_CIRCULAR;
    row->radius = fabs(radius);
    row->programmed_radius = 0.0;
    row->angle = 2.0 * half;
    return 1;
}
