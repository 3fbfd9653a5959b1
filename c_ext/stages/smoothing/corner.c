/* Corners between two chords: a quintic that begins and ends on them without curvature.
 *
 * Bezier points P - d u, P - d/2 u, P, P, P + d/2 v, P + d v: they lie in the triangle of the corner, so the blend leaves the
 * chords nowhere by more than it leaves the corner itself, which is 7/64 d |v - u|.
 */
#include "stages/smoothing/state.h"

#define REACH (7.0 / 64.0)
#define STRAIGHT 1e-7 /* rad */

/* Distance from the corner at which a blend begins that uses up the tolerance. */
double corner_distance(const nc_smooth *s, double turn) { return s->tol / (REACH * 2.0 * sin(0.5 * turn)); }

static void direction(const node *a, const node *b, int axes, double *u) {
    for (int k = 0; k < axes; k++) u[k] = (b->q[k] - a->q[k]) / (b->t - a->t);
}

/* |v - u| of the linear and of the rotary axes. */
static void change(const nc_smooth *s, const double *u, const double *v, double *linear, double *rotary) {
    double sum[2] = {0.0, 0.0};
    for (int k = 0; k < s->cfg.axes; k++) sum[s->cfg.rotary >> k & 1] += (v[k] - u[k]) * (v[k] - u[k]);
    *linear = sqrt(sum[0]);
    *rotary = sqrt(sum[1]);
}

static void blend(nc_smooth *s, const node *at, const double *u, const double *v, double d) {
    double c[NC_AXES][ORDER];
    for (int k = 0; k < s->cfg.axes; k++) {
        double p = at->q[k], a = d * u[k], b = d * v[k];
        /* power form of the Bezier points above */
        double z[ORDER] = {p - a, p - 0.5 * a, p, p, p + 0.5 * b, p + b};
        c[k][0] = z[0];
        c[k][1] = 5.0 * (z[1] - z[0]);
        c[k][2] = 10.0 * (z[2] - 2.0 * z[1] + z[0]);
        c[k][3] = 10.0 * (z[3] - 3.0 * z[2] + 3.0 * z[1] - z[0]);
        c[k][4] = 5.0 * (z[4] - 4.0 * z[3] + 6.0 * z[2] - 4.0 * z[1] + z[0]);
        c[k][5] = z[5] - 5.0 * z[4] + 10.0 * z[3] - 10.0 * z[2] + 5.0 * z[1] - z[0];
    }
    emit_curve(s, c, at->t - d, at->t + d, at);
    s->stats.corners++;
}

void corner_path(nc_smooth *s, int end) {
    const node *n = s->nodes;
    double from = s->out_t, u[NC_AXES], v[NC_AXES], linear, rotary;
    for (int i = 1; i < end; i++) {
        direction(&n[i - 1], &n[i], s->cfg.axes, u);
        direction(&n[i], &n[i + 1], s->cfg.axes, v);
        change(s, u, v, &linear, &rotary);
        double room = fmin(i == 1 ? n[1].t - from : 0.5 * (n[i].t - n[i - 1].t), (i + 1 == end ? 1.0 : 0.5) * (n[i + 1].t - n[i].t));
        double slack = fmax(n[i].slack, n[i + 1].slack), allowed = s->tol - slack;
        double d = fmin(room, allowed / (REACH * fmax(fmax(linear, rotary), 1e-12)));
        if (linear + rotary < STRAIGHT || d < 1e-6) {
            emit_line(s, &n[i - 1], &n[i], from, n[i].t);
            from = n[i].t;
            continue;
        }
        if (n[i].t - d > from + 1e-12) emit_line(s, &n[i - 1], &n[i], from, n[i].t - d);
        blend(s, &n[i], u, v, d);
        s->stats.deviation = fmax(s->stats.deviation, REACH * d * linear + slack);
        s->stats.rotary_deviation = fmax(s->stats.rotary_deviation, (REACH * d * rotary + slack) * s->degrees);
        from = n[i].t + d;
    }
    if (from < n[end].t) emit_line(s, &n[end - 1], &n[end], from, n[end].t);
}
