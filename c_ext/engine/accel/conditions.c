/* Conditions that the plan is made under, and the window they leave. */
#include "engine/accel/conditions.h"
#include "engine/accel/corner_limits.h"
#include "engine/accel/corner_zones.h"
#include "engine/accel/lookahead.h"
#include "engine/accel/profile.h"
#include "engine/accel/tuning.h"
#include "engine/commit/cpu_clock.h"
#include "engine/path/stands.h"
#include "engine/run/dispatch.h"
#include "engine/state/state.h"

/* What the corner limits depend on besides the path: the override that zones
 * are sized for, and which gates are open. */
typedef struct conditions {
    double reserve_override;
    struct stand_orders stands;
} conditions;

bool state_feasible(struct engine *engine, uint64_t end, double curved) {
    if (engine->commit.v <= 0.0) {
        return true;
    }
    if (engine->commit.piece >= end) {
        return false;
    }
    return !is_motion(piece_at(&engine->run, engine->commit.piece))
           || meets_all(engine,
                        engine->commit.piece,
                        end,
                        engine->commit.s,
                        engine->commit.v,
                        curved);
}

static uint64_t plan_under(struct engine *engine,
                           const struct conditions *conditions) {
    engine->plan.reserve_override = conditions->reserve_override;
    engine->plan.stands = conditions->stands;
    engine->accel.capped = engine->commit.piece;
    corner_caps(engine);
    uint64_t end = window_end(engine);
    backward_pass(engine, end);
    return end;
}

static double reserve_wanted(const struct plan_conditions *plan) {
    return plan->ext_speed < NEVER ? NEVER : plan->override > 1.0 ? 2.0 : 1.0;
}

bool conditions_hold(struct engine *engine) {
    return reserve_wanted(&engine->plan) == engine->plan.reserve_override
           && same_stand_orders(engine, &engine->plan.stands);
}

/* Whether a corner has just been driven through that is a stand under the
 * present conditions: they leave it no zone. */
static bool leaves_corner(struct engine *engine) {
    const struct commit_state *commit = &engine->commit;
    const struct piece *piece = piece_at(&engine->run, commit->piece);
    return commit->v > 0.0 && stands_before(&engine->plan, piece)
           && commit->s < corner_zone(&engine->cfg, commit->v, piece);
}

/* New conditions are taken over where the present state can be continued
 * legally under them: a larger override, a speed that the PLC commands (any
 * speed may come) and an opened gate all make zones, where less acceleration is
 * left. Until then the old ones hold. Returns the window's end. */
static uint64_t choose_conditions(struct engine *engine) {
    if (conditions_hold(engine)) {
        corner_caps(engine);
        uint64_t end = window_end(engine);
        backward_pass(engine, end);
        return end;
    }
    struct conditions old = {engine->plan.reserve_override,
                             engine->plan.stands};
    struct conditions want = {reserve_wanted(&engine->plan),
                              stand_orders_now(engine)};
    uint64_t end = plan_under(engine, &want);
    bool leaves = leaves_corner(engine);
    double curved = want.reserve_override == old.reserve_override
                        ? FEASIBLE_CURVED
                        : FEASIBLE;
    if (!leaves && state_feasible(engine, end, curved)) {
        return end; /* else cut anew */
    }
    if (want.reserve_override > old.reserve_override) {
        engine->plan.override =
            lesser(engine->plan.override, old.reserve_override);
    }
    want.reserve_override = old.reserve_override;
    end = plan_under(engine, &want);
    return !leaves && state_feasible(engine, end, FEASIBLE_CURVED)
               ? end
               : plan_under(engine, &old);
}

uint64_t choose_window(struct engine *engine) {
    watch_window(engine);
    uint64_t end = choose_conditions(engine);
    bool wants = (engine->accel.window_motions <= engine->cfg.window
                      ? engine->accel.capped < engine->run.head
                      : engine->accel.unsettled < end)
                 && !engine->dispatch.ends;
    return wants && dispatch_further(engine) ? choose_conditions(engine) : end;
}
