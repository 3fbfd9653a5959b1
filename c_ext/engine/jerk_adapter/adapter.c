/* The jerk-limited planner behind the engine: pieces of the run ring become
 * intervals of its path, its time laws become phases, what is left of its plan
 * becomes the stopping tail.
 *
 * Where the axes must stand is a flag of the interval ahead of that place, so
 * it can come and go while the path ahead is known: gates that open, single
 * block, held axes. A stand that comes too late to be met is not set, as in
 * accel/profile.c.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "engine/jerk_adapter/adapter.h"
#include "engine/commit/commit.h"
#include "engine/commit/planner.h"
#include "engine/jerk_adapter/path_push.h"
#include "engine/jerk_adapter/tuning.h"
#include "engine/path/stands.h"
#include "engine/state/state.h"
#include "engine/state/tuning.h"
#include "jerk/state/api.h"

static jerk_config config_of(const engine_config *cfg) {
    jerk_config config = {.axes = cfg->axis_count,
                          .cycle_s = cfg->cycle_s,
                          .window_blocks = (int)cfg->window};
    for (int i = 0; i < config.axes; i++) {
        config.v_max[i] = cfg->v_max[i];
        config.a_max[i] = cfg->a_max[i];
        config.j_max[i] =
            cfg->j_max[i] > 0 ? cfg->j_max[i] : cfg->a_max[i] / cfg->cycle_s;
    }
    config.window_knots =
        (int)fmin(MAX_KNOTS,
                  fmax(KNOTS_PER_BLOCK * cfg->window,
                       64.0 + BRAKES_AHEAD * jerk_stop_knots(&config)));
    return config;
}

bool jerk_adapter_wanted(const engine_config *cfg) {
    for (int i = 0; i < cfg->axis_count; i++) {
        if (cfg->j_max[i] > 0) {
            return true;
        }
    }
    return false;
}

/* A second planner like the first one. */
static jerk_planner *spare(const struct engine *engine) {
    jerk_config config = config_of(&engine->cfg);
    return jerk_new(&config, 2 * config.window_knots);
}

/* More jerk than that is not seen in a cycle. */
static void bound_jerk(engine_config *cfg) {
    for (int i = 0; i < cfg->axis_count; i++) {
        cfg->j_max[i] = fmin(cfg->j_max[i],
                             ENGINE_JERK_SEEN * cfg->a_max[i] / cfg->cycle_s);
    }
}

static int laws_for(const jerk_config *config) {
    return (int)jerk_laws_max(config);
}

static uint32_t phases_for(int laws) {
    return 2 * (uint32_t)laws + 1024;
}

bool jerk_adapter_new(struct engine *engine) {
    if (!jerk_adapter_wanted(&engine->cfg)) {
        return true;
    }
    bound_jerk(&engine->cfg);
    jerk_config c = config_of(&engine->cfg);
    engine->jerk_adapter.laws_max = laws_for(&c);
    if (engine->commit.tail_max < phases_for(engine->jerk_adapter.laws_max)) {
        engine->commit.tail_max = phases_for(engine->jerk_adapter.laws_max);
    }
    engine->jerk_adapter.planner = jerk_new(&c, 2 * c.window_knots);
    engine->jerk_adapter.laws =
        calloc((size_t)engine->jerk_adapter.laws_max, sizeof(jerk_law));
    for (int i = 0; i < 2; i++) {
        engine->commit.tails[i].place =
            calloc((size_t)engine->jerk_adapter.laws_max, sizeof(uint32_t));
    }
    return engine->jerk_adapter.planner && engine->jerk_adapter.laws
           && engine->commit.tails[0].place && engine->commit.tails[1].place;
}

static bool grow(void **memory, size_t count, size_t size) {
    void *more = realloc(*memory, count * size);
    *memory = more ? more : *memory;
    return more != NULL;
}

/* Room for longer plans; what the tails hold stays. */
static bool grow_room(struct engine *engine, int laws) {
    struct jerk_adapter *adapter = &engine->jerk_adapter;
    struct tail *tails = engine->commit.tails;
    if (laws <= adapter->laws_max) {
        return true;
    }
    uint32_t phases = phases_for(laws);
    bool longer = phases > engine->commit.tail_max;
    bool grown = grow((void **)&adapter->laws, (size_t)laws, sizeof(jerk_law));
    for (int i = 0; grown && i < 2; i++) {
        grown = grow((void **)&tails[i].place, (size_t)laws, sizeof(uint32_t))
                && (!longer
                    || grow((void **)&tails[i].phases, phases, sizeof(phase)));
    }
    if (grown) {
        adapter->laws_max = laws;
        engine->commit.tail_max = longer ? phases : engine->commit.tail_max;
    }
    return grown;
}

bool jerk_adapter_renew(struct engine *engine) {
    if (!engine->jerk_adapter.planner) {
        return true;
    }
    bound_jerk(&engine->cfg);
    jerk_config config = config_of(&engine->cfg);
    jerk_planner *planner = jerk_new(&config, 2 * config.window_knots);
    if (!planner || !grow_room(engine, laws_for(&config))) {
        jerk_free(planner);
        return false;
    }
    jerk_free(engine->jerk_adapter.planner);
    engine->jerk_adapter.planner = planner;
    for (int i = 0; i < 2; i++) {
        engine->commit.tails[i].edition = 0;
    }
    engine->jerk_adapter.restart = true;
    return true;
}

void jerk_adapter_free(struct engine *engine) {
    jerk_free(engine->jerk_adapter.planner);
    free(engine->jerk_adapter.laws);
    for (int i = 0; i < 2; i++) {
        free(engine->commit.tails[i].place);
    }
}

static bool stands_change(struct engine *engine) {
    if (same_stand_orders(engine, &engine->plan.stands)) {
        return false;
    }
    engine->plan.stands = stand_orders_now(engine);
    return true;
}

static void set_speeds(struct engine *engine) {
    jerk_planner *planner = engine->jerk_adapter.planner;
    jerk_hold(planner, engine->plan.hold);
    jerk_read_plan(planner, plan_is_read(engine));
    jerk_command_speed(planner,
                       engine->plan.ext_speed < NEVER ? engine->plan.ext_speed
                                                      : -1.0);
    if (!engine->plan.hold) {
        jerk_override(planner,
                      engine->plan.override,
                      fmin(1.0, engine->plan.rapid));
    }
}

static bool steps_over(struct run_ring *run, uint64_t i) {
    const struct piece *piece = piece_at(run, i);
    return !is_motion(piece) || piece->length <= STEPPED_OVER_MM;
}

/* Events, and pieces without a length, up to piece `until`. */
static void pass_events(struct writer *writer, uint64_t until) {
    while (writer->piece < until && !writer_full(writer)
           && steps_over(&writer->engine->run, writer->piece)) {
        const struct piece *piece =
            piece_at(&writer->engine->run, writer->piece);
        if (is_motion(piece)) {
            const phase ph = {.piece = writer->piece,
                              .s0 = piece->length,
                              .v0 = writer->v,
                              .last = true};
            write_phase(writer, &ph);
            writer->piece++;
        } else {
            pass_event(writer);
        }
    }
}

static void write_law(struct writer *writer, const jerk_law *law) {
    bool last = law->last & 2;
    const phase ph = {law->tag,
                      law->s0,
                      law->v0,
                      law->a0,
                      law->jerk,
                      law->snap,
                      law->crackle,
                      law->pop,
                      law->time,
                      last};
    write_phase(writer, &ph);
    writer->piece = law->tag + last;
    writer->s = last ? 0.0 : law->s0 + law->length;
    writer->v =
        law->flags & JERK_STAND
            ? 0.0
            : law->length
                  / law->time; /* not at rest: that is all a tail needs */
    writer->motion += law->time;
}

static void write_commit(struct engine *engine,
                         struct writer *writer,
                         bool changed) {
    jerk_planner *planner = engine->jerk_adapter.planner;
    jerk_law law;
    pass_events(writer, engine->run.head);
    while (!writer_full(writer)) {
        if (!jerk_next_within(planner,
                              &law,
                              writer->budget - writer->seconds)) {
            int64_t known = jerk_ahead(planner);
            push_path(engine); /* it stands; is there more? */
            if (jerk_ahead(planner) == known) {
                break;
            }
            continue;
        }
        if (changed) {
            forget_missed_stands(planner);
        }
        changed = false;
        write_law(writer, &law);
        pass_events(writer, engine->run.head);
    }
    writer->v = jerk_speed(planner);
}

/* The buffer holds this very plan already: it only begins later. */
static bool tail_continues(struct engine *engine,
                           struct tail *tail,
                           const struct writer *from) {
    const jerk_planner *planner = engine->jerk_adapter.planner;
    jerk_law law;
    bool same = tail->edition != 0 && tail->edition == jerk_edition(planner);
    if (!same || !(from->v > 0.0) || jerk_tail(planner, &law, 1) != 1) {
        return false;
    }
    tail->first = tail->place[jerk_used(planner) - tail->from];
    while (steps_over(&engine->run, tail->phases[tail->first].piece)
           && tail->phases[tail->first].piece < from->piece) {
        tail->first++; /* events that are committed */
    }
    uint32_t i = tail->first;
    while (steps_over(&engine->run, tail->phases[i].piece)) {
        i++;
    }
    struct writer writer = {.engine = engine,
                            .out = tail->phases,
                            .count = i,
                            .budget = NEVER};
    write_law(&writer, &law); /* a part of it may have been handed out */
    return true;
}

/* What is left of the plan; false if it finds no room. */
static bool write_tail(struct engine *engine,
                       struct tail *tail,
                       const struct writer *from) {
    struct jerk_adapter *adapter = &engine->jerk_adapter;
    if (tail_continues(engine, tail, from)) {
        return true;
    }
    struct writer writer = {.engine = engine,
                            .out = tail->phases,
                            .max = engine->commit.tail_max,
                            .piece = from->piece,
                            .s = from->s,
                            .v = from->v,
                            .budget = NEVER};
    int64_t count =
        from->v > 0.0
            ? jerk_tail(adapter->planner, adapter->laws, adapter->laws_max)
            : 0;
    tail->edition = 0;
    for (int64_t i = 0; i < count; i++) {
        tail->place[i] = writer.count;
        pass_events(&writer, adapter->laws[i].tag);
        if (writer_full(&writer)) {
            return false;
        }
        write_law(&writer, &adapter->laws[i]);
    }
    tail->first = 0;
    tail->count = writer.count;
    tail->edition = count > 0 ? jerk_edition(adapter->planner) : 0;
    tail->from = jerk_used(adapter->planner);
    tail->piece = writer.piece;
    tail->s = writer.s;
    return count < adapter->laws_max;
}

/* The `seconds` that were handed out last are not driven: the planner goes back
 * to where they begin, on the plan that the stored tail is of. False: it
 * cannot. */
static bool back_to_tail(struct engine *engine, double seconds) {
    jerk_planner *planner = engine->jerk_adapter.planner;
    if (fabs(jerk_go_back(planner, seconds) - seconds) > SAME_TIME) {
        return false;
    }
    update_stands(engine);
    return true;
}

/* The stopping tail becomes the shortest one there is, so that what lies behind
 * it may be changed. False: not now. */
static bool shorten_tail(struct engine *engine) {
    if (engine->commit.v <= 0.0) {
        return true;
    }
    uint64_t word = ATOMIC_GET(engine->commit.word);
    if (engine->jerk_adapter.restart || (word & 1)) {
        return false;
    }
    uint32_t next = ((word >> 1) & 1) ^ 1;
    struct writer w = {.engine = engine,
                       .piece = engine->commit.piece,
                       .s = engine->commit.s,
                       .v = engine->commit.v};
    jerk_keep(engine->jerk_adapter.planner);
    jerk_brake(engine->jerk_adapter.planner);
    if (write_tail(engine, &engine->commit.tails[next], &w)
        && __atomic_compare_exchange_n(&engine->commit.word,
                                       &word,
                                       engine->commit.written << 2 | next << 1,
                                       false,
                                       __ATOMIC_ACQ_REL,
                                       __ATOMIC_ACQUIRE)) {
        return true;
    }
    engine->jerk_adapter.restart = !back_to_tail(engine, 0.0);
    return false;
}

/* The last `seconds` that were committed, or a little less, are the beginning
 * of the plan again. */
static double take_back(struct engine *engine, double seconds) {
    double back = jerk_take_back(engine->jerk_adapter.planner, seconds);
    if (back > 0.0) {
        update_stands(engine);
    }
    return back;
}

/* Motion from where writer is, as much as its budget, and the tail behind it;
 * false if that finds no room. */
static bool write_plan(struct engine *engine,
                       struct writer *writer,
                       struct tail *tail) {
    bool changed = stands_change(engine);
    if (changed) {
        update_stands(engine);
    }
    push_path(engine);
    set_speeds(engine);
    write_commit(engine, writer, changed);
    return write_tail(engine, tail, writer);
}

/* Commit motion until commit_high of it is ahead of GEO. */
static void commit(struct engine *engine) {
    if (engine->jerk_adapter.restart && engine->commit.v > 0.0) {
        return; /* the stored tail is driven first */
    }
    if (engine->jerk_adapter.restart) {
        adapter_restart(engine);
    }
    uint64_t word = ATOMIC_GET(engine->commit.word),
             before = engine->commit.written;
    struct writer writer = {.engine = engine,
                            .piece = engine->commit.piece,
                            .s = engine->commit.s,
                            .v = engine->commit.v,
                            .budget =
                                commit_high(&engine->cfg) - ahead_s(engine)};
    uint32_t next = ((word >> 1) & 1) ^ 1;
    if (word & 1) {
        return; /* GEO has taken the tail */
    }
    jerk_watch(engine->jerk_adapter.planner, &engine->commit.word);
    jerk_keep(engine->jerk_adapter.planner);
    bool fits = write_plan(engine, &writer, &engine->commit.tails[next]);
    jerk_watch(engine->jerk_adapter.planner, NULL);
    if (!fits
        || !__atomic_compare_exchange_n(&engine->commit.word,
                                        &word,
                                        engine->commit.written << 2 | next << 1,
                                        false,
                                        __ATOMIC_ACQ_REL,
                                        __ATOMIC_ACQUIRE)) {
        engine->commit.written = before;
        engine->jerk_adapter.restart =
            !fits
            || !back_to_tail(
                engine,
                writer.motion); /* from rest: where the tail that GEO drives now
                                   ends, or where the path stands already */
        return;
    }
    engine->commit.phases += engine->commit.written - before;
    engine->commit.piece = writer.piece;
    engine->commit.s = writer.s;
    engine->commit.v = writer.v;
    engine->commit.committed_s += writer.seconds;
}

/* Committed motion ends where the writer is. */
static bool write_behind(struct engine *engine,
                         double at_s,
                         struct writer *writer,
                         struct tail *tail) {
    if (!write_plan(engine, writer, tail)) {
        return false;
    }
    engine->commit.piece = writer->piece;
    engine->commit.s = writer->s;
    engine->commit.v = writer->v;
    engine->commit.committed_s += at_s + writer->seconds;
    engine->jerk_adapter.offered_s = writer->motion;
    return true;
}

static void no_tail_due(struct engine *engine) {
    (void)engine;
}

static void stand_elsewhere(struct engine *engine) {
    engine->jerk_adapter.restart = true;
}

static bool stands_elsewhere(const struct engine *engine) {
    return engine->jerk_adapter.restart;
}

static bool advance(struct engine *engine, double seconds) {
    jerk_planner *planner = engine->jerk_adapter.planner;
    return fabs(jerk_advance(planner, seconds) - seconds) <= SAME_TIME;
}

/* It follows: GEO comes to the tail, whose beginning that is (rejoin.c). Else
 * what was taken back is driven all the same. */
static void taken_back(struct engine *engine, bool follows, double seconds) {
    if (follows) {
        engine->commit.v = jerk_speed(engine->jerk_adapter.planner);
    } else {
        engine->jerk_adapter.restart = !advance(engine, seconds);
    }
}

static bool may_rejoin(const struct engine *engine) {
    return !engine->jerk_adapter.restart;
}

/* An offer behind this one, should GEO refuse it, begins later on the tail. */
static bool follow(struct engine *engine, double motion_s) {
    struct jerk_adapter *adapter = &engine->jerk_adapter;
    uint64_t word = ATOMIC_GET(engine->commit.word);
    double before = adapter->followed_of == word ? adapter->followed_s : 0.0;
    bool follows = advance(engine, motion_s - before);
    adapter->followed_of = word;
    adapter->followed_s = motion_s;
    jerk_keep(adapter->planner);
    return follows;
}

static void refused(struct engine *engine) {
    struct jerk_adapter *adapter = &engine->jerk_adapter;
    adapter->restart = !back_to_tail(engine, adapter->offered_s);
}

/* The stored tail is the rest of the plan. */
static void remainder_of_plan(struct engine *engine, struct writer *writer) {
    const struct tail *tail =
        &engine->commit.tails[(ATOMIC_GET(engine->commit.word) >> 1) & 1];
    for (uint32_t i = tail->first; i < tail->count; i++) {
        if (writer->count >= writer->max || !(tail->phases[i].time >= 0.0)) {
            return;
        }
        writer->out[writer->count++] = tail->phases[i];
    }
}

/* Whether the plan has come to where the last forecast has looked from: what it
 * has found there holds. */
static bool as_predicted(const struct engine *engine,
                         const struct standstill_search *search) {
    return !engine->plan.hold && search->next.v > 0.0
           && fabs(engine->commit.committed_s - search->next_s)
                  < SAME_TIME_PREDICTED
           && fabs(engine->commit.v - search->next.v)
                  < SAME_SPEED_PREDICTED * search->next.v;
}

static void ways_to_standstill(struct engine *engine,
                               struct standstill_search *search,
                               double way[2]) {
    jerk_planner *planner = engine->jerk_adapter.planner;
    way[0] = way[1] = 0.0;
    if (engine->commit.v <= 0.0 && engine->jerk_adapter.restart) {
        return;
    }
    double later = next_commit(engine);
    jerk_preview now = search->next;
    if (!as_predicted(engine, search)) {
        jerk_stop_preview(planner, search->scratch, 0.0, &now);
    }
    jerk_stop_preview(planner, search->scratch, later, &search->next);
    search->next_s = engine->commit.committed_s + later;
    way[0] = now.way;
    way[1] = search->next.before + search->next.way;
}

static bool as_wanted(const struct engine *engine) {
    return jerk_as_wanted(engine->jerk_adapter.planner);
}

static double line_time(const struct engine *engine,
                        const double *most,
                        double length,
                        double fastest) {
    return jerk_line_time(engine->jerk_adapter.planner, most, length, fastest);
}

const struct planner_ops jerk_limited_planner = {
    .commit = commit,
    .write = write_behind,
    .store_tail = no_tail_due,
    .cut = adapter_cut,
    .begin_run = stand_elsewhere,
    .shorten = adapter_shorten,
    .shorten_tail = shorten_tail,
    .take_back = take_back,
    .taken_back = taken_back,
    .stands_elsewhere = stands_elsewhere,
    .stand_elsewhere = stand_elsewhere,
    .may_rejoin = may_rejoin,
    .follow = follow,
    .give_up_rejoin = stand_elsewhere,
    .refused = refused,
    .remainder_of_plan = remainder_of_plan,
    .ways_to_standstill = ways_to_standstill,
    .spare = spare,
    .stands_behind = adapter_stands_behind,
    .as_wanted = as_wanted,
    .line_time = line_time,
    .traits =
        {
            .rejoin_margin_s = REJOIN_MARGIN_S,
            .fed_ahead = FED_AHEAD,
            .cuts_phases = true,
            .tries_stops = true,
            .uses_cpu_clock = true,
        },
};
