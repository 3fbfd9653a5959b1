/* GEO drives the stored tail, because the planner was late. It need not come to rest for that: the planner, which is where the
 * tail begins, follows its plan to a place of the tail that is still ahead of GEO, and offers a commit that goes on from there.
 *
 * GEO answers at the beginning of a cycle. If the place is ahead it makes the offer its commit, drives the tail to there and goes on;
 * until it has left the tail, nothing else is committed, since the next tail would be written over the one it drives. If not, the
 * tail is driven to its end. Without jerk the tail brakes from its beginning on: the place is nearer, and where it was passed or what
 * lies ahead cannot be met from it, a later one is tried.
 */
#include <math.h>
#include "engine/state/state.h"

#define THREAD_MARGIN_S 0.010 /* the place is so far ahead of GEO where the planner has its own thread, ... */
#define QUICK_MARGIN_S 0.004  /* ... without jerk, where plans take less time, ... */
#define MARGIN_CYCLES 3.0     /* ... and at least so many cycles */
#define LEAST_LEFT_CYCLES 5.0 /* of the tail behind it: for less it is driven to its end */
#define SHORTEST 0.05         /* of a cycle: no shorter part of a phase is left on either side */
#define SAME_TIME 1e-9        /* s */

typedef struct place {
    uint32_t phase; /* of the tail */
    double t;       /* s of it */
    double at_s, motion_s; /* of the tail ahead of it: time, time in motion */
} place;

static double margin_s(engine *e) {
    double least = MARGIN_CYCLES * e->cfg.cycle_s;
    return ATOMIC_GET(e->run_running) ? fmax(e->drive.planner ? THREAD_MARGIN_S : QUICK_MARGIN_S, least) : least;
}

/* The first place far enough ahead of GEO, inside a motion; false if too little of the tail would be left. */
static bool find_place(engine *e, const tail *t, place *out) {
    double consumed, at = 0.0, motion = 0.0, shortest = SHORTEST * e->cfg.cycle_s;
    bool found = false;
    __atomic_load(&e->geo.consumed_s, &consumed, __ATOMIC_ACQUIRE);
    double from = consumed + margin_s(e) - e->plan.committed_s;
    for (uint32_t i = t->first; i < t->count; i++) {
        const phase *ph = &t->phases[i];
        bool moves = is_motion(piece_at(e, ph->piece));
        double into = fmax(from - at, shortest);
        if (!found && moves && into <= ph->time - shortest) {
            *out = (place){i, into, at + into, motion + into};
            found = true;
        }
        at += ph->time;
        if (moves) motion += ph->time;
    }
    return found && motion - out->motion_s >= LEAST_LEFT_CYCLES * e->cfg.cycle_s;
}

/* GEO drives the tail, and the planner is where that begins. */
bool rejoin_possible(engine *e) {
    return !(e->drive.planner ? e->drive.restart : e->rejoin.over) && e->plan.v > 0.0 && (ATOMIC_GET(e->commit) & 1) && !ATOMIC_GET(e->tail_done);
}

static void place_writer(engine *e, const tail *t, const place *at, writer *w) {
    const phase *ph = &t->phases[at->phase];
    const jerk_law law = law_of_phase(ph);
    jerk_state state;
    jerk_at(&law, at->t, &state);
    *w = (writer){.e = e, .piece = ph->piece, .s = state.s, .v = state.v, .budget = commit_high(e)};
}

/* What was committed last, as long as the offer is not taken. */
static void remember_end(engine *e) {
    rejoin *r = &e->rejoin;
    r->piece = e->plan.piece;
    r->s = e->plan.s;
    r->v = e->plan.v;
    r->committed_s = e->plan.committed_s;
    r->written = e->plan.written;
}

static void go_back(engine *e) {
    const rejoin *r = &e->rejoin;
    e->plan.piece = r->piece;
    e->plan.s = r->s;
    e->plan.v = r->v;
    e->plan.committed_s = r->committed_s;
    e->plan.written = r->written;
    e->drive.restart = true;
}

/* Committed motion ends where the writer is. */
static void end_at(engine *e, const writer *w) {
    e->plan.piece = w->piece;
    e->plan.s = w->s;
    e->plan.v = w->v;
}

/* The offer, as far as the planner has written it. */
static void offer(engine *e, const place *at, uint32_t next) {
    e->plan.late = false;
    e->rejoin.phase = at->phase;
    e->rejoin.t = at->t;
    e->rejoin.word = e->plan.written << 2 | next << 1;
    ATOMIC_SET(e->rejoin.state, REJOIN_OFFERED);
}

/* Without jerk any place of the tail will do: all that lies ahead can be met from where it begins, so from there too, unless it has
 * been fed anew meanwhile. */
static void offer_quickly(engine *e) {
    uint64_t word = ATOMIC_GET(e->commit);
    uint32_t old = (word >> 1) & 1, next = old ^ 1;
    place at;
    writer w;
    if (!find_place(e, &e->plan.tails[old], &at)) {
        e->rejoin.over = true;
        return;
    }
    remember_end(e);
    place_writer(e, &e->plan.tails[old], &at, &w);
    end_at(e, &w);
    e->plan.committed_s += at.at_s;
    if (!profile_write(e, &w, &e->plan.tails[next])) {
        go_back(e);
        return;
    }
    end_at(e, &w);
    e->plan.left = w.left;
    e->plan.committed_s += w.seconds;
    offer(e, &at, next);
}

/* Motion from a place on the tail on. If there is none the tail is driven to its end. */
void rejoin_offer(engine *e) {
    if (!e->drive.planner) {
        offer_quickly(e);
        return;
    }
    uint64_t word = ATOMIC_GET(e->commit);
    uint32_t old = (word >> 1) & 1, next = old ^ 1;
    place at;
    writer w;
    remember_end(e);
    bool found = find_place(e, &e->plan.tails[old], &at);
    if (!found || fabs(jerk_advance(e->drive.planner, at.motion_s) - at.motion_s) > SAME_TIME) {
        e->drive.restart = true;
        return;
    }
    place_writer(e, &e->plan.tails[old], &at, &w);
    if (!drive_write(e, &w, &e->plan.tails[next])) {
        go_back(e);
        return;
    }
    end_at(e, &w);
    e->plan.committed_s += at.at_s + w.seconds;
    offer(e, &at, next);
}

/* No offer is out, and GEO has left the tail. */
bool rejoin_settled(engine *e) {
    int state = ATOMIC_GET(e->rejoin.state);
    if (state == REJOIN_NONE) return true;
    if (state != REJOIN_REFUSED) return false;
    go_back(e);
    ATOMIC_SET(e->rejoin.state, REJOIN_NONE);
    return true;
}
