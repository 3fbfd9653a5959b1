/* The marked log (mode 1): entries between LOG ON and LOG OFF, written by SDA, read by the service.
 *
 * Entries are published before their count; f_log_is_active falls last. LOG CLEAR changes the generation, so that a
 * reader that was in the middle of a copy notices and starts again. What stands in a real-time loop is kept aside until
 * the loop's end is known: an area inside the loop is logged once, a loop inside an area three times (section 8).
 */
#include <stdlib.h>
#include "engine/state/state.h"

#define LOOP_COPIES 3
#define MARKER_NONE 0 /* an element */

typedef struct loop_item {
    HLI_CONTOUR_LOOKAHEAD_BLOCK entry;
    int action; /* NC_MARKER_... or MARKER_NONE */
} loop_item;

bool log_available(const engine *e) {
    return (e->cfg.functions & ENGINE_FCT_CONTOUR_LAH) && e->cfg.log_max > 0 && e->cfg.fb_storage_size > 0;
}

const HLI_CONTOUR_LOOKAHEAD_BLOCK *log_entry(const engine *e, uint32_t i) {
    return &e->log.chunk[i / LOG_CHUNK][i % LOG_CHUNK];
}

static void append(engine *e, const HLI_CONTOUR_LOOKAHEAD_BLOCK *entry) {
    marked_log *log = &e->log;
    uint32_t i = log->count;
    if (i >= e->cfg.log_max || i / LOG_CHUNK >= LOG_CHUNKS) {
        e->log_dropped++;
        return;
    }
    if (!log->chunk[i / LOG_CHUNK]) {
        log->chunk[i / LOG_CHUNK] = calloc(LOG_CHUNK, sizeof *entry);
        if (!log->chunk[i / LOG_CHUNK]) {
            e->fault = ENGINE_NO_MEMORY;
            return;
        }
    }
    log->chunk[i / LOG_CHUNK][i % LOG_CHUNK] = *entry;
    ATOMIC_SET(log->count, i + 1);
}

/* Entries know their distance as if every real-time loop were driven once; the copies logged so far come on top. */
static void append_shifted(engine *e, HLI_CONTOUR_LOOKAHEAD_BLOCK entry) {
    entry.start_position += e->log.shift;
    append(e, &entry);
}

static void append_typed(engine *e, HLI_CONTOUR_LOOKAHEAD_BLOCK entry, uint32_t type) {
    entry.block_type = type;
    append_shifted(e, entry);
}

static void log_off(engine *e, const HLI_CONTOUR_LOOKAHEAD_BLOCK *marker) {
    if (e->log.active) {
        append_typed(e, *marker, HLI_CLAH_LOG_OFF);
        e->log.complete = true;
        ATOMIC_SET(e->log.active, 0);
    }
    e->log.ignoring = false;
}

static void log_on(engine *e, const HLI_CONTOUR_LOOKAHEAD_BLOCK *marker) {
    if (e->log.active || e->log.ignoring) { /* the manual's loop examples close an area with ON */
        e->log_on_closed++;
        log_off(e, marker);
    } else if (e->log.complete) {
        e->log_ignored_areas++;
        e->log.ignoring = true;
    } else {
        append_typed(e, *marker, HLI_CLAH_LOG_ON);
        ATOMIC_SET(e->log.active, 1);
    }
}

static void log_clear(engine *e) {
    ATOMIC_SET(e->log.generation, e->log.generation + 1);
    __atomic_thread_fence(__ATOMIC_SEQ_CST);
    ATOMIC_SET(e->log.active, 0);
    ATOMIC_SET(e->log.count, 0);
    e->log.complete = e->log.ignoring = false;
    e->log.shift = 0.0;
    ATOMIC_SET(e->log.generation, e->log.generation + 1);
}

static void mark(engine *e, int action, const HLI_CONTOUR_LOOKAHEAD_BLOCK *marker) {
    if (action == NC_MARKER_ON) log_on(e, marker);
    else if (action == NC_MARKER_OFF) log_off(e, marker);
    else if (action == NC_MARKER_CLEAR) log_clear(e);
    else if (e->log.active) append_typed(e, *marker, HLI_CLAH_LOG_PARAM);
    else if (!e->log.ignoring) e->log_stray_params++;
}

/* Keep an entry of a real-time loop aside. */
static void keep(engine *e, const HLI_CONTOUR_LOOKAHEAD_BLOCK *entry, int action) {
    marked_log *log = &e->log;
    if (log->item_count == log->item_room) {
        uint32_t room = log->item_room ? 2 * log->item_room : 64;
        loop_item *items = realloc(log->items, room * sizeof *items);
        if (!items) {
            e->fault = ENGINE_NO_MEMORY;
            return;
        }
        log->items = items;
        log->item_room = room;
    }
    log->items[log->item_count++] = (loop_item){*entry, action};
}

/* Program start: the log is empty. */
void log_reset(engine *e) {
    log_clear(e);
    e->log.in_loop = false;
    e->log_dropped = e->log_ignored_areas = e->log_stray_params = e->log_on_closed = e->log_disabled = 0;
}

void log_marker(engine *e, const nc_block *row) {
    if (!log_available(e)) {
        e->log_disabled++;
        return;
    }
    HLI_CONTOUR_LOOKAHEAD_BLOCK marker;
    memset(&marker, 0, sizeof marker);
    marker.block_number = row->n;
    marker.block_count_r = row->count;
    marker.start_position = e->distance;
    marker.length = row->flags & NC_HAS_PARAM ? row->value : 0.0;
    if (e->log.in_loop) keep(e, &marker, row->code);
    else mark(e, row->code, &marker);
}

void log_element(engine *e, const element *el) {
    if (e->log.in_loop) keep(e, &el->facts, MARKER_NONE);
    else if (e->log.active) append_shifted(e, el->facts);
}

void log_loop_begin(engine *e) {
    e->log.in_loop = log_available(e);
    e->log.item_count = 0;
}

static void log_item(engine *e, const loop_item *item) {
    if (item->action != MARKER_NONE) mark(e, item->action, &item->entry);
    else if (e->log.active) append_shifted(e, item->entry);
}

static void log_items(engine *e, uint32_t from, uint32_t to) {
    for (uint32_t i = from; i < to; i++) log_item(e, &e->log.items[i]);
}

/* First marker from `from` on that opens or closes an area; item_count if there is none. */
static uint32_t next_switch(const engine *e, uint32_t from) {
    while (from < e->log.item_count && (e->log.items[from].action == MARKER_NONE || e->log.items[from].action == NC_MARKER_PARAM)) from++;
    return from;
}

/* Passes behind the first one: their first element follows the last one of the loop. */
static void log_repetitions(engine *e, uint32_t from, uint32_t to, double length) {
    uint32_t first = 0;
    while (first < e->log.item_count && e->log.items[first].action != MARKER_NONE) first++;
    if (first < e->log.item_count) e->log.items[first].entry.tangent_variation = angle_between(e->last_tangent, e->loop_tangent);
    for (int copy = 1; copy < LOOP_COPIES; copy++) {
        e->log.shift += length;
        log_items(e, from, to);
    }
}

void log_loop_end(engine *e, double length) {
    marked_log *log = &e->log;
    if (!log->in_loop) return;
    uint32_t n = log->item_count;
    bool open = log->active;
    log->in_loop = false;
    if (open) { /* opened ahead of the loop */
        uint32_t close = next_switch(e, 0);
        log_items(e, 0, close);
        log_repetitions(e, 0, close, length);
        log_items(e, close, n);
        return;
    }
    log_items(e, 0, n);
    if (!log->active) return; /* no area, or one inside the loop */
    uint32_t from = 0;
    for (uint32_t i = next_switch(e, 0); i < n; i = next_switch(e, i + 1)) from = i + 1;
    log_repetitions(e, from, n, length);
}

void log_program_end(engine *e) {
    if (e->log.in_loop) { /* the program broke off inside a real-time loop */
        e->log.in_loop = false;
        log_items(e, 0, e->log.item_count);
    }
    ATOMIC_SET(e->log.active, 0);
}
