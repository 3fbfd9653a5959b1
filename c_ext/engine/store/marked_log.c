/* The marked log (mode 1): entries between LOG ON and LOG OFF, written by SDA,
 * read by the service.
 *
 * Entries are published before their count; f_log_is_active falls last. LOG
 * CLEAR changes the generation, so that a reader that was in the middle of a
 * copy notices and starts again. What stands in a real-time loop is kept aside
 * until the loop's end is known: an area inside the loop is logged once, a loop
 * inside an area three times (section 8).
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "engine/store/marked_log.h"
#include "engine/path/piece.h"
#include "engine/state/state.h"
#include "rows/nc_block.h"

/* Pieces: rows of a block are executed in another order within so many. */
#define ROWS_OF_BLOCK (4u * BEHIND_MAX)
#define MARKER_NONE 0 /* an element */
/* of a distance, 0.1 um: nearer to it an element has ended */
#define END_OF_ELEMENT 1.0

typedef struct loop_item {
    HLI_CONTOUR_LOOKAHEAD_BLOCK entry;
    int action; /* NC_MARKER_... or MARKER_NONE */
} loop_item;

bool log_available(const engine_config *cfg) {
    return (cfg->functions & ENGINE_FCT_CONTOUR_LAH) && cfg->log_max > 0
           && cfg->fb_storage_size > 0;
}

const HLI_CONTOUR_LOOKAHEAD_BLOCK *log_entry(const struct marked_log *log,
                                             uint32_t i) {
    return &log->chunk[i / LOG_CHUNK][i % LOG_CHUNK];
}

/* Readers in the middle of a copy notice a change of the generation. */
static void begin_change(struct marked_log *log) {
    ATOMIC_SET(log->generation, log->generation + 1);
    __atomic_thread_fence(__ATOMIC_SEQ_CST);
}

static void end_change(struct marked_log *log) {
    ATOMIC_SET(log->generation, log->generation + 1);
}

/* No room: the entry is dropped; but the one that closes the area takes the
 * last place. */
static void append_to_full(struct marked_log *log,
                           const HLI_CONTOUR_LOOKAHEAD_BLOCK *entry) {
    log->dropped++;
    if (entry->block_type != HLI_CLAH_LOG_OFF || log->count < 2) {
        return;
    }
    uint32_t i = log->count - 1;
    begin_change(log);
    log->chunk[i / LOG_CHUNK][i % LOG_CHUNK] = *entry;
    end_change(log);
}

static void append(struct engine *engine,
                   const HLI_CONTOUR_LOOKAHEAD_BLOCK *entry) {
    marked_log *log = &engine->log;
    uint32_t i = log->count;
    if (i >= engine->cfg.log_max || i / LOG_CHUNK >= LOG_CHUNKS) {
        append_to_full(log, entry);
        return;
    }
    if (!log->chunk[i / LOG_CHUNK]) {
        log->chunk[i / LOG_CHUNK] = calloc(LOG_CHUNK, sizeof *entry);
        if (!log->chunk[i / LOG_CHUNK]) {
            engine->fault = ENGINE_NO_MEMORY;
            return;
        }
    }
    log->chunk[i / LOG_CHUNK][i % LOG_CHUNK] = *entry;
    ATOMIC_SET(log->count, i + 1);
}

/* Entries know their distance as if every real-time loop were driven once; the
 * copies logged so far come on top. */
static void append_shifted(struct engine *engine,
                           HLI_CONTOUR_LOOKAHEAD_BLOCK entry) {
    entry.start_position += engine->log.shift;
    append(engine, &entry);
}

static void append_typed(struct engine *engine,
                         HLI_CONTOUR_LOOKAHEAD_BLOCK entry,
                         uint32_t type) {
    entry.block_type = type;
    append_shifted(engine, entry);
}

static void log_off(struct engine *engine,
                    const HLI_CONTOUR_LOOKAHEAD_BLOCK *marker) {
    if (engine->log.active) {
        append_typed(engine, *marker, HLI_CLAH_LOG_OFF);
        engine->log.complete = true;
        ATOMIC_SET(engine->log.active, 0);
    }
    engine->log.ignoring = false;
}

static void log_on(struct engine *engine,
                   const HLI_CONTOUR_LOOKAHEAD_BLOCK *marker) {
    if (engine->log.active
        || engine->log.ignoring) { /* the manual's loop examples close an area
                                      with ON */
        engine->log.on_closed++;
        log_off(engine, marker);
    } else if (engine->log.complete) {
        engine->log.ignored_areas++;
        engine->log.ignoring = true;
    } else {
        append_typed(engine, *marker, HLI_CLAH_LOG_ON);
        ATOMIC_SET(engine->log.active, 1);
    }
}

static void log_clear(struct marked_log *log) {
    begin_change(log);
    ATOMIC_SET(log->active, 0);
    ATOMIC_SET(log->count, 0);
    log->complete = log->ignoring = false;
    log->shift = 0.0;
    end_change(log);
}

static void mark(struct engine *engine,
                 int action,
                 const HLI_CONTOUR_LOOKAHEAD_BLOCK *marker) {
    if (action == NC_MARKER_ON) {
        log_on(engine, marker);
    } else if (action == NC_MARKER_OFF) {
        log_off(engine, marker);
    } else if (action == NC_MARKER_CLEAR) {
        log_clear(&engine->log);
    } else if (engine->log.active) {
        append_typed(engine, *marker, HLI_CLAH_LOG_PARAM);
    } else if (!engine->log.ignoring) {
        engine->log.stray_params++;
    }
}

/* Keep an entry of a real-time loop aside. */
static void keep(struct engine *engine,
                 const HLI_CONTOUR_LOOKAHEAD_BLOCK *entry,
                 int action) {
    marked_log *log = &engine->log;
    if (log->item_count == log->item_room) {
        uint32_t room = log->item_room ? 2 * log->item_room : 64;
        loop_item *items = realloc(log->items, room * sizeof *items);
        if (!items) {
            engine->fault = ENGINE_NO_MEMORY;
            return;
        }
        log->items = items;
        log->item_room = room;
    }
    log->items[log->item_count++] = (loop_item){*entry, action};
}

void log_reset(struct marked_log *log) {
    log_clear(log);
    log->in_loop = false;
    log->dropped = log->ignored_areas = log->stray_params = log->on_closed =
        log->disabled = 0;
}

void log_marker(struct engine *engine, const nc_block *row) {
    if (!log_available(&engine->cfg)) {
        engine->log.disabled++;
        return;
    }
    HLI_CONTOUR_LOOKAHEAD_BLOCK marker;
    memset(&marker, 0, sizeof marker);
    marker.block_number = row->n;
    marker.block_count_r = row->count;
    marker.start_position = engine->push.distance;
    marker.length = row->flags & NC_HAS_PARAM ? row->value : 0.0;
    if (engine->log.in_loop) {
        keep(engine, &marker, row->code);
    } else {
        mark(engine, row->code, &marker);
    }
}

void log_element(struct engine *engine, const struct element *el) {
    if (engine->log.in_loop) {
        keep(engine, &el->facts, MARKER_NONE);
    } else if (engine->log.active) {
        append_shifted(engine, el->facts);
    }
}

void log_loop_begin(struct engine *engine) {
    engine->log.in_loop = log_available(&engine->cfg);
    engine->log.item_count = 0;
}

static void log_item(struct engine *engine, const loop_item *item) {
    if (item->action != MARKER_NONE) {
        mark(engine, item->action, &item->entry);
    } else if (engine->log.active) {
        append_shifted(engine, item->entry);
    }
}

/* `pass`: HLI_CLAH_PASS_..., which copy of the loop it is. */
static void log_items(struct engine *engine,
                      uint32_t from,
                      uint32_t to,
                      uint16_t pass) {
    for (uint32_t i = from; i < to; i++) {
        engine->log.items[i].entry.rt_loop_pass = pass;
        log_item(engine, &engine->log.items[i]);
    }
}

/* First marker from `from` on that opens or closes an area; item_count if there
 * is none. */
static uint32_t next_switch(const struct marked_log *log, uint32_t from) {
    while (from < log->item_count
           && (log->items[from].action == MARKER_NONE
               || log->items[from].action == NC_MARKER_PARAM)) {
        from++;
    }
    return from;
}

/* Passes behind the first one: their first element follows the last one of the
 * loop. */
static void log_repetitions(struct engine *engine,
                            uint32_t from,
                            uint32_t to,
                            double length) {
    uint32_t first = 0;
    while (first < engine->log.item_count
           && engine->log.items[first].action != MARKER_NONE) {
        first++;
    }
    if (first < engine->log.item_count) {
        engine->log.items[first].entry.tangent_variation =
            angle_between(engine->push.last_tangent, engine->push.loop_tangent);
    }
    for (uint16_t pass = HLI_CLAH_PASS_LOOP; pass <= HLI_CLAH_PASS_EXIT;
         pass++) {
        engine->log.shift += length;
        log_items(engine, from, to, pass);
    }
}

void log_loop_end(struct engine *engine, double length) {
    marked_log *log = &engine->log;
    if (!log->in_loop) {
        return;
    }
    uint32_t count = log->item_count;
    bool open = log->active;
    log->in_loop = false;
    if (open) { /* opened ahead of the loop */
        uint32_t close = next_switch(&engine->log, 0);
        log_items(engine, 0, close, HLI_CLAH_PASS_ENTRY);
        log_repetitions(engine, 0, close, length);
        log_items(engine, close, count, HLI_CLAH_PASS_ENTRY);
        return;
    }
    log_items(engine, 0, count, HLI_CLAH_PASS_ENTRY);
    if (!log->active) {
        return; /* no area, or one inside the loop */
    }
    uint32_t from = 0;
    for (uint32_t i = next_switch(&engine->log, 0); i < count;
         i = next_switch(&engine->log, i + 1)) {
        from = i + 1;
    }
    log_repetitions(engine, from, count, length);
}

void log_program_end(struct engine *engine) {
    if (engine->log
            .in_loop) { /* the program broke off inside a real-time loop */
        engine->log.in_loop = false;
        log_items(engine, 0, engine->log.item_count, HLI_CLAH_PASS_ENTRY);
    }
    ATOMIC_SET(engine->log.active, 0);
}

struct logged log_now(const struct engine *engine) {
    const struct marked_log *log = &engine->log;
    return (struct logged){.elements = engine->store.element_head,
                           .count = log->count,
                           .active = log->active,
                           .complete = log->complete,
                           .ignoring = log->ignoring};
}

static bool is_element(const struct marked_log *log, uint32_t i) {
    uint32_t type = log_entry(log, i)->block_type;
    return type != HLI_CLAH_LOG_ON && type != HLI_CLAH_LOG_OFF
           && type != HLI_CLAH_LOG_PARAM;
}

/* Entries that were there ahead of a piece, but for elements that lie ahead of
 * the path, too; with the element that the path is in. */
static uint32_t entries_behind(const struct engine *engine,
                               const struct logged *was) {
    const struct marked_log *log = &engine->log;
    uint64_t begun = ATOMIC_GET(engine->geo.active) + 1;
    uint32_t count = was->count;
    for (uint64_t i = begun;
         i < was->elements && count > 0 && is_element(log, count - 1);
         i++) {
        count--;
    }
    if (begun > was->elements && count < log->count && is_element(log, count)) {
        count++;
    }
    return count;
}

/* The last element ends where the path stands. */
static uint32_t end_element(struct marked_log *log,
                            uint32_t count,
                            double distance) {
    if (count == 0 || !is_element(log, count - 1)) {
        return count;
    }
    uint32_t i = count - 1;
    HLI_CONTOUR_LOOKAHEAD_BLOCK *entry =
        &log->chunk[i / LOG_CHUNK][i % LOG_CHUNK];
    double driven = distance + log->shift - entry->start_position;
    entry->length = fmin(entry->length, driven);
    return driven > 0.0 ? count : i;
}

bool log_marker_is_ahead(const struct engine *engine,
                         const struct piece *piece) {
    uint64_t active = ATOMIC_GET(engine->geo.active);
    uint64_t begun = active + 1;
    if (piece->type != NC_MARKER || piece->element < begun) {
        return false;
    }
    if (piece->element > begun) {
        return true;
    }
    if (begun == 0) {
        return false; /* ahead of all motions */
    }
    const HLI_CONTOUR_LOOKAHEAD_BLOCK *facts =
        &element_at(&engine->store, active)->facts;
    double at = (engine->geo.dist - engine->geo.dist_shift) * TENTH_UM;
    return at < facts->start_position + facts->length - END_OF_ELEMENT;
}

uint64_t first_of_block(const struct engine *engine) {
    uint64_t at = engine->program.halt_piece;
    uint64_t first = at > ROWS_OF_BLOCK ? at - ROWS_OF_BLOCK : 0;
    return first < engine->dispatch.program_first
               ? engine->dispatch.program_first
               : first;
}

/* The first piece that comes again, as far as the log knows of it; NULL: none
 * does. */
static const struct piece *first_left(const struct engine *engine) {
    uint64_t head = engine->store.head;
    uint64_t halt = engine->program.halt_piece;
    uint64_t i = first_of_block(engine);
    while (i < halt
           && !log_marker_is_ahead(engine, store_at(&engine->store, i))) {
        i++;
    }
    return i < head ? store_at(&engine->store, i) : NULL;
}

void log_left_out(struct engine *engine) {
    struct marked_log *log = &engine->log;
    const struct piece *piece = first_left(engine);
    if (!piece || log->in_loop) {
        return;
    }
    const struct logged *was = &piece->logged;
    uint32_t count = entries_behind(engine, was);
    begin_change(log);
    count = end_element(log, count, engine->push.distance);
    ATOMIC_SET(log->count, count);
    ATOMIC_SET(log->active, was->active);
    log->complete = was->complete;
    log->ignoring = was->ignoring;
    end_change(log);
}
