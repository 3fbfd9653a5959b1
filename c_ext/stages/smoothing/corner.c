/* Corners between two chords: a quintic that begins and ends on them without
 * curvature.
 *
 * Bezier points P - d u, P - d/2 u, P, P, P + d/2 v, P + d v: they lie in the
 * triangle of the corner, so the blend leaves the chords nowhere by more than
 * it leaves the corner itself, which is 7/64 d |v - u|.
 */
#include "stages/smoothing/state.h"

#define REACH (7.0 / 64.0)
#define STRAIGHT 1e-7 /* rad */

/* Distance from the corner at which a blend begins that uses up the tolerance.
 */
double corner_distance(const nc_smooth *smooth, double turn) {
    return smooth->tol / (REACH * 2.0 * sin(0.5 * turn));
}

static void direction(const struct node *node,
                      const struct node *node_b,
                      int axes,
                      double *u) {
    for (int k = 0; k < axes; k++) {
        u[k] = (node_b->q[k] - node->q[k]) / (node_b->t - node->t);
    }
}

/* |v - u| of the linear and of the rotary axes. */
static void change(const nc_smooth *smooth,
                   const double *u,
                   const double *v,
                   double *linear,
                   double *rotary) {
    double sum[2] = {0.0, 0.0};
    for (int k = 0; k < smooth->cfg.axes; k++) {
        sum[smooth->cfg.rotary >> k & 1] += (v[k] - u[k]) * (v[k] - u[k]);
    }
    *linear = sqrt(sum[0]);
    *rotary = sqrt(sum[1]);
}

static void blend(nc_smooth *smooth,
                  const struct node *at,
                  const double *u,
                  const double *v,
                  double d) {
    double c[NC_AXES][ORDER];
    for (int k = 0; k < smooth->cfg.axes; k++) {
        double p = at->q[k], a = d * u[k], b = d * v[k];
        /* power form of the Bezier points above */
        double z[ORDER] = {p - a, p - 0.5 * a, p, p, p + 0.5 * b, p + b};
        c[k][0] = z[0];
        c[k][1] = 5.0 * (z[1] - z[0]);
        c[k][2] = 10.0 * (z[2] - 2.0 * z[1] + z[0]);
        c[k][3] = 10.0 * (z[3] - 3.0 * z[2] + 3.0 * z[1] - z[0]);
        c[k][4] = 5.0 * (z[4] - 4.0 * z[3] + 6.0 * z[2] - 4.0 * z[1] + z[0]);
        c[k][5] =
            z[5] - 5.0 * z[4] + 10.0 * z[3] - 10.0 * z[2] + 5.0 * z[1] - z[0];
    }
    emit_curve(smooth, c, at->t - d, at->t + d, at);
    smooth->stats.corners++;
}

void corner_path(nc_smooth *smooth, int end) {
    const struct node *node = smooth->nodes;
    double from = smooth->out_t, u[NC_AXES], v[NC_AXES], linear, rotary;
    for (int i = 1; i < end; i++) {
        direction(&node[i - 1], &node[i], smooth->cfg.axes, u);
        direction(&node[i], &node[i + 1], smooth->cfg.axes, v);
        change(smooth, u, v, &linear, &rotary);
        double room =
            fmin(i == 1 ? node[1].t - from : 0.5 * (node[i].t - node[i - 1].t),
                 (i + 1 == end ? 1.0 : 0.5) * (node[i + 1].t - node[i].t));
        double slack = fmax(node[i].slack, node[i + 1].slack),
               allowed = smooth->tol - slack;
        double d =
            fmin(room, allowed / (REACH * fmax(fmax(linear, rotary), 1e-12)));
        if (linear + rotary < STRAIGHT || d < 1e-6) {
            emit_line(smooth, &node[i - 1], &node[i], from, node[i].t);
            from = node[i].t;
            continue;
        }
        if (node[i].t - d > from + 1e-12) {
            emit_line(smooth, &node[i - 1], &node[i], from, node[i].t - d);
        }
        blend(smooth, &node[i], u, v, d);
        smooth->stats.deviation =
            fmax(smooth->stats.deviation, REACH * d * linear + slack);
        smooth->stats.rotary_deviation =
            fmax(smooth->stats.rotary_deviation,
                 (REACH * d * rotary + slack) * smooth->degrees);
        from = node[i].t + d;
    }
    if (from < node[end].t) {
        emit_line(smooth, &node[end - 1], &node[end], from, node[end].t);
    }
}
