/* The output: pieces, and the programmed rows among them in program order. */
#include <stdlib.h>
#include "stages/smoothing/state.h"

#define SAME 1e-9
#define NOTHING 1e-9 /* mm: what rounding leaves between two pieces is none */

static bool grow(void **data, size_t *room, size_t n, size_t size) {
    if (n <= *room) return true;
    size_t want = *room ? 2 * *room : 1024;
    while (want < n) want *= 2;
    void *more = realloc(*data, want * size);
    if (!more) return false;
    *data = more;
    *room = want;
    return true;
}

static nc_block *new_row(nc_smooth *s) {
    if (!grow((void **)&s->rows, &s->rows_room, s->rows_n + 1, sizeof *s->rows)) {
        s->no_memory = true;
        return NULL;
    }
    return &s->rows[s->rows_n++];
}

void emit_row(nc_smooth *s, const nc_block *row) {
    nc_block *out = new_row(s);
    if (out) *out = *row;
}

/* A programmed row that is written when the contour has got to t. */
void emit_hold(nc_smooth *s, const nc_block *row, double t, bool motion) {
    if (s->held_first > 4096 && s->held_first * 2 > s->held_n) {
        s->held_n -= s->held_first;
        memmove(s->held, s->held + s->held_first, s->held_n * sizeof *s->held);
        s->held_first = 0;
    }
    if (!grow((void **)&s->held, &s->held_room, s->held_n + 1, sizeof *s->held)) {
        s->no_memory = true;
        return;
    }
    s->held[s->held_n++] = (held_row){*row, t, motion};
}

static bool due(const held_row *h, double t0, double t1) {
    if (h->motion) return h->t < t1;
    return h->row.type == NC_MARKER ? h->t < t1 : h->t <= t0;
}

/* Rows that stand ahead of a piece over t0..t1: elements that it touches, everything else up to its start. */
static void rows_before(nc_smooth *s, double t0, double t1) {
    while (s->held_first < s->held_n && due(&s->held[s->held_first], t0, t1)) {
        held_row *h = &s->held[s->held_first++];
        if (h->motion) h->row.flags |= NC_ELEMENT;
        emit_row(s, &h->row);
    }
}

static void place(nc_block *row, const node *at) {
    row->n = at->n;
    row->line = at->line;
    row->count = at->count;
    row->file = at->file;
    row->feed = at->feed;
    row->flags = (uint16_t)(NC_PIECE | at->flags | (at->feed > 0 ? 0 : NC_RAPID));
}

/* A line that is driven as it was programmed stays one row, element and piece. */
static bool whole_row(nc_smooth *s, double t1) {
    const held_row *h = s->held + s->held_first, *next = h + 1;
    if (s->held_first >= s->held_n || !h->motion || h->t != s->line_t || h->row.type != NC_LINEAR) return false;
    for (; next < s->held + s->held_n && !next->motion; next++) continue;
    if (next < s->held + s->held_n ? next->t < t1 : false) return false;
    double miss = 0.0;
    for (int a = 0; a < s->cfg.axes; a++) miss = fmax(miss, fabs(h->row.end[a] - s->line.end[a]));
    return miss < SAME && fabs(h->row.length - s->line.value) < SAME && fabs(s->line.length - h->row.length) < SAME;
}

static void put_line(nc_smooth *s, double t1) {
    if (!s->has_line) return;
    s->has_line = false;
    while (s->held_first < s->held_n && !s->held[s->held_first].motion && s->held[s->held_first].t <= s->line_t)
        emit_row(s, &s->held[s->held_first++].row);
    double main = 0.0, all = 0.0;
    for (int a = 0; a < s->cfg.axes; a++) {
        double d = s->line.end[a] - s->out_at[a];
        all += d * d;
        if (in_main(s, a)) main += d * d;
    }
    s->line.length = s->line.length_min = sqrt(main > SAME * SAME ? main : all);
    if (!(s->line.length > NOTHING)) return;
    if (whole_row(s, t1)) {
        s->line = s->held[s->held_first++].row;
    } else {
        rows_before(s, s->line_t, t1);
    }
    emit_row(s, &s->line);
    s->stats.pieces++;
    memcpy(s->out_at, s->line.end, sizeof s->out_at);
    s->out_t = t1;
}

/* The chord from -> to between contour parameters t0 and t1, exactly. Parts of one chord are joined. */
void emit_line(nc_smooth *s, const node *from, const node *to, double t0, double t1) {
    if (s->has_line && (s->out_t != t0 || s->line_t < from->t)) put_line(s, s->out_t);
    if (!s->has_line) {
        memset(&s->line, 0, sizeof s->line);
        s->line.type = NC_LINEAR;
        s->line_t = t0;
        s->has_line = true;
    }
    double rest = to->t - from->t, r = t1 == to->t ? 1.0 : (t1 - from->t) / rest;
    for (int a = 0; a < s->cfg.axes; a++)
        s->line.end[a] = (r == 1.0 ? to->q[a] : from->q[a] + r * (to->q[a] - from->q[a])) / s->scale[a];
    place(&s->line, to);
    s->line.end_speed = t1 == to->t ? to->end_speed : 0.0f;
    note_deviation(s, to->slack);
    s->line.value += (t1 - t0) / rest * (to->d - from->d);
    s->out_t = t1;
}

/* Coefficients into the pool; where they begin. */
uint32_t emit_pool(nc_smooth *s, const double *values, size_t n) {
    if (!grow((void **)&s->pool, &s->pool_room, s->pool_n + n, sizeof *s->pool)) {
        s->no_memory = true;
        return 0;
    }
    memcpy(s->pool + s->pool_n, values, n * sizeof *values);
    s->pool_n += n;
    return (uint32_t)(s->pool_n - n);
}

/* A smooth piece, scaled coefficients over x = 0..1, in the feed and place of the chord that ends at `at`. */
static void put_curve(nc_smooth *s, double c[][ORDER], double t0, double t1, const node *at, double programmed) {
    curve built;
    double flat[NC_AXES * ORDER];
    for (int a = 0; a < s->cfg.axes; a++)
        for (int k = 0; k < ORDER; k++) flat[a * ORDER + k] = c[a][k] / s->scale[a];
    rows_before(s, t0, t1);
    nc_block row;
    memset(&row, 0, sizeof row);
    if (!curve_build(&built, flat, s->cfg.axes, 5, 1.0, s->main_mask)) s->stats.irregular++;
    row.type = NC_POLYNOMIAL;
    row.degree = 5;
    row.angle = 1.0;
    row.length = row.length_min = curve_length(&built);
    row.pool = emit_pool(s, flat, (size_t)(s->cfg.axes * ORDER));
    place(&row, at);
    row.value = programmed;
    curve_position(&built, 1.0, row.end);
    for (int a = 0; a < s->cfg.axes && at->kind == NODE_BREAK && t1 == at->t; a++) row.end[a] = at->q[a] / s->scale[a];
    if (fabs(t1 - at->t) < SAME) row.end_speed = at->end_speed;
    emit_row(s, &row);
    memcpy(s->out_at, row.end, sizeof s->out_at);
    s->out_t = t1;
    s->stats.pieces++;
    s->stats.curves++;
}

/* Part x0..x1 of a polynomial over 0..1. */
static void cut(double c[][ORDER], double out[][ORDER], int axes, double x0, double x1) {
    for (int a = 0; a < axes; a++) {
        memcpy(out[a], c[a], sizeof out[a]);
        for (int i = 0; i < 5; i++)
            for (int k = 4; k >= i; k--) out[a][k] += x0 * out[a][k + 1];
        double scale = x1 - x0;
        for (int k = 1; k < ORDER; k++, scale *= x1 - x0) out[a][k] *= scale;
    }
}

static double programmed_at(const node *a, const node *b, double t) { return a->d + (t - a->t) / (b->t - a->t) * (b->d - a->d); }

/* A smooth piece over t0..t1, cut where rows or feeds change. `at`: first node behind t0. */
void emit_curve(nc_smooth *s, double c[][ORDER], double t0, double t1, const node *at) {
    put_line(s, t0);
    double from = t0, d = programmed_at(at - 1, at, t0);
    for (; from < t1; at++) {
        bool last = at->t >= t1 || at->kind == NODE_BREAK;
        if (!last && !at->mark) continue;
        double to = last ? t1 : at->t, done = last ? programmed_at(at - 1, at, t1) : at->d, part[NC_AXES][ORDER];
        if (to - from > SAME * (t1 - t0)) {
            cut(c, part, s->cfg.axes, (from - t0) / (t1 - t0), (to - t0) / (t1 - t0));
            put_curve(s, part, from, to, at, done - d);
            from = to;
            d = done;
        }
        if (last) break;
    }
}

/* The section is written: pending line and all rows. */
void emit_flush(nc_smooth *s) {
    put_line(s, s->t);
    rows_before(s, INFINITY, INFINITY);
    s->held_n = s->held_first = 0;
}

int64_t nc_smooth_rows(const nc_smooth *s) { return (int64_t)s->rows_n; }
int64_t nc_smooth_coefficients(const nc_smooth *s) { return (int64_t)s->pool_n; }

void nc_smooth_take(nc_smooth *s, nc_block *rows, double *pool) {
    if (s->rows_n) memcpy(rows, s->rows, s->rows_n * sizeof *rows);
    if (s->pool_n) memcpy(pool, s->pool, s->pool_n * sizeof *pool);
    s->rows_n = s->pool_n = 0;
}
