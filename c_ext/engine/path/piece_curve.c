/* A polynomial as a piece of the engine: checks, evaluation, limits.
 *
 * Without jerk, limits hold between knots (curve_spans.c), or on stretches
 * where they are constant: there, per axis, with m1 >= |q'| and m2 >= |q''|
 * (derivatives by arc length), two sufficient conditions for |q' a + q'' v^2|
 * <= A are known: m1 a + m2 v^2 <= A                 any axis a^2 + (kappa
 * v^2)^2 <= A^2         axes the length is measured over: there q' and q'' are
 * orthogonal, |q'| = 1 The speed is bounded so that m2 v^2 takes ARC_NORMAL of
 * A; what the speed that occurs leaves over is for the tangent.
 */
#include <math.h>
#include <string.h>
#include "engine/path/piece_curve.h"
#include "curve/curve.h"
#include "engine/path/speed_caps.h"
#include "engine/state/state.h"
#include "engine/state/tuning.h"
#include "rows/nc_block.h"

/* Bounds of the derivatives over one cell. */
typedef struct cell_bounds {
    double d1[NC_AXES], d2[NC_AXES], kappa;
} cell_bounds;

static const double no_reserve[NC_AXES];

static uint16_t main_mask(const engine_config *cfg) {
    uint16_t mask = 0;
    for (int i = 0; i < 3; i++) {
        if (cfg->main[i] >= 0) {
            mask |= (uint16_t)(1u << cfg->main[i]);
        }
    }
    return mask;
}

static bool meets(const engine_config *cfg,
                  const struct curve *curve,
                  double w,
                  const double *q) {
    double at[NC_AXES];
    curve_position(curve, w, at);
    for (int i = 0; i < cfg->axis_count; i++) {
        if (!(fabs(at[i] - q[i]) <= LENGTH_MISS)) {
            return false;
        }
    }
    return true;
}

bool curve_row_check(struct engine *engine,
                     const nc_block *row,
                     const double *pool,
                     int64_t pool_n) {
    int64_t n = (int64_t)engine->cfg.axis_count * (row->degree + 1);
    struct curve *c = &engine->push.next_curve;
    if (!pool || row->pool + n > pool_n) {
        return false;
    }
    for (int64_t k = 0; k < n; k++) {
        if (!isfinite(pool[row->pool + k])) {
            return false;
        }
    }
    bool built = row->flags & NC_BY_LENGTH
                     ? curve_build_by_length(c,
                                             pool + row->pool,
                                             engine->cfg.axis_count,
                                             row->degree,
                                             row->angle,
                                             row->length)
                     : curve_build(c,
                                   pool + row->pool,
                                   engine->cfg.axis_count,
                                   row->degree,
                                   row->angle,
                                   main_mask(&engine->cfg));
    if (!built) {
        return false;
    }
    double miss = fabs(curve_length(c) - row->length);
    return miss <= LENGTH_MISS + 1e-9 * row->length
           && meets(&engine->cfg, c, 0.0, engine->push.last_end)
           && meets(&engine->cfg, c, 1.0, row->end);
}

/* Largest magnitude of a smooth function from its samples: a peak between them
 * adds up to an eighth of the second difference. */
static double bound(const double *f) {
    double most = 0.0, bend = 0.0;
    for (int k = 0; k < BOUND_POINTS; k++) {
        most = fmax(most, fabs(f[k]));
    }
    for (int k = 1; k + 1 < BOUND_POINTS; k++) {
        bend = fmax(bend, fabs(f[k - 1] - 2.0 * f[k] + f[k + 1]));
    }
    return most + 0.15 * bend;
}

static struct cell_bounds bound_cell(const struct curve *curve, int cell) {
    double d1[NC_AXES][BOUND_POINTS], d2[NC_AXES][BOUND_POINTS],
        kappa[BOUND_POINTS] = {0};
    struct cell_bounds cell_bounds = {0};
    for (int k = 0; k < BOUND_POINTS; k++) {
        struct curve_point curve_point;
        curve_at(curve,
                 curve->w[cell]
                     + (curve->w[cell + 1] - curve->w[cell]) * k
                           / (BOUND_POINTS - 1),
                 &curve_point);
        for (int i = 0; i < curve->axes; i++) {
            d1[i][k] = curve_point.d1[i];
            d2[i][k] = curve_point.d2[i];
            if (curve->metric >> i & 1) {
                kappa[k] += curve_point.d2[i] * curve_point.d2[i];
            }
        }
        kappa[k] = sqrt(kappa[k]);
    }
    for (int i = 0; i < curve->axes; i++) {
        cell_bounds.d1[i] = bound(d1[i]);
        cell_bounds.d2[i] = bound(d2[i]);
    }
    cell_bounds.kappa = bound(kappa);
    return cell_bounds;
}

static double speed_bound(const engine_config *cfg,
                          const struct piece *piece,
                          const struct cell_bounds *cell_bounds,
                          const double *reserve) {
    double v2 = NEVER, radial = piece->limits.radial_acceleration,
           path = piece->limits.path_velocity;
    if (radial > 0 && cell_bounds->kappa > 1e-12) {
        v2 = radial / cell_bounds->kappa;
    }
    if (path > 0) {
        v2 = fmin(v2, path * path);
    }
    for (int i = 0; i < cfg->axis_count; i++) {
        double room =
            POLYNOMIAL_USABLE * piece_a_max(cfg, piece, i) - reserve[i];
        if (cell_bounds->d1[i] > 1e-12) {
            v2 = fmin(v2,
                      pow(piece_v_max(cfg, piece, i) / cell_bounds->d1[i], 2));
        }
        if (cell_bounds->d2[i] > 1e-12) {
            v2 = fmin(v2, ARC_NORMAL * room / cell_bounds->d2[i]);
        }
    }
    return sqrt(v2);
}

/* Acceleration left along the path on every axis at speeds up to v. */
static double accel_bound(const struct engine *engine,
                          const struct piece *piece,
                          const struct cell_bounds *cell_bounds,
                          const double *reserve,
                          double v) {
    const struct curve *curve = curve_of(&engine->store, piece);
    double accel = piece->limits.path_acceleration > 0
                       ? (double)piece->limits.path_acceleration
                       : NEVER;
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        if (cell_bounds->d1[i] <= 1e-12) {
            continue;
        }
        double room = POLYNOMIAL_USABLE * piece_a_max(&engine->cfg, piece, i)
                      - reserve[i],
               normal = cell_bounds->kappa * v * v;
        double a = (room - cell_bounds->d2[i] * v * v) / cell_bounds->d1[i];
        if (curve->metric >> i & 1 && normal < room) {
            a = fmax(a, sqrt(room * room - normal * normal));
        }
        accel = fmin(accel, a);
    }
    return accel;
}

/* Largest speed squared anywhere on a cell of what its limits let through where
 * the path acceleration helps, about. */
static double fastest2(const engine_config *cfg,
                       const struct piece *piece,
                       const struct curve *curve,
                       int cell) {
    double most = 0.0;
    for (int k = 0; k < BOUND_POINTS; k++) {
        struct curve_point at;
        curve_at(curve,
                 curve->w[cell]
                     + (curve->w[cell + 1] - curve->w[cell]) * k
                           / (BOUND_POINTS - 1),
                 &at);
        double x = NEVER, across = 0.0, bend2 = 0.0;
        for (int i = 0; i < curve->axes; i++) {
            if (fabs(at.d1[i]) > 1e-12) {
                x = fmin(x, pow(piece_v_max(cfg, piece, i) / at.d1[i], 2));
            }
            if (!(curve->metric >> i & 1)) {
                continue;
            }
            across += fabs(at.d2[i]) * piece_a_max(cfg, piece, i);
            bend2 += at.d2[i] * at.d2[i];
        }
        most = fmax(most, bend2 > 1e-24 ? fmin(x, across / bend2) : x);
    }
    return BETWEEN * most;
}

void curve_piece_build(struct engine *engine, struct piece *piece) {
    struct curve *curve =
        &engine->store.curves[piece->origin & engine->store.mask];
    *curve = engine->push.next_curve;
    piece->kind = PIECE_CURVE;
    piece->moving = curve->moving;
    piece->v_hard = 0.0;
    memset(curve->bend, 0, sizeof curve->bend);
    for (int k = 0; k < curve->cells; k++) {
        struct cell_bounds cell_bounds = bound_cell(curve, k);
        piece->v_hard = fmax(
            piece->v_hard,
            !engine->traits.exact_arcs
                ? speed_bound(&engine->cfg, piece, &cell_bounds, no_reserve)
                : sqrt(fastest2(&engine->cfg, piece, curve, k)));
        for (int i = 0; i < curve->axes; i++) {
            curve->bend[i] = fmax(curve->bend[i], cell_bounds.d2[i]);
        }
    }
    curve_piece_tangent(&engine->store, piece, 0.0, piece->tangent_in);
    curve_piece_tangent(&engine->store,
                        piece,
                        piece->length,
                        piece->tangent_out);
}

/* Parameter at u of the whole piece. */
static double parameter_at(const struct piece_store *store,
                           const struct piece *piece,
                           double u,
                           const struct curve **curve) {
    *curve = curve_of(store, piece);
    return curve_parameter(*curve, u * (curve_length(*curve) / piece->whole));
}

void curve_piece_position(const struct piece_store *store,
                          const struct piece *piece,
                          double u,
                          double *q) {
    const struct curve *curve;
    double w = parameter_at(store, piece, u, &curve);
    curve_position(curve, w, q);
}

void curve_piece_tangent(const struct piece_store *store,
                         const struct piece *piece,
                         double s,
                         double *u) {
    const struct curve *curve;
    double w = parameter_at(store, piece, piece->from + piece->dir * s, &curve);
    memset(u, 0, sizeof(double) * NC_AXES);
    curve_tangent(curve, w, u);
    for (int i = 0; i < curve->axes; i++) {
        u[i] *= piece->dir;
    }
}

/* Where a cell ends, in mm of the piece as it is driven. */
static double cell_ahead(const struct curve *curve,
                         const struct piece *piece,
                         int cell,
                         double scale) {
    return piece->dir > 0 ? curve->s[cell + 1] * scale - piece->from
                          : piece->from - curve->s[cell] * scale;
}

void curve_piece_derivatives(const struct piece_store *store,
                             const struct piece *piece,
                             double s,
                             double *d1,
                             double *d2,
                             double *d3) {
    const struct curve *curve;
    double w = parameter_at(store, piece, piece->from + piece->dir * s, &curve);
    struct curve_point at;
    curve_at(curve, w, &at);
    curve_third(curve, w, d3);
    for (int i = 0; i < curve->axes; i++) {
        d1[i] = piece->dir * at.d1[i];
        d2[i] = at.d2[i];
        d3[i] *= piece->dir;
    }
}

uint16_t path_axes(const struct engine *engine, const struct piece *piece) {
    uint16_t main = main_mask(&engine->cfg) & piece->moving;
    return main ? main : UINT16_MAX;
}

double curve_piece_main_rate(const struct engine *engine,
                             const struct piece *piece,
                             double s) {
    double d1[NC_AXES] = {0};
    double d2[NC_AXES];
    double d3[NC_AXES];
    double sum = 0.0;
    curve_piece_derivatives(&engine->store, piece, s, d1, d2, d3);
    uint16_t axes = path_axes(engine, piece);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        if (axes >> i & 1) {
            sum += d1[i] * d1[i];
        }
    }
    return sqrt(sum);
}

double curve_piece_cell_end(const struct piece_store *store,
                            const struct piece *piece,
                            double s) {
    const struct curve *curve = curve_of(store, piece);
    double scale = piece->whole / curve_length(curve);
    int cell = piece->dir > 0 ? 0 : curve->cells - 1,
        last = piece->dir > 0 ? curve->cells - 1 : 0;
    while (cell != last
           && cell_ahead(curve, piece, cell, scale) <= s + CELL_LEAST) {
        cell += piece->dir;
    }
    return cell == last ? piece->length : cell_ahead(curve, piece, cell, scale);
}

void curve_cell_span(const struct engine *engine,
                     const struct piece *piece,
                     int cell,
                     const double *reserve,
                     double length,
                     struct span *out) {
    struct cell_bounds cell_bounds =
        bound_cell(curve_of(&engine->store, piece), cell);
    double feed =
        reachable(piece, greater(engine->plan.reserve_override, OVER_FEED));
    *out = (struct span){
        .length = length,
        .v_hard = speed_bound(&engine->cfg, piece, &cell_bounds, reserve)};
    out->accel = accel_bound(engine,
                             piece,
                             &cell_bounds,
                             reserve,
                             fmin(out->v_hard, feed));
}

double curve_cell_behind(const struct curve *curve,
                         const struct piece *piece,
                         double s,
                         int *cell) {
    double scale = piece->whole / curve_length(curve);
    int last = piece->dir > 0 ? curve->cells - 1 : 0;
    *cell = piece->dir > 0 ? 0 : curve->cells - 1;
    while (*cell != last && cell_ahead(curve, piece, *cell, scale) <= s) {
        *cell += piece->dir;
    }
    return *cell == last ? NEVER : cell_ahead(curve, piece, *cell, scale);
}
