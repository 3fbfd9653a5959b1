/* Geometry of one piece: where it is and where it points at path length s. */
#include <math.h>
#include "engine/state/state.h"

#define ARC_NORMAL 0.8 /* share of the acceleration limit for the normal direction; 0.6 is left for the tangent */

static void set_plane(engine *e, piece *p, const nc_block *row) {
    static const int planes[3][2] = {{0, 1}, {2, 0}, {1, 2}};
    const int *axes = planes[row->plane - 17];
    p->axis1 = (uint8_t)e->cfg.main[axes[0]];
    p->axis2 = (uint8_t)e->cfg.main[axes[1]];
}

static void build_arc(engine *e, piece *p, const nc_block *row) {
    set_plane(e, p, row);
    p->centre[0] = row->center[0];
    p->centre[1] = row->center[1];
    double d1 = p->start[p->axis1] - p->centre[0], d2 = p->start[p->axis2] - p->centre[1];
    p->radius = hypot(d1, d2);
    p->angle0 = atan2(d2, d1);
    p->sweep = row->angle;
    p->plane_speed = fabs(p->sweep) * p->radius / p->length;
    p->curvature = p->plane_speed * p->plane_speed / p->radius;
    p->slope[p->axis1] = p->slope[p->axis2] = 0.0;
}

static double axis_speed_limit(const engine *e, const piece *p) {
    double v = NEVER;
    for (int i = 0; i < e->cfg.axis_count; i++) {
        bool in_plane = p->kind == PIECE_ARC && (i == p->axis1 || i == p->axis2);
        double share = in_plane ? e->drive.planner ? p->plane_speed : 0.0 : fabs(p->slope[i]);
        if (share > 1e-12) v = fmin(v, piece_v_max(e, p, i) / share);
    }
    if (p->kind == PIECE_ARC && !e->drive.planner) v = fmin(v, hypot(piece_v_max(e, p, p->axis1), piece_v_max(e, p, p->axis2)) / p->plane_speed);
    return v;
}

static double speed_limit(const engine *e, const piece *p) {
    double v = axis_speed_limit(e, p);
    if (p->limits.path_velocity > 0) v = fmin(v, (double)p->limits.path_velocity);
    if (p->kind == PIECE_ARC) {
        double a1 = piece_a_max(e, p, p->axis1), a2 = piece_a_max(e, p, p->axis2);
        double a = e->drive.planner ? ARC_NORMAL * fmin(a1, a2) : hypot(a1, a2); /* nowhere on it is more possible; curved_span.c */
        if (p->limits.radial_acceleration > 0) a = fmin(a, (double)p->limits.radial_acceleration);
        v = fmin(v, sqrt(a / p->curvature));
    }
    return v;
}

static void note_moving(const engine *e, piece *p) {
    p->moving = 0;
    for (int i = 0; i < e->cfg.axis_count; i++)
        if (fabs(p->slope[i]) > 1e-12 || (p->kind == PIECE_ARC && (i == p->axis1 || i == p->axis2))) p->moving |= (uint16_t)(1u << i);
}

/* No acceleration along the piece is larger. */
static double most_accel(const engine *e, const piece *p) {
    double most = NEVER, sum = 0.0;
    for (int i = 0; i < e->cfg.axis_count; i++) {
        double a = piece_a_max(e, p, i), share = fabs(p->slope[i]); /* zero in the plane of an arc and on polynomials */
        if (p->moving >> i & 1) sum += a * a;
        if (share > 1e-12 && most * share > a) most = a / share;
    }
    if (p->kind != PIECE_LINE) most = lesser(most, sqrt(sum) / (p->kind == PIECE_ARC ? p->plane_speed : 1.0));
    return p->limits.path_acceleration > 0 ? lesser(most, (double)p->limits.path_acceleration) : most;
}

/* Fill the geometry of p from a motion row; p->start is set already. */
void piece_build(engine *e, piece *p, const nc_block *row) {
    p->kind = row->type == NC_CIRCULAR ? PIECE_ARC : row->type == NC_POLYNOMIAL ? PIECE_CURVE : PIECE_LINE;
    p->length = p->whole = row->length;
    p->feed = row->flags & NC_RAPID ? 0.0 : row->feed;
    memcpy(p->end, row->end, sizeof p->end);
    if (p->kind == PIECE_CURVE) {
        curve_piece_build(e, p);
        p->accel = most_accel(e, p);
        return;
    }
    for (int i = 0; i < NC_AXES; i++) p->slope[i] = i < e->cfg.axis_count ? (p->end[i] - p->start[i]) / p->length : 0.0;
    if (p->kind == PIECE_ARC) build_arc(e, p, row);
    p->v_hard = speed_limit(e, p);
    note_moving(e, p);
    p->accel = most_accel(e, p);
    piece_tangent(e, p, 0.0, p->tangent_in);
    piece_tangent(e, p, p->length, p->tangent_out);
}

/* Position at u of the whole piece. */
static void whole_position(const engine *e, const piece *p, double u, double *q) {
    if (p->kind == PIECE_CURVE) {
        curve_piece_position(e, p, u, q);
        return;
    }
    for (int i = 0; i < e->cfg.axis_count; i++) q[i] = p->start[i] + p->slope[i] * u;
    if (p->kind == PIECE_ARC) {
        double angle = p->angle0 + p->sweep * (u / p->whole);
        q[p->axis1] = p->centre[0] + p->radius * cos(angle) + p->slope[p->axis1] * (u - p->whole); /* slope: short_motions.c */
        q[p->axis2] = p->centre[1] + p->radius * sin(angle) + p->slope[p->axis2] * (u - p->whole);
    }
}

void piece_position(const engine *e, const piece *p, double s, double *q) {
    if (s < load_f64_acquire(&p->length)) {
        whole_position(e, p, p->from + p->dir * s, q);
        return;
    }
    for (int i = 0; i < NC_AXES; i++) q[i] = load_f64_relaxed(&p->end[i]);
}

/* Only the part of a whole piece from u0 to u1 is driven; u0 > u1: backward. */
void piece_cut(const engine *e, piece *p, double u0, double u1) {
    p->from = u0;
    p->dir = u1 < u0 ? -1 : 1;
    p->length = fabs(u1 - u0);
    p->path0 += p->path_rate * u0;
    p->dist0 += p->dist_rate * u0;
    p->path_rate *= p->dir;
    p->dist_rate *= p->dir;
    if (u1 <= 0.0) memcpy(p->end, p->start, sizeof p->end);
    else if (u1 < p->whole) whole_position(e, p, u1, p->end);
    piece_tangent(e, p, 0.0, p->tangent_in);
    piece_tangent(e, p, p->length, p->tangent_out);
}

/* A straight line from q to the end of p takes its place. The path counts on to where it is at that end. */
void piece_shortcut(const engine *e, piece *p, const double *q, double path, double dist) {
    double main2 = 0.0, all2 = 0.0, path_end = p->path0 + p->path_rate * p->length, dist_end = p->dist0 + p->dist_rate * p->length;
    for (int i = 0; i < e->cfg.axis_count; i++) {
        double d = p->end[i] - q[i];
        all2 += d * d;
        if (i == e->cfg.main[0] || i == e->cfg.main[1] || i == e->cfg.main[2]) main2 += d * d;
    }
    p->kind = PIECE_LINE;
    p->shortcut = true;
    p->length = p->whole = sqrt(main2 > 0.0 ? main2 : all2);
    memcpy(p->start, q, sizeof p->start);
    for (int i = 0; i < NC_AXES; i++) p->slope[i] = i < e->cfg.axis_count && p->length > 0 ? (p->end[i] - p->start[i]) / p->length : 0.0;
    p->from = 0.0;
    p->dir = 1;
    p->path0 = path;
    p->dist0 = dist;
    p->path_rate = p->length > 0 ? (path_end - path) / p->length : 0.0;
    p->dist_rate = p->length > 0 ? (dist_end - dist) / p->length : 0.0;
    p->v_hard = speed_limit(e, p);
    note_moving(e, p);
    p->accel = most_accel(e, p);
    piece_tangent(e, p, 0.0, p->tangent_in);
    piece_tangent(e, p, p->length, p->tangent_out);
}

/* dq/ds of all axes. */
void piece_tangent(const engine *e, const piece *p, double s, double *u) {
    if (p->kind == PIECE_CURVE) {
        curve_piece_tangent(e, p, s, u);
        return;
    }
    for (int i = 0; i < NC_AXES; i++) u[i] = i < e->cfg.axis_count ? p->dir * p->slope[i] : 0.0;
    if (p->kind == PIECE_ARC) {
        double angle = p->angle0 + p->sweep * ((p->from + p->dir * s) / p->whole);
        double speed = p->sweep * p->dir > 0 ? p->plane_speed : -p->plane_speed;
        u[p->axis1] -= speed * sin(angle);
        u[p->axis2] += speed * cos(angle);
    }
}
