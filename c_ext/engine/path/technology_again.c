/* A PLC that has fetched a function and ended before it acknowledged: nobody
 * knows whether the function was carried out. It is offered to the next PLC
 * once more, with a mark, so that this PLC can find out.
 *
 * Who fetched it is told by order. A PLC that attaches writes its generation,
 * waits until nothing is being put out and looks which units show a function.
 * The CNC says that it is putting out, then looks at the generation. So a
 * function that an earlier PLC has fetched was put out in an earlier
 * generation and does not show when the PLC attaches
 * (docs/explanation/model/techno.pml).
 */
#include "engine/path/technology_again.h"
#include "engine/state/state.h"
#include "hli/sync.h"

uint32_t begin_output(struct engine *engine) {
    if (!engine->hli.side) {
        return 0;
    }
    store_u32_relaxed(&engine->hli.side->stats.techno_busy, 1);
    __atomic_thread_fence(__ATOMIC_SEQ_CST);
    return load_u32_acquire(&engine->hli.side->plc.generation);
}

void end_output(struct engine *engine) {
    if (engine->hli.side) {
        store_u32_release(&engine->hli.side->stats.techno_busy, 0);
    }
}

/* Of the channel's spindle in gpAx. */
static size_t spindle_place(const struct engine *engine) {
    return (size_t)(engine->hli.spindle - engine->hli.segment->axis);
}

void mark_again(struct engine *engine, uint32_t bit, bool again) {
    uint64_t mask = (uint64_t)1 << bit, *marks = &engine->technology.again;
    if (!engine->hli.side || !(*marks & mask) == !again) {
        return;
    }
    *marks ^= mask;
    HLI_SIDE_TECHNO *techno = &engine->hli.side->techno;
    const uint64_t of_spindle = ~(uint64_t)0 << TECHNO_BIT_SPINDLE;
    store_u64_release(&techno->again[engine->cfg.channel],
                      *marks & ~of_spindle);
    if (mask & of_spindle) {
        store_u8_release(&techno->axis_again[spindle_place(engine)],
                         (uint8_t)(*marks >> TECHNO_BIT_SPINDLE));
    }
}

/* ``shown``: bit i, unit i showed a function when the PLC attached. */
static void look(struct engine *engine,
                 TECHNO_UNIT_CH *units,
                 const struct techno_slot *slots,
                 uint32_t count,
                 uint32_t first,
                 uint64_t shown) {
    for (uint32_t i = 0; i < count; i++) {
        if (slots[i].used && !slots[i].acked
            && slots[i].generation != engine->technology.plc_generation
            && slots[i].synch & (WAITS | LATE) && !(shown >> i & 1)
            && !load_u8_acquire(&units[i].please_rw)
            && !load_u8_acquire(&units[i].done_w)) {
            mark_again(engine, first + i, true);
            store_u8_release(&units[i].please_rw, 1);
        }
    }
}

void offer_again(struct engine *engine) {
    if (!engine->hli.side) {
        return;
    }
    const HLI_SIDE_PLC *plc = &engine->hli.side->plc;
    uint32_t generation = load_u32_acquire(&plc->generation);
    if (generation == engine->technology.plc_generation
        || !load_u32_acquire(&plc->attached)) {
        return;
    }
    engine->technology.plc_generation = generation;
    HLI_CHANNEL *channel = engine->hli.channel;
    const HLI_SIDE_TECHNO *techno = &engine->hli.side->techno;
    uint64_t shown = load_u64_acquire(&techno->shown[engine->cfg.channel]);
    look(engine,
         channel->techno_unit_std_sync,
         engine->technology.std_slots,
         STD_UNITS,
         TECHNO_BIT_STD,
         shown >> TECHNO_BIT_STD);
    look(engine,
         channel->techno_unit_late_sync,
         engine->technology.late_slots,
         LATE_UNITS,
         TECHNO_BIT_LATE,
         shown >> TECHNO_BIT_LATE);
    if (engine->cfg.spindle_count) {
        HLI_AXIS *axis = engine->hli.spindle;
        look(engine,
             (TECHNO_UNIT_CH *)axis->techno_unit_std_sync,
             engine->technology.spindle_slots[0],
             HLI_TU_AX_STD_SYNC_MAXIDX + 1u,
             TECHNO_BIT_SPINDLE,
             load_u8_acquire(&techno->axis_shown[spindle_place(engine)]));
    }
}
