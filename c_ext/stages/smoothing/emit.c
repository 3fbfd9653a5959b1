/* The output: pieces, and the programmed rows among them in program order. */
#include <stdlib.h>
#include "curve/curve.h"
#include "stages/smoothing/emit.h"
#include "stages/smoothing/nodes.h"
#include "stages/smoothing/state.h"

static bool grow(void **data, size_t *room, size_t count, size_t size) {
    if (count <= *room) {
        return true;
    }
    size_t want = *room ? 2 * *room : 1024;
    while (want < count) {
        want *= 2;
    }
    void *more = realloc(*data, want * size);
    if (!more) {
        return false;
    }
    *data = more;
    *room = want;
    return true;
}

static nc_block *new_row(nc_smooth *smooth) {
    if (!grow((void **)&smooth->rows,
              &smooth->rows_room,
              smooth->rows_n + 1,
              sizeof *smooth->rows)) {
        smooth->no_memory = true;
        return NULL;
    }
    return &smooth->rows[smooth->rows_n++];
}

void emit_row(nc_smooth *smooth, const nc_block *row) {
    nc_block *out = new_row(smooth);
    if (out) {
        *out = *row;
    }
}

/* A programmed row that is written when the contour has got to t. */
void emit_hold(nc_smooth *smooth, const nc_block *row, double t, bool motion) {
    if (smooth->held_first > 4096 && smooth->held_first * 2 > smooth->held_n) {
        smooth->held_n -= smooth->held_first;
        memmove(smooth->held,
                smooth->held + smooth->held_first,
                smooth->held_n * sizeof *smooth->held);
        smooth->held_first = 0;
    }
    if (!grow((void **)&smooth->held,
              &smooth->held_room,
              smooth->held_n + 1,
              sizeof *smooth->held)) {
        smooth->no_memory = true;
        return;
    }
    smooth->held[smooth->held_n++] = (struct held_row){*row, t, motion};
}

static bool due(const struct held_row *held_row, double t0, double t1) {
    if (held_row->motion) {
        return held_row->t < t1;
    }
    return held_row->row.type == NC_MARKER ? held_row->t < t1
                                           : held_row->t <= t0;
}

/* Rows that stand ahead of a piece over t0..t1: elements that it touches,
 * everything else up to its start. */
static void rows_before(nc_smooth *smooth, double t0, double t1) {
    while (smooth->held_first < smooth->held_n
           && due(&smooth->held[smooth->held_first], t0, t1)) {
        struct held_row *held_row = &smooth->held[smooth->held_first++];
        if (held_row->motion) {
            held_row->row.flags |= NC_ELEMENT;
        }
        emit_row(smooth, &held_row->row);
    }
}

static void place(nc_block *row, const struct node *at) {
    row->n = at->number;
    row->line = at->line;
    row->count = at->count;
    row->file = at->file;
    row->feed = at->feed;
    row->flags =
        (uint16_t)(NC_PIECE | at->flags | (at->feed > 0 ? 0 : NC_RAPID));
}

/* Of a scaled point of the curve; both may be the same array. */
static void programmed_position(const nc_smooth *smooth,
                                const double *point,
                                double *position) {
    double at[NC_AXES] = {0.0};
    memcpy(at, point, sizeof *at * (size_t)smooth->cfg.axes);
    turn_back(smooth, at);
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        position[axis] = at[axis] / smooth->scale[axis];
    }
}

/* A line that is driven as it was programmed stays one row, element and piece.
 */
static bool whole_row(nc_smooth *smooth, double t1) {
    const struct held_row *held_row = smooth->held + smooth->held_first;
    const struct held_row *next = held_row + 1;
    if (smooth->held_first >= smooth->held_n || !held_row->motion
        || held_row->t != smooth->line_t || held_row->row.type != NC_LINEAR) {
        return false;
    }
    for (; next < smooth->held + smooth->held_n && !next->motion; next++) {
        continue;
    }
    if (next < smooth->held + smooth->held_n ? next->t < t1 : false) {
        return false;
    }
    double miss = 0.0;
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        miss =
            fmax(miss, fabs(held_row->row.end[axis] - smooth->line.end[axis]));
    }
    return miss < SAME && fabs(held_row->row.length - smooth->line.value) < SAME
           && fabs(smooth->line.length - held_row->row.length) < SAME;
}

static void put_line(nc_smooth *smooth, double t1) {
    if (!smooth->has_line) {
        return;
    }
    smooth->has_line = false;
    while (smooth->held_first < smooth->held_n
           && !smooth->held[smooth->held_first].motion
           && smooth->held[smooth->held_first].t <= smooth->line_t) {
        emit_row(smooth, &smooth->held[smooth->held_first++].row);
    }
    double main = 0.0;
    double all = 0.0;
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        double difference = smooth->line.end[axis] - smooth->out_at[axis];
        all += difference * difference;
        if (in_main(smooth, axis)) {
            main += difference * difference;
        }
    }
    smooth->line.length = smooth->line.length_min =
        sqrt(main > SAME * SAME ? main : all);
    if (!(smooth->line.length > NOTHING)) {
        return;
    }
    if (whole_row(smooth, t1)) {
        smooth->line = smooth->held[smooth->held_first++].row;
    } else {
        rows_before(smooth, smooth->line_t, t1);
    }
    emit_row(smooth, &smooth->line);
    smooth->stats.pieces++;
    memcpy(smooth->out_at, smooth->line.end, sizeof smooth->out_at);
    smooth->out_t = t1;
}

/* The chord from -> to between contour parameters t0 and t1, exactly. Parts of
 * one chord are joined. */
void emit_line(nc_smooth *smooth,
               const struct node *from,
               const struct node *to,
               double t0,
               double t1) {
    if (smooth->has_line && (smooth->out_t != t0 || smooth->line_t < from->t)) {
        put_line(smooth, smooth->out_t);
    }
    if (!smooth->has_line) {
        memset(&smooth->line, 0, sizeof smooth->line);
        smooth->line.type = NC_LINEAR;
        smooth->line_t = t0;
        smooth->has_line = true;
    }
    double length = to->t - from->t;
    double share = t1 == to->t ? 1.0 : (t1 - from->t) / length;
    double end[NC_AXES];
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        end[axis] =
            share == 1.0
                ? to->position[axis]
                : from->position[axis]
                      + share * (to->position[axis] - from->position[axis]);
    }
    programmed_position(smooth, end, smooth->line.end);
    place(&smooth->line, to);
    smooth->line.end_speed = t1 == to->t ? to->end_speed : 0.0f;
    note_deviation(smooth, to->slack);
    smooth->line.value +=
        (t1 - t0) / length * (to->programmed - from->programmed);
    smooth->out_t = t1;
}

/* Coefficients into the pool; where they begin. */
uint32_t emit_pool(nc_smooth *smooth, const double *values, size_t count) {
    if (!grow((void **)&smooth->pool,
              &smooth->pool_room,
              smooth->pool_n + count,
              sizeof *smooth->pool)) {
        smooth->no_memory = true;
        return 0;
    }
    memcpy(smooth->pool + smooth->pool_n, values, count * sizeof *values);
    smooth->pool_n += count;
    return (uint32_t)(smooth->pool_n - count);
}

/* A smooth piece, scaled coefficients over x = 0..1, in the feed and place of
 * the chord that ends at `at`. */
static void put_curve(nc_smooth *smooth,
                      double coef[][ORDER],
                      double t0,
                      double t1,
                      const struct node *at,
                      double programmed) {
    struct curve built;
    double flat[NC_AXES * ORDER];
    for (int k = 0; k < ORDER; k++) {
        double term[NC_AXES];
        for (int axis = 0; axis < smooth->cfg.axes; axis++) {
            term[axis] = coef[axis][k];
        }
        programmed_position(smooth, term, term);
        for (int axis = 0; axis < smooth->cfg.axes; axis++) {
            flat[axis * ORDER + k] = term[axis];
        }
    }
    rows_before(smooth, t0, t1);
    nc_block row;
    memset(&row, 0, sizeof row);
    if (!curve_build(&built,
                     flat,
                     smooth->cfg.axes,
                     5,
                     1.0,
                     smooth->main_mask)) {
        smooth->stats.irregular++;
    }
    row.type = NC_POLYNOMIAL;
    row.degree = 5;
    row.angle = 1.0;
    row.length = row.length_min = curve_length(&built);
    row.pool = emit_pool(smooth, flat, (size_t)(smooth->cfg.axes * ORDER));
    place(&row, at);
    row.value = programmed;
    curve_position(&built, 1.0, row.end);
    if (at->kind == NODE_BREAK && t1 == at->t) {
        programmed_position(smooth, at->position, row.end);
    }
    if (fabs(t1 - at->t) < SAME) {
        row.end_speed = at->end_speed;
    }
    emit_row(smooth, &row);
    memcpy(smooth->out_at, row.end, sizeof smooth->out_at);
    smooth->out_t = t1;
    smooth->stats.pieces++;
    smooth->stats.curves++;
}

/* Part x0..x1 of a polynomial over 0..1. */
static void cut(double coef[][ORDER],
                double out[][ORDER],
                int axes,
                double x0,
                double x1) {
    for (int axis = 0; axis < axes; axis++) {
        memcpy(out[axis], coef[axis], sizeof out[axis]);
        for (int i = 0; i < 5; i++) {
            for (int k = 4; k >= i; k--) {
                out[axis][k] += x0 * out[axis][k + 1];
            }
        }
        double scale = x1 - x0;
        for (int k = 1; k < ORDER; k++, scale *= x1 - x0) {
            out[axis][k] *= scale;
        }
    }
}

static double programmed_at(const struct node *node,
                            const struct node *behind,
                            double t) {
    return node->programmed
           + (t - node->t) / (behind->t - node->t)
                 * (behind->programmed - node->programmed);
}

/* A smooth piece over t0..t1, cut where rows or feeds change. `at`: first node
 * behind t0. */
void emit_curve(nc_smooth *smooth,
                double coef[][ORDER],
                double t0,
                double t1,
                const struct node *at) {
    put_line(smooth, t0);
    double from = t0;
    double programmed = programmed_at(at - 1, at, t0);
    for (; from < t1; at++) {
        bool last = at->t >= t1 || at->kind == NODE_BREAK;
        if (!last && !at->mark) {
            continue;
        }
        double to = last ? t1 : at->t;
        double done = last ? programmed_at(at - 1, at, t1) : at->programmed;
        double part[NC_AXES][ORDER];
        if (to - from > SAME * (t1 - t0)) {
            cut(coef,
                part,
                smooth->cfg.axes,
                (from - t0) / (t1 - t0),
                (to - t0) / (t1 - t0));
            put_curve(smooth, part, from, to, at, done - programmed);
            from = to;
            programmed = done;
        }
        if (last) {
            break;
        }
    }
}

/* The section is written: pending line and all rows. */
void emit_flush(nc_smooth *smooth) {
    put_line(smooth, smooth->t);
    rows_before(smooth, INFINITY, INFINITY);
    smooth->held_n = 0;
    smooth->held_first = 0;
}

int64_t nc_smooth_rows(const nc_smooth *smooth) {
    return (int64_t)smooth->rows_n;
}
int64_t nc_smooth_coefficients(const nc_smooth *smooth) {
    return (int64_t)smooth->pool_n;
}

void nc_smooth_take(nc_smooth *smooth, nc_block *rows, double *pool) {
    if (smooth->rows_n) {
        memcpy(rows, smooth->rows, smooth->rows_n * sizeof *rows);
    }
    if (smooth->pool_n) {
        memcpy(pool, smooth->pool, smooth->pool_n * sizeof *pool);
    }
    smooth->rows_n = 0;
    smooth->pool_n = 0;
}
