/* Whether operator or PLC have changed anything since the last commit. */
#include "engine/plan/orders_seen.h"
#include "engine/commit/commit.h"
#include "engine/path/stands.h"
#include "engine/plan/recall.h"
#include "engine/state/state.h"

static orders_seen orders_now(const struct engine *engine) {
    const struct orders *orders = &engine->orders;
    return (orders_seen){
        .override = orders->override,
        .rapid = orders->rapid,
        .ext_speed = orders->ext_speed,
        .hold = orders->hold,
        .rt_loop = orders->rt_loop,
        .backward = orders->backward,
        .simulate = orders->simulate,
        .shortcuts = orders->shortcut_requests,
        .inserts = orders->insert_requests,
        .stands = stand_orders_now(engine),
    };
}

static bool same_orders(const struct engine *engine, const orders_seen *then) {
    const struct orders *now = &engine->orders;
    return now->override == then->override && now->rapid == then->rapid
           && now->ext_speed == then->ext_speed && now->hold == then->hold
           && now->rt_loop == then->rt_loop && now->backward == then->backward
           && now->simulate == then->simulate
           && now->shortcut_requests == then->shortcuts
           && now->insert_requests == then->inserts
           && same_stand_orders(engine, &then->stands);
}

void recall_for_orders(struct engine *engine) {
    if (!engine->commit.far || ahead_s(engine) <= commit_high(&engine->cfg)) {
        return;
    }
    if (!same_orders(engine, &engine->commit.under)) {
        recall_commit(engine);
    }
}

void choose_reach(struct engine *engine) {
    bool may = !cuts_phases(engine) && !engine->dispatch.in_loop
               && !(engine->cfg.functions & ENGINE_FCT_CALC_POS_V_0);
    engine->commit.far = false;
    if (may) {
        engine->commit.far = same_orders(engine, &engine->commit.under);
        engine->commit.under = orders_now(engine);
    }
}
