/* A polynomial as a piece of the engine: checks, evaluation, limits.
 *
 * Without jerk, limits hold between knots (curve_spans.c), or on stretches where they are constant: there, per axis, with m1 >= |q'| and m2 >= |q''| (derivatives
 * by arc length), two sufficient conditions for |q' a + q'' v^2| <= A are known:
 *     m1 a + m2 v^2 <= A                 any axis
 *     a^2 + (kappa v^2)^2 <= A^2         axes the length is measured over: there q' and q'' are orthogonal, |q'| = 1
 * The speed is bounded so that m2 v^2 takes NORMAL of A; what the speed that occurs leaves over is for the tangent.
 */
#include <math.h>
#include "engine/state/state.h"

#define USABLE 0.98         /* share of the acceleration limit that is planned with, as in lookahead.c */
#define NORMAL 0.8          /* share of it for the normal direction */
#define LENGTH_MISS 1e-6    /* mm by which the row's length and start may differ from its coefficients' */
#define CELL_LEAST 1e-7     /* mm: what is left of a cell counts as the next one's */
#define BOUND_POINTS 5      /* per cell */
#define OVER_FEED 2.0       /* the largest override */
#define BETWEEN 1.2         /* speeds squared may be that much larger between them */

static uint16_t main_mask(const engine *e) {
    uint16_t mask = 0;
    for (int i = 0; i < 3; i++)
        if (e->cfg.main[i] >= 0) mask |= (uint16_t)(1u << e->cfg.main[i]);
    return mask;
}

static bool meets(const engine *e, const curve *c, double w, const double *q) {
    double at[NC_AXES];
    curve_position(c, w, at);
    for (int i = 0; i < e->cfg.axis_count; i++)
        if (!(fabs(at[i] - q[i]) <= LENGTH_MISS)) return false;
    return true;
}

/* The row's coefficients, checked and kept for the piece that is pushed next. */
bool curve_row_check(engine *e, const nc_block *row, const double *pool, int64_t pool_n) {
    int64_t n = (int64_t)e->cfg.axis_count * (row->degree + 1);
    curve *c = &e->next_curve;
    if (!pool || row->pool + n > pool_n) return false;
    for (int64_t k = 0; k < n; k++)
        if (!isfinite(pool[row->pool + k])) return false;
    bool built = row->flags & NC_BY_LENGTH
                     ? curve_build_by_length(c, pool + row->pool, e->cfg.axis_count, row->degree, row->angle, row->length)
                     : curve_build(c, pool + row->pool, e->cfg.axis_count, row->degree, row->angle, main_mask(e));
    if (!built) return false;
    double miss = fabs(curve_length(c) - row->length);
    return miss <= LENGTH_MISS + 1e-9 * row->length && meets(e, c, 0.0, e->last_end) && meets(e, c, 1.0, row->end);
}

/* Bounds of the derivatives over one cell. */
typedef struct cell_bounds {
    double d1[NC_AXES], d2[NC_AXES], kappa;
} cell_bounds;

/* Largest magnitude of a smooth function from its samples: a peak between them adds up to an eighth of the second difference. */
static double bound(const double *f) {
    double most = 0.0, bend = 0.0;
    for (int k = 0; k < BOUND_POINTS; k++) most = fmax(most, fabs(f[k]));
    for (int k = 1; k + 1 < BOUND_POINTS; k++) bend = fmax(bend, fabs(f[k - 1] - 2.0 * f[k] + f[k + 1]));
    return most + 0.15 * bend;
}

static cell_bounds bound_cell(const curve *c, int cell) {
    double d1[NC_AXES][BOUND_POINTS], d2[NC_AXES][BOUND_POINTS], kappa[BOUND_POINTS] = {0};
    cell_bounds b = {0};
    for (int k = 0; k < BOUND_POINTS; k++) {
        curve_point p;
        curve_at(c, c->w[cell] + (c->w[cell + 1] - c->w[cell]) * k / (BOUND_POINTS - 1), &p);
        for (int i = 0; i < c->axes; i++) {
            d1[i][k] = p.d1[i];
            d2[i][k] = p.d2[i];
            if (c->metric >> i & 1) kappa[k] += p.d2[i] * p.d2[i];
        }
        kappa[k] = sqrt(kappa[k]);
    }
    for (int i = 0; i < c->axes; i++) {
        b.d1[i] = bound(d1[i]);
        b.d2[i] = bound(d2[i]);
    }
    b.kappa = bound(kappa);
    return b;
}

static double speed_bound(const engine *e, const piece *p, const cell_bounds *b, const double *reserve) {
    double v2 = NEVER, radial = p->limits.radial_acceleration, path = p->limits.path_velocity;
    if (radial > 0 && b->kappa > 1e-12) v2 = radial / b->kappa;
    if (path > 0) v2 = fmin(v2, path * path);
    for (int i = 0; i < e->cfg.axis_count; i++) {
        double room = USABLE * piece_a_max(e, p, i) - reserve[i];
        if (b->d1[i] > 1e-12) v2 = fmin(v2, pow(piece_v_max(e, p, i) / b->d1[i], 2));
        if (b->d2[i] > 1e-12) v2 = fmin(v2, NORMAL * room / b->d2[i]);
    }
    return sqrt(v2);
}

/* Acceleration left along the path on every axis at speeds up to v. */
static double accel_bound(const engine *e, const piece *p, const cell_bounds *b, const double *reserve, double v) {
    const curve *c = curve_of(e, p);
    double accel = p->limits.path_acceleration > 0 ? (double)p->limits.path_acceleration : NEVER;
    for (int i = 0; i < e->cfg.axis_count; i++) {
        if (b->d1[i] <= 1e-12) continue;
        double room = USABLE * piece_a_max(e, p, i) - reserve[i], normal = b->kappa * v * v;
        double a = (room - b->d2[i] * v * v) / b->d1[i];
        if (c->metric >> i & 1 && normal < room) a = fmax(a, sqrt(room * room - normal * normal));
        accel = fmin(accel, a);
    }
    return accel;
}

static const double no_reserve[NC_AXES];

/* Largest speed squared anywhere on a cell of what its limits let through where the path acceleration helps, about. */
static double fastest2(const engine *e, const piece *p, const curve *c, int cell) {
    double most = 0.0;
    for (int k = 0; k < BOUND_POINTS; k++) {
        curve_point at;
        curve_at(c, c->w[cell] + (c->w[cell + 1] - c->w[cell]) * k / (BOUND_POINTS - 1), &at);
        double x = NEVER, across = 0.0, bend2 = 0.0;
        for (int i = 0; i < c->axes; i++) {
            if (fabs(at.d1[i]) > 1e-12) x = fmin(x, pow(piece_v_max(e, p, i) / at.d1[i], 2));
            if (!(c->metric >> i & 1)) continue;
            across += fabs(at.d2[i]) * piece_a_max(e, p, i);
            bend2 += at.d2[i] * at.d2[i];
        }
        most = fmax(most, bend2 > 1e-24 ? fmin(x, across / bend2) : x);
    }
    return BETWEEN * most;
}

/* Fill p from the coefficients kept by curve_row_check; length, end and feed are set. */
void curve_piece_build(engine *e, piece *p) {
    curve *c = &e->curves[p->origin & e->store_mask];
    *c = e->next_curve;
    p->kind = PIECE_CURVE;
    p->moving = c->moving;
    p->v_hard = 0.0;
    memset(c->bend, 0, sizeof c->bend);
    for (int k = 0; k < c->cells; k++) {
        cell_bounds b = bound_cell(c, k);
        p->v_hard = fmax(p->v_hard, e->drive.planner ? speed_bound(e, p, &b, no_reserve) : sqrt(fastest2(e, p, c, k)));
        for (int i = 0; i < c->axes; i++) c->bend[i] = fmax(c->bend[i], b.d2[i]);
    }
    curve_piece_tangent(e, p, 0.0, p->tangent_in);
    curve_piece_tangent(e, p, p->length, p->tangent_out);
}

/* Parameter at u of the whole piece. */
static double parameter_at(const engine *e, const piece *p, double u, const curve **c) {
    *c = curve_of(e, p);
    return curve_parameter(*c, u * (curve_length(*c) / p->whole));
}

/* Position at u of the whole piece. */
void curve_piece_position(const engine *e, const piece *p, double u, double *q) {
    const curve *c;
    double w = parameter_at(e, p, u, &c);
    curve_position(c, w, q);
}

void curve_piece_tangent(const engine *e, const piece *p, double s, double *u) {
    const curve *c;
    double w = parameter_at(e, p, p->from + p->dir * s, &c);
    memset(u, 0, sizeof(double) * NC_AXES);
    curve_tangent(c, w, u);
    for (int i = 0; i < c->axes; i++) u[i] *= p->dir;
}

/* Where a cell ends, in mm of the piece as it is driven. */
static double cell_ahead(const curve *c, const piece *p, int cell, double scale) {
    return p->dir > 0 ? c->s[cell + 1] * scale - p->from : p->from - c->s[cell] * scale;
}

/* Derivatives by length at s of the piece as it is driven. */
void curve_piece_derivatives(const engine *e, const piece *p, double s, double *d1, double *d2, double *d3) {
    const curve *c;
    double w = parameter_at(e, p, p->from + p->dir * s, &c);
    curve_point at;
    curve_at(c, w, &at);
    curve_third(c, w, d3);
    for (int i = 0; i < c->axes; i++) {
        d1[i] = p->dir * at.d1[i];
        d2[i] = at.d2[i];
        d3[i] *= p->dir;
    }
}

/* Speed of the main axes (of all others where those rest) over that of the parameter. */
double curve_piece_main_rate(const engine *e, const piece *p, double s) {
    double d1[NC_AXES] = {0}, d2[NC_AXES], d3[NC_AXES], main2 = 0.0, all2 = 0.0;
    curve_piece_derivatives(e, p, s, d1, d2, d3);
    uint16_t main = main_mask(e) & p->moving;
    for (int i = 0; i < e->cfg.axis_count; i++) {
        if (main >> i & 1) main2 += d1[i] * d1[i];
        all2 += d1[i] * d1[i];
    }
    return sqrt(main ? main2 : all2);
}

/* Next end of a cell behind s, mm of the piece as it is driven. */
double curve_piece_cell_end(const engine *e, const piece *p, double s) {
    const curve *c = curve_of(e, p);
    double scale = p->whole / curve_length(c);
    int cell = p->dir > 0 ? 0 : c->cells - 1, last = p->dir > 0 ? c->cells - 1 : 0;
    while (cell != last && cell_ahead(c, p, cell, scale) <= s + CELL_LEAST) cell += p->dir;
    return cell == last ? p->length : cell_ahead(c, p, cell, scale);
}

/* Constant bounds over `length` mm of a cell. */
void curve_cell_span(const engine *e, const piece *p, int cell, const double *reserve, double length, span *out) {
    cell_bounds b = bound_cell(curve_of(e, p), cell);
    double feed = reachable(p, greater(e->plan.reserve_override, OVER_FEED));
    *out = (span){.length = length, .v_hard = speed_bound(e, p, &b, reserve)};
    out->accel = accel_bound(e, p, &b, reserve, fmin(out->v_hard, feed));
}

/* Where the cell ends that lies behind s, mm of the piece as it is driven; NEVER: the last one. */
double curve_cell_behind(const curve *c, const piece *p, double s, int *cell) {
    double scale = p->whole / curve_length(c);
    int last = p->dir > 0 ? c->cells - 1 : 0;
    *cell = p->dir > 0 ? 0 : c->cells - 1;
    while (*cell != last && cell_ahead(c, p, *cell, scale) <= s) *cell += p->dir;
    return *cell == last ? NEVER : cell_ahead(c, p, *cell, scale);
}
