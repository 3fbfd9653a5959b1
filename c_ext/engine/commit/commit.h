/* Committed motion: phases written cycle by cycle into the phase ring, or whole
 * into a tail. */
#ifndef ENGINE_COMMIT_COMMIT_H
#define ENGINE_COMMIT_COMMIT_H
#include "engine/state/state.h"
#include "engine/state/tuning.h"

/* Where phases are written to, and how far it has got. */
typedef struct writer {
    struct engine *engine;
    phase *out; /* linear buffer, or NULL for the ring */
    uint32_t count, max;
    uint64_t piece;
    double s, v, seconds, budget;
    double motion; /* s; of that what the jerk-limited planner has handed out */
    double near; /* s; of the budget, what is committed over any pieces, ... */
    uint64_t far_to; /* ... the rest up to this piece */
    double least; /* s; so much is committed although more of the path might let
                     it drive faster */
    uint64_t too_fast; /* corners and stands that it passes too fast, ... */
    bool refused;      /* ... by more than rounding */
    curved_remainder left;
} writer;

void write_phase(struct writer *writer, const phase *ph);
void pass_event(struct writer *writer);
double ahead_s(struct engine *engine);

/* So much motion is ahead of GEO behind a commit; never less than the cycle
 * that comes next, or GEO would live on the tails. */
double commit_high(const engine_config *cfg);

/* Less motion ahead than this: more is committed. Without jerk a planner that
 * is pumped with every cycle needs no time of its own; fewer and longer commits
 * spare it stopping tails. */
double commit_low(const struct engine *engine);

/* What is committed next, once too little is ahead of GEO; s. */
double next_commit(struct engine *engine);

static inline bool cuts_phases(const struct engine *engine) {
    return engine->traits.cuts_phases || ATOMIC_GET(engine->threads.running);
}

static inline bool writer_full(const struct writer *writer) {
    if (writer->seconds >= writer->budget) {
        return true;
    }
    if (writer->out) {
        return writer->count + 4 >= writer->max;
    }
    return writer->engine->commit.written
               - ATOMIC_GET(writer->engine->geo.consumed)
           >= PHASE_RING - 4 - PARTS_MAX;
}

/* Pumped on one thread without jerk phases are not cut: they are written where
 * they stay. */
static inline phase *phase_slot(struct writer *writer) {
    if (writer->out) {
        return &writer->out[writer->count++];
    }
    return &writer->engine->commit
                .ring[writer->engine->commit.written++ & (PHASE_RING - 1)];
}

/* Written field by field where it stays: a copy would wait for what was just
 * written. */
static inline void emit_phase(struct writer *writer,
                              double a,
                              double time,
                              bool last) {
    phase cut;
    bool stays = writer->out || !cuts_phases(writer->engine);
    phase *ph = stays ? phase_slot(writer) : &cut;
    ph->piece = writer->piece;
    ph->s0 = writer->s;
    ph->v0 = writer->v;
    ph->a = a;
    ph->jerk = ph->snap = ph->crackle = ph->pop = 0.0;
    ph->time = time;
    ph->last = last;
    if (stays) {
        writer->seconds += time;
    } else {
        write_phase(writer, ph);
    }
}

#endif
