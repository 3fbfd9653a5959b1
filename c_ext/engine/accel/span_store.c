/* Memory for the stretches of pieces: a shared share for a few, room of their
 * own for many. */
#include <stdlib.h>
#include "engine/accel/span_store.h"
#include "engine/accel/tuning.h"
#include "engine/state/memory.h"
#include "engine/state/state.h"

static void free_room(span_room *room) {
    free(room->spans);
    free(room->rows);
}

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

static uint32_t first_count(const engine_config *cfg) {
    return SPANS_FIRST < spans_max(cfg) ? SPANS_FIRST : spans_max(cfg);
}

span_room spans_first(const engine_config *cfg, const span_room *room) {
    return (span_room){room->spans,
                       room->rows,
                       first_count(cfg),
                       ROWS_FIRST * SPAN_ROW * (uint32_t)cfg->axis_count};
}

bool spans_new(struct engine *engine) {
    uint64_t slots = 1;
    while (slots < SLOTS * ((uint64_t)engine->cfg.window + 64)) {
        slots <<= 1;
    }
    size_t few = (size_t)(slots * FEW_ROOM),
           row = SPAN_ROW * (size_t)engine->cfg.axis_count;
    engine->accel.span_mask = slots - 1;
    engine->accel.spans = calloc(few, sizeof(struct span));
    engine->accel.rows = calloc(few * row, sizeof(double));
    engine->accel.span_slots = calloc((size_t)slots, sizeof(span_slot));
    room_for(&engine->accel.made,
             first_count(&engine->cfg),
             ROWS_FIRST * (uint32_t)row);
    bool shared = engine->accel.spans && engine->accel.rows;
    if (!shared || !engine->accel.span_slots || !engine->accel.made.count) {
        return false;
    }
    if (!engine->traits.uses_spans) {
        return true; /* it needs none of them */
    }
    memory_touch(engine->accel.spans, few * sizeof(struct span));
    memory_touch(engine->accel.span_slots, (size_t)slots * sizeof(span_slot));
    return true;
}

void spans_free(struct accel_state *accel) {
    for (uint64_t i = 0; accel->span_slots && i <= accel->span_mask; i++) {
        free_room(&accel->span_slots[i].many);
    }
    free_room(&accel->made);
    free(accel->spans);
    free(accel->rows);
    free(accel->span_slots);
}

void spans_grow(const engine_config *cfg,
                span_room *room,
                double count,
                uint32_t per_axis) {
    uint32_t most = (uint32_t)lesser(spans_max(cfg), count),
             row = SPAN_ROW * per_axis * (uint32_t)cfg->axis_count;
    if (room->count >= most && room->row_numbers >= most * row) {
        return;
    }
    most = (uint32_t)lesser(spans_max(cfg),
                            MORE_ROOM * greater(most, room->count));
    room_for(room, most, most * row);
}

void spans_prefetch(const struct accel_state *accel, uint64_t i) {
    uint64_t slot = i & accel->span_mask;
    const struct span *spans = &accel->spans[slot * FEW_ROOM];
    __builtin_prefetch(&accel->span_slots[slot], 1);
    for (uint32_t k = 0; k < FETCHED; k++) {
        __builtin_prefetch(&spans[k], 1);
    }
}

bool spans_known(const struct engine *engine, uint64_t i) {
    return engine->run.pieces[i & engine->run.mask].spanned
           && engine->accel.span_slots[i & engine->accel.span_mask].owner == i;
}
