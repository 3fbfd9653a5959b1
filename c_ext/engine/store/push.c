/* Preparation's end of the store: prepared rows become elements (HLI facts) and
 * pieces (axis-space geometry). */
#include <string.h>
#include "engine/store/push.h"
#include "engine/path/limits.h"
#include "engine/path/piece.h"
#include "engine/state/state.h"
#include "engine/store/element_map.h"
#include "engine/store/element_more.h"
#include "engine/store/elements.h"
#include "engine/store/marked_log.h"
#include "engine/store/piece_push.h"
#include "engine/store/row_check.h"
#include "engine/store/short_motions.h"
#include "engine/store/store.h"
#include "engine/store/technology_rows.h"
#include "rows/nc_block.h"

#define LOOP_PIECES_MAX                                                        \
    (STORE_AHEAD / 2) /* a real-time loop is held whole in the store */

bool store_has_room(struct engine *engine) {
    if (engine->store.head + 4 * BEHIND_MAX
        >= ATOMIC_GET(engine->store.floor) + engine->store.mask) {
        return false;
    }
    if (!techno_has_room(engine)) {
        return false;
    }
    return engine->store.element_head
           < ATOMIC_GET(engine->geo.active)
                 + (engine->store.element_mask + 1) / 2;
}

static void push_motion(struct engine *engine,
                        struct piece *piece,
                        const nc_block *row) {
    const struct short_motions before = engine->push.short_motions;
    if (!(row->flags & NC_PIECE)) {
        piece->element = engine->store.element_head;
        piece->dist0 = engine->push.distance / TENTH_UM;
        push_element(engine, row);
        element_map_behind(engine);
    }
    push_piece(engine, piece, row);
    piece->path_rate = piece->dist_rate = row->length / piece->length;
    engine->push.short_motions.rows = 0;
    if (row->flags & NC_PIECE) {
        element_map_piece(engine,
                          piece,
                          row->value + (before.rows ? before.programmed : 0.0));
        if (row->flags & NC_BY_PARAMETER) {
            piece->path_rate = piece->dist_rate;
        }
    }
    engine->push.path += piece->length * piece->path_rate;
}

/* #RT WHILE: what comes is known to be driven only where the path enters it. */
static void push_loop_begin(struct engine *engine, struct piece *piece) {
    struct push_state *push = &engine->push;
    piece->mate = 0;
    piece->first_element = push->loop_behind;
    push->in_loop = true;
    push->loop++;
    push->epoch++;
    push->loop_begin = engine->store.head;
    push->loop_path = push->path;
    push->loop_distance = push->distance;
    push->loop_first = UINT64_MAX;
    memcpy(push->before_loop, push->last_tangent, sizeof push->before_loop);
    push->has_before_loop = push->has_tangent;
    log_loop_begin(engine);
}

/* #RT ENDWHILE: both ends know each other. Behind the loop the distance is not
 * known until it is left. */
static void push_loop_end(struct engine *engine, struct piece *piece) {
    struct push_state *push = &engine->push;
    struct piece *begin = store_at(&engine->store, push->loop_begin);
    piece->mate = push->loop_begin;
    piece->first_element = begin->first_element;
    piece->value = push->path - push->loop_path;
    piece->loop_distance = (push->distance - push->loop_distance) / TENTH_UM;
    piece->flags |= begin->flags & NC_MODULO;
    begin->value = piece->value;
    begin->loop_distance = piece->loop_distance;
    if (push->loop_first != UINT64_MAX) {
        element_at(&engine->store, push->loop_first)->other_variation =
            angle_between(push->last_tangent, push->loop_tangent);
    }
    ATOMIC_SET(begin->mate, engine->store.head);
    push->in_loop = false;
    push->behind_loop = true;
    push->loop_behind = engine->store.element_head;
    push->epoch++;
    log_loop_end(engine, push->distance - push->loop_distance);
}

static void push_loop(struct engine *engine,
                      struct piece *piece,
                      const nc_block *row) {
    if (row->type == NC_RT_LOOP_BEGIN) {
        push_loop_begin(engine, piece);
    } else {
        push_loop_end(engine, piece);
    }
    piece->loop = engine->push.loop;
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
    piece->element = engine->store.element_head;
    piece->code = row->code;
    piece->value = row->value;
    memcpy(piece->end, engine->push.last_end, sizeof piece->end);
    if (stops(row)) {
        engine->push.stop_pending = true;
    }
    piece->stop_before = stops(row);
    if (is_m01(row)) {
        piece->m01 = engine->push.m01_pending = true;
    }
    if (row->type == NC_MARKER) {
        log_marker(engine, row);
    }
    if (row->type == NC_RT_LOOP_BEGIN || row->type == NC_RT_LOOP_END) {
        push_loop(engine, piece, row);
    }
    if (row->type == NC_DISTANCE_RESET) {
        piece->mate = engine->push.epoch_element;
        engine->push.epoch_element = engine->push.loop_behind =
            engine->store.element_head;
        engine->push.epoch++;
        engine->push.resets++;
        piece->dist0 = engine->push.distance / TENTH_UM;
        engine->push.distance = 0.0;
        engine->log.shift = 0.0;
    }
}

/* Functions that wait for the end of their block go ahead of the first row of
 * the next one. */
static void push_row(struct engine *engine, const nc_block *row) {
    if (row->type > NC_POLYNOMIAL && row->type != NC_DYNAMICS) {
        short_motions_flush(engine);
        note_event(engine, row);
    }
    if (engine->technology_rows.spindle_pending
        && (row->count != engine->technology_rows.spindle_row.count
            || row->type <= NC_POLYNOMIAL)) {
        techno_spindle_word(engine);
    }
    if (engine->technology_rows.behind_count
        && row->count != engine->technology_rows.behind[0].count) {
        techno_block_end(engine);
    }
    if (row->type == NC_DYNAMICS) {
        limits_set(engine, row);
        return;
    }
    if (row->type <= NC_POLYNOMIAL && row->flags & NC_ELEMENT) {
        push_element(engine, row);
        return;
    }
    if (row->type <= NC_POLYNOMIAL) {
        if (short_motions_row(engine, row)) {
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
    store_publish(&engine->store);
}

int64_t engine_push(struct engine *engine,
                    const nc_block *rows,
                    int64_t count,
                    const double *pool,
                    int64_t pool_n) {
    for (int64_t i = 0; i < count; i++) {
        if (!store_has_room(engine)) {
            return i;
        }
        int64_t error =
            !row_is_finite(&engine->cfg, &rows[i]) ? ENGINE_NOT_FINITE
            : !row_is_supported(engine, &rows[i], pool, pool_n) ? ENGINE_BAD_ROW
                                                                : 0;
        if (!error && engine->push.in_loop
            && engine->store.head - engine->push.loop_begin > LOOP_PIECES_MAX) {
            error = ENGINE_LOOP_TOO_LONG;
        }
        if (error) {
            return i > 0 ? i : error;
        }
        push_row(engine, &rows[i]);
        engine->push.rows_taken++;
        if (engine->fault) {
            return ENGINE_NO_MEMORY;
        }
    }
    return count;
}

void engine_finish(struct engine *engine) {
    short_motions_flush(engine);
    techno_spindle_word(engine);
    techno_block_end(engine);
    log_program_end(engine);
    ATOMIC_SET(engine->program.finished, 1);
}

void engine_expect_drain(struct engine *engine) {
    short_motions_flush(engine);
    techno_spindle_word(engine);
    techno_block_end(engine);
    ATOMIC_SET(engine->program.drain_at, engine->store.head);
    engine->program.drain_from =
        ATOMIC_GET(engine->geo.cycle)
        + 1; /* the other side gets its turn, however often a program asks */
    ATOMIC_SET(engine->program.expect_drain, 1);
}
