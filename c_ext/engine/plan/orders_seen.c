/* Whether operator or PLC have changed anything since the last commit. */
#include "engine/plan/orders_seen.h"
#include "engine/commit/commit.h"
#include "engine/path/technology_counts.h"
#include "engine/plan/recall.h"
#include "engine/state/state.h"

static orders_seen orders_now(const struct engine *engine) {
    const struct orders *orders = &engine->orders;
    return (orders_seen){
        .override = orders->override,
        .rapid = orders->rapid,
        .ext_speed = orders->ext_speed,
        .hold = orders->hold,
        .single = orders->single,
        .m01 = orders->m01,
        .rt_loop = orders->rt_loop,
        .backward = orders->backward,
        .simulate = orders->simulate,
        .held_axes = orders->held_axes,
        .shortcuts = orders->shortcut_requests,
        .inserts = orders->insert_requests,
        .done = techno_done(&engine->technology.done),
        .done_again = techno_done(&engine->technology.done_again),
    };
}

static bool same_orders(const orders_seen *now, const orders_seen *then) {
    return now->override == then->override && now->rapid == then->rapid
           && now->ext_speed == then->ext_speed && now->hold == then->hold
           && now->single == then->single && now->m01 == then->m01
           && now->rt_loop == then->rt_loop && now->backward == then->backward
           && now->simulate == then->simulate
           && now->held_axes == then->held_axes
           && now->shortcuts == then->shortcuts && now->inserts == then->inserts
           && same_techno(&now->done, &then->done)
           && same_techno(&now->done_again, &then->done_again);
}

void recall_for_orders(struct engine *engine) {
    if (!engine->commit.far || ahead_s(engine) <= commit_high(&engine->cfg)) {
        return;
    }
    const orders_seen now = orders_now(engine);
    if (!same_orders(&now, &engine->commit.under)) {
        recall_commit(engine);
    }
}

void choose_reach(struct engine *engine) {
    bool may = !cuts_phases(engine) && !engine->dispatch.in_loop
               && !(engine->cfg.functions & ENGINE_FCT_CALC_POS_V_0);
    engine->commit.far = false;
    if (may) {
        const orders_seen now = orders_now(engine);
        engine->commit.far = same_orders(&now, &engine->commit.under);
        engine->commit.under = now;
    }
}
