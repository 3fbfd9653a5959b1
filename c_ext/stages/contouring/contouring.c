/* Rows in, rows out: which blocks meet in a corner, what stands between them.
 */
#include "stages/contouring/contouring.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "rows/planes.h"
#include "rows/pool.h"
#include "stages/contouring/corner.h"
#include "stages/contouring/tuning.h"

#define CONTOUR_SKIPPED 16 /* short blocks between two rounded ones */
#define CONTOUR_HELD 512   /* rows between two motions */
#define CONTOUR_NUMBERS 65536

typedef struct held_row {
    nc_block row;
    int skipped; /* index of a short block that may be left out, -1: no motion
                  */
} held_row;

struct nc_contour {
    nc_contour_config cfg;
    struct contour_mode mode;    /* in force where the rows are read */
    double at[NC_AXES];          /* end of the last motion read */
    bool holding, stands_behind; /* stands_behind: nothing is rounded at the end
                                    of the block held */
    struct leg block;            /* the motion held */
    struct contour_mode block_mode;
    struct leg skipped[CONTOUR_SKIPPED];
    int n_skipped;
    struct held_row held[CONTOUR_HELD];
    int n_held;
    bool wait_behind; /* a function that waits behind its block, of block ... */
    uint32_t wait_count;
    nc_block *rows;
    size_t n_rows, room_rows;
    double *pool;
    size_t n_pool, room_pool;
    bool failed; /* no memory */
    nc_contour_stats stats;
    nc_contour_short too_short[NC_CONTOUR_SHORT];
    int n_short;
    uint8_t t_wait, s_wait;
    uint8_t m_wait[CONTOUR_NUMBERS], h_wait[CONTOUR_NUMBERS];
};

nc_contour *nc_contour_new(const nc_contour_config *config,
                           const double *start) {
    nc_contour *contour = calloc(1, sizeof *contour);
    if (!contour) {
        return NULL;
    }
    contour->cfg = *config;
    nc_contour_resync(contour, start);
    return contour;
}

void nc_contour_free(nc_contour *contour) {
    if (!contour) {
        return;
    }
    free(contour->rows);
    free(contour->pool);
    free(contour);
}

void nc_contour_resync(nc_contour *contour, const double *position) {
    memcpy(contour->at, position, sizeof contour->at);
    contour->holding = false;
    contour->wait_behind = false;
    contour->n_held = 0;
    contour->n_skipped = 0;
}

void nc_contour_set_wait(nc_contour *contour, int kind, int code, int how) {
    if (kind == NC_T) {
        contour->t_wait = (uint8_t)how;
    }
    if (kind == NC_S) {
        contour->s_wait = (uint8_t)how;
    }
    if (code < 0 || code >= CONTOUR_NUMBERS) {
        return;
    }
    if (kind == NC_M) {
        contour->m_wait[code] = (uint8_t)how;
    }
    if (kind == NC_H) {
        contour->h_wait[code] = (uint8_t)how;
    }
}

int nc_contour_idle(const nc_contour *contour) {
    return !contour->mode.active && !contour->holding;
}

void nc_contour_get_stats(const nc_contour *contour, nc_contour_stats *out) {
    *out = contour->stats;
}

int nc_contour_take_short(nc_contour *contour, nc_contour_short *out) {
    int count = contour->n_short;
    memcpy(out, contour->too_short, sizeof *out * (size_t)count);
    contour->n_short = 0;
    return count;
}

static bool grow(void **data, size_t *room, size_t need, size_t size) {
    if (need <= *room) {
        return true;
    }
    size_t more = *room ? 2 * *room : 256;
    while (more < need) {
        more *= 2;
    }
    void *made = realloc(*data, more * size);
    if (!made) {
        return false;
    }
    *data = made;
    *room = more;
    return true;
}

static void emit(nc_contour *contour, const nc_block *row) {
    if (!grow((void **)&contour->rows,
              &contour->room_rows,
              contour->n_rows + 1,
              sizeof *contour->rows)) {
        contour->failed = true;
        return;
    }
    contour->rows[contour->n_rows++] = *row;
}

static uint32_t emit_pool(nc_contour *contour,
                          const double *data,
                          size_t count) {
    uint32_t at = (uint32_t)contour->n_pool;
    if (!grow((void **)&contour->pool,
              &contour->room_pool,
              contour->n_pool + count,
              sizeof *contour->pool)) {
        contour->failed = true;
        return 0;
    }
    memcpy(contour->pool + contour->n_pool, data, count * sizeof *data);
    contour->n_pool += count;
    return at;
}

int64_t nc_contour_rows(const nc_contour *contour) {
    return (int64_t)contour->n_rows;
}
int64_t nc_contour_coefficients(const nc_contour *contour) {
    return (int64_t)contour->n_pool;
}

void nc_contour_take(nc_contour *contour, nc_block *rows, double *pool) {
    if (contour->n_rows) {
        memcpy(rows, contour->rows, sizeof *rows * contour->n_rows);
    }
    if (contour->n_pool) {
        memcpy(pool, contour->pool, sizeof *pool * contour->n_pool);
    }
    contour->n_rows = 0;
    contour->n_pool = 0;
}

static void emit_block(nc_contour *contour, const struct leg *leg) {
    if (leg->length > 0.0) {
        emit(contour, &leg->row);
    }
}

/* The block held and everything behind it, as programmed. */
static void release(nc_contour *contour) {
    if (contour->holding) {
        emit_block(contour, &contour->block);
    }
    for (int i = 0; i < contour->n_held; i++) {
        emit(contour, &contour->held[i].row);
    }
    contour->holding = false;
    contour->n_held = 0;
    contour->n_skipped = 0;
}

static void hold(nc_contour *contour, const nc_block *row, int skipped) {
    contour->held[contour->n_held].row = *row;
    contour->held[contour->n_held++].skipped = skipped;
}

static bool is_marker(const nc_block *row) {
    return row->type == NC_MARKER || row->type == NC_DISTANCE_RESET
           || row->type == NC_EVENT;
}

static int wait_of(const nc_contour *contour, const nc_block *row) {
    switch (row->type) {
    case NC_M:
        return row->code >= 0 && row->code < CONTOUR_NUMBERS
                   ? contour->m_wait[row->code]
                   : 0;
    case NC_H:
        return row->code >= 0 && row->code < CONTOUR_NUMBERS
                   ? contour->h_wait[row->code]
                   : 0;
    case NC_T:
        return contour->t_wait;
    case NC_S:
        return contour->s_wait;
    default:
        return 0;
    }
}

/* Rows between the blocks: functions where the mode wants them; markers, and
 * functions that mean the end of the second block, behind the curve. */
static void emit_held(nc_contour *contour, uint8_t place) {
    for (int i = 0; i < contour->n_held; i++) {
        const struct held_row *held_row = &contour->held[i];
        if (held_row->skipped >= 0) {
            continue;
        }
        bool last =
            is_marker(&held_row->row) || wait_of(contour, &held_row->row) == 2;
        if ((last ? NC_CONTOUR_POST : contour->block_mode.action) == place) {
            emit(contour, &held_row->row);
        }
    }
}

static void emit_curve(nc_contour *contour,
                       const struct corner *corner,
                       int half,
                       const struct leg *like,
                       const double *end,
                       double feed_most) {
    nc_block row = like->row;
    const nc_block *number = &contour->block.row;
    row.type = NC_POLYNOMIAL;
    row.plane = 0;
    row.degree = 4;
    row.angle = 1.0;
    row.center[0] = 0.0;
    row.center[1] = 0.0;
    row.radius = 0.0;
    row.programmed_radius = 0.0;
    row.length = row.length_min = corner->length[half];
    row.n = number->n;
    row.line = number->line;
    row.count = number->count;
    row.file = number->file;
    row.flags = like->row.flags & NC_RAPID;
    if (feed_most > 0.0 && (row.flags & NC_RAPID || row.feed > feed_most)) {
        row.flags = 0;
        row.feed = feed_most;
    }
    memcpy(row.end, end, sizeof(double) * (size_t)contour->cfg.axes);
    row.pool = emit_pool(contour,
                         &corner->coef[half][0][0],
                         5 * (size_t)contour->cfg.axes);
    emit(contour, &row);
}

static double slower_feed(const struct leg *leg, const struct leg *leg_b) {
    double fa = leg->row.flags & NC_RAPID ? INFINITY : leg->row.feed;
    double fb = leg_b->row.flags & NC_RAPID ? INFINITY : leg_b->row.feed;
    double slower = fmin(fa, fb);
    return isfinite(slower) ? slower : 0.0;
}

static void round_corner(nc_contour *contour,
                         struct leg *next,
                         const struct corner *corner) {
    leg_cut_start(&contour->cfg, next, corner->post);
    leg_cut_end(&contour->cfg, &contour->block, corner->pre);
    double most = contour->block_mode.const_vel
                      ? slower_feed(&contour->block, next)
                      : 0.0;
    emit_block(contour, &contour->block);
    emit_held(contour, NC_CONTOUR_PRE);
    emit_curve(contour, corner, 0, &contour->block, corner->mid, most);
    emit_held(contour, NC_CONTOUR_INTER);
    emit_curve(contour, corner, 1, next, next->start, most);
    emit_held(contour, NC_CONTOUR_POST);
    contour->stats.corners++;
    contour->stats.skipped += (uint64_t)contour->n_skipped;
    contour->stats.deviation =
        fmax(contour->stats.deviation, corner->deviation);
    contour->holding = false;
    contour->n_held = 0;
    contour->n_skipped = 0;
}

static bool moves_main(const nc_contour *contour, const struct leg *leg) {
    double sum = 0.0;
    for (int i = 0; i < 3; i++) {
        int axis = contour->cfg.main_axis[i];
        if (axis >= 0) {
            sum += fabs(leg->row.end[axis] - leg->start[axis]);
        }
    }
    return leg->row.type == NC_CIRCULAR
           || (leg->row.type == NC_LINEAR && sum > 1e-9);
}

static void note_short(nc_contour *contour, const struct leg *leg) {
    if (contour->n_short == NC_CONTOUR_SHORT) {
        return;
    }
    contour->too_short[contour->n_short++] =
        (nc_contour_short){leg->whole, leg->row.line, leg->row.file, 0};
}

static bool long_enough(nc_contour *contour, const struct leg *leg) {
    if (leg->whole >= SHORTEST) {
        return true;
    }
    note_short(contour, leg);
    return false;
}

/* Short blocks are passed over; the corner is made with the next longer one. */
static bool pass_over(nc_contour *contour, const struct leg *next) {
    const struct contour_mode *contour_mode = &contour->block_mode;
    double relevant = contour_mode->relevant_path > 0.0
                          ? fmax(contour_mode->relevant_path, SHORTEST)
                          : 0.0;
    if (!(next->whole < relevant)
        || (contour_mode->relevant_track > 0.0
            && leg_track(&contour->cfg, next)
                   >= contour_mode->relevant_track)) {
        return false;
    }
    if (next->row.flags & NC_EXACT_STOP || contour->n_skipped == CONTOUR_SKIPPED
        || contour->n_held == CONTOUR_HELD) {
        return false;
    }
    contour->skipped[contour->n_skipped] = *next;
    hold(contour, &next->row, contour->n_skipped++);
    return true;
}

static void take_motion(nc_contour *contour,
                        const nc_block *row,
                        const double *pool) {
    struct leg next;
    nc_block copy = *row;
    if (row->type == NC_POLYNOMIAL) {
        copy.pool = emit_pool(contour,
                              pool + row->pool,
                              (size_t)contour->cfg.axes * (row->degree + 1u));
    }
    memset(&next, 0, sizeof next);
    leg_set(&contour->cfg, &next, &copy, contour->at);
    bool corner_here = contour->holding && !contour->stands_behind
                       && moves_main(contour, &contour->block)
                       && moves_main(contour, &next);
    memcpy(contour->at, row->end, sizeof contour->at);
    if (corner_here && pass_over(contour, &next)) {
        return;
    }
    if (corner_here && long_enough(contour, &contour->block)
        && long_enough(contour, &next)) {
        struct corner corner;
        bool irregular;
        if (corner_make(&contour->cfg,
                        &contour->block_mode,
                        &contour->block,
                        &next,
                        contour->skipped,
                        contour->n_skipped,
                        &corner,
                        &irregular)) {
            round_corner(contour, &next, &corner);
        }
        contour->stats.irregular += irregular;
    }
    release(contour);
    contour->stands_behind =
        row->flags & NC_EXACT_STOP
        || (contour->wait_behind && contour->wait_count == row->count);
    contour->wait_behind = false;
    if (contour->mode.active && row->type != NC_POLYNOMIAL) {
        contour->block = next;
        contour->block_mode = contour->mode;
        contour->holding = true;
    } else {
        emit_block(contour, &next);
    }
}

static void set_mode(nc_contour *contour, const nc_block *row) {
    struct contour_mode *contour_mode = &contour->mode;
    contour_mode->mode = row->code;
    contour_mode->active = row->plane != 0;
    contour_mode->const_vel = row->flags & NC_CONTOUR_CONST_VEL;
    contour_mode->action = row->degree;
    contour_mode->path_dev = row->value;
    contour_mode->pre = row->center[0];
    contour_mode->post = row->center[1];
    contour_mode->track_dev = row->radius;
    contour_mode->relevant_path = row->programmed_radius;
    contour_mode->relevant_track = row->length_min;
    contour_mode->remain = row->feed;
    contour_mode->max_angle = row->angle;
    contour_mode->share = row->length;
    memcpy(contour_mode->interim, row->end, sizeof contour_mode->interim);
}

/* The path stands here, or the row means this very place. */
static bool breaks(const nc_contour *contour, const nc_block *row) {
    if (row->flags & NC_STANDSTILL || row->type == NC_DWELL
        || row->type == NC_FLUSH || row->type == NC_RT_LOOP_BEGIN
        || row->type == NC_RT_LOOP_END || row->type == NC_SMOOTHING) {
        return true;
    }
    if (row->type == NC_EVENT) {
        return row->code == NC_EVENT_EXPL_SYN;
    }
    return wait_of(contour, row) == 1;
}

static void take_other(nc_contour *contour, const nc_block *row) {
    if (row->type == NC_CONTOUR) {
        set_mode(contour, row);
        return;
    }
    if (wait_of(contour, row) == 2) {
        contour->wait_behind = true;
        contour->wait_count = row->count;
        if (contour->holding && row->count == contour->block.row.count) {
            contour->stands_behind = true;
        }
    }
    if (contour->holding
        && (breaks(contour, row) || contour->n_held == CONTOUR_HELD)) {
        release(contour);
    }
    if (contour->holding) {
        hold(contour, row, -1);
    } else {
        emit(contour, row);
    }
}

int nc_contour_push(nc_contour *contour,
                    const nc_block *rows,
                    int64_t count,
                    const double *pool,
                    int64_t pool_n) {
    for (int64_t i = 0; i < count && !contour->failed; i++) {
        if (!row_in_pool(&rows[i], contour->cfg.axes, pool_n)
            || !row_in_plane(&rows[i], contour->cfg.main_axis)) {
            return -2;
        }
        if (rows[i].type <= NC_POLYNOMIAL) {
            take_motion(contour, &rows[i], pool);
        } else {
            take_other(contour, &rows[i]);
        }
    }
    return contour->failed ? -1 : 0;
}

int nc_contour_drain(nc_contour *contour) {
    release(contour);
    return contour->failed ? -1 : 0;
}
