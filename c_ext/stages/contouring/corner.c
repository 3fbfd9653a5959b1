/* One corner: a point on either block, and between them a curve of two quartics
 * that continues both in position, direction and curvature. Each quartic runs
 * over 0..1; with v the derivative, w the second one at an outer end, f(t) = p0
 * + v0 t + w0/2 t^2 + c3 t^3 + c4 t^4          from the first block g(s) = p1 -
 * v1 s + w1/2 s^2 + e3 s^3 + e4 s^4          back from the second one and they
 * meet at t = s = 1 with the same position and three derivatives; with an
 * interim point with two.
 */
#include <math.h>
#include <string.h>
#include "stages/contouring/corner.h"
#include "stages/contouring/tuning.h"
#include "curve/curve.h"
#include "stages/square.h"
#include "maths/plain.h"

typedef struct ends {
    double p0[NC_AXES];
    double v0[NC_AXES];
    double w0[NC_AXES];
    double p1[NC_AXES];
    double v1[NC_AXES];
    double w1[NC_AXES];
} ends;

/* The first quartic as it is; the second one, known from its end, over its own
 * 0..1. */
static void write_axis(struct corner *corner,
                       int axis,
                       const double *first,
                       const double *second) {
    memcpy(corner->coef[0][axis], first, 5 * sizeof *first);
    double *reversed = corner->coef[1][axis];
    reversed[0] = second[0] + second[1] + second[2] + second[3] + second[4];
    reversed[1] =
        -(second[1] + 2.0 * second[2] + 3.0 * second[3] + 4.0 * second[4]);
    reversed[2] = second[2] + 3.0 * second[3] + 6.0 * second[4];
    reversed[3] = -(second[3] + 4.0 * second[4]);
    reversed[4] = second[4];
    corner->mid[axis] = reversed[0];
}

static void curve_axis(struct corner *corner,
                       int axis,
                       const struct ends *ends,
                       const double *interim) {
    double w0 = ends->w0[axis];
    double w1 = ends->w1[axis];
    double f0 = ends->p0[axis] + ends->v0[axis] + 0.5 * w0;
    double f1 = ends->v0[axis] + ends->w0[axis];
    double f2 = ends->w0[axis];
    double g0 = ends->p1[axis] - ends->v1[axis] + 0.5 * w1;
    double g1 = -ends->v1[axis] + ends->w1[axis];
    double g2 = ends->w1[axis];
    double first[5] = {ends->p0[axis],
                       ends->v0[axis],
                       0.5 * ends->w0[axis],
                       0,
                       0};
    double second[5] = {ends->p1[axis],
                        -ends->v1[axis],
                        0.5 * ends->w1[axis],
                        0,
                        0};
    if (interim) {
        double x = interim[axis] - f0;
        double y = interim[axis] - g0;
        double sum = -(f1 + g1) - 3.0 * (x + y);
        double difference = y - x + (g2 - f2) / 6.0;
        first[4] = 0.5 * (sum + difference);
        second[4] = 0.5 * (sum - difference);
        first[3] = x - first[4];
        second[3] = y - second[4];
    } else {
        double x = g0 - f0;
        double z = (g2 - f2) / 6.0;
        double y = -(f1 + g1);
        double s3 = 0.5 * y;
        double s4 = -y / 8.0;
        double d3 = 2.0 * x - z;
        double d4 = z - x;
        first[3] = 0.5 * (s3 + d3);
        first[4] = 0.5 * (s4 + d4);
        second[3] = 0.5 * (s3 - d3);
        second[4] = 0.5 * (s4 - d4);
    }
    write_axis(corner, axis, first, second);
}

/* How long the tangents at both ends are, as a share of the corner distances:
 * the shortest jerk-limited motion at a given deviation, measured. Towards 4/3
 * the third derivative begins at 0, below 1 it begins with its peak. */
static double tangent_share(double turn) {
    return fmin(1.2, fmax(1.1, 1.06 + 0.115 * turn));
}

typedef struct request {
    const nc_contour_config *cfg;
    const struct contour_mode *mode;
    const struct leg *before, *behind, *skipped;
    int n_skipped;
    double turn, gap;
} request;

static void make_curve(const struct request *request,
                       double pre,
                       double post,
                       struct corner *corner) {
    struct ends ends;
    double share = tangent_share(request->turn);
    double l0 = share * (pre + 0.5 * request->gap);
    double l1 = share * (post + 0.5 * request->gap);
    leg_at(request->cfg,
           request->before,
           request->before->length - pre,
           ends.p0,
           ends.v0,
           ends.w0);
    leg_at(request->cfg, request->behind, post, ends.p1, ends.v1, ends.w1);
    const double *interim =
        request->mode->mode == NC_CONTOUR_POS ? request->mode->interim : NULL;
    double middle[NC_AXES];
    if (interim) {
        for (int axis = 0; axis < request->cfg->axes; axis++) {
            double given =
                isnan(interim[axis])
                    ? request->before->row.end[axis]
                    : interim[axis]; /* not programmed: the corner's */
            middle[axis] = is_main(request->cfg, axis)
                               ? given
                               : 0.5 * (ends.p0[axis] + ends.p1[axis]);
        }
        interim = middle;
        l0 = main_distance(request->cfg, ends.p0, middle);
        l1 = main_distance(request->cfg, ends.p1, middle);
    }
    for (int axis = 0; axis < request->cfg->axes; axis++) {
        ends.v0[axis] *= l0;
        ends.w0[axis] *= l0 * l0;
        ends.v1[axis] *= l1;
        ends.w1[axis] *= l1 * l1;
        curve_axis(corner, axis, &ends, interim);
    }
    corner->pre = pre;
    corner->post = post;
}

static void value_at(const nc_contour_config *cfg,
                     const struct corner *corner,
                     int half,
                     double t,
                     double *position,
                     double *d1,
                     double *d2) {
    for (int axis = 0; axis < cfg->axes; axis++) {
        const double *k = corner->coef[half][axis];
        double third = k[3] + t * k[4];
        double rise = t * (k[1] + t * (k[2] + t * third));
        position[axis] = k[0] + rise;
        double slope3 = 3.0 * k[3] + t * 4.0 * k[4];
        d1[axis] = k[1] + t * (2.0 * k[2] + t * slope3);
        double bend3 = 6.0 * k[3] + t * 12.0 * k[4];
        d2[axis] = 2.0 * k[2] + t * bend3;
    }
}

/* Largest distance between curve and contour: of the corner from the interim
 * point, of samples from the blocks. */
static double deviation(const struct request *request,
                        const struct corner *corner) {
    double most =
        fmin(main_distance(request->cfg, corner->mid, request->before->row.end),
             main_distance(request->cfg, corner->mid, request->behind->start));
    if (request->before->row.type == NC_LINEAR
        && request->behind->row.type == NC_LINEAR && !request->n_skipped
        && request->mode->mode != NC_CONTOUR_POS) {
        return most;
    }
    for (int half = 0; half < 2; half++) {
        for (int k = 1; k <= SAMPLES; k++) {
            double position[NC_AXES], d1[NC_AXES], d2[NC_AXES];
            value_at(request->cfg,
                     corner,
                     half,
                     (double)k / SAMPLES,
                     position,
                     d1,
                     d2);
            double away =
                fmin(leg_distance(request->cfg, request->before, position),
                     leg_distance(request->cfg, request->behind, position));
            for (int i = 0; i < request->n_skipped; i++) {
                away = fmin(
                    away,
                    leg_distance(request->cfg, &request->skipped[i], position));
            }
            most = fmax(most, away);
        }
    }
    return most;
}

static double track_deviation(const struct request *request,
                              const struct corner *corner) {
    double most = 0.0;
    for (int axis = 0; axis < request->cfg->axes; axis++) {
        if (!is_main(request->cfg, axis)) {
            most =
                fmax(most,
                     fabs(corner->mid[axis] - request->before->row.end[axis]));
        }
    }
    return most;
}

static void third_at(const nc_contour_config *cfg,
                     const struct corner *corner,
                     int half,
                     double t,
                     double *d3) {
    for (int axis = 0; axis < cfg->axes; axis++) {
        const double *k = corner->coef[half][axis];
        d3[axis] = 6.0 * k[3] + t * 24.0 * k[4];
    }
}

static double main_product(const nc_contour_config *cfg,
                           const double *a,
                           const double *b) {
    double sum = 0.0;
    for (int i = 0; i < 3; i++) {
        int axis = cfg->main_axis[i];
        if (axis >= 0) {
            sum += a[axis] * b[axis];
        }
    }
    return sum;
}

/* At a constant path speed of 1: the largest acceleration and jerk of the main
 * axes, these are the second and third derivative by length. */
struct needs {
    double accel, jerk;
};

static struct needs needs_of(const struct request *request,
                             const struct corner *corner) {
    const nc_contour_config *cfg = request->cfg;
    struct needs most = {0.0, 0.0};
    for (int half = 0; half < 2; half++) {
        for (int k = 0; k <= SAMPLES; k++) {
            double t = (double)k / SAMPLES;
            double position[NC_AXES], d1[NC_AXES], d2[NC_AXES], d3[NC_AXES];
            double by_length[NC_AXES] = {0.0};
            value_at(cfg, corner, half, t, position, d1, d2);
            third_at(cfg, corner, half, t, d3);
            double v2 = main_product(cfg, d1, d1);
            if (v2 <= 0.0) {
                return (struct needs){1e300, 1e300};
            }
            double w2 = main_product(cfg, d2, d2);
            double vw = main_product(cfg, d1, d2);
            double along = 4.0 * vw * vw / v2 - w2 - main_product(cfg, d1, d3);
            for (int axis = 0; axis < cfg->axes; axis++) {
                by_length[axis] =
                    d3[axis] + (along * d1[axis] - 3.0 * vw * d2[axis]) / v2;
            }
            most.accel =
                fmax(most.accel, sqrt(fmax(0.0, w2 - vw * vw / v2)) / v2);
            most.jerk = fmax(most.jerk,
                             sqrt(main_product(cfg, by_length, by_length))
                                 / (v2 * sqrt(v2)));
        }
    }
    return most;
}

/* Whether the curve asks for more than the machine has: at this speed, with a
 * share of the acceleration. */
static bool too_tight(const struct request *request,
                      const struct corner *corner,
                      double speed,
                      double share) {
    const nc_contour_config *cfg = request->cfg;
    struct needs needs = needs_of(request, corner);
    return needs.accel * speed * speed >= share * cfg->accel
           || (cfg->jerk > 0.0
               && needs.jerk * speed * speed * speed >= cfg->jerk);
}

static double most_of(const struct contour_mode *contour_mode,
                      const struct leg *leg) {
    double most = 0.5 * (1.0 - contour_mode->remain) * leg->whole;
    if (leg->row.type == NC_CIRCULAR) {
        most = fmin(most, leg->length * QUARTER / fabs(leg->row.angle));
    }
    return fmin(most, leg->length);
}

static double speed_of(const struct request *request, const struct leg *leg) {
    return leg->row.flags & NC_RAPID ? request->cfg->rapid : leg->row.feed;
}

static bool allowed(const struct request *request,
                    const struct corner *corner) {
    if (request->mode->path_dev > 0.0
        && deviation(request, corner) > request->mode->path_dev) {
        return false;
    }
    return !(request->mode->track_dev > 0.0)
           || track_deviation(request, corner) <= request->mode->track_dev;
}

/* Largest share of both distances whose deviations are allowed. */
static void shrink_to_allowed(const struct request *request,
                              double *pre,
                              double *post,
                              struct corner *corner) {
    make_curve(request, *pre, *post, corner);
    if (allowed(request, corner)) {
        return;
    }
    double low = 0.0;
    double high = 1.0;
    for (int k = 0; k < STEPS; k++) {
        double middle = 0.5 * (low + high);
        make_curve(request, middle * *pre, middle * *post, corner);
        if (allowed(request, corner)) {
            low = middle;
        } else {
            high = middle;
        }
    }
    *pre *= TARGET * low;
    *post *= TARGET * low;
    make_curve(request, *pre, *post, corner);
}

/* Not longer than the programmed speed needs with this share of the machine's
 * acceleration, and its jerk. */
static void shrink_to_speed(const struct request *request,
                            double speed,
                            double share,
                            double *pre,
                            double *post,
                            struct corner *corner) {
    make_curve(request, *pre, *post, corner);
    if (too_tight(request, corner, speed, share)) {
        return;
    }
    double low = 0.0;
    double high = 1.0;
    for (int k = 0; k < STEPS; k++) {
        double middle = 0.5 * (low + high);
        make_curve(request, middle * *pre, middle * *post, corner);
        if (too_tight(request, corner, speed, share)) {
            low = middle;
        } else {
            high = middle;
        }
    }
    *pre *= high;
    *post *= high;
    make_curve(request, *pre, *post, corner);
}

static void symmetrical(double *pre, double *post) {
    *pre = *post = fmin(*pre, *post);
}

/* Corner distances by mode, limited by the blocks; the curve they give. */
static void choose(const struct request *request, struct corner *corner) {
    const struct contour_mode *contour_mode = request->mode;
    double pre = most_of(contour_mode, request->before);
    double post = most_of(contour_mode, request->behind);
    double slower = fmin(speed_of(request, request->before),
                         speed_of(request, request->behind));
    bool given = contour_mode->mode == NC_CONTOUR_DIST
                 || contour_mode->mode == NC_CONTOUR_POS;
    bool equal = !given || contour_mode->pre == contour_mode->post;
    if (contour_mode->pre >= 0.0) {
        pre = fmin(pre, contour_mode->pre);
    }
    if (contour_mode->post >= 0.0) {
        post = fmin(post, contour_mode->post);
    }
    if (equal) {
        symmetrical(&pre, &post);
    }
    if (contour_mode->mode == NC_CONTOUR_SOFT) {
        shrink_to_speed(request,
                        slower,
                        contour_mode->share,
                        &pre,
                        &post,
                        corner);
    }
    if (contour_mode->mode == NC_CONTOUR_AUTO_DEV) {
        shrink_to_speed(request, slower, 1.0, &pre, &post, corner);
    }
    if (contour_mode->mode == NC_CONTOUR_AUTO_VEL) {
        shrink_to_speed(request,
                        speed_of(request, request->before)
                            * contour_mode->share,
                        1.0,
                        &pre,
                        &post,
                        corner);
    }
    if (contour_mode->mode == NC_CONTOUR_POS) {
        make_curve(request, pre, post, corner);
    } else {
        shrink_to_allowed(request, &pre, &post, corner);
    }
}

static double turn_between(const nc_contour_config *cfg,
                           const double *before,
                           const double *behind) {
    double minus = 0.0;
    double plus = 0.0;
    for (int i = 0; i < 3; i++) {
        int axis = cfg->main_axis[i];
        if (axis < 0) {
            continue;
        }
        minus += square(before[axis] - behind[axis]);
        plus += square(before[axis] + behind[axis]);
    }
    return 2.0 * plain_atan2(sqrt(minus), sqrt(plus));
}

static bool tracks_bend(const nc_contour_config *cfg,
                        const double *before,
                        const double *behind) {
    for (int axis = 0; axis < cfg->axes; axis++) {
        if (!is_main(cfg, axis)
            && fabs(before[axis] - behind[axis]) > TANGENTIAL) {
            return true;
        }
    }
    return false;
}

/* Lengths as the engine will measure them; false: no regular curve. */
static bool measure(const nc_contour_config *cfg, struct corner *corner) {
    uint16_t main = 0;
    for (int i = 0; i < 3; i++) {
        if (cfg->main_axis[i] >= 0) {
            main |= (uint16_t)(1u << cfg->main_axis[i]);
        }
    }
    for (int half = 0; half < 2; half++) {
        struct curve curve;
        if (!curve_build(&curve,
                         &corner->coef[half][0][0],
                         cfg->axes,
                         4,
                         1.0,
                         main)) {
            return false;
        }
        if (!(curve.moving & main)) {
            return false;
        }
        corner->length[half] = curve_length(&curve);
    }
    return true;
}

bool corner_make(const nc_contour_config *cfg,
                 const struct contour_mode *mode,
                 const struct leg *before,
                 const struct leg *behind,
                 const struct leg *skipped,
                 int skipped_count,
                 struct corner *out,
                 bool *irregular) {
    double position[NC_AXES], before_tangent[NC_AXES], behind_tangent[NC_AXES],
        second[NC_AXES];
    leg_at(cfg, before, before->length, position, before_tangent, second);
    leg_at(cfg, behind, 0.0, position, behind_tangent, second);
    struct request request = {
        cfg,
        mode,
        before,
        behind,
        skipped,
        skipped_count,
        turn_between(cfg, before_tangent, behind_tangent),
        main_distance(cfg, before->row.end, behind->start)};
    *irregular = false;
    if (mode->mode != NC_CONTOUR_POS) {
        if (request.turn < TANGENTIAL && !skipped_count
            && !(mode->track_dev > 0.0
                 && tracks_bend(cfg, before_tangent, behind_tangent))) {
            return false;
        }
        if (request.turn > REVERSAL) {
            return false;
        }
    }
    if (mode->max_angle > 0.0 && request.turn > mode->max_angle) {
        return false;
    }
    choose(&request, out);
    if (mode->mode != NC_CONTOUR_POS && (out->pre < KEPT || out->post < KEPT)) {
        return false;
    }
    if (before->length - out->pre < NOTHING) {
        make_curve(&request, before->length, out->post, out);
    }
    out->deviation = deviation(&request, out);
    *irregular = !measure(cfg, out);
    return !*irregular;
}
