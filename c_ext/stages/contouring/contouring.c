/* Rows in, rows out: which blocks meet in a corner, what stands between them. */
#include "stages/contouring/contouring.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "stages/contouring/state.h"

#define SHORTEST 0.032 /* mm: shorter blocks are not rounded (message 120216) */
#define NOTHING 1e-7   /* mm: what is left of a block is left out */

typedef struct held_row {
    nc_block row;
    int skipped; /* index of a short block that may be left out, -1: no motion */
} held_row;

struct nc_contour {
    nc_contour_config cfg;
    contour_mode mode;      /* in force where the rows are read */
    double at[NC_AXES];     /* end of the last motion read */
    bool holding, stands_behind; /* stands_behind: nothing is rounded at the end of the block held */
    leg block;              /* the motion held */
    contour_mode block_mode;
    leg skipped[CONTOUR_SKIPPED];
    int n_skipped;
    held_row held[CONTOUR_HELD];
    int n_held;
    bool wait_behind;       /* a function that waits behind its block, of block ... */
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

nc_contour *nc_contour_new(const nc_contour_config *config, const double *start) {
    nc_contour *c = calloc(1, sizeof *c);
    if (!c) return NULL;
    c->cfg = *config;
    nc_contour_resync(c, start);
    return c;
}

void nc_contour_free(nc_contour *c) {
    if (!c) return;
    free(c->rows);
    free(c->pool);
    free(c);
}

void nc_contour_resync(nc_contour *c, const double *position) {
    memcpy(c->at, position, sizeof c->at);
    c->holding = c->wait_behind = false;
    c->n_held = c->n_skipped = 0;
}

void nc_contour_set_wait(nc_contour *c, int kind, int code, int how) {
    if (kind == NC_T) c->t_wait = (uint8_t)how;
    if (kind == NC_S) c->s_wait = (uint8_t)how;
    if (code < 0 || code >= CONTOUR_NUMBERS) return;
    if (kind == NC_M) c->m_wait[code] = (uint8_t)how;
    if (kind == NC_H) c->h_wait[code] = (uint8_t)how;
}

int nc_contour_idle(const nc_contour *c) { return !c->mode.active && !c->holding; }

void nc_contour_get_stats(const nc_contour *c, nc_contour_stats *out) { *out = c->stats; }

int nc_contour_take_short(nc_contour *c, nc_contour_short *out) {
    int n = c->n_short;
    memcpy(out, c->too_short, sizeof *out * (size_t)n);
    c->n_short = 0;
    return n;
}

/* ---- output ----------------------------------------------------------------------------------------------------- */

static bool grow(void **data, size_t *room, size_t need, size_t size) {
    if (need <= *room) return true;
    size_t more = *room ? 2 * *room : 256;
    while (more < need) more *= 2;
    void *made = realloc(*data, more * size);
    if (!made) return false;
    *data = made;
    *room = more;
    return true;
}

static void emit(nc_contour *c, const nc_block *row) {
    if (!grow((void **)&c->rows, &c->room_rows, c->n_rows + 1, sizeof *c->rows)) {
        c->failed = true;
        return;
    }
    c->rows[c->n_rows++] = *row;
}

static uint32_t emit_pool(nc_contour *c, const double *data, size_t n) {
    uint32_t at = (uint32_t)c->n_pool;
    if (!grow((void **)&c->pool, &c->room_pool, c->n_pool + n, sizeof *c->pool)) {
        c->failed = true;
        return 0;
    }
    memcpy(c->pool + c->n_pool, data, n * sizeof *data);
    c->n_pool += n;
    return at;
}

int64_t nc_contour_rows(const nc_contour *c) { return (int64_t)c->n_rows; }
int64_t nc_contour_coefficients(const nc_contour *c) { return (int64_t)c->n_pool; }

void nc_contour_take(nc_contour *c, nc_block *rows, double *pool) {
    if (c->n_rows) memcpy(rows, c->rows, sizeof *rows * c->n_rows);
    if (c->n_pool) memcpy(pool, c->pool, sizeof *pool * c->n_pool);
    c->n_rows = c->n_pool = 0;
}

static void emit_block(nc_contour *c, const leg *l) {
    if (l->length > NOTHING) emit(c, &l->row);
}

/* The block held and everything behind it, as programmed. */
static void release(nc_contour *c) {
    if (c->holding) emit_block(c, &c->block);
    for (int i = 0; i < c->n_held; i++) emit(c, &c->held[i].row);
    c->holding = false;
    c->n_held = c->n_skipped = 0;
}

static void hold(nc_contour *c, const nc_block *row, int skipped) {
    c->held[c->n_held].row = *row;
    c->held[c->n_held++].skipped = skipped;
}

/* ---- corners ---------------------------------------------------------------------------------------------------- */

static bool is_marker(const nc_block *row) {
    return row->type == NC_MARKER || row->type == NC_DISTANCE_RESET || row->type == NC_EVENT;
}

static int wait_of(const nc_contour *c, const nc_block *row) {
    switch (row->type) {
    case NC_M: return row->code >= 0 && row->code < CONTOUR_NUMBERS ? c->m_wait[row->code] : 0;
    case NC_H: return row->code >= 0 && row->code < CONTOUR_NUMBERS ? c->h_wait[row->code] : 0;
    case NC_T: return c->t_wait;
    case NC_S: return c->s_wait;
    default: return 0;
    }
}

/* Rows between the blocks: functions where the mode wants them; markers, and functions that mean the end of the second block,
 * behind the curve. */
static void emit_held(nc_contour *c, uint8_t place) {
    for (int i = 0; i < c->n_held; i++) {
        const held_row *h = &c->held[i];
        if (h->skipped >= 0) continue;
        bool last = is_marker(&h->row) || wait_of(c, &h->row) == 2;
        if ((last ? NC_CONTOUR_POST : c->block_mode.action) == place) emit(c, &h->row);
    }
}

static void emit_curve(nc_contour *c, const corner *k, int half, const leg *like, const double *end, double feed_most) {
    nc_block row = like->row;
    const nc_block *number = &c->block.row;
    row.type = NC_POLYNOMIAL;
    row.plane = 0;
    row.degree = 4;
    row.angle = 1.0;
    row.center[0] = row.center[1] = row.radius = row.programmed_radius = 0.0;
    row.length = row.length_min = k->length[half];
    row.n = number->n;
    row.line = number->line;
    row.count = number->count;
    row.file = number->file;
    row.flags = like->row.flags & NC_RAPID;
    if (feed_most > 0.0 && (row.flags & NC_RAPID || row.feed > feed_most)) {
        row.flags = 0;
        row.feed = feed_most;
    }
    memcpy(row.end, end, sizeof(double) * (size_t)c->cfg.axes);
    row.pool = emit_pool(c, &k->coef[half][0][0], 5 * (size_t)c->cfg.axes);
    emit(c, &row);
}

static double slower_feed(const leg *a, const leg *b) {
    double fa = a->row.flags & NC_RAPID ? INFINITY : a->row.feed, fb = b->row.flags & NC_RAPID ? INFINITY : b->row.feed;
    double f = fmin(fa, fb);
    return isfinite(f) ? f : 0.0;
}

static void round_corner(nc_contour *c, leg *next, const corner *k) {
    leg_cut_start(&c->cfg, next, k->post);
    leg_cut_end(&c->cfg, &c->block, k->pre);
    double most = c->block_mode.const_vel ? slower_feed(&c->block, next) : 0.0;
    emit_block(c, &c->block);
    emit_held(c, NC_CONTOUR_PRE);
    emit_curve(c, k, 0, &c->block, k->mid, most);
    emit_held(c, NC_CONTOUR_INTER);
    emit_curve(c, k, 1, next, next->start, most);
    emit_held(c, NC_CONTOUR_POST);
    c->stats.corners++;
    c->stats.skipped += (uint64_t)c->n_skipped;
    c->stats.deviation = fmax(c->stats.deviation, k->deviation);
    c->holding = false;
    c->n_held = c->n_skipped = 0;
}

static bool moves_main(const nc_contour *c, const leg *l) {
    double sum = 0.0;
    for (int i = 0; i < 3; i++) {
        int a = c->cfg.main_axis[i];
        if (a >= 0) sum += fabs(l->row.end[a] - l->start[a]);
    }
    return l->row.type == NC_CIRCULAR || (l->row.type == NC_LINEAR && sum > 1e-9);
}

static void note_short(nc_contour *c, const leg *l) {
    if (c->n_short == NC_CONTOUR_SHORT) return;
    c->too_short[c->n_short++] = (nc_contour_short){l->whole, l->row.line, l->row.file, 0};
}

static bool long_enough(nc_contour *c, const leg *l) {
    if (l->whole >= SHORTEST) return true;
    note_short(c, l);
    return false;
}

/* Short blocks are passed over; the corner is made with the next longer one. */
static bool pass_over(nc_contour *c, const leg *next) {
    const contour_mode *m = &c->block_mode;
    double relevant = m->relevant_path > 0.0 ? fmax(m->relevant_path, SHORTEST) : 0.0;
    if (!(next->whole < relevant) || (m->relevant_track > 0.0 && leg_track(&c->cfg, next) >= m->relevant_track)) return false;
    if (next->row.flags & NC_EXACT_STOP || c->n_skipped == CONTOUR_SKIPPED || c->n_held == CONTOUR_HELD) return false;
    c->skipped[c->n_skipped] = *next;
    hold(c, &next->row, c->n_skipped++);
    return true;
}

static void take_motion(nc_contour *c, const nc_block *row, const double *pool) {
    leg next;
    nc_block copy = *row;
    if (row->type == NC_POLYNOMIAL) copy.pool = emit_pool(c, pool + row->pool, (size_t)c->cfg.axes * (row->degree + 1u));
    memset(&next, 0, sizeof next);
    leg_set(&c->cfg, &next, &copy, c->at);
    bool corner_here = c->holding && !c->stands_behind && moves_main(c, &c->block) && moves_main(c, &next);
    memcpy(c->at, row->end, sizeof c->at);
    if (corner_here && pass_over(c, &next)) return;
    if (corner_here && long_enough(c, &c->block) && long_enough(c, &next)) {
        corner k;
        bool irregular;
        if (corner_make(&c->cfg, &c->block_mode, &c->block, &next, c->skipped, c->n_skipped, &k, &irregular)) round_corner(c, &next, &k);
        c->stats.irregular += irregular;
    }
    release(c);
    c->stands_behind = row->flags & NC_EXACT_STOP || (c->wait_behind && c->wait_count == row->count);
    c->wait_behind = false;
    if (c->mode.active && row->type != NC_POLYNOMIAL) {
        c->block = next;
        c->block_mode = c->mode;
        c->holding = true;
    } else {
        emit_block(c, &next);
    }
}

/* ---- rows that are no motion ------------------------------------------------------------------------------------ */

static void set_mode(nc_contour *c, const nc_block *row) {
    contour_mode *m = &c->mode;
    m->mode = row->code;
    m->active = row->plane != 0;
    m->const_vel = row->flags & NC_CONTOUR_CONST_VEL;
    m->action = row->degree;
    m->path_dev = row->value;
    m->pre = row->center[0];
    m->post = row->center[1];
    m->track_dev = row->radius;
    m->relevant_path = row->programmed_radius;
    m->relevant_track = row->length_min;
    m->remain = row->feed;
    m->max_angle = row->angle;
    m->share = row->length;
    memcpy(m->interim, row->end, sizeof m->interim);
}

/* The path stands here, or the row means this very place. */
static bool breaks(const nc_contour *c, const nc_block *row) {
    if (row->flags & NC_STANDSTILL || row->type == NC_DWELL || row->type == NC_FLUSH || row->type == NC_RT_LOOP_BEGIN ||
        row->type == NC_RT_LOOP_END || row->type == NC_SMOOTHING)
        return true;
    if (row->type == NC_EVENT) return row->code == NC_EVENT_EXPL_SYN;
    return wait_of(c, row) == 1;
}

static void take_other(nc_contour *c, const nc_block *row) {
    if (row->type == NC_CONTOUR) {
        set_mode(c, row);
        return;
    }
    if (wait_of(c, row) == 2) {
        c->wait_behind = true;
        c->wait_count = row->count;
        if (c->holding && row->count == c->block.row.count) c->stands_behind = true;
    }
    if (c->holding && (breaks(c, row) || c->n_held == CONTOUR_HELD)) release(c);
    if (c->holding) hold(c, row, -1);
    else emit(c, row);
}

int nc_contour_push(nc_contour *c, const nc_block *rows, int64_t n, const double *pool, int64_t pool_n) {
    (void)pool_n;
    for (int64_t i = 0; i < n && !c->failed; i++) {
        if (rows[i].type <= NC_POLYNOMIAL) take_motion(c, &rows[i], pool);
        else take_other(c, &rows[i]);
    }
    return c->failed ? -1 : 0;
}

int nc_contour_drain(nc_contour *c) {
    release(c);
    return c->failed ? -1 : 0;
}
