/* Geometry of one piece: where it is and where it points at path length s. */
#include <math.h>
#include "engine_internal.h"

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
        double share = p->kind == PIECE_ARC && (i == p->axis1 || i == p->axis2) ? p->plane_speed : fabs(p->slope[i]);
        if (share > 1e-12) v = fmin(v, e->cfg.v_max[i] / share);
    }
    return v;
}

static double speed_limit(const engine *e, const piece *p) {
    double v = axis_speed_limit(e, p);
    if (p->kind == PIECE_ARC) {
        double a = fmin(e->cfg.a_max[p->axis1], e->cfg.a_max[p->axis2]);
        v = fmin(v, sqrt(ARC_NORMAL * a / p->curvature));
    }
    return v;
}

/* Fill the geometry of p from a motion row; p->start is set already. */
void piece_build(engine *e, piece *p, const nc_block *row) {
    p->kind = row->type == NC_CIRCULAR ? PIECE_ARC : row->type == NC_POLYNOMIAL ? PIECE_CURVE : PIECE_LINE;
    p->length = row->length;
    p->feed = row->flags & NC_RAPID ? 0.0 : row->feed;
    memcpy(p->end, row->end, sizeof p->end);
    if (p->kind == PIECE_CURVE) {
        curve_piece_build(e, p);
        return;
    }
    for (int i = 0; i < NC_AXES; i++) p->slope[i] = i < e->cfg.axis_count ? (p->end[i] - p->start[i]) / p->length : 0.0;
    if (p->kind == PIECE_ARC) build_arc(e, p, row);
    p->v_hard = speed_limit(e, p);
    piece_tangent(e, p, 0.0, p->tangent_in);
    piece_tangent(e, p, p->length, p->tangent_out);
}

void piece_position(const engine *e, const piece *p, double s, double *q) {
    if (s >= p->length) {
        memcpy(q, p->end, sizeof p->end);
        return;
    }
    if (p->kind == PIECE_CURVE) {
        curve_piece_position(e, p, s, q);
        return;
    }
    for (int i = 0; i < e->cfg.axis_count; i++) q[i] = p->start[i] + p->slope[i] * s;
    if (p->kind == PIECE_ARC) {
        double angle = p->angle0 + p->sweep * (s / p->length);
        q[p->axis1] = p->centre[0] + p->radius * cos(angle);
        q[p->axis2] = p->centre[1] + p->radius * sin(angle);
    }
}

/* dq/ds of all axes. */
void piece_tangent(const engine *e, const piece *p, double s, double *u) {
    if (p->kind == PIECE_CURVE) {
        curve_piece_tangent(e, p, s, u);
        return;
    }
    for (int i = 0; i < NC_AXES; i++) u[i] = i < e->cfg.axis_count ? p->slope[i] : 0.0;
    if (p->kind == PIECE_ARC) {
        double angle = p->angle0 + p->sweep * (s / p->length);
        double speed = p->sweep > 0 ? p->plane_speed : -p->plane_speed;
        u[p->axis1] = -speed * sin(angle);
        u[p->axis2] = speed * cos(angle);
    }
}
