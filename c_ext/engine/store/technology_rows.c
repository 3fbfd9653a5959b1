/* Rows of technology functions become output and gate pieces of the store. */
#include <stdlib.h>
#include <string.h>
#include "engine/store/technology_rows.h"
#include "engine/state/state.h"
#include "engine/store/store.h"
#include "rows/nc_block.h"

int engine_set_synch(struct engine *engine,
                     int kind,
                     uint32_t nr,
                     uint32_t synch,
                     double pre_output) {
    struct synch_table *synch_table =
        kind == NC_M   ? &engine->technology_rows.m_synch
        : kind == NC_H ? &engine->technology_rows.h_synch
                       : NULL;
    if (kind == NC_T) {
        engine->technology_rows.tool_synch = synch;
        return 0;
    }
    if (!synch_table || nr >= SYNCH_NUMBERS) {
        return -1;
    }
    if (!synch_table->synch) {
        synch_table->synch = calloc(SYNCH_NUMBERS, sizeof *synch_table->synch);
        synch_table->pre = calloc(SYNCH_NUMBERS, sizeof *synch_table->pre);
        if (!synch_table->synch || !synch_table->pre) {
            return -1;
        }
    }
    synch_table->synch[nr] = synch;
    synch_table->pre[nr] = pre_output;
    return 0;
}

int engine_set_spindle_synch(struct engine *engine,
                             uint32_t what,
                             uint32_t synch) {
    if (what >= sizeof engine->technology_rows.spindle_synch
                    / sizeof *engine->technology_rows.spindle_synch) {
        return -1;
    }
    engine->technology_rows.spindle_synch[what] = synch;
    return 0;
}

/* Functions of the main spindle: M3, M4, M5, M19, and an S word alone. */
static bool is_spindle(const engine_config *cfg, const nc_block *row) {
    if (!cfg->spindle_count) {
        return false;
    }
    return row->type == NC_S
           || (row->type == NC_M
               && (row->code == 3 || row->code == 4 || row->code == 5
                   || row->code == 19));
}

static uint32_t synch_of(const struct engine *engine, const nc_block *row) {
    if (is_spindle(&engine->cfg, row)) {
        return engine->technology_rows
            .spindle_synch[row->type == NC_S ? 0 : row->code];
    }
    if (row->type == NC_T) {
        return engine->technology_rows.tool_synch;
    }
    const struct synch_table *synch_table =
        row->type == NC_M ? &engine->technology_rows.m_synch
                          : &engine->technology_rows.h_synch;
    return synch_table->synch && row->code >= 0
                   && row->code < (int32_t)SYNCH_NUMBERS
               ? synch_table->synch[row->code]
               : 0;
}

static bool is_function(const nc_block *row) {
    return row->type == NC_M || row->type == NC_H || row->type == NC_T
           || row->type == NC_S;
}

static struct piece *new_event(struct engine *engine, const nc_block *row) {
    struct piece *piece = store_slot(engine, row);
    piece->kind = PIECE_EVENT;
    piece->code = row->code;
    piece->value = row->value;
    piece->element = engine->store.element_head;
    memcpy(piece->end, engine->push.last_end, sizeof piece->end);
    return piece;
}

static void push_gate(struct engine *engine,
                      const nc_block *row,
                      struct techno_counts need) {
    struct piece *piece = new_event(engine, row);
    piece->type = NC_EVENT;
    piece->code = EVENT_GATE;
    piece->need = need;
    piece->gated = true;
    engine->technology_rows.pending_gate = need;
    engine->technology_rows.has_pending_gate = true;
    store_publish(&engine->store);
}

/* The counts a gate needs when everything pushed up to now has to be done in
 * the member given. */
static struct techno_counts need_freed(
    const struct technology_rows *technology_rows) {
    struct techno_counts need = {0};
    need.std_freed = technology_rows->pushed.std_freed;
    return need;
}

/* What the spindle is to do: move command and speed, or a position. */
static void spindle_piece(const struct technology_rows *technology_rows,
                          struct piece *piece,
                          const nc_block *row) {
    piece->type = NC_S;
    piece->code = row->type == NC_S ? technology_rows->spindle_move : row->code;
    piece->value =
        row->type == NC_S ? row->value : technology_rows->spindle_rev;
    piece->dist0 =
        row->type == NC_M && row->code == 19 && row->flags & NC_HAS_VALUE
            ? row->value
            : 0.0;
}

/* A function more (1) or less (-1) that gates wait for. */
static void count_pushed(struct techno_counts *pushed,
                         uint32_t synch,
                         int change) {
    uint64_t by = (uint64_t)(int64_t)change;
    if (synch & LATE) {
        pushed->late_freed += by;
    } else {
        pushed->std_freed += by;
    }
    if (synch & SYNCH_MVS_SLM) {
        pushed->slm_acked += by;
    } else if (synch & SYNCH_MVS_SLP) {
        pushed->slp_acked += by;
    } else if (synch & WAITS) {
        pushed->std_acked += by;
    }
}

static void push_output(struct engine *engine,
                        const nc_block *row,
                        uint32_t synch) {
    struct techno_counts need = {0};
    bool late = synch & LATE;
    if (late) {
        need.late_freed =
            engine->technology_rows.pushed.late_freed >= LATE_UNITS
                ? engine->technology_rows.pushed.late_freed - LATE_UNITS + 1
                : 0;
    } else if (row->count != engine->technology_rows.std_block
               || engine->technology_rows.std_index >= STD_UNITS) {
        need = need_freed(&engine->technology_rows);
        engine->technology_rows.std_block = row->count;
        engine->technology_rows.std_base =
            engine->technology_rows.pushed.std_freed;
        engine->technology_rows.std_index = 0;
    }
    if (need.std_freed || need.late_freed) {
        push_gate(engine, row, need);
    }
    struct piece *piece = new_event(engine, row);
    piece->flags |= NC_OUTPUT;
    piece->synch = synch;
    if (is_spindle(&engine->cfg, row)) {
        spindle_piece(&engine->technology_rows, piece, row);
    }
    piece->unit =
        late || piece->type == NC_S ? 0 : engine->technology_rows.std_index++;
    if (synch & SYNCH_MNS_SNS) {
        piece->stop_before = true;
    }
    engine->push.stop_pending |= piece->stop_before;
    store_publish(&engine->store);
    count_pushed(&engine->technology_rows.pushed, synch, 1);
}

static void push_ack_gate(struct engine *engine, const nc_block *row) {
    struct techno_counts need = {0};
    need.std_acked = engine->technology_rows.pushed.std_acked;
    push_gate(engine, row, need);
}

void techno_block_end(struct engine *engine) {
    struct technology_rows *rows = &engine->technology_rows;
    uint64_t next = engine->push.rows_taken; /* pieces belong to their rows */
    uint32_t count = rows->behind_count;
    if (!count) {
        return;
    }
    rows->behind_count = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t synch = synch_of(engine, &rows->behind[i]);
        engine->push.rows_taken = rows->behind_number[i];
        if (synch & SYNCH_MNS_SNS) {
            push_output(engine, &rows->behind[i], synch);
        }
    }
    push_ack_gate(engine, &rows->behind[count - 1]);
    engine->push.rows_taken = next;
}

/* Early output of the output piece pushed last: GEO looks at the nearest one
 * each cycle. */
static void push_early(struct engine *engine,
                       const nc_block *row,
                       uint32_t synch) {
    struct early_output *early_output =
        &engine->early.entries[engine->early.head % EARLY_MAX];
    const struct synch_table *synch_table =
        row->type == NC_M ? &engine->technology_rows.m_synch
                          : &engine->technology_rows.h_synch;
    double pre = synch_table->pre ? synch_table->pre[row->code] : 0.0;
    early_output->path = engine->push.path;
    early_output->distance = synch & SYNCH_MEP_SVS ? pre / TENTH_UM : 0.0;
    early_output->time = synch & SYNCH_MET_SVS ? pre * 1e-6 : 0.0;
    early_output->piece = engine->store.head - 1;
    early_output->free_before = engine->technology_rows.std_base;
    ATOMIC_SET(engine->early.head, engine->early.head + 1);
}

bool techno_has_room(const struct engine *engine) {
    return engine->early.head - ATOMIC_GET(engine->early.done) < EARLY_MAX - 64
           && engine->technology_rows.behind_count < BEHIND_MAX;
}

void techno_spindle_word(struct engine *engine) {
    if (!engine->technology_rows.spindle_pending) {
        return;
    }
    struct technology_rows *rows = &engine->technology_rows;
    uint64_t next = engine->push.rows_taken;
    rows->spindle_pending = false;
    if (rows->spindle_synch[0]
        && (rows->spindle_move == 3 || rows->spindle_move == 4)) {
        engine->push.rows_taken = rows->spindle_number;
        push_output(engine, &rows->spindle_row, rows->spindle_synch[0]);
        if (rows->spindle_synch[0] & SYNCH_MVS_SVS) {
            push_ack_gate(engine, &rows->spindle_row);
        }
        engine->push.rows_taken = next;
    }
}

static bool note_spindle(struct technology_rows *technology_rows,
                         const nc_block *row,
                         uint64_t number) {
    if (row->type == NC_S) {
        technology_rows->spindle_number = number;
        technology_rows->spindle_rev = row->value;
        technology_rows->spindle_row = *row;
        technology_rows->spindle_pending = true;
        return false;
    }
    technology_rows->spindle_move = row->code == 19 ? 0 : row->code;
    technology_rows->spindle_pending = false;
    return true;
}

bool techno_push(struct engine *engine, const nc_block *row) {
    if (is_spindle(&engine->cfg, row)
        && !note_spindle(&engine->technology_rows,
                         row,
                         engine->push.rows_taken)) {
        return false;
    }
    uint32_t synch =
        is_function(row) && row->type != NC_S ? synch_of(engine, row) : 0;
    if (!synch) {
        return false;
    }
    if (synch & BEHIND) {
        struct technology_rows *rows = &engine->technology_rows;
        rows->behind[rows->behind_count] = *row;
        rows->behind_number[rows->behind_count++] = engine->push.rows_taken;
    }
    if (synch & SYNCH_MNS_SNS) {
        return true;
    }
    push_output(engine, row, synch);
    if (synch & EARLY) {
        push_early(engine, row, synch);
    }
    if (synch & (SYNCH_MVS_SVS | EARLY)) {
        push_ack_gate(engine, row);
    }
    return true;
}

void techno_before_motion(struct engine *engine, const nc_block *row) {
    if (row->flags & NC_RAPID
        || engine->technology_rows.gated.slm_acked
               == engine->technology_rows.pushed.slm_acked) {
        return;
    }
    struct techno_counts need = {0};
    need.slm_acked = engine->technology_rows.pushed.slm_acked;
    engine->technology_rows.gated.slm_acked =
        engine->technology_rows.pushed.slm_acked;
    push_gate(engine, row, need);
}

void techno_expl_syn(struct engine *engine, const nc_block *row) {
    struct techno_counts need = {0};
    need.slp_acked = engine->technology_rows.pushed.slp_acked;
    if (need.slp_acked) {
        push_gate(engine, row, need);
    }
}

bool is_gate(const struct piece *piece) {
    return piece->kind == PIECE_EVENT && piece->type == NC_EVENT
           && piece->code == EVENT_GATE;
}

void techno_left_out(struct engine *engine) {
    struct technology_rows *rows = &engine->technology_rows;
    uint64_t head = engine->store.head;
    for (uint64_t i = engine->program.halt_piece; i < head; i++) {
        const struct piece *piece = store_at(&engine->store, i);
        if (piece->kind == PIECE_EVENT && piece->flags & NC_OUTPUT
            && !piece->put_out) {
            count_pushed(&rows->pushed, piece->synch, -1);
        }
    }
    rows->has_pending_gate = false;
    rows->gated = rows->pushed;
    rows->std_block = rows->std_index = 0;
    rows->std_base = rows->pushed.std_freed;
}

void engine_await_functions(struct engine *engine) {
    struct technology_rows *rows = &engine->technology_rows;
    rows->gated.slm_acked = 0; /* the next feed motion asks */
    if (!rows->pushed.std_acked) {
        return;
    }
    const nc_block row = {0};
    engine->push.rows_taken--; /* it belongs to what was pushed last */
    push_ack_gate(engine, &row);
    engine->push.rows_taken++;
}
