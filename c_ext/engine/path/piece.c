/* Geometry of one piece: where it is and where it points at path length s. */
#include <math.h>
#include <string.h>
#include "engine/path/piece.h"
#include "engine/path/piece_curve.h"
#include "engine/state/state.h"
#include "engine/state/tuning.h"
#include "hli/sync.h"
#include "rows/nc_block.h"
#include "maths/plain.h"

static void set_plane(engine_config *cfg,
                      struct piece *piece,
                      const nc_block *row) {
    static const int planes[3][2] = {
        {0, 1},
        {2, 0},
        {1, 2},
    };
    const int *axes = planes[row->plane - 17];
    piece->axis1 = (uint8_t)cfg->main[axes[0]];
    piece->axis2 = (uint8_t)cfg->main[axes[1]];
}

static void build_arc(engine_config *cfg,
                      struct piece *piece,
                      const nc_block *row) {
    set_plane(cfg, piece, row);
    piece->centre[0] = row->center[0];
    piece->centre[1] = row->center[1];
    double d1 = piece->start[piece->axis1] - piece->centre[0],
           d2 = piece->start[piece->axis2] - piece->centre[1];
    piece->radius = hypot(d1, d2);
    piece->angle0 = plain_atan2(d2, d1);
    piece->sweep = row->angle;
    piece->plane_speed = fabs(piece->sweep) * piece->radius / piece->length;
    piece->curvature = piece->plane_speed * piece->plane_speed / piece->radius;
    piece->slope[piece->axis1] = piece->slope[piece->axis2] = 0.0;
}

static double axis_speed_limit(const struct engine *engine,
                               const struct piece *piece) {
    double v = NEVER;
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        bool in_plane = piece->kind == PIECE_ARC
                        && (i == piece->axis1 || i == piece->axis2);
        double share =
            in_plane ? !engine->traits.exact_arcs ? piece->plane_speed : 0.0
                     : fabs(piece->slope[i]);
        if (share > 1e-12) {
            v = fmin(v, piece_v_max(&engine->cfg, piece, i) / share);
        }
    }
    if (piece->kind == PIECE_ARC && engine->traits.exact_arcs) {
        v = fmin(v,
                 hypot(piece_v_max(&engine->cfg, piece, piece->axis1),
                       piece_v_max(&engine->cfg, piece, piece->axis2))
                     / piece->plane_speed);
    }
    return v;
}

static double speed_limit(const struct engine *engine,
                          const struct piece *piece) {
    double v = axis_speed_limit(engine, piece);
    if (piece->limits.path_velocity > 0) {
        v = fmin(v, (double)piece->limits.path_velocity);
    }
    if (piece->kind == PIECE_ARC) {
        double a1 = piece_a_max(&engine->cfg, piece, piece->axis1),
               a2 = piece_a_max(&engine->cfg, piece, piece->axis2);
        double a =
            !engine->traits.exact_arcs
                ? ARC_NORMAL * fmin(a1, a2)
                : hypot(a1,
                        a2); /* nowhere on it is more possible; curved_span.c */
        if (piece->limits.radial_acceleration > 0) {
            a = fmin(a, (double)piece->limits.radial_acceleration);
        }
        v = fmin(v, sqrt(a / piece->curvature));
    }
    return v;
}

static void note_moving(const engine_config *cfg, struct piece *piece) {
    piece->moving = 0;
    for (int i = 0; i < cfg->axis_count; i++) {
        bool in_plane = piece->kind == PIECE_ARC
                        && (i == piece->axis1 || i == piece->axis2);
        if (fabs(piece->slope[i]) > 1e-12 || in_plane) {
            piece->moving |= (uint16_t)(1u << i);
        }
    }
}

/* No acceleration along the piece is larger. */
static double most_accel(const engine_config *cfg, const struct piece *piece) {
    double most = NEVER, sum = 0.0;
    for (int i = 0; i < cfg->axis_count; i++) {
        double a = piece_a_max(cfg, piece, i),
               share = fabs(piece->slope[i]); /* zero in the plane of an arc and
                                                 on polynomials */
        if (piece->moving >> i & 1) {
            sum += a * a;
        }
        if (share > 1e-12 && most * share > a) {
            most = a / share;
        }
    }
    if (piece->kind != PIECE_LINE) {
        most = lesser(
            most,
            sqrt(sum) / (piece->kind == PIECE_ARC ? piece->plane_speed : 1.0));
    }
    return piece->limits.path_acceleration > 0
               ? lesser(most, (double)piece->limits.path_acceleration)
               : most;
}

void piece_build(struct engine *engine,
                 struct piece *piece,
                 const nc_block *row) {
    piece->kind = row->type == NC_CIRCULAR     ? PIECE_ARC
                  : row->type == NC_POLYNOMIAL ? PIECE_CURVE
                                               : PIECE_LINE;
    piece->length = piece->whole = row->length;
    piece->feed = row->flags & NC_RAPID ? 0.0 : row->feed;
    memcpy(piece->end, row->end, sizeof piece->end);
    if (piece->kind == PIECE_CURVE) {
        curve_piece_build(engine, piece);
        piece->accel = most_accel(&engine->cfg, piece);
        return;
    }
    for (int i = 0; i < NC_AXES; i++) {
        piece->slope[i] =
            i < engine->cfg.axis_count
                ? (piece->end[i] - piece->start[i]) / piece->length
                : 0.0;
    }
    if (piece->kind == PIECE_ARC) {
        build_arc(&engine->cfg, piece, row);
    }
    piece->v_hard = speed_limit(engine, piece);
    note_moving(&engine->cfg, piece);
    piece->accel = most_accel(&engine->cfg, piece);
    piece_tangent(engine, piece, 0.0, piece->tangent_in);
    piece_tangent(engine, piece, piece->length, piece->tangent_out);
}

/* Position at u of the whole piece. */
static void whole_position(const struct engine *engine,
                           const struct piece *piece,
                           double u,
                           double *q) {
    if (piece->kind == PIECE_CURVE) {
        curve_piece_position(&engine->store, piece, u, q);
        return;
    }
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        q[i] = piece->start[i] + piece->slope[i] * u;
    }
    if (piece->kind == PIECE_ARC) {
        double angle = piece->angle0 + piece->sweep * (u / piece->whole);
        q[piece->axis1] =
            piece->centre[0] + piece->radius * plain_cos(angle)
            + piece->slope[piece->axis1]
                  * (u - piece->whole); /* slope: short_motions.c */
        q[piece->axis2] = piece->centre[1] + piece->radius * plain_sin(angle)
                          + piece->slope[piece->axis2] * (u - piece->whole);
    }
}

void piece_position(const struct engine *engine,
                    const struct piece *piece,
                    double s,
                    double *q) {
    if (s < load_f64_acquire(&piece->length)) {
        whole_position(engine, piece, piece->from + piece->dir * s, q);
        return;
    }
    for (int i = 0; i < NC_AXES; i++) {
        q[i] = load_f64_relaxed(&piece->end[i]);
    }
}

void piece_cut(const struct engine *engine,
               struct piece *piece,
               double u0,
               double u1) {
    piece->from = u0;
    piece->dir = u1 < u0 ? -1 : 1;
    piece->length = fabs(u1 - u0);
    piece->path0 += piece->path_rate * u0;
    piece->dist0 += piece->dist_rate * u0;
    piece->path_rate *= piece->dir;
    piece->dist_rate *= piece->dir;
    if (u1 <= 0.0) {
        memcpy(piece->end, piece->start, sizeof piece->end);
    } else if (u1 < piece->whole) {
        whole_position(engine, piece, u1, piece->end);
    }
    piece_tangent(engine, piece, 0.0, piece->tangent_in);
    piece_tangent(engine, piece, piece->length, piece->tangent_out);
}

void piece_shortcut(const struct engine *engine,
                    struct piece *piece,
                    const double *q,
                    double path,
                    double dist) {
    double main2 = 0.0, all2 = 0.0,
           path_end = piece->path0 + piece->path_rate * piece->length,
           dist_end = piece->dist0 + piece->dist_rate * piece->length;
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        double d = piece->end[i] - q[i];
        all2 += d * d;
        if (i == engine->cfg.main[0] || i == engine->cfg.main[1]
            || i == engine->cfg.main[2]) {
            main2 += d * d;
        }
    }
    piece->kind = PIECE_LINE;
    piece->shortcut = true;
    piece->length = piece->whole = sqrt(main2 > 0.0 ? main2 : all2);
    memcpy(piece->start, q, sizeof piece->start);
    for (int i = 0; i < NC_AXES; i++) {
        piece->slope[i] =
            i < engine->cfg.axis_count && piece->length > 0
                ? (piece->end[i] - piece->start[i]) / piece->length
                : 0.0;
    }
    piece->from = 0.0;
    piece->dir = 1;
    piece->path0 = path;
    piece->dist0 = dist;
    piece->path_rate =
        piece->length > 0 ? (path_end - path) / piece->length : 0.0;
    piece->dist_rate =
        piece->length > 0 ? (dist_end - dist) / piece->length : 0.0;
    piece->v_hard = speed_limit(engine, piece);
    note_moving(&engine->cfg, piece);
    piece->accel = most_accel(&engine->cfg, piece);
    piece_tangent(engine, piece, 0.0, piece->tangent_in);
    piece_tangent(engine, piece, piece->length, piece->tangent_out);
}

void piece_tangent(const struct engine *engine,
                   const struct piece *piece,
                   double s,
                   double *u) {
    if (piece->kind == PIECE_CURVE) {
        curve_piece_tangent(&engine->store, piece, s, u);
        return;
    }
    for (int i = 0; i < NC_AXES; i++) {
        u[i] = i < engine->cfg.axis_count ? piece->dir * piece->slope[i] : 0.0;
    }
    if (piece->kind == PIECE_ARC) {
        double angle =
            piece->angle0
            + piece->sweep * ((piece->from + piece->dir * s) / piece->whole);
        double speed = piece->sweep * piece->dir > 0 ? piece->plane_speed
                                                     : -piece->plane_speed;
        u[piece->axis1] -= speed * plain_sin(angle);
        u[piece->axis2] += speed * plain_cos(angle);
    }
}

double angle_between(const double *a, const double *b) {
    double minus = 0.0, plus = 0.0;
    for (int i = 0; i < 3; i++) {
        minus += (a[i] - b[i]) * (a[i] - b[i]);
        plus += (a[i] + b[i]) * (a[i] + b[i]);
    }
    return 2.0 * plain_atan2(sqrt(minus), sqrt(plus));
}
