/* One corner: a point on either block, and between them a curve of two quartics that continues both in position,
 * direction and curvature. Each quartic runs over 0..1; with v the derivative, w the second one at an outer end,
 *     f(t) = p0 + v0 t + w0/2 t^2 + c3 t^3 + c4 t^4          from the first block
 *     g(s) = p1 - v1 s + w1/2 s^2 + e3 s^3 + e4 s^4          back from the second one
 * and they meet at t = s = 1 with the same position and three derivatives; with an interim point with two.
 */
#include "stages/contouring/contouring.h"
#include <math.h>
#include <string.h>
#include "stages/contouring/state.h"

#define TANGENTIAL 1e-6      /* rad */
#define REVERSAL 3.09        /* rad: nearer to a reversal nothing is rounded */
#define QUARTER 1.5707963267948966
#define SAMPLES 8            /* per quartic */
#define STEPS 48
#define TARGET 0.9999        /* share of the allowed deviation that is aimed at */
#define KEPT 1e-6            /* mm: corner distances below it are none */

static bool is_main(const nc_contour_config *cfg, int axis) {
    return axis == cfg->main_axis[0] || axis == cfg->main_axis[1] || axis == cfg->main_axis[2];
}

/* ---- blocks ----------------------------------------------------------------------------------------------------- */

void leg_set(const nc_contour_config *cfg, leg *l, const nc_block *row, const double *start) {
    static const int planes[3][2] = {{0, 1}, {2, 0}, {1, 2}};
    l->row = *row;
    memcpy(l->start, start, sizeof l->start);
    l->length = l->whole = row->length;
    if (row->type != NC_CIRCULAR) return;
    l->axis1 = cfg->main_axis[planes[row->plane - 17][0]];
    l->axis2 = cfg->main_axis[planes[row->plane - 17][1]];
    memcpy(l->centre, row->center, sizeof l->centre);
    double e1 = start[l->axis1] - row->center[0], e2 = start[l->axis2] - row->center[1];
    l->radius = hypot(e1, e2);
    l->angle0 = atan2(e2, e1);
}

/* Position and derivatives by path length, s from the block's present start. */
void leg_at(const nc_contour_config *cfg, const leg *l, double s, double *q, double *d1, double *d2) {
    double r = s / l->length;
    for (int a = 0; a < cfg->axes; a++) {
        d1[a] = (l->row.end[a] - l->start[a]) / l->length;
        d2[a] = 0.0;
        q[a] = l->start[a] + d1[a] * s;
    }
    if (l->row.type != NC_CIRCULAR) return;
    double rate = l->row.angle / l->length, angle = l->angle0 + l->row.angle * r, x = l->radius * cos(angle), y = l->radius * sin(angle);
    q[l->axis1] = l->centre[0] + x;
    q[l->axis2] = l->centre[1] + y;
    d1[l->axis1] = -rate * y;
    d1[l->axis2] = rate * x;
    d2[l->axis1] = -rate * rate * x;
    d2[l->axis2] = -rate * rate * y;
}

static void set_length(leg *l, double length) {
    double share = length / l->length;
    l->row.angle *= share;
    l->row.length_min *= share;
    l->row.length = l->length = length;
}

void leg_cut_end(const nc_contour_config *cfg, leg *l, double d) {
    double q[NC_AXES], d1[NC_AXES], d2[NC_AXES], length = l->length - d;
    leg_at(cfg, l, length, q, d1, d2);
    memcpy(l->row.end, q, sizeof *q * (size_t)cfg->axes);
    set_length(l, length);
}

void leg_cut_start(const nc_contour_config *cfg, leg *l, double d) {
    double q[NC_AXES], d1[NC_AXES], d2[NC_AXES];
    leg_at(cfg, l, d, q, d1, d2);
    memcpy(l->start, q, sizeof *q * (size_t)cfg->axes);
    if (l->row.type == NC_CIRCULAR) l->angle0 += l->row.angle * (d / l->length);
    set_length(l, l->length - d);
}

/* Largest way of an axis that is no main axis. */
double leg_track(const nc_contour_config *cfg, const leg *l) {
    double most = 0.0;
    for (int a = 0; a < cfg->axes; a++)
        if (!is_main(cfg, a)) most = fmax(most, fabs(l->row.end[a] - l->start[a]));
    return most;
}

static double main_distance(const nc_contour_config *cfg, const double *p, const double *q) {
    double sum = 0.0;
    for (int i = 0; i < 3; i++) {
        int a = cfg->main_axis[i];
        if (a >= 0) sum += (p[a] - q[a]) * (p[a] - q[a]);
    }
    return sqrt(sum);
}

/* Distance of q from the block, main axes. */
static double leg_distance(const nc_contour_config *cfg, const leg *l, const double *q) {
    double at[NC_AXES], d1[NC_AXES], d2[NC_AXES], s;
    if (l->row.type == NC_CIRCULAR) {
        double along = atan2(q[l->axis2] - l->centre[1], q[l->axis1] - l->centre[0]) - l->angle0;
        double turn = fmod(l->row.angle > 0 ? along : -along, 4.0 * QUARTER);
        if (turn < 0) turn += 4.0 * QUARTER;
        double whole = fabs(l->row.angle);
        if (turn > whole) turn = turn - whole < 4.0 * QUARTER - turn ? whole : 0.0;
        s = turn / whole * l->length;
    } else {
        double dot = 0.0;
        for (int i = 0; i < 3; i++) {
            int a = cfg->main_axis[i];
            if (a >= 0) dot += (q[a] - l->start[a]) * (l->row.end[a] - l->start[a]);
        }
        s = fmin(fmax(dot / l->length, 0.0), l->length);
    }
    leg_at(cfg, l, s, at, d1, d2);
    return main_distance(cfg, at, q);
}

/* ---- curve ------------------------------------------------------------------------------------------------------ */

typedef struct ends {
    double p0[NC_AXES], v0[NC_AXES], w0[NC_AXES], p1[NC_AXES], v1[NC_AXES], w1[NC_AXES];
} ends;

/* The first quartic as it is; the second one, known from its end, over its own 0..1. */
static void write_axis(corner *c, int a, const double *f, const double *g) {
    memcpy(c->coef[0][a], f, 5 * sizeof *f);
    double *h = c->coef[1][a];
    h[0] = g[0] + g[1] + g[2] + g[3] + g[4];
    h[1] = -(g[1] + 2.0 * g[2] + 3.0 * g[3] + 4.0 * g[4]);
    h[2] = g[2] + 3.0 * g[3] + 6.0 * g[4];
    h[3] = -(g[3] + 4.0 * g[4]);
    h[4] = g[4];
    c->mid[a] = h[0];
}

static void curve_axis(corner *c, int a, const ends *e, const double *interim) {
    double f0 = e->p0[a] + e->v0[a] + 0.5 * e->w0[a], f1 = e->v0[a] + e->w0[a], f2 = e->w0[a];
    double g0 = e->p1[a] - e->v1[a] + 0.5 * e->w1[a], g1 = -e->v1[a] + e->w1[a], g2 = e->w1[a];
    double f[5] = {e->p0[a], e->v0[a], 0.5 * e->w0[a], 0, 0}, g[5] = {e->p1[a], -e->v1[a], 0.5 * e->w1[a], 0, 0};
    if (interim) {
        double x = interim[a] - f0, y = interim[a] - g0;
        double sum = -(f1 + g1) - 3.0 * (x + y), difference = y - x + (g2 - f2) / 6.0;
        f[4] = 0.5 * (sum + difference);
        g[4] = 0.5 * (sum - difference);
        f[3] = x - f[4];
        g[3] = y - g[4];
    } else {
        double x = g0 - f0, z = (g2 - f2) / 6.0, y = -(f1 + g1);
        double s3 = 0.5 * y, s4 = -y / 8.0, d3 = 2.0 * x - z, d4 = z - x;
        f[3] = 0.5 * (s3 + d3);
        f[4] = 0.5 * (s4 + d4);
        g[3] = 0.5 * (s3 - d3);
        g[4] = 0.5 * (s4 - d4);
    }
    write_axis(c, a, f, g);
}

/* How long the tangents at both ends are, as a share of the corner distances: the shortest jerk-limited motion at a given
 * deviation, measured. Towards 4/3 the third derivative begins at 0, below 1 it begins with its peak. */
static double tangent_share(double turn) { return fmin(1.2, fmax(1.1, 1.06 + 0.115 * turn)); }

typedef struct request {
    const nc_contour_config *cfg;
    const contour_mode *m;
    const leg *a, *b, *skipped;
    int n_skipped;
    double turn, gap;
} request;

static void make_curve(const request *r, double pre, double post, corner *c) {
    ends e;
    double share = tangent_share(r->turn), l0 = share * (pre + 0.5 * r->gap), l1 = share * (post + 0.5 * r->gap);
    leg_at(r->cfg, r->a, r->a->length - pre, e.p0, e.v0, e.w0);
    leg_at(r->cfg, r->b, post, e.p1, e.v1, e.w1);
    const double *interim = r->m->mode == NC_CONTOUR_POS ? r->m->interim : NULL;
    double middle[NC_AXES];
    if (interim) {
        for (int a = 0; a < r->cfg->axes; a++) {
            double given = isnan(interim[a]) ? r->a->row.end[a] : interim[a]; /* not programmed: the corner's */
            middle[a] = is_main(r->cfg, a) ? given : 0.5 * (e.p0[a] + e.p1[a]);
        }
        interim = middle;
        l0 = main_distance(r->cfg, e.p0, middle);
        l1 = main_distance(r->cfg, e.p1, middle);
    }
    for (int a = 0; a < r->cfg->axes; a++) {
        e.v0[a] *= l0;
        e.w0[a] *= l0 * l0;
        e.v1[a] *= l1;
        e.w1[a] *= l1 * l1;
        curve_axis(c, a, &e, interim);
    }
    c->pre = pre;
    c->post = post;
}

static void value_at(const nc_contour_config *cfg, const corner *c, int half, double t, double *q, double *d1, double *d2) {
    for (int a = 0; a < cfg->axes; a++) {
        const double *k = c->coef[half][a];
        q[a] = k[0] + t * (k[1] + t * (k[2] + t * (k[3] + t * k[4])));
        d1[a] = k[1] + t * (2.0 * k[2] + t * (3.0 * k[3] + t * 4.0 * k[4]));
        d2[a] = 2.0 * k[2] + t * (6.0 * k[3] + t * 12.0 * k[4]);
    }
}

/* Largest distance between curve and contour: of the corner from the interim point, of samples from the blocks. */
static double deviation(const request *r, const corner *c) {
    double most = fmin(main_distance(r->cfg, c->mid, r->a->row.end), main_distance(r->cfg, c->mid, r->b->start));
    if (r->a->row.type == NC_LINEAR && r->b->row.type == NC_LINEAR && !r->n_skipped && r->m->mode != NC_CONTOUR_POS) return most;
    for (int half = 0; half < 2; half++)
        for (int k = 1; k <= SAMPLES; k++) {
            double q[NC_AXES], d1[NC_AXES], d2[NC_AXES];
            value_at(r->cfg, c, half, (double)k / SAMPLES, q, d1, d2);
            double away = fmin(leg_distance(r->cfg, r->a, q), leg_distance(r->cfg, r->b, q));
            for (int i = 0; i < r->n_skipped; i++) away = fmin(away, leg_distance(r->cfg, &r->skipped[i], q));
            most = fmax(most, away);
        }
    return most;
}

static double track_deviation(const request *r, const corner *c) {
    double most = 0.0;
    for (int a = 0; a < r->cfg->axes; a++)
        if (!is_main(r->cfg, a)) most = fmax(most, fabs(c->mid[a] - r->a->row.end[a]));
    return most;
}

static double peak_curvature(const request *r, const corner *c) {
    double most = 0.0;
    for (int half = 0; half < 2; half++)
        for (int k = 0; k <= SAMPLES; k++) {
            double q[NC_AXES], d1[NC_AXES], d2[NC_AXES], v2 = 0.0, w2 = 0.0, vw = 0.0;
            value_at(r->cfg, c, half, (double)k / SAMPLES, q, d1, d2);
            for (int i = 0; i < 3; i++) {
                int a = r->cfg->main_axis[i];
                if (a < 0) continue;
                v2 += d1[a] * d1[a];
                w2 += d2[a] * d2[a];
                vw += d1[a] * d2[a];
            }
            if (v2 <= 0.0) return 1e300;
            most = fmax(most, sqrt(fmax(0.0, w2 - vw * vw / v2)) / v2);
        }
    return most;
}

/* ---- corner distances ------------------------------------------------------------------------------------------- */

static double most_of(const contour_mode *m, const leg *l) {
    double most = 0.5 * (1.0 - m->remain) * l->whole;
    if (l->row.type == NC_CIRCULAR) most = fmin(most, l->length * QUARTER / fabs(l->row.angle));
    return fmin(most, l->length);
}

static double speed_of(const request *r, const leg *l) { return l->row.flags & NC_RAPID ? r->cfg->rapid : l->row.feed; }

static bool allowed(const request *r, const corner *c) {
    if (r->m->path_dev > 0.0 && deviation(r, c) > r->m->path_dev) return false;
    return !(r->m->track_dev > 0.0) || track_deviation(r, c) <= r->m->track_dev;
}

/* Largest share of both distances whose deviations are allowed. */
static void shrink_to_allowed(const request *r, double *pre, double *post, corner *c) {
    make_curve(r, *pre, *post, c);
    if (allowed(r, c)) return;
    double low = 0.0, high = 1.0;
    for (int k = 0; k < STEPS; k++) {
        double middle = 0.5 * (low + high);
        make_curve(r, middle * *pre, middle * *post, c);
        if (allowed(r, c)) low = middle;
        else high = middle;
    }
    *pre *= TARGET * low;
    *post *= TARGET * low;
    make_curve(r, *pre, *post, c);
}

/* Not longer than the acceleration `share` of the machine's needs at the programmed speed. */
static void shrink_to_speed(const request *r, double speed, double share, double *pre, double *post, corner *c) {
    double most = speed > 0.0 ? share * r->cfg->accel / (speed * speed) : 1e300;
    make_curve(r, *pre, *post, c);
    if (peak_curvature(r, c) >= most) return;
    double low = 0.0, high = 1.0;
    for (int k = 0; k < STEPS; k++) {
        double middle = 0.5 * (low + high);
        make_curve(r, middle * *pre, middle * *post, c);
        if (peak_curvature(r, c) >= most) low = middle;
        else high = middle;
    }
    *pre *= high;
    *post *= high;
    make_curve(r, *pre, *post, c);
}

static void symmetrical(double *pre, double *post) { *pre = *post = fmin(*pre, *post); }

/* Corner distances by mode, limited by the blocks; the curve they give. */
static void choose(const request *r, corner *c) {
    const contour_mode *m = r->m;
    double pre = most_of(m, r->a), post = most_of(m, r->b);
    double slower = fmin(speed_of(r, r->a), speed_of(r, r->b));
    bool given = m->mode == NC_CONTOUR_DIST || m->mode == NC_CONTOUR_POS;
    bool equal = !given || m->pre == m->post;
    if (m->pre >= 0.0) pre = fmin(pre, m->pre);
    if (m->post >= 0.0) post = fmin(post, m->post);
    if (equal) symmetrical(&pre, &post);
    if (m->mode == NC_CONTOUR_SOFT) shrink_to_speed(r, slower, m->share, &pre, &post, c);
    if (m->mode == NC_CONTOUR_AUTO_DEV) shrink_to_speed(r, slower, 1.0, &pre, &post, c);
    if (m->mode == NC_CONTOUR_AUTO_VEL) shrink_to_speed(r, speed_of(r, r->a) * m->share, 1.0, &pre, &post, c);
    if (m->mode == NC_CONTOUR_POS) make_curve(r, pre, post, c);
    else shrink_to_allowed(r, &pre, &post, c);
}

static double turn_between(const nc_contour_config *cfg, const double *u, const double *v) {
    double minus = 0.0, plus = 0.0;
    for (int i = 0; i < 3; i++) {
        int a = cfg->main_axis[i];
        if (a < 0) continue;
        minus += (u[a] - v[a]) * (u[a] - v[a]);
        plus += (u[a] + v[a]) * (u[a] + v[a]);
    }
    return 2.0 * atan2(sqrt(minus), sqrt(plus));
}

static bool tracks_bend(const nc_contour_config *cfg, const double *u, const double *v) {
    for (int a = 0; a < cfg->axes; a++)
        if (!is_main(cfg, a) && fabs(u[a] - v[a]) > TANGENTIAL) return true;
    return false;
}

/* Lengths as the engine will measure them; false: no regular curve. */
static bool measure(const nc_contour_config *cfg, corner *c) {
    uint16_t main = 0;
    for (int i = 0; i < 3; i++)
        if (cfg->main_axis[i] >= 0) main |= (uint16_t)(1u << cfg->main_axis[i]);
    for (int half = 0; half < 2; half++) {
        curve k;
        if (!curve_build(&k, &c->coef[half][0][0], cfg->axes, 4, 1.0, main)) return false;
        if (!(k.moving & main)) return false;
        c->length[half] = curve_length(&k);
    }
    return true;
}

bool corner_make(const nc_contour_config *cfg, const contour_mode *m, const leg *a, const leg *b, const leg *skipped, int n,
                 corner *out, bool *irregular) {
    double q[NC_AXES], u[NC_AXES], v[NC_AXES], k[NC_AXES];
    leg_at(cfg, a, a->length, q, u, k);
    leg_at(cfg, b, 0.0, q, v, k);
    request r = {cfg, m, a, b, skipped, n, turn_between(cfg, u, v), main_distance(cfg, a->row.end, b->start)};
    *irregular = false;
    if (m->mode != NC_CONTOUR_POS) {
        if (r.turn < TANGENTIAL && !n && !(m->track_dev > 0.0 && tracks_bend(cfg, u, v))) return false;
        if (r.turn > REVERSAL) return false;
    }
    if (m->max_angle > 0.0 && r.turn > m->max_angle) return false;
    choose(&r, out);
    if (m->mode != NC_CONTOUR_POS && (out->pre < KEPT || out->post < KEPT)) return false;
    out->deviation = deviation(&r, out);
    *irregular = !measure(cfg, out);
    return !*irregular;
}
