/* Conditions that the plan is made under, and the window they leave. */
#include "engine/accel/conditions.h"
#include "engine/accel/corner_limits.h"
#include "engine/accel/lookahead.h"
#include "engine/accel/profile.h"
#include "engine/accel/tuning.h"
#include "engine/commit/cpu_clock.h"
#include "engine/path/technology_counts.h"
#include "engine/run/dispatch.h"
#include "engine/state/state.h"

/* What the corner limits depend on besides the path: the override that zones
 * are sized for, and which gates are open. */
typedef struct conditions {
    double reserve_override;
    struct techno_counts done, done_again;
    bool single, m01;
    uint32_t held_axes;
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
    engine->plan.done = conditions->done;
    engine->plan.done_again = conditions->done_again;
    engine->plan.single = conditions->single;
    engine->plan.m01 = conditions->m01;
    engine->plan.held_axes = conditions->held_axes;
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
           && ATOMIC_GET(engine->orders.single) == engine->plan.single
           && ATOMIC_GET(engine->orders.m01) == engine->plan.m01
           && ATOMIC_GET(engine->orders.held_axes) == engine->plan.held_axes
           && same_techno(&engine->technology.done, &engine->plan.done)
           && same_techno(&engine->technology.done_again,
                          &engine->plan.done_again);
}

static struct conditions conditions_now(const struct plan_conditions *plan) {
    return (struct conditions){plan->reserve_override,
                               plan->done,
                               plan->done_again,
                               plan->single,
                               plan->m01,
                               plan->held_axes};
}

static struct conditions conditions_wanted(struct engine *engine) {
    return (struct conditions){reserve_wanted(&engine->plan),
                               techno_done(&engine->technology.done),
                               techno_done(&engine->technology.done_again),
                               ATOMIC_GET(engine->orders.single),
                               ATOMIC_GET(engine->orders.m01),
                               ATOMIC_GET(engine->orders.held_axes)};
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
    struct conditions old = conditions_now(&engine->plan),
                      want = conditions_wanted(engine);
    uint64_t end = plan_under(engine, &want);
    if (state_feasible(engine,
                       end,
                       want.reserve_override == old.reserve_override
                           ? FEASIBLE_CURVED
                           : FEASIBLE)) {
        return end; /* else cut anew */
    }
    if (want.reserve_override > old.reserve_override) {
        engine->plan.override =
            lesser(engine->plan.override, old.reserve_override);
    }
    want.reserve_override = old.reserve_override;
    end = plan_under(engine, &want);
    return state_feasible(engine, end, FEASIBLE_CURVED)
               ? end
               : plan_under(engine, &old);
}

uint64_t choose_window(struct engine *engine) {
    watch_window(engine);
    uint64_t end = choose_conditions(engine);
    bool wants = (engine->accel.window_motions <= engine->cfg.window
                      ? engine->accel.capped < engine->run.head
                      : engine->accel.unsettled < end)
                 && !engine->dispatch.final;
    return wants && dispatch_further(engine) ? choose_conditions(engine) : end;
}
