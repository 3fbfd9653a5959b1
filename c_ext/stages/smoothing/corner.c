/* Corners between two chords: a quintic that begins and ends on them without
 * curvature.
 *
 * Bezier points P - d u, P - d/2 u, P, P, P + d/2 v, P + d v: they lie in the
 * triangle of the corner, so the blend leaves the chords nowhere by more than
 * it leaves the corner itself, which is 7/64 d |v - u|.
 */
#include "stages/smoothing/emit.h"
#include "stages/smoothing/state.h"
#include "stages/square.h"
#include "maths/plain.h"

#define REACH (7.0 / 64.0)

/* Distance from the corner at which a blend begins that uses up the tolerance.
 */
double corner_distance(const nc_smooth *smooth, double turn) {
    return smooth->tol / (REACH * 2.0 * plain_sin(0.5 * turn));
}

static void direction(const struct node *from,
                      const struct node *behind,
                      int axes,
                      double *unit) {
    for (int k = 0; k < axes; k++) {
        unit[k] =
            (behind->position[k] - from->position[k]) / (behind->t - from->t);
    }
}

/* |v - u| of the linear and of the rotary axes. */
static void change(const nc_smooth *smooth,
                   const double *before,
                   const double *behind,
                   double *linear,
                   double *rotary) {
    double sum[2] = {0.0, 0.0};
    for (int k = 0; k < smooth->cfg.axes; k++) {
        int rotates = smooth->cfg.rotary >> k & 1;
        sum[rotates] += square(behind[k] - before[k]);
    }
    *linear = sqrt(sum[0]);
    *rotary = sqrt(sum[1]);
}

static void blend(nc_smooth *smooth,
                  const struct node *at,
                  const double *before,
                  const double *behind,
                  double reach) {
    double coef[NC_AXES][ORDER];
    for (int k = 0; k < smooth->cfg.axes; k++) {
        double point = at->position[k];
        double back = reach * before[k];
        double ahead = reach * behind[k];
        /* power form of the Bezier points above */
        double z[ORDER] = {point - back,
                           point - 0.5 * back,
                           point,
                           point,
                           point + 0.5 * ahead,
                           point + ahead};
        coef[k][0] = z[0];
        coef[k][1] = 5.0 * (z[1] - z[0]);
        coef[k][2] = 10.0 * (z[2] - 2.0 * z[1] + z[0]);
        coef[k][3] = 10.0 * (z[3] - 3.0 * z[2] + 3.0 * z[1] - z[0]);
        coef[k][4] = 5.0 * (z[4] - 4.0 * z[3] + 6.0 * z[2] - 4.0 * z[1] + z[0]);
        coef[k][5] =
            z[5] - 5.0 * z[4] + 10.0 * z[3] - 10.0 * z[2] + 5.0 * z[1] - z[0];
    }
    emit_curve(smooth, coef, at->t - reach, at->t + reach, at);
    smooth->stats.corners++;
}

void corner_path(nc_smooth *smooth, int end) {
    const struct node *node = smooth->nodes;
    double from = smooth->out_t;
    double before[NC_AXES], behind[NC_AXES], linear, rotary;
    for (int i = 1; i < end; i++) {
        const struct node *at = &node[i];
        direction(at - 1, at, smooth->cfg.axes, before);
        direction(at, at + 1, smooth->cfg.axes, behind);
        change(smooth, before, behind, &linear, &rotary);
        double room =
            fmin(i == 1 ? node[1].t - from : 0.5 * (node[i].t - node[i - 1].t),
                 (i + 1 == end ? 1.0 : 0.5) * (node[i + 1].t - node[i].t));
        double slack = fmax(node[i].slack, node[i + 1].slack);
        double allowed = smooth->tol - slack;
        double reach =
            fmin(room, allowed / (REACH * fmax(fmax(linear, rotary), 1e-12)));
        if (linear + rotary < STRAIGHT || reach < 1e-6) {
            emit_line(smooth, at - 1, at, from, at->t);
            from = node[i].t;
            continue;
        }
        if (node[i].t - reach > from + 1e-12) {
            emit_line(smooth, at - 1, at, from, at->t - reach);
        }
        blend(smooth, &node[i], before, behind, reach);
        smooth->stats.deviation =
            fmax(smooth->stats.deviation, REACH * reach * linear + slack);
        smooth->stats.rotary_deviation =
            fmax(smooth->stats.rotary_deviation,
                 (REACH * reach * rotary + slack) * smooth->degrees);
        from = node[i].t + reach;
    }
    if (from < node[end].t) {
        const struct node *last = &node[end];
        emit_line(smooth, last - 1, last, from, last->t);
    }
}
