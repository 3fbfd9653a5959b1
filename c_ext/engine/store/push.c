/* SDA's end of the ring: prepared rows become elements (HLI facts) and pieces (axis-space geometry). */
#include <math.h>
#include <stddef.h>
#include "engine/state/state.h"

#define LOOP_PIECES_MAX (STORE_AHEAD / 2) /* a real-time loop is held whole in the store */

bool ring_has_room(engine *e) {
    if (e->store_head + 4 * BEHIND_MAX >= ATOMIC_GET(e->store_floor) + e->store_mask) return false;
    if (!techno_has_room(e)) return false;
    return e->element_head < ATOMIC_GET(e->geo.active) + (e->element_mask + 1) / 2;
}

static bool row_is_finite(const engine *e, const nc_block *r) {
    for (int i = 0; i < e->cfg.axis_count; i++)
        if (!isfinite(r->end[i])) return false;
    return isfinite(r->length) && isfinite(r->feed) && isfinite(r->center[0]) && isfinite(r->center[1]) &&
           isfinite(r->radius) && isfinite(r->programmed_radius) && isfinite(r->angle) && isfinite(r->value) &&
           isfinite(r->length_min) && isfinite(r->end_speed);
}

/* A motion in other coordinates than the axes': its tangents, kept for the element that is pushed next. */
static bool tangents_are_given(engine *e, const nc_block *r, const double *pool, int64_t pool_n) {
    if (!pool || (int64_t)r->pool + 6 > pool_n || !(r->length > 0)) return false;
    for (int i = 0; i < 6; i++) {
        e->next_tangents[i] = pool[r->pool + i];
        if (!isfinite(e->next_tangents[i])) return false;
    }
    return true;
}

static bool row_is_supported(engine *e, const nc_block *r, const double *pool, int64_t pool_n) {
    if (r->type <= NC_POLYNOMIAL && r->flags & NC_ELEMENT && r->degree == NC_TANGENTS)
        return tangents_are_given(e, r, pool, pool_n);
    if (r->flags & NC_ELEMENT && r->type == NC_POLYNOMIAL) return false;
    if (r->flags & NC_PIECE && !(r->value >= 0 && e->element_head > 0)) return false;
    switch (r->type) {
    case NC_LINEAR:
        return r->length > 0 && (r->feed > 0 || (r->flags & NC_RAPID));
    case NC_CIRCULAR: {
        if (r->plane < 17 || r->plane > 19 || !(r->length > 0) || !(r->radius > 0) || r->angle == 0.0) return false;
        for (int i = 0; i < 3; i++)
            if (e->cfg.main[i] < 0 && i != (r->plane == 17 ? 2 : r->plane == 18 ? 1 : 0)) return false;
        return r->feed > 0 || (r->flags & NC_RAPID);
    }
    case NC_POLYNOMIAL:
        return r->length > 0 && r->degree >= 1 && r->degree < CURVE_ORDER && r->angle > 0 &&
               (r->feed > 0 || (r->flags & NC_RAPID)) && curve_row_check(e, r, pool, pool_n);
    case NC_DWELL:
        return r->value >= 0;
    case NC_M: case NC_H: case NC_S: case NC_T: case NC_MARKER: case NC_DISTANCE_RESET: case NC_FLUSH: case NC_EVENT:
        return true;
    case NC_DYNAMICS:
        return limits_row_check(e, r);
    case NC_RT_LOOP_BEGIN:
        return !e->in_loop;
    case NC_RT_LOOP_END:
        return e->in_loop;
    default:
        return false;
    }
}

/* Unit tangent of the three main axes; false where none of them moves. */
static bool main_tangent(const engine *e, const double *u, double *t) {
    double norm = 0.0;
    for (int i = 0; i < 3; i++) {
        t[i] = e->cfg.main[i] < 0 ? 0.0 : u[e->cfg.main[i]];
        norm += t[i] * t[i];
    }
    norm = sqrt(norm);
    if (norm < 1e-12) return false;
    for (int i = 0; i < 3; i++) t[i] /= norm;
    return true;
}

/* Angle between two unit vectors, exact near 0 and pi. */
double angle_between(const double *a, const double *b) {
    double minus = 0.0, plus = 0.0;
    for (int i = 0; i < 3; i++) {
        minus += (a[i] - b[i]) * (a[i] - b[i]);
        plus += (a[i] + b[i]) * (a[i] + b[i]);
    }
    return 2.0 * atan2(sqrt(minus), sqrt(plus));
}

static double tangent_variation(engine *e, const piece *p) {
    double in[3], out[3];
    double angle = 0.0;
    if (main_tangent(e, p->tangent_in, in)) {
        if (e->has_tangent) angle = angle_between(e->last_tangent, in);
        if (main_tangent(e, p->tangent_out, out)) {
            memcpy(e->last_tangent, out, sizeof out);
            e->has_tangent = true;
        }
    }
    return angle;
}

static void push_element(engine *e, const piece *p, const nc_block *row) {
    element *el = element_at(e, e->element_head);
    __atomic_thread_fence(__ATOMIC_RELEASE); /* who sees the slot change sees at least the present head (docs: ring.pml) */
    HLI_CONTOUR_LOOKAHEAD_BLOCK *f = &el->facts;
    memset(el, 0, sizeof *el);
    f->block_type = row->type == NC_CIRCULAR     ? HLI_CLAH_CIRCULAR
                    : row->type == NC_POLYNOMIAL ? HLI_CLAH_POLYNOMIAL
                                                 : HLI_CLAH_LINEAR;
    f->block_number = row->n;
    f->block_count_r = row->count;
    f->start_position = e->distance;
    f->length = row->length * TENTH_UM;
    f->length_min = row->length_min * TENTH_UM;
    if (row->type == NC_CIRCULAR) {
        f->programmed_radius = row->programmed_radius * TENTH_UM;
        f->compensated_radius = row->radius * TENTH_UM;
        f->circle_angle = row->angle;
    }
    f->tangent_variation = tangent_variation(e, p);
    el->epoch = e->push_epoch;
    if (e->in_loop && e->element_head == store_at(e, e->loop_begin)->element) main_tangent(e, p->tangent_in, e->loop_tangent);
    e->distance = f->start_position + f->length;
    log_element(e, el);
    ATOMIC_SET(e->element_head, e->element_head + 1);
}

/* The next place of the store, cleared, with what every row has. */
piece *store_slot(engine *e, const nc_block *row) {
    piece *p = store_at(e, e->store_head);
    memset(p, 0, offsetof(piece, capped));
    p->type = row->type;
    p->n = row->n;
    p->count = row->count;
    p->line = row->line;
    p->flags = row->flags;
    p->origin = e->store_head;
    p->row = e->rows_taken;
    p->dir = 1;
    return p;
}

void store_publish(engine *e) { ATOMIC_SET(e->store_head, e->store_head + 1); }

/* What a motion row says of its piece, but for where that lies on the path. */
void push_piece(engine *e, piece *p, const nc_block *row) {
    memcpy(p->start, e->last_end, sizeof p->start);
    p->limits = e->limits[row->flags & NC_RAPID ? 1 : 0];
    if (e->carried.rows) carry_build(e, p, row);
    else piece_build(e, p, row);
    p->stop_before = e->stop_pending || !e->has_motion_piece;
    p->new_block = e->has_motion_piece && e->last_count != p->count;
    p->m01 = e->m01_pending;
    e->m01_pending = false;
    p->gated = e->has_pending_gate;
    p->need = e->pending_gate;
    e->has_pending_gate = false;
    p->stop_after = row->flags & NC_EXACT_STOP;
    e->stop_pending = p->stop_after;
    p->entry_speed = e->end_speed > 0 ? e->end_speed : NEVER;
    e->end_speed = row->end_speed;
    p->path0 = e->pushed_path;
    p->whole = p->length;
    memcpy(e->last_end, row->end, sizeof e->last_end);
    e->last_count = p->count;
    e->has_motion_piece = true;
}

static void push_motion(engine *e, piece *p, const nc_block *row) {
    const carried before = e->carried;
    push_piece(e, p, row);
    p->path_rate = p->dist_rate = row->length / p->length;
    e->carried.rows = 0;
    if (row->flags & NC_PIECE) {
        map_piece(e, p, row->value + (before.rows ? before.programmed : 0.0));
        if (row->flags & NC_BY_PARAMETER) p->path_rate = p->dist_rate;
    } else {
        p->element = e->element_head;
        p->dist0 = e->distance / TENTH_UM;
        if (before.rows && p->kind != PIECE_CURVE) {
            push_programmed(e, row);
        } else {
            push_element(e, p, row);
            memcpy(e->element_end, row->end, sizeof e->element_end);
        }
        map_behind_element(e);
    }
    e->pushed_path += p->length * p->path_rate;
}

/* A programmed motion that smoothed pieces execute: an element without a piece. */
void push_programmed(engine *e, const nc_block *row) {
    piece p;
    memset(&p, 0, sizeof p);
    memcpy(p.start, e->element_end, sizeof p.start);
    if (row->degree == NC_TANGENTS) {
        for (int i = 0; i < 3; i++) {
            if (e->cfg.main[i] < 0) continue;
            p.tangent_in[e->cfg.main[i]] = e->next_tangents[i];
            p.tangent_out[e->cfg.main[i]] = e->next_tangents[3 + i];
        }
    } else {
        piece_build(e, &p, row);
    }
    push_element(e, &p, row);
    memcpy(e->element_end, row->end, sizeof e->element_end);
}

/* #RT WHILE .. #RT ENDWHILE: both ends know each other. Behind the loop the distance is not known until it is left. */
static void push_loop(engine *e, piece *p, const nc_block *row) {
    if (row->type == NC_RT_LOOP_BEGIN) {
        e->in_loop = true;
        e->loop_begin = e->store_head;
        e->loop_path = e->pushed_path;
        log_loop_begin(e);
        return;
    }
    p->mate = e->loop_begin;
    p->value = e->pushed_path - e->loop_path;
    p->flags |= store_at(e, e->loop_begin)->flags & NC_MODULO;
    store_at(e, e->loop_begin)->mate = e->store_head;
    store_at(e, e->loop_begin)->value = p->value;
    e->in_loop = false;
    e->push_epoch++;
    log_loop_end(e, p->value * TENTH_UM);
}

static bool is_m01(const nc_block *row) { return row->type == NC_M && row->code == 1; }

static bool stops(const nc_block *row) {
    return row->type == NC_DWELL || ((row->flags & NC_STANDSTILL) && !is_m01(row));
}

static void push_event(engine *e, piece *p, const nc_block *row) {
    p->kind = PIECE_EVENT;
    p->element = e->element_head;
    p->code = row->code;
    p->value = row->value;
    memcpy(p->end, e->last_end, sizeof p->end);
    if (stops(row)) e->stop_pending = true;
    p->stop_before = stops(row);
    if (is_m01(row)) p->m01 = e->m01_pending = true;
    if (row->type == NC_MARKER) log_marker(e, row);
    if (row->type == NC_RT_LOOP_BEGIN || row->type == NC_RT_LOOP_END) push_loop(e, p, row);
    if (row->type == NC_DISTANCE_RESET) {
        p->mate = e->epoch_element;
        e->epoch_element = e->element_head;
        e->push_epoch++;
        e->distance = 0.0;
        e->log.shift = 0.0;
    }
}

/* Functions that wait for the end of their block go ahead of the first row of the next one. */
static void push_row(engine *e, const nc_block *row) {
    if (row->type > NC_POLYNOMIAL && row->type != NC_DYNAMICS) carry_flush(e);
    if (e->spindle_pending && (row->count != e->spindle_row.count || row->type <= NC_POLYNOMIAL)) techno_spindle_word(e);
    if (e->behind_count && row->count != e->behind[0].count) techno_block_end(e);
    if (row->type == NC_DYNAMICS) {
        limits_set(e, row);
        return;
    }
    if (row->type <= NC_POLYNOMIAL && row->flags & NC_ELEMENT) {
        push_programmed(e, row);
        return;
    }
    if (row->type <= NC_POLYNOMIAL) {
        if (carry_row(e, row)) return;
        techno_before_motion(e, row);
    }
    if (techno_push(e, row)) return;
    if (row->type == NC_EVENT && row->code == NC_EVENT_EXPL_SYN) techno_expl_syn(e, row);
    piece *p = store_slot(e, row);
    if (row->type <= NC_POLYNOMIAL) push_motion(e, p, row);
    else push_event(e, p, row);
    store_publish(e);
}

int64_t engine_push(engine *e, const nc_block *rows, int64_t n, const double *pool, int64_t pool_n) {
    for (int64_t i = 0; i < n; i++) {
        if (!ring_has_room(e)) return i;
        int64_t error = !row_is_finite(e, &rows[i]) ? ENGINE_NOT_FINITE : !row_is_supported(e, &rows[i], pool, pool_n) ? ENGINE_BAD_ROW : 0;
        if (!error && e->in_loop && e->store_head - e->loop_begin > LOOP_PIECES_MAX) error = ENGINE_LOOP_TOO_LONG;
        if (error) return i > 0 ? i : error;
        push_row(e, &rows[i]);
        e->rows_taken++;
        if (e->fault) return ENGINE_NO_MEMORY;
    }
    return n;
}

void engine_finish(engine *e) {
    carry_flush(e);
    techno_spindle_word(e);
    techno_block_end(e);
    log_program_end(e);
    ATOMIC_SET(e->finished, 1);
}

void engine_expect_drain(engine *e) {
    carry_flush(e);
    techno_spindle_word(e);
    techno_block_end(e);
    e->drain_at = e->store_head;
    e->drain_from = ATOMIC_GET(e->geo.cycle) + 1; /* the other side gets its turn, however often a program asks */
    ATOMIC_SET(e->expect_drain, 1);
}
