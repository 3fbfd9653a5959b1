/* M, H and T functions to the PLC: technology units with two flags
 * (hli_reference section 6).
 *
 * SDA turns a function row into pieces: an `output` and, where the CNC waits, a
 * `gate`. Functions are numbered as they are pushed; GEO counts how many have
 * been acknowledged or have freed their unit. A gate is open when the counts
 * have reached what it needs, and stays open. A closed gate is a standstill for
 * the planner, an open one is nothing, so a function that is acknowledged in
 * time costs no speed.
 *
 * The std array holds one block's functions, contiguous from 0; the late array
 * has gaps.
 */
#include <math.h>
#include <stdlib.h>
#include "engine/state/state.h"

#define STD_UNITS (HLI_TU_CH_STD_SYNC_MAXIDX + 1u)
#define LATE_UNITS (HLI_TU_CH_LATE_SYNC_MAXIDX + 1u)
#define WAITS                                                                  \
    (SYNCH_MVS_SVS | SYNCH_MVS_SNS | SYNCH_MNS_SNS | SYNCH_MEP_SVS             \
     | SYNCH_MET_SVS)
#define EARLY (SYNCH_MEP_SVS | SYNCH_MET_SVS)
#define LATE (SYNCH_MVS_SLM | SYNCH_MVS_SLP)
#define BEHIND (SYNCH_MVS_SNS | SYNCH_MNS_SNS)

int engine_set_synch(struct engine *engine,
                     int kind,
                     uint32_t nr,
                     uint32_t synch,
                     double pre_output) {
    struct synch_table *synch_table = kind == NC_M   ? &engine->m_synch
                                      : kind == NC_H ? &engine->h_synch
                                                     : NULL;
    if (kind == NC_T) {
        engine->tool_synch = synch;
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
    if (what >= sizeof engine->spindle_synch / sizeof *engine->spindle_synch) {
        return -1;
    }
    engine->spindle_synch[what] = synch;
    return 0;
}

/* Functions of the main spindle: M3, M4, M5, M19, and an S word alone. */
static bool is_spindle(const struct engine *engine, const nc_block *row) {
    if (!engine->cfg.spindle_count) {
        return false;
    }
    return row->type == NC_S
           || (row->type == NC_M
               && (row->code == 3 || row->code == 4 || row->code == 5
                   || row->code == 19));
}

static uint32_t synch_of(const struct engine *engine, const nc_block *row) {
    if (is_spindle(engine, row)) {
        return engine->spindle_synch[row->type == NC_S ? 0 : row->code];
    }
    if (row->type == NC_T) {
        return engine->tool_synch;
    }
    const struct synch_table *synch_table =
        row->type == NC_M ? &engine->m_synch : &engine->h_synch;
    return synch_table->synch && row->code >= 0
                   && row->code < (int32_t)SYNCH_NUMBERS
               ? synch_table->synch[row->code]
               : 0;
}

static bool is_function(const nc_block *row) {
    return row->type == NC_M || row->type == NC_H || row->type == NC_T
           || row->type == NC_S;
}

/* ------------------------------------------------------------------------------------------------
 * SDA */
static struct piece *new_event(struct engine *engine, const nc_block *row) {
    struct piece *piece = store_slot(engine, row);
    piece->kind = PIECE_EVENT;
    piece->code = row->code;
    piece->value = row->value;
    piece->element = engine->element_head;
    memcpy(piece->end, engine->last_end, sizeof piece->end);
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
    engine->pending_gate = need;
    engine->has_pending_gate = true;
    store_publish(engine);
}

/* The counts a gate needs when everything pushed up to now has to be done in
 * the member given. */
static struct techno_counts need_freed(const struct engine *engine) {
    struct techno_counts need = {0};
    need.std_freed = engine->pushed.std_freed;
    return need;
}

/* What the spindle is to do: move command and speed, or a position. */
static void spindle_piece(const struct engine *engine,
                          struct piece *piece,
                          const nc_block *row) {
    piece->type = NC_S;
    piece->code = row->type == NC_S ? engine->spindle_move : row->code;
    piece->value = row->type == NC_S ? row->value : engine->spindle_rev;
    piece->dist0 =
        row->type == NC_M && row->code == 19 && row->flags & NC_HAS_VALUE
            ? row->value
            : 0.0;
}

static void push_output(struct engine *engine,
                        const nc_block *row,
                        uint32_t synch) {
    struct techno_counts need = {0};
    bool late = synch & LATE;
    if (late) {
        need.late_freed = engine->pushed.late_freed >= LATE_UNITS
                              ? engine->pushed.late_freed - LATE_UNITS + 1
                              : 0;
    } else if (row->count != engine->std_block
               || engine->std_index >= STD_UNITS) {
        need = need_freed(engine);
        engine->std_block = row->count;
        engine->std_base = engine->pushed.std_freed;
        engine->std_index = 0;
    }
    if (need.std_freed || need.late_freed) {
        push_gate(engine, row, need);
    }
    struct piece *piece = new_event(engine, row);
    piece->flags |= NC_OUTPUT;
    piece->synch = synch;
    if (is_spindle(engine, row)) {
        spindle_piece(engine, piece, row);
    }
    piece->unit = late || piece->type == NC_S ? 0 : engine->std_index++;
    if (synch & SYNCH_MNS_SNS) {
        piece->stop_before = true;
    }
    engine->stop_pending |= piece->stop_before;
    store_publish(engine);
    if (late) {
        engine->pushed.late_freed++;
    } else {
        engine->pushed.std_freed++;
    }
    if (synch & SYNCH_MVS_SLM) {
        engine->pushed.slm_acked++;
    } else if (synch & SYNCH_MVS_SLP) {
        engine->pushed.slp_acked++;
    } else if (synch & WAITS) {
        engine->pushed.std_acked++;
    }
}

static void push_ack_gate(struct engine *engine, const nc_block *row) {
    struct techno_counts need = {0};
    need.std_acked = engine->pushed.std_acked;
    push_gate(engine, row, need);
}

/* Functions that are put out or waited for behind the motion of their block. */
void techno_block_end(struct engine *engine) {
    uint32_t count = engine->behind_count;
    if (!count) {
        return;
    }
    engine->behind_count = 0;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t synch = synch_of(engine, &engine->behind[i]);
        if (synch & SYNCH_MNS_SNS) {
            push_output(engine, &engine->behind[i], synch);
        }
    }
    push_ack_gate(engine, &engine->behind[count - 1]);
}

/* Early output of the output piece pushed last: GEO looks at the nearest one
 * each cycle. */
static void push_early(struct engine *engine,
                       const nc_block *row,
                       uint32_t synch) {
    struct early_output *early_output =
        &engine->early[engine->early_head % EARLY_MAX];
    const struct synch_table *synch_table =
        row->type == NC_M ? &engine->m_synch : &engine->h_synch;
    double pre = synch_table->pre ? synch_table->pre[row->code] : 0.0;
    early_output->path = engine->pushed_path;
    early_output->distance = synch & SYNCH_MEP_SVS ? pre / TENTH_UM : 0.0;
    early_output->time = synch & SYNCH_MET_SVS ? pre * 1e-6 : 0.0;
    early_output->piece = engine->store_head - 1;
    early_output->free_before = engine->std_base;
    ATOMIC_SET(engine->early_head, engine->early_head + 1);
}

/* Room for what one row may add. */
bool techno_has_room(const struct engine *e) {
    return e->early_head - ATOMIC_GET(e->early_done) < EARLY_MAX - 64
           && e->behind_count < BEHIND_MAX;
}

/* An S word of a block without M3, M4, M5, M19: a turning spindle changes its
 * speed. */
void techno_spindle_word(struct engine *engine) {
    if (!engine->spindle_pending) {
        return;
    }
    engine->spindle_pending = false;
    if (engine->spindle_synch[0]
        && (engine->spindle_move == 3 || engine->spindle_move == 4)) {
        push_output(engine, &engine->spindle_row, engine->spindle_synch[0]);
        if (engine->spindle_synch[0] & SYNCH_MVS_SVS) {
            push_ack_gate(engine, &engine->spindle_row);
        }
    }
}

static bool note_spindle(struct engine *engine, const nc_block *row) {
    if (row->type == NC_S) {
        engine->spindle_rev = row->value;
        engine->spindle_row = *row;
        engine->spindle_pending = true;
        return false;
    }
    engine->spindle_move = row->code == 19 ? 0 : row->code;
    engine->spindle_pending = false;
    return true;
}

/* A function row; false if it is no function that goes to the PLC. */
bool techno_push(struct engine *e, const nc_block *row) {
    if (is_spindle(e, row) && !note_spindle(e, row)) {
        return false;
    }
    uint32_t synch =
        is_function(row) && row->type != NC_S ? synch_of(e, row) : 0;
    if (!synch) {
        return false;
    }
    if (synch & BEHIND) {
        e->behind[e->behind_count++] = *row;
    }
    if (synch & SYNCH_MNS_SNS) {
        return true;
    }
    push_output(e, row, synch);
    if (synch & EARLY) {
        push_early(e, row, synch);
    }
    if (synch & (SYNCH_MVS_SVS | EARLY)) {
        push_ack_gate(e, row);
    }
    return true;
}

/* MVS_SLM: the transition to the next G01, G02, G03. MVS_SLP: at #EXPL SYN. */
void techno_before_motion(struct engine *engine, const nc_block *row) {
    if (row->flags & NC_RAPID
        || engine->gated.slm_acked == engine->pushed.slm_acked) {
        return;
    }
    struct techno_counts need = {0};
    need.slm_acked = engine->pushed.slm_acked;
    engine->gated.slm_acked = engine->pushed.slm_acked;
    push_gate(engine, row, need);
}

void techno_expl_syn(struct engine *engine, const nc_block *row) {
    struct techno_counts need = {0};
    need.slp_acked = engine->pushed.slp_acked;
    if (need.slp_acked) {
        push_gate(engine, row, need);
    }
}

/* ------------------------------------------------------------------------------------------------
 * gates */
bool gate_open(const struct techno_counts *done,
               const struct techno_counts *need) {
    return done->std_freed >= need->std_freed
           && done->std_acked >= need->std_acked
           && done->late_freed >= need->late_freed
           && done->slm_acked >= need->slm_acked
           && done->slp_acked >= need->slp_acked;
}

struct techno_counts techno_done(const struct techno_counts *counts) {
    struct techno_counts techno_counts;
    techno_counts.std_freed = ATOMIC_GET(counts->std_freed);
    techno_counts.std_acked = ATOMIC_GET(counts->std_acked);
    techno_counts.late_freed = ATOMIC_GET(counts->late_freed);
    techno_counts.slm_acked = ATOMIC_GET(counts->slm_acked);
    techno_counts.slp_acked = ATOMIC_GET(counts->slp_acked);
    return techno_counts;
}

static uint32_t free_spindle_slot(const struct engine *engine) {
    uint32_t i = 0;
    while (i <= HLI_TU_AX_STD_SYNC_MAXIDX && engine->spindle_slots[0][i].used) {
        i++;
    }
    return i;
}

static uint32_t free_std_slot(const struct engine *engine) {
    uint32_t i = 0;
    while (i < STD_UNITS && engine->std_slots[i].used) {
        i++;
    }
    return i;
}

/* An event that cannot be run yet: a gate that is not open, a repeated function
 * without a free unit. */
bool techno_blocked(struct engine *e, const struct piece *p) {
    if (p->gated
        && !gate_open(p->replay ? &e->done_again : &e->done, &p->need)) {
        return true;
    }
    if (!(p->flags & NC_OUTPUT) || p->synch & LATE) {
        return false;
    }
    if (p->type == NC_S) {
        return free_spindle_slot(e) > HLI_TU_AX_STD_SYNC_MAXIDX;
    }
    if (p->replay) {
        return free_std_slot(e) >= STD_UNITS;
    }
    return !store_at(e, p->origin)->put_out && e->std_slots[p->unit].used;
}

/* ------------------------------------------------------------------------------------------------
 * GEO */
static void count(uint64_t *counter) {
    ATOMIC_SET(*counter, *counter + 1);
}

static void acknowledge(struct engine *engine,
                        struct techno_slot *techno_slot) {
    if (techno_slot->acked) {
        return;
    }
    techno_slot->acked = true;
    struct techno_counts *done =
        techno_slot->replay ? &engine->done_again : &engine->done;
    if (techno_slot->synch & SYNCH_MVS_SLM) {
        count(&done->slm_acked);
    } else if (techno_slot->synch & SYNCH_MVS_SLP) {
        count(&done->slp_acked);
    } else if (techno_slot->synch & WAITS) {
        count(&done->std_acked);
    }
}

static void release(struct engine *engine,
                    struct techno_slot *techno_slot,
                    bool late) {
    struct techno_counts *done =
        techno_slot->replay ? &engine->done_again : &engine->done;
    techno_slot->used = false;
    count(late ? &done->late_freed : &done->std_freed);
}

static void fill_function(struct engine *engine,
                          TECHNO_UNIT_CH *unit,
                          const struct piece *piece) {
    HLI_M_H_PROZESS m_h_prozess;
    memset(&m_h_prozess, 0, sizeof m_h_prozess);
    m_h_prozess.nr = (uint32_t)piece->code;
    m_h_prozess.satz_nr = piece->n;
    m_h_prozess.zeilen_nr = piece->count;
    m_h_prozess.add_value =
        piece->flags & NC_HAS_VALUE
            ? (int32_t)lrint(fmax(-2e9, fmin(2e9, piece->value)))
            : 0;
    m_h_prozess.nr_late_sync = (uint16_t)engine->late_open;
    m_h_prozess.synch_mode = piece->synch;
    memcpy(&unit->attribut_r, &m_h_prozess, sizeof m_h_prozess);
}

static void fill_tool(struct engine *engine,
                      TECHNO_UNIT_CH *unit,
                      const struct piece *piece) {
    HLI_T_PROZESS t_prozess;
    memset(&t_prozess, 0, sizeof t_prozess);
    t_prozess.id.basic = piece->code;
    t_prozess.nr_late_sync = (uint16_t)engine->late_open;
    t_prozess.synch_mode = piece->synch;
    memcpy(&unit->attribut_r, &t_prozess, sizeof t_prozess);
}

static void fill_spindle(struct engine *engine,
                         TECHNO_UNIT_CH *unit,
                         const struct piece *piece) {
    HLI_S_PROZESS s_prozess;
    memset(&s_prozess, 0, sizeof s_prozess);
    s_prozess.pos = (int32_t)lrint(fmax(-2e9, fmin(2e9, piece->dist0 * 1e4)));
    s_prozess.rev = (int32_t)lrint(
        fmin(2e9, piece->value * 6000.0)); /* rev/min as 1e-3 degrees/s */
    s_prozess.move_cmd = piece->code == 19 ? 0 : (uint16_t)piece->code;
    s_prozess.pos_cmd = piece->code == 19 ? 19 : 0;
    s_prozess.axis_nr = (uint16_t)engine->cfg.spindle_id[0];
    s_prozess.synch_mode = piece->synch;
    s_prozess.satz_nr = piece->n;
    s_prozess.zeilen_nr = piece->count;
    memcpy(&unit->attribut_r, &s_prozess, sizeof s_prozess);
}

/* Data first, done_w FALSE, please_rw TRUE last. */
static void put_out(struct engine *engine,
                    TECHNO_UNIT_CH *unit,
                    struct techno_slot *techno_slot,
                    const struct piece *piece) {
    memset(&unit->attribut_r, 0, sizeof unit->attribut_r);
    if (piece->type == NC_S) {
        fill_spindle(engine, unit, piece);
    } else if (piece->type == NC_T) {
        fill_tool(engine, unit, piece);
    } else {
        fill_function(engine, unit, piece);
    }
    store_u16_relaxed(&unit->fkt_ctrl_r,
                      piece->type == NC_M   ? 1
                      : piece->type == NC_H ? 2
                      : piece->type == NC_S ? 3
                                            : 4);
    store_u8_release(&unit->done_w, 0);
    store_u8_release(&unit->please_rw, 1);
    *techno_slot = (struct techno_slot){.used = true,
                                        .synch = piece->synch,
                                        .replay = piece->replay};
}

static uint32_t free_late_slot(const struct engine *engine) {
    uint32_t i = 0;
    while (i < LATE_UNITS && engine->late_slots[i].used) {
        i++;
    }
    return i;
}

/* Spindle functions go to the spindle's axis area. */
static void output_spindle(struct engine *engine, struct piece *piece) {
    HLI_AXIS *axis =
        engine->segment ? &engine->segment->axis[engine->cfg.axis_count] : NULL;
    bool present = axis && !engine->suppressed
                   && load_u8_acquire(&axis->head.plc_present_w);
    uint32_t i = free_spindle_slot(engine);
    struct techno_slot here = {.used = true,
                               .synch = piece->synch,
                               .replay = piece->replay};
    if (!present) {
        engine->techno_unseen++;
        acknowledge(engine, &here);
        release(engine, &here, false);
        return;
    }
    engine->techno_functions++;
    put_out(engine,
            (TECHNO_UNIT_CH *)&axis->techno_unit_std_sync[i],
            &engine->spindle_slots[0][i],
            piece);
    engine->spindle_open[0]++;
    if (!piece->replay && ATOMIC_GET(engine->simulate_now)
        && !(piece->synch & SYNCH_FWD)) {
        acknowledge(engine, &engine->spindle_slots[0][i]);
    }
    if (i >= engine->spindle_used) {
        store_u16_relaxed(&axis->used_units_std_sync_r,
                          (uint16_t)(engine->spindle_used = i + 1));
    }
}

void techno_output(struct engine *engine, struct piece *piece) {
    if (piece->put_out) {
        return;
    }
    piece->put_out = true;
    if (piece->type == NC_S) {
        output_spindle(engine, piece);
        return;
    }
    bool late = piece->synch & LATE;
    bool present = engine->channel && !engine->suppressed
                   && load_u8_acquire(&engine->channel->head.plc_present_w);
    uint32_t index = late            ? free_late_slot(engine)
                     : piece->replay ? free_std_slot(engine)
                                     : piece->unit;
    struct techno_slot here = {.used = true,
                               .synch = piece->synch,
                               .replay = piece->replay},
                       *techno_slot = present
                                          ? (late ? &engine->late_slots[index]
                                                  : &engine->std_slots[index])
                                          : &here;
    if (!present) {
        engine->techno_unseen++;
        acknowledge(engine, techno_slot);
        release(engine, techno_slot, late);
        return;
    }
    engine->techno_functions++;
    put_out(engine,
            late ? &engine->channel->techno_unit_late_sync[index]
                 : &engine->channel->techno_unit_std_sync[index],
            techno_slot,
            piece);
    if (!piece->replay && ATOMIC_GET(engine->simulate_now)
        && !(piece->synch & SYNCH_FWD)) {
        acknowledge(engine, techno_slot);
    }
    if (late) {
        engine->late_open++;
    } else {
        engine->std_open++;
        if (index >= engine->std_used) {
            store_u16_relaxed(&engine->channel->used_units_std_sync_r,
                              (uint16_t)(engine->std_used = index + 1));
        }
    }
    store_u16_relaxed(&engine->channel->used_units_late_sync_r,
                      (uint16_t)engine->late_open);
}

/* What the PLC has done with a unit; true if it is free now. */
static bool look_at_unit(struct engine *engine,
                         TECHNO_UNIT_CH *unit,
                         struct techno_slot *techno_slot,
                         bool late) {
    if (!techno_slot->used) {
        return false;
    }
    bool fetched = !load_u8_acquire(&unit->please_rw),
         done = load_u8_acquire(&unit->done_w);
    if (fetched && done) {
        acknowledge(engine, techno_slot);
    }
    if (!fetched
        || ((techno_slot->synch & (WAITS | LATE)) && !techno_slot->acked)) {
        return false;
    }
    release(engine, techno_slot, late);
    return true;
}

static void look_at_spindle(struct engine *engine) {
    if (!engine->cfg.spindle_count || !engine->spindle_open[0]) {
        return;
    }
    HLI_AXIS *axis = &engine->segment->axis[engine->cfg.axis_count];
    for (uint32_t i = 0; i <= HLI_TU_AX_STD_SYNC_MAXIDX; i++) {
        if (look_at_unit(engine,
                         (TECHNO_UNIT_CH *)&axis->techno_unit_std_sync[i],
                         &engine->spindle_slots[0][i],
                         false)) {
            engine->spindle_open[0]--;
        }
    }
    if (!engine->spindle_open[0]) {
        store_u16_relaxed(&axis->used_units_std_sync_r,
                          (uint16_t)(engine->spindle_used = 0));
    }
}

static void look_at(struct engine *engine,
                    TECHNO_UNIT_CH *unit,
                    struct techno_slot *techno_slot,
                    bool late) {
    if (!look_at_unit(engine, unit, techno_slot, late)) {
        return;
    }
    if (late) {
        engine->late_open--;
    } else if (--engine->std_open == 0) {
        store_u16_relaxed(&engine->channel->used_units_std_sync_r,
                          (uint16_t)(engine->std_used = 0));
    }
}

static void look_at_early(struct engine *engine) {
    while (engine->early_done < ATOMIC_GET(engine->early_head)) {
        const struct early_output *early_output =
            &engine->early[engine->early_done % EARLY_MAX];
        double rest =
            early_output->path - (engine->geo.path - engine->geo.path_shift);
        bool passed = ATOMIC_GET(engine->store_done) > early_output->piece;
        if (!passed && rest > early_output->distance
            && rest > early_output->time * engine->geo.v) {
            return;
        }
        if (!passed
            && (engine->done.std_freed < early_output->free_before
                || engine
                       ->std_slots[store_at(engine, early_output->piece)->unit]
                       .used)) {
            return;
        }
        if (!passed) {
            techno_output(engine, store_at(engine, early_output->piece));
        }
        ATOMIC_SET(engine->early_done, engine->early_done + 1);
    }
}

/* Once a cycle: what the PLC fetched and acknowledged; early outputs that are
 * due. */
void techno_cycle(struct engine *engine) {
    if (engine->channel) {
        techno_clear_units(engine);
        for (uint32_t i = 0; i < STD_UNITS; i++) {
            look_at(engine,
                    &engine->channel->techno_unit_std_sync[i],
                    &engine->std_slots[i],
                    false);
        }
        for (uint32_t i = 0; i < LATE_UNITS; i++) {
            look_at(engine,
                    &engine->channel->techno_unit_late_sync[i],
                    &engine->late_slots[i],
                    true);
        }
        store_u16_relaxed(&engine->channel->used_units_std_sync_r,
                          (uint16_t)engine->std_used);
        store_u16_relaxed(&engine->channel->used_units_late_sync_r,
                          (uint16_t)engine->late_open);
        look_at_spindle(engine);
    }
    look_at_early(engine);
}
