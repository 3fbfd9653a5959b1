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
#include <string.h>
#include "engine/geo/technology.h"
#include "engine/path/technology_again.h"
#include "engine/path/technology_counts.h"
#include "engine/state/record_ring.h"
#include "engine/state/state.h"
#include "hli/sync.h"
#include "rows/nc_block.h"

static void techno_clear_units(struct engine *engine);

static uint32_t free_spindle_slot(const struct technology_state *technology) {
    uint32_t i = 0;
    while (i <= HLI_TU_AX_STD_SYNC_MAXIDX
           && technology->spindle_slots[0][i].used) {
        i++;
    }
    return i;
}

static uint32_t free_std_slot(const struct technology_state *technology) {
    uint32_t i = 0;
    while (i < STD_UNITS && technology->std_slots[i].used) {
        i++;
    }
    return i;
}

bool techno_blocked(struct engine *engine, const struct piece *piece) {
    if (piece->gated
        && !gate_open(piece->replay ? &engine->technology.done_again
                                    : &engine->technology.done,
                      &piece->need)) {
        return true;
    }
    if (!(piece->flags & NC_OUTPUT) || piece->synch & LATE) {
        return false;
    }
    if (piece->type == NC_S) {
        return free_spindle_slot(&engine->technology)
               > HLI_TU_AX_STD_SYNC_MAXIDX;
    }
    if (piece->replay) {
        return free_std_slot(&engine->technology) >= STD_UNITS;
    }
    return !store_at(&engine->store, piece->origin)->put_out
           && engine->technology.std_slots[piece->unit].used;
}

static void count(uint64_t *counter) {
    ATOMIC_SET(*counter, *counter + 1);
}

static void acknowledge(struct technology_state *technology,
                        struct techno_slot *techno_slot) {
    if (techno_slot->acked) {
        return;
    }
    techno_slot->acked = true;
    struct techno_counts *done =
        techno_slot->replay ? &technology->done_again : &technology->done;
    if (techno_slot->synch & SYNCH_MVS_SLM) {
        count(&done->slm_acked);
    } else if (techno_slot->synch & SYNCH_MVS_SLP) {
        count(&done->slp_acked);
    } else if (techno_slot->synch & WAITS) {
        count(&done->std_acked);
    }
}

/* Cycles are counted at their end: the number of the one that runs. */
static uint64_t this_cycle(const struct engine *engine) {
    return engine->geo.cycle + 1;
}

static void record_function(struct engine *engine,
                            const struct techno_slot *techno_slot) {
    struct engine_function *row = record_next(&engine->recording.functions);
    if (row) {
        *row = techno_slot->recorded;
        record_put(&engine->recording.functions);
    }
}

static struct techno_slot slot_of(const struct engine *engine,
                                  const struct piece *piece,
                                  bool seen) {
    return (struct techno_slot){
        .used = true,
        .synch = piece->synch,
        .replay = piece->replay,
        .recorded = {.issued = this_cycle(engine),
                     .value = piece->value,
                     .code = piece->code,
                     .type = piece->type,
                     .n = piece->n,
                     .count = piece->count,
                     .line = piece->line,
                     .synch = piece->synch,
                     .seen = seen},
    };
}

static void release(struct engine *engine,
                    struct techno_slot *techno_slot,
                    bool late) {
    struct technology_state *technology = &engine->technology;
    struct techno_counts *done =
        techno_slot->replay ? &technology->done_again : &technology->done;
    record_function(engine, techno_slot);
    techno_slot->used = false;
    count(late ? &done->late_freed : &done->std_freed);
}

static void fill_function(struct technology_state *technology,
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
    m_h_prozess.nr_late_sync = (uint16_t)technology->late_open;
    m_h_prozess.synch_mode = piece->synch;
    memcpy(&unit->attribut_r, &m_h_prozess, sizeof m_h_prozess);
}

static void fill_tool(struct technology_state *technology,
                      TECHNO_UNIT_CH *unit,
                      const struct piece *piece) {
    HLI_T_PROZESS t_prozess;
    memset(&t_prozess, 0, sizeof t_prozess);
    t_prozess.id.basic = piece->code;
    t_prozess.nr_late_sync = (uint16_t)technology->late_open;
    t_prozess.synch_mode = piece->synch;
    memcpy(&unit->attribut_r, &t_prozess, sizeof t_prozess);
}

/* Revolutions a minute as 1e-3 degrees/s. */
static int32_t speed_of(const struct piece *piece) {
    return (int32_t)lrint(fmin(2e9, piece->value * 6000.0));
}

/* The spindle is there at once: M3 turns forward, M4 backward. */
static void show_spindle(HLI_LR_STATE *state, const struct piece *piece) {
    int32_t speed = speed_of(piece);
    int32_t turns = piece->code == 3 ? speed : piece->code == 4 ? -speed : 0;
    show_u32(&state->cmd_rev_r, (uint32_t)speed);
    show_u32(&state->active_rev_r, (uint32_t)turns);
    show_u32(&state->current_rev_r, (uint32_t)turns);
}

static void fill_spindle(engine_config *cfg,
                         TECHNO_UNIT_CH *unit,
                         const struct piece *piece) {
    HLI_S_PROZESS s_prozess;
    memset(&s_prozess, 0, sizeof s_prozess);
    s_prozess.pos = (int32_t)lrint(fmax(-2e9, fmin(2e9, piece->dist0 * 1e4)));
    s_prozess.rev = speed_of(piece);
    s_prozess.move_cmd = piece->code == 19 ? 0 : (uint16_t)piece->code;
    s_prozess.pos_cmd = piece->code == 19 ? 19 : 0;
    s_prozess.axis_nr = (uint16_t)cfg->spindle_id[0];
    s_prozess.synch_mode = piece->synch;
    s_prozess.satz_nr = piece->n;
    s_prozess.zeilen_nr = piece->count;
    memcpy(&unit->attribut_r, &s_prozess, sizeof s_prozess);
}

/* Data first, done_w FALSE, please_rw TRUE last. */
static void put_out(struct engine *engine,
                    TECHNO_UNIT_CH *unit,
                    struct techno_slot *techno_slot,
                    const struct piece *piece,
                    uint32_t bit) {
    uint32_t generation = begin_output(engine);
    mark_again(engine, bit, false);
    memset(&unit->attribut_r, 0, sizeof unit->attribut_r);
    if (piece->type == NC_S) {
        fill_spindle(&engine->cfg, unit, piece);
    } else if (piece->type == NC_T) {
        fill_tool(&engine->technology, unit, piece);
    } else {
        fill_function(&engine->technology, unit, piece);
    }
    store_u16_relaxed(&unit->fkt_ctrl_r,
                      piece->type == NC_M   ? 1
                      : piece->type == NC_H ? 2
                      : piece->type == NC_S ? 3
                                            : 4);
    store_u8_release(&unit->done_w, 0);
    store_u8_release(&unit->please_rw, 1);
    *techno_slot = slot_of(engine, piece, true);
    techno_slot->generation = generation;
    end_output(engine);
}

static uint32_t free_late_slot(const struct technology_state *technology) {
    uint32_t i = 0;
    while (i < LATE_UNITS && technology->late_slots[i].used) {
        i++;
    }
    return i;
}

/* Spindle functions go to the spindle's axis area. */
static void output_spindle(struct engine *engine, struct piece *piece) {
    HLI_AXIS *axis = engine->hli.segment ? engine->hli.spindle : NULL;
    bool present = axis && !engine->technology.suppressed
                   && load_u8_acquire(&axis->head.plc_present_w);
    uint32_t i = free_spindle_slot(&engine->technology);
    struct techno_slot here = slot_of(engine, piece, false);
    if (axis) {
        show_spindle(&axis->lr_state, piece);
    }
    if (!present) {
        engine->technology.unseen++;
        acknowledge(&engine->technology, &here);
        release(engine, &here, false);
        return;
    }
    engine->technology.functions++;
    put_out(engine,
            (TECHNO_UNIT_CH *)&axis->techno_unit_std_sync[i],
            &engine->technology.spindle_slots[0][i],
            piece,
            TECHNO_BIT_SPINDLE + i);
    engine->technology.spindle_open[0]++;
    if (!piece->replay && ATOMIC_GET(engine->orders.simulate)
        && !(piece->synch & SYNCH_FWD)) {
        acknowledge(&engine->technology,
                    &engine->technology.spindle_slots[0][i]);
    }
    if (i >= engine->technology.spindle_used) {
        store_u16_relaxed(&axis->used_units_std_sync_r,
                          (uint16_t)(engine->technology.spindle_used = i + 1));
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
    bool present = engine->hli.channel && !engine->technology.suppressed
                   && load_u8_acquire(&engine->hli.channel->head.plc_present_w);
    uint32_t index = late            ? free_late_slot(&engine->technology)
                     : piece->replay ? free_std_slot(&engine->technology)
                                     : piece->unit;
    struct techno_slot here = slot_of(engine, piece, false),
                       *techno_slot =
                           present
                               ? (late ? &engine->technology.late_slots[index]
                                       : &engine->technology.std_slots[index])
                               : &here;
    if (!present) {
        engine->technology.unseen++;
        acknowledge(&engine->technology, techno_slot);
        release(engine, techno_slot, late);
        return;
    }
    engine->technology.functions++;
    put_out(engine,
            late ? &engine->hli.channel->techno_unit_late_sync[index]
                 : &engine->hli.channel->techno_unit_std_sync[index],
            techno_slot,
            piece,
            (late ? TECHNO_BIT_LATE : TECHNO_BIT_STD) + index);
    if (!piece->replay && ATOMIC_GET(engine->orders.simulate)
        && !(piece->synch & SYNCH_FWD)) {
        acknowledge(&engine->technology, techno_slot);
    }
    if (late) {
        engine->technology.late_open++;
    } else {
        engine->technology.std_open++;
        if (index >= engine->technology.std_used) {
            store_u16_relaxed(
                &engine->hli.channel->used_units_std_sync_r,
                (uint16_t)(engine->technology.std_used = index + 1));
        }
    }
    store_u16_relaxed(&engine->hli.channel->used_units_late_sync_r,
                      (uint16_t)engine->technology.late_open);
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
    struct engine_function *recorded = &techno_slot->recorded;
    if (fetched && !recorded->fetched) {
        recorded->fetched = this_cycle(engine);
    }
    if (fetched && done) {
        recorded->acknowledged = this_cycle(engine);
        acknowledge(&engine->technology, techno_slot);
    }
    if (!fetched
        || ((techno_slot->synch & (WAITS | LATE)) && !techno_slot->acked)) {
        return false;
    }
    release(engine, techno_slot, late);
    return true;
}

static void look_at_spindle(struct engine *engine) {
    if (!engine->cfg.spindle_count || !engine->technology.spindle_open[0]) {
        return;
    }
    HLI_AXIS *axis = engine->hli.spindle;
    for (uint32_t i = 0; i <= HLI_TU_AX_STD_SYNC_MAXIDX; i++) {
        if (look_at_unit(engine,
                         (TECHNO_UNIT_CH *)&axis->techno_unit_std_sync[i],
                         &engine->technology.spindle_slots[0][i],
                         false)) {
            engine->technology.spindle_open[0]--;
        }
    }
    if (!engine->technology.spindle_open[0]) {
        store_u16_relaxed(&axis->used_units_std_sync_r,
                          (uint16_t)(engine->technology.spindle_used = 0));
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
        engine->technology.late_open--;
    } else if (--engine->technology.std_open == 0) {
        store_u16_relaxed(&engine->hli.channel->used_units_std_sync_r,
                          (uint16_t)(engine->technology.std_used = 0));
    }
}

static void look_at_early(struct engine *engine) {
    while (engine->early.done < ATOMIC_GET(engine->early.head)) {
        const struct early_output *early_output =
            &engine->early.entries[engine->early.done % EARLY_MAX];
        double remainder =
            early_output->path - (engine->geo.path - engine->geo.path_shift);
        bool passed = ATOMIC_GET(engine->store.done) > early_output->piece;
        if (!passed && remainder > early_output->distance
            && remainder > early_output->time * engine->geo.v) {
            return;
        }
        if (!passed
            && (engine->technology.done.std_freed < early_output->free_before
                || engine->technology
                       .std_slots[store_at(&engine->store, early_output->piece)
                                      ->unit]
                       .used)) {
            return;
        }
        if (!passed) {
            techno_output(engine,
                          store_at(&engine->store, early_output->piece));
        }
        ATOMIC_SET(engine->early.done, engine->early.done + 1);
    }
}

void techno_cycle(struct engine *engine) {
    if (engine->hli.channel) {
        techno_clear_units(engine);
        offer_again(engine);
        for (uint32_t i = 0; i < STD_UNITS; i++) {
            look_at(engine,
                    &engine->hli.channel->techno_unit_std_sync[i],
                    &engine->technology.std_slots[i],
                    false);
        }
        for (uint32_t i = 0; i < LATE_UNITS; i++) {
            look_at(engine,
                    &engine->hli.channel->techno_unit_late_sync[i],
                    &engine->technology.late_slots[i],
                    true);
        }
        store_u16_relaxed(&engine->hli.channel->used_units_std_sync_r,
                          (uint16_t)engine->technology.std_used);
        store_u16_relaxed(&engine->hli.channel->used_units_late_sync_r,
                          (uint16_t)engine->technology.late_open);
        look_at_spindle(engine);
    }
    look_at_early(engine);
}

static void record_open(struct engine *engine,
                        const struct techno_slot *slots,
                        uint32_t count) {
    for (uint32_t i = 0; i < count; i++) {
        if (slots[i].used) {
            record_function(engine, &slots[i]);
        }
    }
}

void engine_record_end(struct engine *engine) {
    const struct technology_state *technology = &engine->technology;
    record_open(engine, technology->std_slots, STD_UNITS);
    record_open(engine, technology->late_slots, LATE_UNITS);
    record_open(engine,
                technology->spindle_slots[0],
                HLI_TU_AX_STD_SYNC_MAXIDX + 1);
}

void technology_clear(struct technology_state *technology) {
    memset(technology->std_slots, 0, sizeof technology->std_slots);
    memset(technology->late_slots, 0, sizeof technology->late_slots);
    memset(technology->spindle_slots, 0, sizeof technology->spindle_slots);
    technology->std_open = technology->late_open = technology->std_used = 0;
    memset(technology->spindle_open, 0, sizeof technology->spindle_open);
    technology->spindle_used = 0;
    ATOMIC_SET(technology->units_cleared, 0);
}

/* The PLC's side of it, in the cycle. */
static void techno_clear_units(struct engine *engine) {
    if (ATOMIC_GET(engine->technology.units_cleared)) {
        return;
    }
    ATOMIC_SET(engine->technology.units_cleared, 1);
    for (uint32_t i = 0; i <= HLI_TU_CH_STD_SYNC_MAXIDX; i++) {
        store_u8_release(
            &engine->hli.channel->techno_unit_std_sync[i].please_rw,
            0);
    }
    for (uint32_t i = 0; i <= HLI_TU_CH_LATE_SYNC_MAXIDX; i++) {
        store_u8_release(
            &engine->hli.channel->techno_unit_late_sync[i].please_rw,
            0);
    }
    store_u16_relaxed(&engine->hli.channel->used_units_std_sync_r, 0);
    store_u16_relaxed(&engine->hli.channel->used_units_late_sync_r, 0);
    for (uint32_t k = 0; k < engine->cfg.spindle_count; k++) {
        HLI_AXIS *axis = &engine->hli.spindle[k];
        for (uint32_t i = 0; i <= HLI_TU_AX_STD_SYNC_MAXIDX; i++) {
            store_u8_release(&axis->techno_unit_std_sync[i].please_rw, 0);
        }
        store_u16_relaxed(&axis->used_units_std_sync_r, 0);
    }
}
