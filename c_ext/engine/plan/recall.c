/* Feed hold: what is committed but not begun is taken back, so that the path brakes from the next cycle on and not behind the
 * motion that was committed ahead.
 *
 * What is taken back first becomes the beginning of the stored tail (the same motion, published in the same atomic word): if
 * the planner is late with the stop, GEO goes on as before and comes to rest where the old plan does.
 */
#include "engine/state/state.h"

#define THREAD_MARGIN_S 0.006 /* motion that is left to GEO while a planner on its own thread computes the stop */
#define THREAD_MARGIN_CYCLES 2.0 /* ... and at least so many cycles: in the one ahead of the cut nothing may be changed any more */
#define SAME_TIME 1e-9
#define SHORT_REST 0.05       /* of a cycle: no less of a phase is taken back */

typedef struct cut {
    uint64_t phase;  /* first one that is taken back */
    double at_s;     /* committed motion ahead of it */
    double motion_s; /* of what is taken back, dwells left out */
} cut;

static const phase *phase_at(const engine *e, uint64_t i) { return &e->phase_ring[i & (PHASE_RING - 1)]; }

static double consumed_s(engine *e) {
    double s;
    __atomic_load(&e->geo.consumed_s, &s, __ATOMIC_ACQUIRE);
    return s;
}

/* Pumped on one thread without jerk phases are not written cycle by cycle: the one that GEO is in ends with the cycle it has
 * come to (at least one cycle behind its beginning), the rest of it becomes a phase of its own. */
static void end_present_phase(engine *e) {
    geo *g = &e->geo;
    if (e->drive.planner || ATOMIC_GET(e->run_running)) return; /* GEO may be at work on another thread */
    double dt = e->cfg.cycle_s, t = greater(g->t, g->t > 0.0 ? 0.0 : dt);
    if (g->in_tail || !g->has_phase || !is_motion(piece_at(e, g->now.piece)) || g->now.time - t < SHORT_REST * dt) return;
    phase *rest = &e->phase_ring[(g->consumed - 1) & (PHASE_RING - 1)];
    *rest = g->now;
    rest->s0 = g->now.s0 + (g->now.v0 + 0.5 * g->now.a * t) * t;
    rest->v0 = greater(0.0, g->now.v0 + g->now.a * t);
    rest->time = g->now.time - t;
    g->now.time = t;
    g->now.last = false;
    ATOMIC_SET(g->consumed, g->consumed - 1);
    e->plan.phases++;
}

static double margin_s(engine *e) { return ATOMIC_GET(e->run_running) ? greater(THREAD_MARGIN_S, THREAD_MARGIN_CYCLES * e->cfg.cycle_s) : 0.0; }

/* Everything that begins no earlier than `margin` from where GEO is. */
static bool find_cut(engine *e, double margin, cut *c) {
    double earliest = consumed_s(e) + margin;
    uint64_t first = ATOMIC_GET(e->geo.consumed);
    *c = (cut){e->plan.written, e->plan.committed_s, 0.0};
    while (c->phase > first) {
        const phase *ph = phase_at(e, c->phase - 1);
        if (c->at_s - ph->time < earliest - SAME_TIME) break;
        c->phase--;
        c->at_s -= ph->time;
        if (is_motion(piece_at(e, ph->piece))) c->motion_s += ph->time;
    }
    if (c->phase >= e->plan.written || !(c->motion_s > 0.0)) return false;
    return !ATOMIC_GET(e->run_running) || phase_at(e, c->phase)->v0 > GEO_MOVES;
}

/* The motion that is taken back, and the stored tail behind it. */
static bool longer_tail(const engine *e, const cut *c, const tail *old, tail *t) {
    uint64_t n = e->plan.written - c->phase, kept = old->count - old->first;
    if (n + kept > e->plan.tail_max) return false;
    for (uint64_t i = 0; i < n; i++) t->phases[i] = *phase_at(e, c->phase + i);
    memcpy(t->phases + n, old->phases + old->first, kept * sizeof(phase));
    t->first = 0;
    t->count = (uint32_t)(n + kept);
    t->edition = 0;
    t->piece = old->piece;
    t->s = old->s;
    return true;
}

static void go_back(engine *e, const cut *c) {
    const phase *ph = phase_at(e, c->phase);
    e->plan.phases -= e->plan.written - c->phase;
    e->plan.written = c->phase;
    e->plan.committed_s = c->at_s;
    e->plan.piece = ph->piece;
    e->plan.s = ph->s0;
    e->plan.v = ph->v0;
}

/* GEO has come too near to the cut: it may be about to read the next phase, so that one is not written any more. */
static bool too_late(engine *e, const cut *c) { return ATOMIC_GET(e->run_running) && consumed_s(e) > c->at_s - e->cfg.cycle_s; }

/* Forward to where the last `seconds` of motion begin. */
static void cut_later(engine *e, cut *c, double seconds) {
    while (c->motion_s > seconds + SAME_TIME) {
        const phase *ph = phase_at(e, c->phase++);
        c->at_s += ph->time;
        if (is_motion(piece_at(e, ph->piece))) c->motion_s -= ph->time;
    }
}

/* The commit ends at the cut from now on; the motion behind it is the beginning of the stored tail. */
static bool publish_cut(engine *e, uint64_t word, const cut *c) {
    uint32_t old = (word >> 1) & 1, next = old ^ 1;
    if (c->phase >= e->plan.written || !longer_tail(e, c, &e->plan.tails[old], &e->plan.tails[next])) return false;
    if (!__atomic_compare_exchange_n(&e->commit, &word, c->phase << 2 | next << 1, false, __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE)) return false;
    go_back(e, c);
    e->plan.late = too_late(e, c);
    return !e->plan.late;
}

void recall_commit(engine *e) {
    uint64_t word = ATOMIC_GET(e->commit);
    cut c;
    if ((word & 1) || ATOMIC_GET(e->withdraw) != WITHDRAW_NONE || (e->drive.planner && e->drive.restart)) return;
    if (e->cfg.functions & ENGINE_FCT_CALC_POS_V_0) return; /* the place of rest has been told the PLC */
    planner_store_tail(e);
    end_present_phase(e);
    if (!find_cut(e, margin_s(e), &c)) return;
    if (!e->drive.planner) {
        publish_cut(e, word, &c);
        return;
    }
    double seconds = drive_take_back(e, c.motion_s);
    if (seconds <= 0.0) return;
    cut_later(e, &c, seconds);
    bool in_time = publish_cut(e, word, &c);
    if (in_time || e->plan.late) e->plan.v = jerk_speed(e->drive.planner); /* late: GEO comes to the tail, whose beginning that is (rejoin.c) */
    else e->drive.restart = true; /* from where the tail ends */
}
