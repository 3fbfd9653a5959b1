/* Stretches of a polynomial for the acceleration-limited planner: rows at knots
 * (curved_span.c) where they are certified.
 *
 * Between two knots the planner sees q' and q'' of every axis on their chords
 * and a constant path acceleration u. What is driven differs from that by at
 * most |u| h^2/8 max|q'''| + x h^2/8 max|q''''| + |u| h/2 |change of q''| (x =
 * v^2; the last: x changes as well as q'') with bounds that hold everywhere
 * between them (bounds.c). Where that is little at the largest u and x that the
 * rows let through, it is taken off the acceleration. Else the rows carry it
 * along, so that it counts at the u and x that occur: near where a slow axis
 * stands its rows alone let through a hundred times of what is ever driven.
 * Where a part would lose much it is cut; where there would be many stretches
 * then, by what is likely to occur (at a standstill, at constant speed). Where
 * the speed of the parameter changes too much to tell, the constant bounds of
 * the cells are left (piece_curve.c).
 */
#include <limits.h>
#include <math.h>
#include "engine/accel/curve_parts.h"
#include "curve/curve.h"
#include "engine/accel/curved_span.h"
#include "engine/accel/tuning.h"
#include "engine/path/piece_curve.h"
#include "engine/state/state.h"
#include "rows/nc_block.h"

void set_axes(struct builder *builder) {
    for (int i = 0; i < builder->c->axes; i++) {
        double v = piece_v_max(&builder->engine->cfg, builder->piece, i);
        builder->usable[i] =
            USABLE * piece_a_max(&builder->engine->cfg, builder->piece, i);
        builder->v2[i] = v * v;
    }
}

struct extent extent_at(const struct builder *builder,
                        const struct knot *knot) {
    const struct piece *piece = builder->piece;
    double u = piece->limits.path_acceleration > 0
                   ? (double)piece->limits.path_acceleration
                   : NEVER,
           x = builder->fast2;
    for (int i = 0; i < builder->c->axes; i++) {
        double d1 = knot->d1[i];
        double d2 = knot->d2[i];
        double room = builder->room[i];
        if (x * d1 * d1 > builder->v2[i]) {
            x = builder->v2[i] / (d1 * d1);
        }
        for (int j = 0; j < i; j++) {
            double cross = fabs(d1 * knot->d2[j] - knot->d1[j] * d2);
            double along =
                       fabs(d2) * builder->room[j] + fabs(knot->d2[j]) * room,
                   across =
                       fabs(d1) * builder->room[j] + fabs(knot->d1[j]) * room;
            if (u * cross > along) {
                u = along / cross;
            }
            if (x * cross > across) {
                x = across / cross;
            }
        }
    }
    for (int i = 0; i < builder->c->axes; i++) {
        double d1 = fabs(knot->d1[i]),
               most = builder->room[i] + fabs(knot->d2[i]) * x;
        if (u * d1 > most) {
            u = most / d1;
        }
    }
    for (int i = 0; i < builder->c->axes; i++) {
        double d2 = fabs(knot->d2[i]),
               most = builder->room[i] + fabs(knot->d1[i]) * u;
        if (x * d2 > most) {
            x = most / d2;
        }
    }
    return (struct extent){u, x};
}

void knot_at(const struct builder *builder,
             double w,
             double s,
             struct knot *knot) {
    double bend2 = 0.0;
    curve_derivatives(builder->c, w, knot->d1, knot->d2);
    for (int i = 0; i < builder->c->axes; i++) {
        if (builder->piece->dir < 0) {
            knot->d1[i] = -knot->d1[i];
        }
        if (builder->c->metric >> i & 1) {
            bend2 += knot->d2[i] * knot->d2[i];
        }
    }
    knot->bend = sqrt(bend2);
    knot->w = w;
    knot->s = s;
}

/* What can be reached at a knot. */
static void reach_at(const struct builder *builder, place *out) {
    const struct knot *knot = &out->at;
    out->most = out->likely = extent_at(builder, knot);
    for (int i = 0; builder->likely && i < builder->c->axes; i++) {
        if (out->likely.u * fabs(knot->d1[i]) > builder->room[i]) {
            out->likely.u = builder->room[i] / fabs(knot->d1[i]);
        }
        if (out->likely.x * fabs(knot->d2[i]) > builder->room[i]) {
            out->likely.x = builder->room[i] / fabs(knot->d2[i]);
        }
    }
}

static void place_at(const struct builder *builder,
                     double w,
                     double s,
                     place *out) {
    knot_at(builder, w, s, &out->at);
    reach_at(builder, out);
}

void knot_inside(const struct builder *builder, double w, struct knot *knot) {
    knot_at(builder,
            w,
            builder->piece->dir
                * (curve_length_to(builder->c, w) * builder->scale
                   - builder->piece->from),
            knot);
}

static void place_inside(const struct builder *builder, double w, place *out) {
    knot_inside(builder, w, &out->at);
    reach_at(builder, out);
}

double parameter_behind(const struct builder *builder, double s) {
    return curve_parameter(builder->c,
                           (builder->piece->from + builder->piece->dir * s)
                               / builder->scale);
}

void place_behind(const struct builder *builder, double s, place *out) {
    if (s <= 0.0 || s >= builder->piece->length) {
        out->at = builder->ends[s > 0.0];
        reach_at(builder, out);
        return;
    }
    place_at(builder, parameter_behind(builder, s), s, out);
}

struct extent extent_between(const struct extent *extent,
                             const struct extent *extent_z,
                             double h) {
    double u = lesser(extent->u, extent_z->u), added = 2.0 * u * h;
    return (struct extent){u,
                           lesser(greater(extent->x, extent_z->x),
                                  lesser(extent->x, extent_z->x) + added)};
}

/* Constant bounds, cell by cell. */
static void add_constant(struct builder *builder, double from, double to) {
    for (double at = from; at < to;) {
        int cell;
        double end =
            lesser(to,
                   curve_cell_behind(builder->c, builder->piece, at, &cell));
        struct span *span = &builder->spans[builder->piece->span_count++];
        curve_cell_span(builder->engine,
                        builder->piece,
                        cell,
                        builder->reserve,
                        end - at,
                        span);
        at = end;
    }
}

/* What lies ahead of `to` is all there is, and nothing has been added yet. */
static bool is_alone(const struct builder *builder, const place *to) {
    return builder->piece->span_count == 0
           && to->at.s >= builder->piece->length;
}

/* Whether there is room for a stretch whose rows carry along what they lose,
 * and one row an axis for all behind it. */
static bool has_more_rows(const struct builder *builder) {
    int64_t left = builder->has->row_numbers
                   - (builder->rows - builder->has->rows),
            behind =
                (int64_t)builder->has->count - builder->piece->span_count - 1;
    return left >= (SIGNS + behind) * SPAN_ROW * builder->c->axes;
}

/* Rows between two knots, or constant bounds where too little would be left of
 * an axis. */
static void add_stretch(struct builder *builder,
                        const place *from,
                        const place *to,
                        const double *third,
                        const double *fourth) {
    double h = to->at.s - from->at.s;
    double part = 0.125 * h * h;
    double room[NC_AXES];
    double turn2 = 0.0;
    if (h < TINY_MM) {
        if (is_alone(builder, to)) {
            add_constant(builder, from->at.s, to->at.s);
        }
        return;
    }
    chord_loss lost;
    struct extent most = extent_between(&from->most, &to->most, h);
    bool more_rows = has_more_rows(builder);
    for (int i = 0; i < builder->c->axes; i++) {
        lost.above[i] = part * third[i] + ROUNDING;
        lost.u[i] =
            lost.above[i] + 0.5 * h * fabs(to->at.d2[i] - from->at.d2[i]);
        lost.x[i] = part * fourth[i];
        room[i] = builder->room[i];
        if (builder->c->metric >> i & 1) {
            turn2 += lost.x[i] * lost.x[i];
        }
        double loss = lost.u[i] * most.u + lost.x[i] * most.x;
        if (more_rows && loss > LITTLE * builder->room[i]) {
            continue;
        }
        builder->starved |= loss > LITTLE * builder->room[i];
        if (!(loss <= GIVEN_UP * builder->room[i])) {
            add_constant(builder, from->at.s, to->at.s);
            return;
        }
        room[i] -= loss;
        lost.u[i] = lost.x[i] = 0.0;
    }
    struct knot knot = from->at, knot_z = to->at;
    knot.bend = knot_z.bend = greater(knot.bend, knot_z.bend) + sqrt(turn2);
    struct span *span = &builder->spans[builder->piece->span_count++];
    builder->rows += curved_rows(&builder->engine->cfg,
                                 builder->piece,
                                 &knot,
                                 &knot_z,
                                 room,
                                 &lost,
                                 span,
                                 builder->rows);
    for (int k = 0; k < 2; k++) {
        span->v2_limit[k] = lesser(span->v2_limit[k], builder->fast2);
    }
}

int parts_for(const struct builder *builder,
              struct extent most,
              double h,
              const double *third,
              const double *fourth) {
    double worst = 0.0;
    for (int i = 0; i < builder->c->axes; i++) {
        double loss =
            h * h * (0.625 * third[i] * most.u + 0.125 * fourth[i] * most.x);
        if (loss > worst * builder->room[i]) {
            worst = loss / builder->room[i];
        }
    }
    if (worst >= 0.0 && worst <= builder->loss) {
        return 1;
    }
    double n = ceil(sqrt(worst / builder->loss));
    return n < INT_MAX ? (int)n : INT_MAX;
}

static int parts_needed(const struct builder *builder,
                        const place *from,
                        const place *to,
                        const double *third,
                        const double *fourth) {
    double h = to->at.s - from->at.s;
    return parts_for(builder,
                     builder->likely
                         ? extent_between(&from->likely, &to->likely, h)
                         : extent_between(&from->most, &to->most, h),
                     h,
                     third,
                     fourth);
}

static void add_stretches(struct builder *builder,
                          const place *from,
                          const place *to,
                          int count,
                          const double *third,
                          const double *fourth) {
    place last = *from, next;
    for (int k = 1; k < count; k++) {
        double w = from->at.w + (to->at.w - from->at.w) * k / count;
        place_at(builder,
                 w,
                 last.at.s
                     + builder->scale
                           * curve_length_between(builder->c, last.at.w, w),
                 &next);
        add_stretch(builder, &last, &next, third, fourth);
        last = next;
    }
    add_stretch(builder, &last, to, third, fourth);
}

int most_constant(const struct builder *builder, double w) {
    int cells = 0;
    for (int k = 0; k < builder->c->cells; k++) {
        cells += builder->piece->dir > 0 ? builder->c->w[k + 1] > w
                                         : builder->c->w[k] < w;
    }
    return cells + builder->strips + HALVINGS;
}

static bool cut_in_halves(struct builder *builder,
                          const place *from,
                          const place *to,
                          int halvings,
                          int least,
                          int about) {
    place middle;
    if (to->at.s - from->at.s < SHORTEST_PART_MM) {
        return false;
    }
    place_inside(builder, 0.5 * (from->at.w + to->at.w), &middle);
    if (!(middle.at.s > from->at.s && middle.at.s < to->at.s)) {
        return false;
    }
    refine(builder, from, &middle, halvings - 1, least - 1, about / TIGHTER);
    refine(builder, &middle, to, halvings - 1, least - 1, about / TIGHTER);
    return true;
}

void refine(struct builder *builder,
            const place *from,
            const place *to,
            int halvings,
            int least,
            int about) {
    double parts[2][NC_AXES];
    if (least > 0 && cut_in_halves(builder, from, to, halvings, least, about)) {
        return;
    }
    int left = builder->counting
                   ? INT_MAX
                   : (int)builder->has->count - (int)builder->piece->span_count
                         - most_constant(builder, from->at.w);
    bool clearly = about > CLEARLY * OF_PART && halvings > 0 && left > 1;
    if (clearly && cut_in_halves(builder, from, to, halvings, least, about)) {
        return;
    }
    bool whole = builder->certified && from->at.s <= 0.0
                 && to->at.s >= builder->piece->length;
    bool sure =
        whole
        || curve_certify(builder->c, from->at.w, to->at.w, parts[0], parts[1]);
    const double *third = whole ? builder->third : parts[0],
                 *fourth = whole ? builder->fourth : parts[1];
    int count = sure ? parts_needed(builder, from, to, third, fourth) : INT_MAX,
        most = halvings < HALVINGS ? OF_PART : AT_ONCE;
    bool halved = count > most && halvings > 0 && left > 1;
    if (halved
        && cut_in_halves(builder,
                         from,
                         to,
                         halvings,
                         least,
                         count < INT_MAX ? count : 0)) {
        return;
    }
    if (count > most) {
        count = most;
    }
    builder->starved |= left < count;
    if (count > left) {
        count = left < 1 ? 1 : left;
    }
    if (builder->counting) {
        builder->count += count;
    } else if (sure) {
        add_stretches(builder, from, to, count, third, fourth);
    } else {
        add_constant(builder, from->at.s, to->at.s);
    }
}
