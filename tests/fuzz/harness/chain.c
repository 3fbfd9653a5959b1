#include "chain.h"

#include <stdlib.h>
#include <string.h>

#include "verdict.h"

struct batch batch_copy(const nc_block *rows,
                        int64_t count,
                        const double *pool,
                        int64_t pool_n) {
    struct batch batch = {.count = count, .pool_n = pool_n};
    batch.rows = malloc((size_t)(count ? count : 1) * sizeof *rows);
    batch.pool = malloc((size_t)(pool_n ? pool_n : 1) * sizeof *pool);
    if (count) {
        memcpy(batch.rows, rows, (size_t)count * sizeof *rows);
    }
    if (pool_n) {
        memcpy(batch.pool, pool, (size_t)pool_n * sizeof *pool);
    }
    return batch;
}

void batch_free(struct batch *batch) {
    free(batch->rows);
    free(batch->pool);
}

struct chain *chain_new(int axes, const double *start) {
    int third = axes > 2 ? 2 : -1;
    struct chain *chain = calloc(1, sizeof *chain);
    nc_smooth_config smooth = {.axes = axes,
                               .main_axis = {0, 1, third},
                               .accel = 3000,
                               .axis_feed = {300, 300, 300},
                               .turn_max = 0.5,
                               .rotary_tolerance = 0.01};
    nc_contour_config contour = {.axes = axes,
                                 .main_axis = {0, 1, third},
                                 .accel = 3000,
                                 .rapid = 300};
    chain->smooth = nc_smooth_new(&smooth, start);
    chain->contour = nc_contour_new(&contour, start);
    nc_offset_init(&chain->offset);
    chain->offset.axes = (uint8_t)axes;
    memcpy(chain->offset.main_axis,
           contour.main_axis,
           sizeof contour.main_axis);
    nc_offset_resync(&chain->offset, start);
    nc_contour_set_wait(chain->contour, NC_M, 20, 1);
    nc_contour_set_wait(chain->contour, NC_M, 21, 2);
    return chain;
}

void chain_free(struct chain *chain) {
    nc_smooth_free(chain->smooth);
    nc_contour_free(chain->contour);
    free(chain);
}

/* Behind an error compensation is off, as in RadiusCompensation. */
static struct batch compensate(nc_offset *offset,
                               const struct batch *in,
                               bool last) {
    size_t left = (size_t)in->count;
    size_t room = NC_OFFSET_GROWTH * (left + 2) + (size_t)offset->held
                  + (size_t)offset->has_prev;
    size_t total = 0, taken = 0, made = 0;
    const nc_block *next = in->rows;
    nc_block *out = malloc(room * sizeof *out);
    while (left) {
        int error = nc_offset_push(offset,
                                   next,
                                   left,
                                   &taken,
                                   out + total,
                                   room - total,
                                   &made);
        total += made;
        next += taken;
        left -= taken;
        if (error) {
            nc_offset_forget(offset);
        }
        if (!taken || made > room) {
            fuzz_broken("compensation: %zu taken, %zu made", taken, made);
            break;
        }
    }
    if (last && room - total >= (size_t)offset->held + NC_OFFSET_GROWTH) {
        if (nc_offset_drain(offset, out + total, room - total, &made)) {
            nc_offset_forget(offset);
        }
        total += made;
    }
    struct batch made_of =
        batch_copy(out, (int64_t)total, in->pool, in->pool_n);
    free(out);
    return made_of;
}

static struct batch round_corners(nc_contour *contour,
                                  const struct batch *in,
                                  bool last) {
    nc_contour_short too_short[NC_CONTOUR_SHORT];
    int64_t first = 0;
    while (first < in->count) { /* a refused row is left out */
        const nc_block *row = &in->rows[first++];
        nc_contour_push(contour, row, 1, in->pool, in->pool_n);
    }
    if (last) {
        nc_contour_drain(contour);
    }
    nc_contour_take_short(contour, too_short);
    struct batch out = {.count = nc_contour_rows(contour),
                        .pool_n = nc_contour_coefficients(contour)};
    out.rows = malloc((size_t)(out.count + 1) * sizeof *out.rows);
    out.pool = malloc((size_t)(out.pool_n + 1) * sizeof *out.pool);
    nc_contour_take(contour, out.rows, out.pool);
    return out;
}

/* `out` grows by what the smoothing has ready. */
static void take_smooth(nc_smooth *smooth, struct batch *out) {
    int64_t rows = nc_smooth_rows(smooth);
    int64_t pool = nc_smooth_coefficients(smooth);
    nc_block *end;
    out->rows =
        realloc(out->rows, (size_t)(out->count + rows + 1) * sizeof *out->rows);
    out->pool = realloc(out->pool,
                        (size_t)(out->pool_n + pool + 1) * sizeof *out->pool);
    end = out->rows + out->count;
    nc_smooth_take(smooth, end, out->pool + out->pool_n);
    for (int64_t i = 0; i < rows; i++) {
        end[i].pool += (uint32_t)out->pool_n;
    }
    out->count += rows;
    out->pool_n += pool;
}

static struct batch smoothed(nc_smooth *smooth,
                             const struct batch *in,
                             bool last) {
    struct batch out = {0};
    int64_t first = 0;
    while (first < in->count) {
        int64_t taken = nc_smooth_push(smooth,
                                       in->rows + first,
                                       in->count - first,
                                       in->pool,
                                       in->pool_n);
        if (taken == 0) {
            fuzz_broken("smoothing takes nothing");
            break;
        }
        first += taken < 0 ? 1 : taken; /* a refused row is left out */
        take_smooth(smooth, &out);
    }
    if (last) {
        nc_smooth_drain(smooth);
    }
    take_smooth(smooth, &out);
    return out;
}

struct batch chain_push(struct chain *chain,
                        const struct batch *batch,
                        bool last) {
    struct batch one = compensate(&chain->offset, batch, last);
    struct batch two = round_corners(chain->contour, &one, last);
    struct batch three = smoothed(chain->smooth, &two, last);
    batch_free(&one);
    batch_free(&two);
    return three;
}
