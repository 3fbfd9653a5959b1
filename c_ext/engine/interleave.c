/* Test build (HLI_COSIM_INTERLEAVE): planner, GEO and service on one thread
 * that is switched at their atomic accesses, at places that a seed chooses, for
 * as long as an overloaded machine might. So a race is the same every time, and
 * a run takes no real time.
 */
#include "engine/events.h"
#include "engine/geo/cycle.h"
#include "engine/lookahead/service.h"
#include "engine/plan/prediction.h"
#include "engine/plan/pump.h"
#include "engine/state/state.h"

#ifdef ENGINE_INTERLEAVE
#define BURSTS 13

typedef struct scheduler {
    struct engine *engine; /* NULL: nothing is switched */
    uint64_t random;
    int64_t left; /* accesses until the other side runs */
    int64_t cycles, end;
    bool geo_first; /* GEO is interrupted by the planner, else the planner by
                       GEO */
    bool rehearse;  /* GEO rehearses ahead of each cycle, as in real time */
    bool switched;
    int64_t seen;        /* cycle that the planner's last turn has ended in */
    int64_t turns, most; /* it ended so often while the path stood unasked */
} scheduler;

static scheduler now;

static uint64_t draw(uint64_t n) {
    now.random = now.random * 6364136223846793005u + 1442695040888963407u;
    return (now.random >> 33) % n;
}

static void run_geo(void) {
    if (now.rehearse) {
        geo_rehearse(now.engine);
    }
    geo_cycle(now.engine);
    now.cycles++;
}

/* A turn of the planner has ended: the path stands unasked for one more, if GEO
 * has had a cycle since the last one. */
static void count_turn(void) {
    const struct engine *engine = now.engine;
    bool stands = engine->lateness.cycles_now > 0 && !engine->geo.has_phase;
    now.turns = !stands ? 0 : now.turns + (now.cycles != now.seen);
    now.seen = now.cycles;
    now.most = now.turns > now.most ? now.turns : now.most;
}

static void run_planner(void) {
    prediction_plan(now.engine, planner_pump(now.engine) != 0);
    count_turn();
}

/* Mostly a cycle or two; now and then as many as pass while the planner gets no
 * time. */
static void other_side(void) {
    static const int64_t bursts[BURSTS] =
        {1, 1, 1, 2, 3, 5, 7, 8, 10, 14, 19, 25, 40};
    if (now.geo_first) {
        for (uint64_t i = 0, n = 1 + draw(3); i < n; i++) {
            run_planner();
        }
        return;
    }
    int64_t burst = bursts[draw(draw(4) ? 4 : BURSTS)];
    for (int64_t i = 0; i < burst && now.cycles < now.end; i++) {
        run_geo();
    }
    if (draw(4) == 0) {
        serve_request(now.engine);
    }
}

static void next_switch(void) {
    static const uint64_t within[] = {8, 24, 96, 3000};
    now.left = (int64_t)draw(within[draw(4)]);
}

void interleave(void) {
    if (!now.engine || now.switched || now.left-- > 0) {
        return;
    }
    now.switched = true;
    other_side();
    now.switched = false;
    next_switch();
}

/* One side, interrupted by the other, then perhaps the other one alone. */
static void turn(void) {
    now.switched = false;
    next_switch();
    if (now.geo_first) {
        run_geo();
    } else {
        run_planner();
    }
    now.switched = true;
    if (draw(3) == 0) {
        serve_request(now.engine);
    }
    if (draw(2) == 0) {
        return;
    }
    if (now.geo_first) {
        run_planner();
    } else {
        run_geo();
    }
}

int engine_interleaved(engine *engine,
                       int64_t cycles,
                       uint64_t seed,
                       int geo_first,
                       int rehearse) {
    int event = -1;
    if (!engine) {
        return ENGINE_DONE;
    }
    now = (scheduler){.engine = engine,
                      .random = seed * 2654435761u + 12345u,
                      .geo_first = geo_first != 0,
                      .rehearse = rehearse != 0,
                      .end = cycles,
                      .switched = true,
                      .seen = -1,
                      .turns = now.turns,
                      .most = now.most};
    for (int i = 0; i < 8; i++) {
        draw(2);
    }
    ATOMIC_SET(engine->threads.running, 1);
    while (now.cycles < cycles && (event = pending_event(engine)) < 0) {
        turn();
    }
    now.engine = NULL;
    ATOMIC_SET(engine->threads.running, 0);
    return event < 0 ? ENGINE_DONE : event;
}

int64_t engine_interleaved_stood(void) {
    int64_t most = now.most;
    now.turns = now.most = 0;
    return most;
}
#else
int engine_interleaved(struct engine *engine,
                       int64_t cycles,
                       uint64_t seed,
                       int geo_first,
                       int rehearse) {
    (void)engine, (void)cycles, (void)seed, (void)geo_first, (void)rehearse;
    return -1;
}

int64_t engine_interleaved_stood(void) {
    return -1;
}
#endif
