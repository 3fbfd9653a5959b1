/* One cycle of GEO: commands, motion, answers to the planner, samples,
 * publication. */
#include <string.h>
#include "engine/geo/cycle.h"
#include "engine/geo/commands.h"
#include "engine/geo/external.h"
#include "engine/geo/interpolate.h"
#include "engine/commit/lateness.h"
#include "engine/lookahead/service.h"
#include "engine/geo/publish.h"
#include "engine/geo/record.h"
#include "engine/geo/rt_cycle.h"
#include "engine/geo/standstill.h"
#include "engine/geo/technology.h"
#include "engine/state/state.h"

static void note_end(struct engine *engine) {
    if (engine->program.end || !ATOMIC_GET(engine->program.finished)
        || !geo_drained(engine)) {
        return;
    }
    if (ATOMIC_GET(engine->dispatch.dir) < 0
        || ATOMIC_GET(engine->dispatch.drives_on)
        || ATOMIC_GET(engine->withdrawal.state) != WITHDRAW_NONE) {
        return;
    }
    engine->geo.v = 0.0;
    ATOMIC_SET(engine->program.active, 0);
    ATOMIC_SET(engine->program.end, 1);
    /* in the cycle: the PLC's next scan sees it */
    if (engine->hli.side && all_ended(&engine->group)) {
        store_u32_release(&engine->hli.side->cnc.phase, HLI_PHASE_ENDED);
    }
}

/* It stands at an M00 or M01: that one is not over, whatever turns the path
 * around meanwhile. */
static bool at_program_stop(struct engine *engine) {
    const struct piece *piece = piece_at(&engine->run, engine->geo.piece);
    return engine->geo.waiting_continue && !engine->geo.stands_single
           && !piece->inserted && !(piece->flags & NC_OUTPUT);
}

/* The planner wants phases back: at standstill it gets all that are not begun.
 */
static void answer_withdrawal(struct engine *engine) {
    struct geo *geo = &engine->geo;
    int state = ATOMIC_GET(engine->withdrawal.state);
    /* in this order: a planner that has asked commits nothing more */
    uint64_t word = ATOMIC_GET(engine->commit.word);
    if (state != WITHDRAW_ASKED || (word & 1) || geo->v > 0.0) {
        return;
    }
    if (geo->has_phase && is_motion(piece_at(&engine->run, geo->piece))
        && geo->t > 0.0) {
        return;
    }
    bool inside = geo->piece != UINT64_MAX
                  && (ATOMIC_GET(engine->run.done) <= geo->piece
                      || at_program_stop(engine));
    engine->withdrawal.piece =
        inside ? geo->piece : ATOMIC_GET(engine->run.done);
    engine->withdrawal.s =
        inside && is_motion(piece_at(&engine->run, geo->piece)) ? geo->s : 0.0;
    geo->has_phase = geo->waiting_continue = geo->stands_single =
        geo->waiting_techno = geo->dwelling = false;
    ATOMIC_SET(geo->consumed, word >> 2);
    ATOMIC_SET(engine->withdrawal.state, WITHDRAW_DONE);
}

/* The planner offers to go on from a place on the tail: taken if that is still
 * ahead. */
static void answer_rejoin(struct engine *engine) {
    struct geo *geo = &engine->geo;
    struct rejoin *rejoin = &engine->rejoin;
    if (ATOMIC_GET(rejoin->state) != REJOIN_OFFERED) {
        return;
    }
    bool inside = geo->tail_next == rejoin->phase + 1 && geo->has_phase;
    bool ahead =
        geo->tail_next <= rejoin->phase || (inside && geo->t < rejoin->t);
    if (!geo->in_tail || !ahead) {
        ATOMIC_SET(rejoin->state, REJOIN_REFUSED);
        return;
    }
    geo->leaves = true;
    if (inside) {
        end_phase_at(geo, rejoin->t);
    }
    ATOMIC_SET(engine->commit.word, rejoin->word);
    ATOMIC_SET(rejoin->state, REJOIN_TAKEN);
}

void geo_cycle(struct engine *engine) {
    if (engine->hli.segment) {
        take_commands(engine);
    }
    external_cycle(engine);
    rt_cycles_run(engine);
    techno_cycle(engine);
    answer_withdrawal(engine);
    answer_rejoin(engine);
    if (!ATOMIC_GET(engine->program.hold_start)) {
        geo_advance(engine, engine->cfg.cycle_s);
    }
    note_lateness(engine);
    ATOMIC_SET(engine->withdrawal.waits,
               engine->geo.waiting_continue || engine->geo.waiting_techno);
    geo_evaluate(engine);
    count_time(engine);
    ATOMIC_SET(engine->geo.cycle, engine->geo.cycle + 1);
    note_end(engine);
    note_standstill(engine);
    if (engine->hli.segment) {
        publish(engine);
    }
    record_cycle(engine);
    if (engine->hli.segment && engine->cfg.service == HLI_SERVICE_CYCLIC) {
        serve_request(engine);
    }
}

void geo_rehearse(struct engine *engine) {
    geo_evaluate(engine);
    if (engine->hli.segment) {
        publish_again(engine);
    }
    record_rehearse(engine);
}

void engine_rehearse(struct engine *engine) {
    geo_rehearse(engine);
}
