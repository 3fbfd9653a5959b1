/* Memory for the stretches of pieces: a shared share for a few, room of their
 * own for many. */
#include <stdlib.h>
#include "engine/accel/span_store.h"
#include "engine/state/memory.h"
#include "engine/state/state.h"

#define FEW                                                                    \
    12u /* stretches that most pieces do with: these lie close together in     \
           memory */
#define FEW_ROOM (FEW + 1u)
#define MORE_ROOM 1.25
#define SLOTS 2u /* pieces, events among them, over motions of a window */

static void free_room(span_room *room) {
    free(room->spans);
    free(room->rows);
}

/* Without memory it stays as it is. */
void room_for(span_room *room, uint32_t count, uint32_t numbers) {
    if (room->count >= count && room->row_numbers >= numbers) {
        return;
    }
    struct span *spans = malloc(
        count
        * sizeof(struct span)); /* nothing is read that has not been written */
    double *rows = malloc(numbers * sizeof(double));
    if (!spans || !rows) {
        free(spans);
        free(rows);
        return;
    }
    free_room(room);
    *room = (span_room){spans, rows, count, numbers};
}

static uint32_t first_count(const struct engine *engine) {
    return SPANS_FIRST < spans_max(engine) ? SPANS_FIRST : spans_max(engine);
}

/* The share of a room that there is at first, whatever pieces before have
 * needed. */
span_room spans_first(const struct engine *engine, const span_room *room) {
    return (span_room){room->spans,
                       room->rows,
                       first_count(engine),
                       ROWS_FIRST * SPAN_ROW
                           * (uint32_t)engine->cfg.axis_count};
}

bool spans_new(struct engine *e) {
    planner *w = &e->plan;
    uint64_t slots = 1;
    while (slots < SLOTS * ((uint64_t)e->cfg.window + 64)) {
        slots <<= 1;
    }
    size_t few = (size_t)(slots * FEW_ROOM),
           row = SPAN_ROW * (size_t)e->cfg.axis_count;
    w->span_mask = slots - 1;
    w->spans = calloc(few, sizeof(struct span));
    w->rows = calloc(few * row, sizeof(double));
    w->span_slots = calloc((size_t)slots, sizeof(span_slot));
    room_for(&w->made, first_count(e), ROWS_FIRST * (uint32_t)row);
    if (!w->spans || !w->rows || !w->span_slots || !w->made.count) {
        return false;
    }
    if (!e->traits.uses_spans) {
        return true; /* it needs none of them */
    }
    memory_touch(w->spans, few * sizeof(struct span));
    memory_touch(w->span_slots, (size_t)slots * sizeof(span_slot));
    return true;
}

void spans_free(struct engine *engine) {
    for (uint64_t i = 0; engine->plan.span_slots && i <= engine->plan.span_mask;
         i++) {
        free_room(&engine->plan.span_slots[i].many);
    }
    free_room(&engine->plan.made);
    free(engine->plan.spans);
    free(engine->plan.rows);
    free(engine->plan.span_slots);
}

/* Room for `count` stretches of so many rows per axis, or as many as a piece
 * may have; what was in it is lost. */
void spans_grow(const struct engine *engine,
                span_room *room,
                double count,
                uint32_t per_axis) {
    uint32_t most = (uint32_t)lesser(spans_max(engine), count),
             row = SPAN_ROW * per_axis * (uint32_t)engine->cfg.axis_count;
    if (room->count >= most && room->row_numbers >= most * row) {
        return;
    }
    most = (uint32_t)lesser(spans_max(engine),
                            MORE_ROOM * greater(most, room->count));
    room_for(room, most, most * row);
}

/* The stretches of piece i are those in the room it shares with others. */
bool spans_known(const struct engine *e, uint64_t i) {
    return e->pieces[i & e->piece_mask].spanned
           && e->plan.span_slots[i & e->plan.span_mask].owner == i;
}
