/* Committed motion: phases written cycle by cycle into the phase ring, or whole
 * into a tail. */
#include <math.h>
#include "engine/commit/commit.h"
#include "engine/state/state.h"
#include "engine/state/tuning.h"
#include "jerk/state/api.h"
#include "rows/nc_block.h"

/* What is left of a phase from t on begins so. */
static void begin_at(phase *ph, double t) {
    jerk_law law = law_of_phase(ph);
    jerk_begin_at(&law, t);
    ph->s0 = law.s0;
    ph->v0 = law.v0;
    ph->a = law.a0;
    ph->jerk = law.jerk;
    ph->snap = law.snap;
    ph->crackle = law.crackle;
}

/* From `at` (committed motion, s) to the end of the cycle of GEO in which it is
 * driven. */
static double remainder_of_cycle(struct engine *engine, double at) {
    double now, dt = engine->cfg.cycle_s;
    __atomic_load(&engine->geo.consumed_s, &now, __ATOMIC_ACQUIRE);
    double cycles = (at - now) / dt,
           remainder = (floor(cycles) + 1.0 - cycles) * dt;
    return remainder < SHORT_PART * dt ? remainder + dt : remainder;
}

/* Committed motion is written cycle by cycle: what has not begun can be taken
 * back (recall.c). Pumped on one thread without jerk it is cut then and there.
 */
static void commit_phase(struct writer *writer, const phase *ph) {
    struct engine *engine = writer->engine;
    if (!cuts_phases(engine)) {
        engine->commit.ring[engine->commit.written++ & (PHASE_RING - 1)] = *ph;
        return;
    }
    bool motion = is_motion(piece_at(&engine->run, ph->piece));
    double from = 0.0, to = motion
                                ? remainder_of_cycle(engine,
                                                     engine->commit.committed_s
                                                         + writer->seconds)
                                : ph->time;
    for (int i = 1;; i++) {
        phase *out =
            &engine->commit.ring[engine->commit.written++ & (PHASE_RING - 1)];
        bool end =
            i >= PARTS_MAX || to >= ph->time - SHORT_PART * engine->cfg.cycle_s;
        *out = *ph;
        if (from > 0.0) {
            begin_at(out, from);
        }
        out->time = (end ? ph->time : to) - from;
        out->last = ph->last && end;
        if (end) {
            return;
        }
        from = to;
        to += engine->cfg.cycle_s;
    }
}

void write_phase(struct writer *writer, const phase *ph) {
    if (writer->out) {
        writer->out[writer->count++] = *ph;
    } else {
        commit_phase(writer, ph);
    }
    writer->seconds += ph->time;
}

void pass_event(struct writer *writer) {
    const struct piece *piece = piece_at(&writer->engine->run, writer->piece);
    double time = piece->type == NC_DWELL ? piece->value : 0.0;
    emit_phase(writer, 0.0, time, true);
    writer->piece++;
    writer->s = 0.0;
}

double ahead_s(struct engine *engine) {
    double consumed;
    __atomic_load(&engine->geo.consumed_s, &consumed, __ATOMIC_ACQUIRE);
    return engine->commit.committed_s - consumed;
}

double commit_high(const engine_config *cfg) {
    return greater(COMMIT_HIGH_S, COMMIT_HIGH_CYCLES * cfg->cycle_s);
}

double commit_low(const struct engine *engine) {
    double least = COMMIT_LOW_CYCLES * engine->cfg.cycle_s;
    if (cuts_phases(engine)) {
        return greater(COMMIT_LOW_S, least);
    }
    return greater(lesser(COMMIT_LOW_S, PUMPED_CYCLES * engine->cfg.cycle_s),
                   least);
}

double next_commit(struct engine *engine) {
    double dt = engine->cfg.cycle_s, low = commit_low(engine),
           ahead = ahead_s(engine);
    return engine->plan.hold
               ? 0.0
               : greater(0.0,
                         commit_high(&engine->cfg)
                             - (ahead
                                - (floor(greater(0.0, ahead - low) / dt) + 1.0)
                                      * dt));
}
