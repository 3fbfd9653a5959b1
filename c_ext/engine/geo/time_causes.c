/* Where the time goes: each cycle counts for what limits the speed in it.
 *
 * At constant speed that is the limit which holds it there. A cycle that speeds
 * up counts for the low end of its ramp, and so does one that slows down: a
 * corner that is driven exactly costs the ramps on both of its sides. A ramp
 * whose low end is no corner and no stop counts for the limit of the axes that
 * shapes it, acceleration or jerk. */
#include <math.h>
#include <string.h>
#include "engine/geo/standstill.h"
#include "engine/path/piece.h"
#include "engine/state/tuning.h"
#include "rows/nc_block.h"

#define LONG_AGO (UINT64_MAX / 2) /* a cycle that no program reaches */

static bool jerk_limited(const struct engine *engine) {
    return engine->jerk_adapter.planner != NULL;
}

/* What shapes a ramp of this steepness, mm/s a cycle. */
static uint32_t ramp_limit(const struct engine *engine, double change) {
    const struct piece *piece = piece_at(&engine->run, engine->geo.piece);
    double reached = CAUSE_REACHED * piece->accel * engine->cfg.cycle_s;
    return jerk_limited(engine) && change < reached ? ENGINE_CAUSE_JERK
                                                    : ENGINE_CAUSE_ACCELERATION;
}

static bool turns(const struct engine *engine, const struct piece *piece) {
    const double *before = engine->time_causes.tangent;
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        if (fabs(piece->tangent_in[i] - before[i]) > CAUSE_TURN) {
            return true;
        }
    }
    return false;
}

/* The pieces that the cycle has come to: is there a corner, is there a stop? */
static void pass_pieces(struct engine *engine) {
    struct time_causes *causes = &engine->time_causes;
    uint64_t at = engine->geo.piece, from = causes->piece + 1;
    if (causes->piece == UINT64_MAX || from > at || at - from > CAUSE_PIECES) {
        from = at;
    }
    causes->piece = at;
    for (; from <= at; from++) {
        const struct piece *piece = piece_at(&engine->run, from);
        if (!is_motion(piece)) {
            continue;
        }
        bool stop = piece->stop_before && causes->has_tangent;
        causes->corner_ahead =
            !stop && causes->has_tangent && turns(engine, piece);
        if (stop) {
            causes->stop_cycle = engine->geo.cycle;
        } else if (causes->corner_ahead) {
            causes->corner_cycle = engine->geo.cycle;
        }
        memcpy(causes->tangent, piece->tangent_out, sizeof causes->tangent);
        causes->has_tangent = true;
    }
}

/* The low end of a ramp has just been passed. */
static uint32_t low_end(const struct engine *engine) {
    const struct time_causes *causes = &engine->time_causes;
    uint64_t now = engine->geo.cycle;
    if (now - causes->stop_cycle <= CAUSE_NEAR_CYCLES) {
        return ENGINE_CAUSE_EXACT_STOP;
    }
    if (now - causes->corner_cycle <= CAUSE_NEAR_CYCLES) {
        return ENGINE_CAUSE_EXACT_CORNER;
    }
    return ENGINE_CAUSE_NONE;
}

/* The ramp down belongs to its low end; NONE: to what has shaped it. */
static void settle_ramp(struct time_causes *causes, uint32_t low) {
    if (!causes->falls) {
        return;
    }
    for (uint32_t i = 0; i < ENGINE_CAUSES; i++) {
        causes->seconds[low == ENGINE_CAUSE_NONE ? i : low] +=
            causes->falling[i];
        causes->falling[i] = 0.0;
    }
    causes->falls = false;
}

static bool axis_at_limit(const struct engine *engine,
                          const struct piece *piece) {
    double tangent[NC_AXES];
    piece_tangent(engine, piece, engine->geo.s, tangent);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        if (fabs(tangent[i]) * engine->geo.v
            >= CAUSE_REACHED * piece_v_max(&engine->cfg, piece, i)) {
            return true;
        }
    }
    return false;
}

/* What holds a constant speed where it is. */
static uint32_t plateau(const struct engine *engine) {
    const struct piece *piece = piece_at(&engine->run, engine->geo.piece);
    const struct orders *orders = &engine->orders;
    double factor = piece->flags & NC_NO_OVERRIDE ? 1.0
                    : piece->feed > 0             ? orders->override
                                                  : orders->rapid,
           top = piece->feed > 0 ? piece->feed : piece->v_hard;
    if (engine->geo.v >= CAUSE_REACHED * top * factor && factor < 1.0) {
        return ENGINE_CAUSE_OVERRIDE;
    }
    if (piece->feed > 0 && engine->geo.v >= CAUSE_REACHED * top * factor) {
        return ENGINE_CAUSE_FEED;
    }
    if (axis_at_limit(engine, piece)) {
        return ENGINE_CAUSE_VELOCITY;
    }
    if (piece->kind != PIECE_LINE) {
        return ENGINE_CAUSE_ACCELERATION;
    }
    return engine->time_causes.corner_ahead ? ENGINE_CAUSE_EXACT_CORNER
                                            : engine->time_causes.low;
}

static void count_motion(struct engine *engine, double before) {
    struct time_causes *causes = &engine->time_causes;
    double now = engine->geo.v, change = now - before,
           cycle = engine->cfg.cycle_s;
    if (fabs(change) <= CAUSE_FLAT * now) {
        uint32_t cause = plateau(engine);
        bool corner = cause == ENGINE_CAUSE_EXACT_CORNER;
        causes->low = corner ? cause : ENGINE_CAUSE_NONE;
        settle_ramp(causes, causes->low);
        causes->seconds[cause == ENGINE_CAUSE_NONE ? ramp_limit(engine, 0.0)
                                                   : cause] += cycle;
    } else if (change < 0) {
        causes->falling[ramp_limit(engine, -change)] += cycle;
        causes->falls = true;
    } else {
        if (causes->falls) {
            causes->low = low_end(engine);
            settle_ramp(causes, causes->low);
        }
        uint32_t low = causes->low;
        causes->seconds[low == ENGINE_CAUSE_NONE ? ramp_limit(engine, change)
                                                 : low] += cycle;
    }
}

static void count_standstill(struct engine *engine) {
    struct time_causes *causes = &engine->time_causes;
    const struct geo *geo = &engine->geo;
    uint32_t cause = ENGINE_CAUSE_WAIT;
    if (geo->dwelling) {
        cause = ENGINE_CAUSE_DWELL;
    }
    uint32_t held = stop_conditions(engine) & ~ENGINE_STOP_NO_BLOCKS;
    uint32_t stop = ENGINE_STOP_DWELL | ENGINE_STOP_FUNCTION | ENGINE_STOP_M00
                    | ENGINE_STOP_M01;
    causes->low = held & stop ? ENGINE_CAUSE_EXACT_STOP
                  : held      ? ENGINE_CAUSE_WAIT
                              : low_end(engine);
    settle_ramp(causes, causes->low);
    causes->seconds[cause] += engine->cfg.cycle_s;
}

void count_time(struct engine *engine) {
    struct time_causes *causes = &engine->time_causes;
    const struct geo *geo = &engine->geo;
    double before = causes->speed;
    causes->speed = geo->v;
    if (!ATOMIC_GET(engine->program.active) || engine->program.end
        || ATOMIC_GET(engine->program.hold_start)) {
        return;
    }
    if (geo->piece != causes->piece && geo->piece != UINT64_MAX) {
        pass_pieces(engine);
    }
    bool moves = geo->v > 0.0 || before > 0.0;
    if (moves && is_motion(piece_at(&engine->run, geo->piece))) {
        count_motion(engine, before);
    } else {
        count_standstill(engine);
    }
}

void time_causes_begin(struct time_causes *causes) {
    settle_ramp(causes, ENGINE_CAUSE_NONE);
    causes->low = ENGINE_CAUSE_NONE;
    causes->piece = UINT64_MAX;
    causes->speed = 0.0;
    causes->has_tangent = causes->corner_ahead = false;
    causes->corner_cycle = causes->stop_cycle = LONG_AGO;
}

void time_by_cause(const struct engine *engine, double *seconds) {
    const struct time_causes *causes = &engine->time_causes;
    for (uint32_t i = 0; i < ENGINE_CAUSES; i++) {
        seconds[i] = causes->seconds[i] + causes->falling[i];
    }
}
