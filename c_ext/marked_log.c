/* The marked log (mode 1): entries between LOG ON and LOG OFF, written by SDA, read by the service.
 *
 * Entries are published before their count; f_log_is_active falls last. LOG CLEAR changes the generation, so that a
 * reader that was in the middle of a copy notices and starts again.
 */
#include <stdlib.h>
#include "engine_internal.h"

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

static void append_marker(engine *e, const nc_block *row, uint32_t type) {
    HLI_CONTOUR_LOOKAHEAD_BLOCK entry;
    memset(&entry, 0, sizeof entry);
    entry.block_type = type;
    entry.block_number = row->n;
    entry.block_count_r = row->count;
    entry.start_position = e->distance;
    entry.length = row->flags & NC_HAS_PARAM ? row->value : 0.0;
    append(e, &entry);
}

static void log_off(engine *e, const nc_block *row) {
    if (e->log.active) {
        append_marker(e, row, HLI_CLAH_LOG_OFF);
        e->log.complete = true;
        ATOMIC_SET(e->log.active, 0);
    }
    e->log.ignoring = false;
}

static void log_on(engine *e, const nc_block *row) {
    if (e->log.active || e->log.ignoring) { /* the manual's loop examples close an area with ON */
        e->log_on_closed++;
        log_off(e, row);
    } else if (e->log.complete) {
        e->log_ignored_areas++;
        e->log.ignoring = true;
    } else {
        append_marker(e, row, HLI_CLAH_LOG_ON);
        ATOMIC_SET(e->log.active, 1);
    }
}

static void log_clear(engine *e) {
    ATOMIC_SET(e->log.generation, e->log.generation + 1);
    __atomic_thread_fence(__ATOMIC_SEQ_CST);
    ATOMIC_SET(e->log.active, 0);
    ATOMIC_SET(e->log.count, 0);
    e->log.complete = e->log.ignoring = false;
    ATOMIC_SET(e->log.generation, e->log.generation + 1);
}

void log_marker(engine *e, const nc_block *row) {
    if (!log_available(e)) {
        e->log_disabled++;
        return;
    }
    if (row->code == NC_MARKER_ON) log_on(e, row);
    else if (row->code == NC_MARKER_OFF) log_off(e, row);
    else if (row->code == NC_MARKER_CLEAR) log_clear(e);
    else if (e->log.active) append_marker(e, row, HLI_CLAH_LOG_PARAM);
    else if (!e->log.ignoring) e->log_stray_params++;
}

void log_element(engine *e, const element *el) {
    if (e->log.active) append(e, &el->facts);
}

void log_program_end(engine *e) { ATOMIC_SET(e->log.active, 0); }
