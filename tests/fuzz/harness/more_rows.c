#include "more_rows.h"

#include <math.h>
#include <string.h>

#define DEGREE 3
#define PARTS 64 /* of a curve whose length is measured */

void more_rows_start(struct more_rows *more, struct rows_in *in, bool curves) {
    *more =
        (struct more_rows){.in = in, .pool_n = in->pool_n, .curves = curves};
}

void more_rows_batch(struct more_rows *more) {
    more->in->pool_n = more->pool_n;
}

static void begin(struct rows_in *in, nc_block *row, int type) {
    memset(row, 0, sizeof *row);
    memcpy(row->end, in->position, sizeof row->end);
    row->type = (uint8_t)type;
    row->line = row->count = row->n = ++in->line;
}

static int main_axes(const struct rows_in *in) {
    return in->axes < 3 ? in->axes : 3;
}

/* Speed over the parameter, of the main axes. */
static double rate(const double *curve, int axes, double at) {
    double sum = 0.0;
    for (int i = 0; i < axes; i++) {
        const double *c = curve + i * (DEGREE + 1);
        double d = c[1] + at * (2.0 * c[2] + at * 3.0 * c[3]);
        sum += d * d;
    }
    return sqrt(sum);
}

/* Gauss-Legendre of three points in each part. */
static double length_of(const double *curve, int axes) {
    double sum = 0.0, half = 0.5 / PARTS, off = half * sqrt(0.6);
    for (int k = 0; k < PARTS; k++) {
        double middle = (2 * k + 1) * half;
        sum += 5.0 * rate(curve, axes, middle - off)
               + 8.0 * rate(curve, axes, middle)
               + 5.0 * rate(curve, axes, middle + off);
    }
    return sum * half / 9.0;
}

/* The first axis goes on all the way, so the curve stands nowhere. */
static bool curve(struct more_rows *more, nc_block *row) {
    struct rows_in *in = more->in;
    int64_t count = (int64_t)in->axes * (DEGREE + 1);
    if (!more->curves || in->pool_n + count > FUZZ_POOL) {
        return false;
    }
    double *pool = in->pool + in->pool_n;
    begin(in, row, NC_POLYNOMIAL);
    for (int i = 0; i < in->axes; i++) {
        double *c = pool + i * (DEGREE + 1);
        c[0] = in->position[i];
        c[1] = i ? take_signed(&in->bytes) * 0.05
                 : 0.05 + take_byte(&in->bytes) * 0.1;
        c[2] = i ? take_signed(&in->bytes) * 0.05 : 0.0;
        c[3] = i ? take_signed(&in->bytes) * 0.02 : 0.0;
        row->end[i] = c[0] + c[1] + c[2] + c[3];
    }
    row->pool = (uint32_t)in->pool_n;
    row->degree = DEGREE;
    row->angle = 1.0;
    row->length = row->length_min = length_of(pool, main_axes(in));
    row->feed = 0.1 + take_word(&in->bytes) / 100.0;
    in->pool_n += count;
    memcpy(in->position, row->end, sizeof in->position);
    return true;
}

static bool line(struct rows_in *in, nc_block *row) {
    begin(in, row, NC_LINEAR);
    double sum = 0.0;
    for (int i = 0; i < main_axes(in); i++) {
        double way = take_signed(&in->bytes) * 0.1;
        row->end[i] += way;
        sum += way * way;
    }
    row->length = row->length_min = sqrt(sum);
    row->feed = 0.1 + take_word(&in->bytes) / 100.0;
    return sum > 1e-6;
}

/* What the PLC sees; the row behind it executes it. */
static bool element(struct more_rows *more, nc_block *row) {
    if (!more->curves || !line(more->in, row)) {
        return false;
    }
    row->flags = NC_ELEMENT;
    more->piece = row->length;
    memcpy(more->in->position, row->end, sizeof row->end);
    return true;
}

static void piece(struct more_rows *more, nc_block *row) {
    double feed = 0.1 + take_word(&more->in->bytes) / 100.0;
    begin(more->in, row, NC_LINEAR);
    row->flags = NC_PIECE;
    row->length = row->length_min = row->value = more->piece;
    row->feed = feed;
    more->piece = 0.0;
}

static bool motion(struct rows_in *in, nc_block *row) {
    uint8_t flags = take_byte(&in->bytes);
    if (!line(in, row)) {
        return false;
    }
    row->flags |= flags & 1 ? NC_NO_OVERRIDE : 0;
    row->flags |= flags & 2 ? NC_RAPID : 0;
    row->flags |= flags & 4 ? NC_EXACT_STOP : 0;
    row->end_speed = flags & 8 ? (float)(1 + (flags >> 4)) : 0.0f;
    row->feed = flags & 2 ? 0.0 : row->feed;
    memcpy(in->position, row->end, sizeof in->position);
    return true;
}

static void function(struct rows_in *in, nc_block *row) {
    static const uint8_t kinds[] = {NC_M, NC_M, NC_M, NC_H, NC_T, NC_S};
    uint8_t what = take_byte(&in->bytes);
    begin(in, row, kinds[what % 6]);
    row->code = (what >> 3) % 22;
    row->value = take_byte(&in->bytes) * 10.0;
    row->flags = what & 128 ? NC_HAS_VALUE : 0;
    row->flags |= fuzz_function_flags(row, take_byte(&in->bytes) & 1);
}

static void event(struct rows_in *in, nc_block *row) {
    uint8_t what = take_byte(&in->bytes);
    begin(in, row, what % 16 == 15 ? NC_FLUSH : NC_EVENT);
    row->code = 1 + what % 11;
    row->value = row->code >= NC_EVENT_ESA_TIME && row->code < NC_EVENT_RT_COUNT
                     ? (what >> 4) / 100.0
                     : what >> 4 & 7;
}

/* A pass, and the end of it where one has begun. */
static void loop(struct rows_in *in, nc_block *row) {
    uint8_t what = take_byte(&in->bytes);
    begin(in, row, what & 1 ? NC_RT_LOOP_BEGIN : NC_RT_LOOP_END);
    row->flags = what & 2 ? NC_MODULO : 0;
}

static bool is_closed(const struct more_rows *more) {
    const struct rows_in *in = more->in;
    return !memcmp(more->begin,
                   in->position,
                   (size_t)in->axes * sizeof(double));
}

void more_rows_see(struct more_rows *more, const nc_block *row) {
    if (row->type == NC_RT_LOOP_BEGIN && !more->in_loop) {
        more->in_loop = true;
        memcpy(more->begin, more->in->position, sizeof more->begin);
    } else if (row->type == NC_RT_LOOP_END) {
        more->in->consistent &= !more->in_loop || is_closed(more);
        more->in_loop = more->closing = false;
    }
}

void more_rows_anew(struct more_rows *more) {
    more->piece = 0.0;
    more->in_loop = more->closing = false;
}

/* Back to where the loop begins. */
static void close_loop(struct more_rows *more, nc_block *row) {
    struct rows_in *in = more->in;
    double main = 0.0, others = 0.0;
    begin(in, row, NC_LINEAR);
    memcpy(row->end, more->begin, sizeof row->end);
    for (int i = 0; i < in->axes; i++) {
        double way = more->begin[i] - in->position[i];
        *(i < 3 ? &main : &others) += way * way;
    }
    row->length = row->length_min = sqrt(main > 0.0 ? main : others);
    row->feed = 50.0;
    memcpy(in->position, row->end, sizeof in->position);
    more->closing = true;
}

static bool any_row(struct more_rows *more, nc_block *row) {
    struct rows_in *in = more->in;
    switch (take_byte(&in->bytes) % 12) {
    case 0:
    case 1:
        return curve(more, row);
    case 2:
        return element(more, row);
    case 3:
        return motion(in, row);
    case 4:
    case 5:
        function(in, row);
        return true;
    case 6:
        event(in, row);
        return true;
    case 7:
        loop(in, row);
        return true;
    default:
        return fuzz_row(in, row);
    }
}

bool more_row(struct more_rows *more, nc_block *row) {
    if (more->piece > 0.0) {
        piece(more, row);
        return true;
    }
    if (more->closing) {
        begin(more->in, row, NC_RT_LOOP_END);
    } else if (!any_row(more, row)) {
        return false;
    }
    if (row->type == NC_RT_LOOP_END && more->in_loop && !is_closed(more)) {
        close_loop(more, row);
    }
    more_rows_see(more, row);
    return true;
}
