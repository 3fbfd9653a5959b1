/* SDA's end of the ring: prepared rows become elements (HLI facts) and pieces
 * (axis-space geometry). */
#include <math.h>
#include <stddef.h>
#include "engine/state/state.h"

#define LOOP_PIECES_MAX                                                        \
    (STORE_AHEAD / 2) /* a real-time loop is held whole in the store */

bool ring_has_room(struct engine *e) {
    if (e->store_head + 4 * BEHIND_MAX
        >= ATOMIC_GET(e->store_floor) + e->store_mask) {
        return false;
    }
    if (!techno_has_room(e)) {
        return false;
    }
    return e->element_head
           < ATOMIC_GET(e->geo.active) + (e->element_mask + 1) / 2;
}

static bool row_is_finite(const struct engine *engine, const nc_block *row) {
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        if (!isfinite(row->end[i])) {
            return false;
        }
    }
    return isfinite(row->length) && isfinite(row->feed)
           && isfinite(row->center[0]) && isfinite(row->center[1])
           && isfinite(row->radius) && isfinite(row->programmed_radius)
           && isfinite(row->angle) && isfinite(row->value)
           && isfinite(row->length_min) && isfinite(row->end_speed);
}

/* A motion in other coordinates than the axes': its tangents, kept for the
 * element that is pushed next. */
static bool tangents_are_given(struct engine *engine,
                               const nc_block *row,
                               const double *pool,
                               int64_t pool_n) {
    if (!pool || (int64_t)row->pool + 6 > pool_n || !(row->length > 0)) {
        return false;
    }
    for (int i = 0; i < 6; i++) {
        engine->next_tangents[i] = pool[row->pool + i];
        if (!isfinite(engine->next_tangents[i])) {
            return false;
        }
    }
    return true;
}

static bool row_is_supported(struct engine *engine,
                             const nc_block *row,
                             const double *pool,
                             int64_t pool_n) {
    if (row->type <= NC_POLYNOMIAL && row->flags & NC_ELEMENT
        && row->degree == NC_TANGENTS) {
        return tangents_are_given(engine, row, pool, pool_n);
    }
    if (row->flags & NC_ELEMENT && row->type == NC_POLYNOMIAL) {
        return false;
    }
    if (row->flags & NC_PIECE
        && !(row->value >= 0 && engine->element_head > 0)) {
        return false;
    }
    switch (row->type) {
    case NC_LINEAR:
        return row->length > 0 && (row->feed > 0 || (row->flags & NC_RAPID));
    case NC_CIRCULAR: {
        if (row->plane < 17 || row->plane > 19 || !(row->length > 0)
            || !(row->radius > 0) || row->angle == 0.0) {
            return false;
        }
        for (int i = 0; i < 3; i++) {
            if (engine->cfg.main[i] < 0
                && i
                       != (row->plane == 17   ? 2
                           : row->plane == 18 ? 1
                                              : 0)) {
                return false;
            }
        }
        return row->feed > 0 || (row->flags & NC_RAPID);
    }
    case NC_POLYNOMIAL:
        return row->length > 0 && row->degree >= 1 && row->degree < CURVE_ORDER
               && row->angle > 0 && (row->feed > 0 || (row->flags & NC_RAPID))
               && curve_row_check(engine, row, pool, pool_n);
    case NC_DWELL:
        return row->value >= 0;
    case NC_M:
    case NC_H:
    case NC_S:
    case NC_T:
    case NC_MARKER:
    case NC_DISTANCE_RESET:
    case NC_FLUSH:
    case NC_EVENT:
        return true;
    case NC_DYNAMICS:
        return limits_row_check(engine, row);
    case NC_RT_LOOP_BEGIN:
        return !engine->in_loop;
    case NC_RT_LOOP_END:
        return engine->in_loop;
    default:
        return false;
    }
}

/* Unit tangent of the three main axes; false where none of them moves. */
static bool main_tangent(const struct engine *engine,
                         const double *u,
                         double *t) {
    double norm = 0.0;
    for (int i = 0; i < 3; i++) {
        t[i] = engine->cfg.main[i] < 0 ? 0.0 : u[engine->cfg.main[i]];
        norm += t[i] * t[i];
    }
    norm = sqrt(norm);
    if (norm < 1e-12) {
        return false;
    }
    for (int i = 0; i < 3; i++) {
        t[i] /= norm;
    }
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

static double tangent_variation(struct engine *engine,
                                const struct piece *piece) {
    double in[3], out[3];
    double angle = 0.0;
    if (main_tangent(engine, piece->tangent_in, in)) {
        if (engine->has_tangent) {
            angle = angle_between(engine->last_tangent, in);
        }
        if (main_tangent(engine, piece->tangent_out, out)) {
            memcpy(engine->last_tangent, out, sizeof out);
            engine->has_tangent = true;
        }
    }
    return angle;
}

static void push_element(struct engine *engine,
                         const struct piece *piece,
                         const nc_block *row) {
    struct element *el = element_at(engine, engine->element_head);
    __atomic_thread_fence(
        __ATOMIC_RELEASE); /* who sees the slot change sees at least the present
                              head (docs/explanation/model/ring.pml) */
    HLI_CONTOUR_LOOKAHEAD_BLOCK *facts = &el->facts;
    memset(el, 0, sizeof *el);
    facts->block_type = row->type == NC_CIRCULAR     ? HLI_CLAH_CIRCULAR
                        : row->type == NC_POLYNOMIAL ? HLI_CLAH_POLYNOMIAL
                                                     : HLI_CLAH_LINEAR;
    facts->block_number = row->n;
    facts->block_count_r = row->count;
    facts->start_position = engine->distance;
    facts->length = row->length * TENTH_UM;
    facts->length_min = row->length_min * TENTH_UM;
    if (row->type == NC_CIRCULAR) {
        facts->programmed_radius = row->programmed_radius * TENTH_UM;
        facts->compensated_radius = row->radius * TENTH_UM;
        facts->circle_angle = row->angle;
    }
    facts->tangent_variation = tangent_variation(engine, piece);
    el->epoch = engine->push_epoch;
    if (engine->in_loop
        && engine->element_head
               == store_at(engine, engine->loop_begin)->element) {
        main_tangent(engine, piece->tangent_in, engine->loop_tangent);
    }
    engine->distance = facts->start_position + facts->length;
    log_element(engine, el);
    ATOMIC_SET(engine->element_head, engine->element_head + 1);
}

/* The next place of the store, cleared, with what every row has. */
struct piece *store_slot(struct engine *engine, const nc_block *row) {
    struct piece *piece = store_at(engine, engine->store_head);
    memset(piece, 0, offsetof(struct piece, capped));
    piece->type = row->type;
    piece->n = row->n;
    piece->count = row->count;
    piece->line = row->line;
    piece->flags = row->flags;
    piece->origin = engine->store_head;
    piece->row = engine->rows_taken;
    piece->dir = 1;
    return piece;
}

void store_publish(struct engine *engine) {
    ATOMIC_SET(engine->store_head, engine->store_head + 1);
}

/* What a motion row says of its piece, but for where that lies on the path. */
void push_piece(struct engine *engine,
                struct piece *piece,
                const nc_block *row) {
    memcpy(piece->start, engine->last_end, sizeof piece->start);
    piece->limits = engine->limits[row->flags & NC_RAPID ? 1 : 0];
    if (engine->carried.rows) {
        carry_build(engine, piece, row);
    } else {
        piece_build(engine, piece, row);
    }
    piece->stop_before = engine->stop_pending || !engine->has_motion_piece;
    piece->new_block =
        engine->has_motion_piece && engine->last_count != piece->count;
    piece->m01 = engine->m01_pending;
    engine->m01_pending = false;
    piece->gated = engine->has_pending_gate;
    piece->need = engine->pending_gate;
    engine->has_pending_gate = false;
    piece->stop_after = row->flags & NC_EXACT_STOP;
    engine->stop_pending = piece->stop_after;
    piece->entry_speed = engine->end_speed > 0 ? engine->end_speed : NEVER;
    engine->end_speed = row->end_speed;
    piece->path0 = engine->pushed_path;
    piece->whole = piece->length;
    memcpy(engine->last_end, row->end, sizeof engine->last_end);
    engine->last_count = piece->count;
    engine->has_motion_piece = true;
}

static void push_motion(struct engine *engine,
                        struct piece *piece,
                        const nc_block *row) {
    const struct carried before = engine->carried;
    push_piece(engine, piece, row);
    piece->path_rate = piece->dist_rate = row->length / piece->length;
    engine->carried.rows = 0;
    if (row->flags & NC_PIECE) {
        map_piece(engine,
                  piece,
                  row->value + (before.rows ? before.programmed : 0.0));
        if (row->flags & NC_BY_PARAMETER) {
            piece->path_rate = piece->dist_rate;
        }
    } else {
        piece->element = engine->element_head;
        piece->dist0 = engine->distance / TENTH_UM;
        if (before.rows && piece->kind != PIECE_CURVE) {
            push_programmed(engine, row);
        } else {
            push_element(engine, piece, row);
            memcpy(engine->element_end, row->end, sizeof engine->element_end);
        }
        map_behind_element(engine);
    }
    engine->pushed_path += piece->length * piece->path_rate;
}

/* A programmed motion that smoothed pieces execute: an element without a piece.
 */
void push_programmed(struct engine *engine, const nc_block *row) {
    struct piece piece;
    memset(&piece, 0, sizeof piece);
    memcpy(piece.start, engine->element_end, sizeof piece.start);
    if (row->degree == NC_TANGENTS) {
        for (int i = 0; i < 3; i++) {
            if (engine->cfg.main[i] < 0) {
                continue;
            }
            piece.tangent_in[engine->cfg.main[i]] = engine->next_tangents[i];
            piece.tangent_out[engine->cfg.main[i]] =
                engine->next_tangents[3 + i];
        }
    } else {
        piece_build(engine, &piece, row);
    }
    push_element(engine, &piece, row);
    memcpy(engine->element_end, row->end, sizeof engine->element_end);
}

/* #RT WHILE .. #RT ENDWHILE: both ends know each other. Behind the loop the
 * distance is not known until it is left. */
static void push_loop(struct engine *engine,
                      struct piece *piece,
                      const nc_block *row) {
    if (row->type == NC_RT_LOOP_BEGIN) {
        engine->in_loop = true;
        engine->loop_begin = engine->store_head;
        engine->loop_path = engine->pushed_path;
        log_loop_begin(engine);
        return;
    }
    piece->mate = engine->loop_begin;
    piece->value = engine->pushed_path - engine->loop_path;
    piece->flags |= store_at(engine, engine->loop_begin)->flags & NC_MODULO;
    store_at(engine, engine->loop_begin)->mate = engine->store_head;
    store_at(engine, engine->loop_begin)->value = piece->value;
    engine->in_loop = false;
    engine->push_epoch++;
    log_loop_end(engine, piece->value * TENTH_UM);
}

static bool is_m01(const nc_block *row) {
    return row->type == NC_M && row->code == 1;
}

static bool stops(const nc_block *row) {
    return row->type == NC_DWELL
           || ((row->flags & NC_STANDSTILL) && !is_m01(row));
}

static void push_event(struct engine *engine,
                       struct piece *piece,
                       const nc_block *row) {
    piece->kind = PIECE_EVENT;
    piece->element = engine->element_head;
    piece->code = row->code;
    piece->value = row->value;
    memcpy(piece->end, engine->last_end, sizeof piece->end);
    if (stops(row)) {
        engine->stop_pending = true;
    }
    piece->stop_before = stops(row);
    if (is_m01(row)) {
        piece->m01 = engine->m01_pending = true;
    }
    if (row->type == NC_MARKER) {
        log_marker(engine, row);
    }
    if (row->type == NC_RT_LOOP_BEGIN || row->type == NC_RT_LOOP_END) {
        push_loop(engine, piece, row);
    }
    if (row->type == NC_DISTANCE_RESET) {
        piece->mate = engine->epoch_element;
        engine->epoch_element = engine->element_head;
        engine->push_epoch++;
        engine->distance = 0.0;
        engine->log.shift = 0.0;
    }
}

/* Functions that wait for the end of their block go ahead of the first row of
 * the next one. */
static void push_row(struct engine *engine, const nc_block *row) {
    if (row->type > NC_POLYNOMIAL && row->type != NC_DYNAMICS) {
        carry_flush(engine);
    }
    if (engine->spindle_pending
        && (row->count != engine->spindle_row.count
            || row->type <= NC_POLYNOMIAL)) {
        techno_spindle_word(engine);
    }
    if (engine->behind_count && row->count != engine->behind[0].count) {
        techno_block_end(engine);
    }
    if (row->type == NC_DYNAMICS) {
        limits_set(engine, row);
        return;
    }
    if (row->type <= NC_POLYNOMIAL && row->flags & NC_ELEMENT) {
        push_programmed(engine, row);
        return;
    }
    if (row->type <= NC_POLYNOMIAL) {
        if (carry_row(engine, row)) {
            return;
        }
        techno_before_motion(engine, row);
    }
    if (techno_push(engine, row)) {
        return;
    }
    if (row->type == NC_EVENT && row->code == NC_EVENT_EXPL_SYN) {
        techno_expl_syn(engine, row);
    }
    struct piece *piece = store_slot(engine, row);
    if (row->type <= NC_POLYNOMIAL) {
        push_motion(engine, piece, row);
    } else {
        push_event(engine, piece, row);
    }
    store_publish(engine);
}

int64_t engine_push(struct engine *engine,
                    const nc_block *rows,
                    int64_t count,
                    const double *pool,
                    int64_t pool_n) {
    for (int64_t i = 0; i < count; i++) {
        if (!ring_has_room(engine)) {
            return i;
        }
        int64_t error = !row_is_finite(engine, &rows[i]) ? ENGINE_NOT_FINITE
                        : !row_is_supported(engine, &rows[i], pool, pool_n)
                            ? ENGINE_BAD_ROW
                            : 0;
        if (!error && engine->in_loop
            && engine->store_head - engine->loop_begin > LOOP_PIECES_MAX) {
            error = ENGINE_LOOP_TOO_LONG;
        }
        if (error) {
            return i > 0 ? i : error;
        }
        push_row(engine, &rows[i]);
        engine->rows_taken++;
        if (engine->fault) {
            return ENGINE_NO_MEMORY;
        }
    }
    return count;
}

void engine_finish(struct engine *engine) {
    carry_flush(engine);
    techno_spindle_word(engine);
    techno_block_end(engine);
    log_program_end(engine);
    ATOMIC_SET(engine->finished, 1);
}

void engine_expect_drain(struct engine *engine) {
    carry_flush(engine);
    techno_spindle_word(engine);
    techno_block_end(engine);
    engine->drain_at = engine->store_head;
    engine->drain_from =
        ATOMIC_GET(engine->geo.cycle)
        + 1; /* the other side gets its turn, however often a program asks */
    ATOMIC_SET(engine->expect_drain, 1);
}
