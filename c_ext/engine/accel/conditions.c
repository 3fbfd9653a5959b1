/* Conditions that the plan is made under, and the window they leave. */
#include "engine/accel/conditions.h"
#include "engine/accel/corner_limits.h"
#include "engine/accel/lookahead.h"
#include "engine/accel/profile.h"
#include "engine/commit/cpu_clock.h"
#include "engine/path/technology_counts.h"
#include "engine/run/dispatch.h"
#include "engine/state/state.h"

#define FEASIBLE 1.0000001 /* speeds squared may miss by rounding, ... */
#define FEASIBLE_BENT                                                          \
    1.002 /* ... inside a curved stretch by what the chord of its limits is    \
             off */

/* What the corner limits depend on besides the path: the override that zones
 * are sized for, and which gates are open. */
typedef struct conditions {
    double reserve_override;
    struct techno_counts done, done_again;
    bool single, m01;
    uint32_t held_axes;
} conditions;

bool state_feasible(struct engine *engine, uint64_t end, double bent) {
    if (engine->plan.v <= 0.0) {
        return true;
    }
    if (engine->plan.piece >= end) {
        return false;
    }
    return !is_motion(piece_at(engine, engine->plan.piece))
           || meets_all(engine,
                        engine->plan.piece,
                        end,
                        engine->plan.s,
                        engine->plan.v,
                        bent);
}

static uint64_t plan_under(struct engine *engine,
                           const struct conditions *conditions) {
    engine->plan.reserve_override = conditions->reserve_override;
    engine->plan.done = conditions->done;
    engine->plan.done_again = conditions->done_again;
    engine->plan.single = conditions->single;
    engine->plan.m01 = conditions->m01;
    engine->plan.held_axes = conditions->held_axes;
    engine->plan.capped = engine->plan.piece;
    corner_caps(engine);
    uint64_t end = window_end(engine);
    backward_pass(engine, end);
    return end;
}

static double reserve_wanted(const struct engine *engine) {
    return engine->plan.ext_speed < NEVER ? NEVER
           : engine->plan.override > 1.0  ? 2.0
                                          : 1.0;
}

static bool same_counts(const struct techno_counts *now,
                        const struct techno_counts *then) {
    return ATOMIC_GET(now->std_freed) == then->std_freed
           && ATOMIC_GET(now->std_acked) == then->std_acked
           && ATOMIC_GET(now->late_freed) == then->late_freed
           && ATOMIC_GET(now->slm_acked) == then->slm_acked
           && ATOMIC_GET(now->slp_acked) == then->slp_acked;
}

/* The last plan was made under the present conditions. */
bool conditions_hold(struct engine *engine) {
    const planner *plan = &engine->plan;
    return reserve_wanted(engine) == plan->reserve_override
           && ATOMIC_GET(engine->single_now) == plan->single
           && ATOMIC_GET(engine->m01_now) == plan->m01
           && ATOMIC_GET(engine->held_axes) == plan->held_axes
           && same_counts(&engine->done, &plan->done)
           && same_counts(&engine->done_again, &plan->done_again);
}

static struct conditions conditions_now(const struct engine *engine) {
    const planner *plan = &engine->plan;
    return (struct conditions){plan->reserve_override,
                               plan->done,
                               plan->done_again,
                               plan->single,
                               plan->m01,
                               plan->held_axes};
}

static struct conditions conditions_wanted(struct engine *engine) {
    return (struct conditions){reserve_wanted(engine),
                               techno_done(&engine->done),
                               techno_done(&engine->done_again),
                               ATOMIC_GET(engine->single_now),
                               ATOMIC_GET(engine->m01_now),
                               ATOMIC_GET(engine->held_axes)};
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
    struct conditions old = conditions_now(engine),
                      want = conditions_wanted(engine);
    uint64_t end = plan_under(engine, &want);
    if (state_feasible(engine,
                       end,
                       want.reserve_override == old.reserve_override
                           ? FEASIBLE_BENT
                           : FEASIBLE)) {
        return end; /* else cut anew */
    }
    if (want.reserve_override > old.reserve_override) {
        engine->plan.override =
            lesser(engine->plan.override, old.reserve_override);
    }
    want.reserve_override = old.reserve_override;
    end = plan_under(engine, &want);
    return state_feasible(engine, end, FEASIBLE_BENT)
               ? end
               : plan_under(engine, &old);
}

/* The window's end; where corner limits need more of the path than is fed, more
 * is fed. */
uint64_t choose_window(struct engine *engine) {
    watch_window(engine);
    uint64_t end = choose_conditions(engine);
    bool wants = (engine->plan.window_motions <= engine->cfg.window
                      ? engine->plan.capped < engine->piece_head
                      : engine->plan.unsettled < end)
                 && !engine->feed.final;
    return wants && feed_further(engine) ? choose_conditions(engine) : end;
}
