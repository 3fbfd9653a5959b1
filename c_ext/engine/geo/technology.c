/* M, H and T functions to the PLC: technology units with two flags (hli_reference section 6).
 *
 * SDA turns a function row into pieces: an `output` and, where the CNC waits, a `gate`. Functions are numbered as they
 * are pushed; GEO counts how many have been acknowledged or have freed their unit. A gate is open when the counts have
 * reached what it needs, and stays open. A closed gate is a standstill for the planner, an open one is nothing, so a
 * function that is acknowledged in time costs no speed.
 *
 * The std array holds one block's functions, contiguous from 0; the late array has gaps.
 */
#include <math.h>
#include <stdlib.h>
#include "engine/state/state.h"

#define STD_UNITS (HLI_TU_CH_STD_SYNC_MAXIDX + 1u)
#define LATE_UNITS (HLI_TU_CH_LATE_SYNC_MAXIDX + 1u)
#define WAITS (SYNCH_MVS_SVS | SYNCH_MVS_SNS | SYNCH_MNS_SNS | SYNCH_MEP_SVS | SYNCH_MET_SVS)
#define EARLY (SYNCH_MEP_SVS | SYNCH_MET_SVS)
#define LATE (SYNCH_MVS_SLM | SYNCH_MVS_SLP)
#define BEHIND (SYNCH_MVS_SNS | SYNCH_MNS_SNS)

int engine_set_synch(engine *e, int kind, uint32_t nr, uint32_t synch, double pre_output) {
    synch_table *t = kind == NC_M ? &e->m_synch : kind == NC_H ? &e->h_synch : NULL;
    if (kind == NC_T) {
        e->tool_synch = synch;
        return 0;
    }
    if (!t || nr >= SYNCH_NUMBERS) return -1;
    if (!t->synch) {
        t->synch = calloc(SYNCH_NUMBERS, sizeof *t->synch);
        t->pre = calloc(SYNCH_NUMBERS, sizeof *t->pre);
        if (!t->synch || !t->pre) return -1;
    }
    t->synch[nr] = synch;
    t->pre[nr] = pre_output;
    return 0;
}

int engine_set_spindle_synch(engine *e, uint32_t what, uint32_t synch) {
    if (what >= sizeof e->spindle_synch / sizeof *e->spindle_synch) return -1;
    e->spindle_synch[what] = synch;
    return 0;
}

/* Functions of the main spindle: M3, M4, M5, M19, and an S word alone. */
static bool is_spindle(const engine *e, const nc_block *row) {
    if (!e->cfg.spindle_count) return false;
    return row->type == NC_S || (row->type == NC_M && (row->code == 3 || row->code == 4 || row->code == 5 || row->code == 19));
}

static uint32_t synch_of(const engine *e, const nc_block *row) {
    if (is_spindle(e, row)) return e->spindle_synch[row->type == NC_S ? 0 : row->code];
    if (row->type == NC_T) return e->tool_synch;
    const synch_table *t = row->type == NC_M ? &e->m_synch : &e->h_synch;
    return t->synch && row->code >= 0 && row->code < (int32_t)SYNCH_NUMBERS ? t->synch[row->code] : 0;
}

static bool is_function(const nc_block *row) {
    return row->type == NC_M || row->type == NC_H || row->type == NC_T || row->type == NC_S;
}

/* ------------------------------------------------------------------------------------------------ SDA */
static piece *new_event(engine *e, const nc_block *row) {
    piece *p = store_slot(e, row);
    p->kind = PIECE_EVENT;
    p->code = row->code;
    p->value = row->value;
    p->element = e->element_head;
    memcpy(p->end, e->last_end, sizeof p->end);
    return p;
}

static void push_gate(engine *e, const nc_block *row, techno_counts need) {
    piece *p = new_event(e, row);
    p->type = NC_EVENT;
    p->code = EVENT_GATE;
    p->need = need;
    p->gated = true;
    e->pending_gate = need;
    e->has_pending_gate = true;
    store_publish(e);
}

/* The counts a gate needs when everything pushed up to now has to be done in the member given. */
static techno_counts need_freed(const engine *e) {
    techno_counts need = {0};
    need.std_freed = e->pushed.std_freed;
    return need;
}

/* What the spindle is to do: move command and speed, or a position. */
static void spindle_piece(const engine *e, piece *p, const nc_block *row) {
    p->type = NC_S;
    p->code = row->type == NC_S ? e->spindle_move : row->code;
    p->value = row->type == NC_S ? row->value : e->spindle_rev;
    p->dist0 = row->type == NC_M && row->code == 19 && row->flags & NC_HAS_VALUE ? row->value : 0.0;
}

static void push_output(engine *e, const nc_block *row, uint32_t synch) {
    techno_counts need = {0};
    bool late = synch & LATE;
    if (late) {
        need.late_freed = e->pushed.late_freed >= LATE_UNITS ? e->pushed.late_freed - LATE_UNITS + 1 : 0;
    } else if (row->count != e->std_block || e->std_index >= STD_UNITS) {
        need = need_freed(e);
        e->std_block = row->count;
        e->std_base = e->pushed.std_freed;
        e->std_index = 0;
    }
    if (need.std_freed || need.late_freed) push_gate(e, row, need);
    piece *p = new_event(e, row);
    p->flags |= NC_OUTPUT;
    p->synch = synch;
    if (is_spindle(e, row)) spindle_piece(e, p, row);
    p->unit = late || p->type == NC_S ? 0 : e->std_index++;
    if (synch & SYNCH_MNS_SNS) p->stop_before = true;
    e->stop_pending |= p->stop_before;
    store_publish(e);
    if (late) e->pushed.late_freed++;
    else e->pushed.std_freed++;
    if (synch & SYNCH_MVS_SLM) e->pushed.slm_acked++;
    else if (synch & SYNCH_MVS_SLP) e->pushed.slp_acked++;
    else if (synch & WAITS) e->pushed.std_acked++;
}

static void push_ack_gate(engine *e, const nc_block *row) {
    techno_counts need = {0};
    need.std_acked = e->pushed.std_acked;
    push_gate(e, row, need);
}

/* Functions that are put out or waited for behind the motion of their block. */
void techno_block_end(engine *e) {
    uint32_t n = e->behind_count;
    if (!n) return;
    e->behind_count = 0;
    for (uint32_t i = 0; i < n; i++) {
        uint32_t synch = synch_of(e, &e->behind[i]);
        if (synch & SYNCH_MNS_SNS) push_output(e, &e->behind[i], synch);
    }
    push_ack_gate(e, &e->behind[n - 1]);
}

/* Early output of the output piece pushed last: GEO looks at the nearest one each cycle. */
static void push_early(engine *e, const nc_block *row, uint32_t synch) {
    early_output *o = &e->early[e->early_head % EARLY_MAX];
    const synch_table *t = row->type == NC_M ? &e->m_synch : &e->h_synch;
    double pre = t->pre ? t->pre[row->code] : 0.0;
    o->path = e->pushed_path;
    o->distance = synch & SYNCH_MEP_SVS ? pre / TENTH_UM : 0.0;
    o->time = synch & SYNCH_MET_SVS ? pre * 1e-6 : 0.0;
    o->piece = e->store_head - 1;
    o->free_before = e->std_base;
    ATOMIC_SET(e->early_head, e->early_head + 1);
}

/* Room for what one row may add. */
bool techno_has_room(const engine *e) { return e->early_head - ATOMIC_GET(e->early_done) < EARLY_MAX - 64 && e->behind_count < BEHIND_MAX; }

/* An S word of a block without M3, M4, M5, M19: a turning spindle changes its speed. */
void techno_spindle_word(engine *e) {
    if (!e->spindle_pending) return;
    e->spindle_pending = false;
    if (e->spindle_synch[0] && (e->spindle_move == 3 || e->spindle_move == 4)) {
        push_output(e, &e->spindle_row, e->spindle_synch[0]);
        if (e->spindle_synch[0] & SYNCH_MVS_SVS) push_ack_gate(e, &e->spindle_row);
    }
}

static bool note_spindle(engine *e, const nc_block *row) {
    if (row->type == NC_S) {
        e->spindle_rev = row->value;
        e->spindle_row = *row;
        e->spindle_pending = true;
        return false;
    }
    e->spindle_move = row->code == 19 ? 0 : row->code;
    e->spindle_pending = false;
    return true;
}

/* A function row; false if it is no function that goes to the PLC. */
bool techno_push(engine *e, const nc_block *row) {
    if (is_spindle(e, row) && !note_spindle(e, row)) return false;
    uint32_t synch = is_function(row) && row->type != NC_S ? synch_of(e, row) : 0;
    if (!synch) return false;
    if (synch & BEHIND) e->behind[e->behind_count++] = *row;
    if (synch & SYNCH_MNS_SNS) return true;
    push_output(e, row, synch);
    if (synch & EARLY) push_early(e, row, synch);
    if (synch & (SYNCH_MVS_SVS | EARLY)) push_ack_gate(e, row);
    return true;
}

/* MVS_SLM: the transition to the next G01, G02, G03. MVS_SLP: at #EXPL SYN. */
void techno_before_motion(engine *e, const nc_block *row) {
    if (row->flags & NC_RAPID || e->gated.slm_acked == e->pushed.slm_acked) return;
    techno_counts need = {0};
    need.slm_acked = e->pushed.slm_acked;
    e->gated.slm_acked = e->pushed.slm_acked;
    push_gate(e, row, need);
}

void techno_expl_syn(engine *e, const nc_block *row) {
    techno_counts need = {0};
    need.slp_acked = e->pushed.slp_acked;
    if (need.slp_acked) push_gate(e, row, need);
}

/* ------------------------------------------------------------------------------------------------ gates */
bool gate_open(const techno_counts *done, const techno_counts *need) {
    return done->std_freed >= need->std_freed && done->std_acked >= need->std_acked && done->late_freed >= need->late_freed &&
           done->slm_acked >= need->slm_acked && done->slp_acked >= need->slp_acked;
}

techno_counts techno_done(const techno_counts *counts) {
    techno_counts c;
    c.std_freed = ATOMIC_GET(counts->std_freed);
    c.std_acked = ATOMIC_GET(counts->std_acked);
    c.late_freed = ATOMIC_GET(counts->late_freed);
    c.slm_acked = ATOMIC_GET(counts->slm_acked);
    c.slp_acked = ATOMIC_GET(counts->slp_acked);
    return c;
}

static uint32_t free_spindle_slot(const engine *e) {
    uint32_t i = 0;
    while (i <= HLI_TU_AX_STD_SYNC_MAXIDX && e->spindle_slots[0][i].used) i++;
    return i;
}

static uint32_t free_std_slot(const engine *e) {
    uint32_t i = 0;
    while (i < STD_UNITS && e->std_slots[i].used) i++;
    return i;
}

/* An event that cannot be run yet: a gate that is not open, a repeated function without a free unit. */
bool techno_blocked(engine *e, const piece *p) {
    if (p->gated && !gate_open(p->replay ? &e->done_again : &e->done, &p->need)) return true;
    if (!(p->flags & NC_OUTPUT) || p->synch & LATE) return false;
    if (p->type == NC_S) return free_spindle_slot(e) > HLI_TU_AX_STD_SYNC_MAXIDX;
    if (p->replay) return free_std_slot(e) >= STD_UNITS;
    return !store_at(e, p->origin)->put_out && e->std_slots[p->unit].used;
}

/* ------------------------------------------------------------------------------------------------ GEO */
static void count(uint64_t *counter) { ATOMIC_SET(*counter, *counter + 1); }

static void acknowledge(engine *e, techno_slot *s) {
    if (s->acked) return;
    s->acked = true;
    techno_counts *done = s->replay ? &e->done_again : &e->done;
    if (s->synch & SYNCH_MVS_SLM) count(&done->slm_acked);
    else if (s->synch & SYNCH_MVS_SLP) count(&done->slp_acked);
    else if (s->synch & WAITS) count(&done->std_acked);
}

static void release(engine *e, techno_slot *s, bool late) {
    techno_counts *done = s->replay ? &e->done_again : &e->done;
    s->used = false;
    count(late ? &done->late_freed : &done->std_freed);
}

static void fill_function(engine *e, TECHNO_UNIT_CH *u, const piece *p) {
    HLI_M_H_PROZESS m;
    memset(&m, 0, sizeof m);
    m.nr = (uint32_t)p->code;
    m.satz_nr = p->n;
    m.zeilen_nr = p->count;
    m.add_value = p->flags & NC_HAS_VALUE ? (int32_t)lrint(fmax(-2e9, fmin(2e9, p->value))) : 0;
    m.nr_late_sync = (uint16_t)e->late_open;
    m.synch_mode = p->synch;
    memcpy(&u->attribut_r, &m, sizeof m);
}

static void fill_tool(engine *e, TECHNO_UNIT_CH *u, const piece *p) {
    HLI_T_PROZESS t;
    memset(&t, 0, sizeof t);
    t.id.basic = p->code;
    t.nr_late_sync = (uint16_t)e->late_open;
    t.synch_mode = p->synch;
    memcpy(&u->attribut_r, &t, sizeof t);
}

static void fill_spindle(engine *e, TECHNO_UNIT_CH *u, const piece *p) {
    HLI_S_PROZESS s;
    memset(&s, 0, sizeof s);
    s.pos = (int32_t)lrint(fmax(-2e9, fmin(2e9, p->dist0 * 1e4)));
    s.rev = (int32_t)lrint(fmin(2e9, p->value * 6000.0)); /* rev/min as 1e-3 degrees/s */
    s.move_cmd = p->code == 19 ? 0 : (uint16_t)p->code;
    s.pos_cmd = p->code == 19 ? 19 : 0;
    s.axis_nr = (uint16_t)e->cfg.spindle_id[0];
    s.synch_mode = p->synch;
    s.satz_nr = p->n;
    s.zeilen_nr = p->count;
    memcpy(&u->attribut_r, &s, sizeof s);
}

/* Data first, done_w FALSE, please_rw TRUE last. */
static void put_out(engine *e, TECHNO_UNIT_CH *u, techno_slot *s, const piece *p) {
    memset(&u->attribut_r, 0, sizeof u->attribut_r);
    if (p->type == NC_S) fill_spindle(e, u, p);
    else if (p->type == NC_T) fill_tool(e, u, p);
    else fill_function(e, u, p);
    store_u16_relaxed(&u->fkt_ctrl_r, p->type == NC_M ? 1 : p->type == NC_H ? 2 : p->type == NC_S ? 3 : 4);
    store_u8_release(&u->done_w, 0);
    store_u8_release(&u->please_rw, 1);
    *s = (techno_slot){.used = true, .synch = p->synch, .replay = p->replay};
}

static uint32_t free_late_slot(const engine *e) {
    uint32_t i = 0;
    while (i < LATE_UNITS && e->late_slots[i].used) i++;
    return i;
}

/* Spindle functions go to the spindle's axis area. */
static void output_spindle(engine *e, piece *p) {
    HLI_AXIS *axis = e->segment ? &e->segment->axis[e->cfg.axis_count] : NULL;
    bool present = axis && !e->suppressed && load_u8_acquire(&axis->head.plc_present_w);
    uint32_t i = free_spindle_slot(e);
    techno_slot here = {.used = true, .synch = p->synch, .replay = p->replay};
    if (!present) {
        e->techno_unseen++;
        acknowledge(e, &here);
        release(e, &here, false);
        return;
    }
    e->techno_functions++;
    put_out(e, (TECHNO_UNIT_CH *)&axis->techno_unit_std_sync[i], &e->spindle_slots[0][i], p);
    e->spindle_open[0]++;
    if (!p->replay && ATOMIC_GET(e->simulate_now) && !(p->synch & SYNCH_FWD)) acknowledge(e, &e->spindle_slots[0][i]);
    if (i >= e->spindle_used) store_u16_relaxed(&axis->used_units_std_sync_r, (uint16_t)(e->spindle_used = i + 1));
}

void techno_output(engine *e, piece *p) {
    if (p->put_out) return;
    p->put_out = true;
    if (p->type == NC_S) {
        output_spindle(e, p);
        return;
    }
    bool late = p->synch & LATE;
    bool present = e->channel && !e->suppressed && load_u8_acquire(&e->channel->head.plc_present_w);
    uint32_t index = late ? free_late_slot(e) : p->replay ? free_std_slot(e) : p->unit;
    techno_slot here = {.used = true, .synch = p->synch, .replay = p->replay}, *s = present ? (late ? &e->late_slots[index] : &e->std_slots[index]) : &here;
    if (!present) {
        e->techno_unseen++;
        acknowledge(e, s);
        release(e, s, late);
        return;
    }
    e->techno_functions++;
    put_out(e, late ? &e->channel->techno_unit_late_sync[index] : &e->channel->techno_unit_std_sync[index], s, p);
    if (!p->replay && ATOMIC_GET(e->simulate_now) && !(p->synch & SYNCH_FWD)) acknowledge(e, s);
    if (late) {
        e->late_open++;
    } else {
        e->std_open++;
        if (index >= e->std_used) store_u16_relaxed(&e->channel->used_units_std_sync_r, (uint16_t)(e->std_used = index + 1));
    }
    store_u16_relaxed(&e->channel->used_units_late_sync_r, (uint16_t)e->late_open);
}

/* What the PLC has done with a unit; true if it is free now. */
static bool look_at_unit(engine *e, TECHNO_UNIT_CH *u, techno_slot *s, bool late) {
    if (!s->used) return false;
    bool fetched = !load_u8_acquire(&u->please_rw), done = load_u8_acquire(&u->done_w);
    if (fetched && done) acknowledge(e, s);
    if (!fetched || ((s->synch & (WAITS | LATE)) && !s->acked)) return false;
    release(e, s, late);
    return true;
}

static void look_at_spindle(engine *e) {
    if (!e->cfg.spindle_count || !e->spindle_open[0]) return;
    HLI_AXIS *axis = &e->segment->axis[e->cfg.axis_count];
    for (uint32_t i = 0; i <= HLI_TU_AX_STD_SYNC_MAXIDX; i++)
        if (look_at_unit(e, (TECHNO_UNIT_CH *)&axis->techno_unit_std_sync[i], &e->spindle_slots[0][i], false)) e->spindle_open[0]--;
    if (!e->spindle_open[0]) store_u16_relaxed(&axis->used_units_std_sync_r, (uint16_t)(e->spindle_used = 0));
}

static void look_at(engine *e, TECHNO_UNIT_CH *u, techno_slot *s, bool late) {
    if (!look_at_unit(e, u, s, late)) return;
    if (late) e->late_open--;
    else if (--e->std_open == 0) store_u16_relaxed(&e->channel->used_units_std_sync_r, (uint16_t)(e->std_used = 0));
}

static void look_at_early(engine *e) {
    while (e->early_done < ATOMIC_GET(e->early_head)) {
        const early_output *o = &e->early[e->early_done % EARLY_MAX];
        double rest = o->path - (e->geo.path - e->geo.path_shift);
        bool passed = ATOMIC_GET(e->store_done) > o->piece;
        if (!passed && rest > o->distance && rest > o->time * e->geo.v) return;
        if (!passed && (e->done.std_freed < o->free_before || e->std_slots[store_at(e, o->piece)->unit].used)) return;
        if (!passed) techno_output(e, store_at(e, o->piece));
        ATOMIC_SET(e->early_done, e->early_done + 1);
    }
}

/* Once a cycle: what the PLC fetched and acknowledged; early outputs that are due. */
void techno_cycle(engine *e) {
    if (e->channel) {
        techno_clear_units(e);
        for (uint32_t i = 0; i < STD_UNITS; i++) look_at(e, &e->channel->techno_unit_std_sync[i], &e->std_slots[i], false);
        for (uint32_t i = 0; i < LATE_UNITS; i++) look_at(e, &e->channel->techno_unit_late_sync[i], &e->late_slots[i], true);
        store_u16_relaxed(&e->channel->used_units_std_sync_r, (uint16_t)e->std_used);
        store_u16_relaxed(&e->channel->used_units_late_sync_r, (uint16_t)e->late_open);
        look_at_spindle(e);
    }
    look_at_early(e);
}
