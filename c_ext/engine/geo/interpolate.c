/* GEO: evaluates committed phases once a cycle. It never plans, never
 * allocates, never locks. */
#include <math.h>
#include <string.h>
#include "engine/geo/interpolate.h"
#include "engine/geo/commands.h"
#include "engine/geo/external.h"
#include "engine/geo/technology.h"
#include "engine/path/piece.h"
#include "engine/path/piece_curve.h"
#include "engine/plan/prediction.h"
#include "engine/state/state.h"
#include "engine/store/element_map.h"
#include "hli/sync.h"
#include "jerk/state/api.h"
#include "rows/nc_block.h"

static bool fetch_phase(struct engine *engine);

/* Path and displayed distance at s of a motion. The planner may look at them
 * while the path stands. */
static void place_on_path(struct geo *geo,
                          const struct piece *piece,
                          double s) {
    store_f64_relaxed(&geo->path,
                      geo->path_shift + piece->path0 + piece->path_rate * s);
    store_f64_relaxed(&geo->dist, piece->dist0 + piece->dist_rate * s);
}

double geo_path_speed(const struct engine *engine) {
    const struct geo *geo = &engine->geo;
    if (geo->v <= 0.0 || geo->piece == UINT64_MAX) {
        return geo->v;
    }
    const struct piece *piece = piece_at(&engine->run, geo->piece);
    if (!is_motion(piece) || !(piece->flags & NC_BY_PARAMETER)) {
        return geo->v;
    }
    if (piece->flags & NC_OF_TIP) {
        return geo->v * fabs(piece->path_rate);
    }
    return geo->v * curve_piece_main_rate(engine, piece, geo->s);
}

static void enter_piece(struct engine *engine, uint64_t i) {
    struct geo *geo = &engine->geo;
    const struct piece *piece = piece_at(&engine->run, i);
    geo->piece = i;
    geo->n = piece->n;
    geo->count = piece->count;
    geo->s = 0.0;
    geo->dwelling = piece->type == NC_DWELL;
    if (!is_motion(piece)) {
        return;
    }
    geo->rapid = piece->feed <= 0.0;
    geo->feed = piece->flags & NC_BY_PARAMETER
                    ? piece->feed * fabs(piece->path_rate)
                    : piece->feed;
    place_on_path(geo, piece, 0.0);
    if (piece->mapped) {
        element_map_position(engine, piece);
    } else {
        ATOMIC_SET(geo->active, piece->element);
    }
}

/* Distances change their meaning here; `marks` lets the look-ahead service see
 * either the old or the new one. */
static void set_epoch(struct geo *geo,
                      uint32_t epoch,
                      uint32_t resets,
                      uint64_t first,
                      double dist_shift) {
    ATOMIC_SET(geo->marks, geo->marks + 1);
    __atomic_thread_fence(__ATOMIC_SEQ_CST);
    ATOMIC_SET(geo->epoch, epoch);
    ATOMIC_SET(geo->resets, resets);
    ATOMIC_SET(geo->epoch_first, first);
    __atomic_store(&geo->dist_shift, &dist_shift, __ATOMIC_RELEASE);
    ATOMIC_SET(geo->marks, geo->marks + 1);
}

/* Displayed distance stays what it is where the path goes from one end of a
 * loop to the other one. */
static void cross_loop(struct geo *geo,
                       const struct piece *loop,
                       double times) {
    store_f64_relaxed(&geo->path_shift, geo->path_shift + times * loop->value);
    store_f64_relaxed(&geo->dist, geo->dist - times * loop->loop_distance);
}

static void note_loop(uint64_t *bits, const struct piece *loop, bool on) {
    uint64_t bit = UINT64_C(1) << (loop->loop & 63u);
    ATOMIC_SET(*bits, on ? *bits | bit : *bits & ~bit);
}

static void count_pass(struct geo *geo, const struct piece *loop, int passes) {
    geo->loop_count += passes;
    note_loop(&geo->loops_repeated, loop, geo->loop_count != 0);
}

static void enter_loop(struct engine *engine,
                       const struct piece *loop,
                       int dir) {
    struct geo *geo = &engine->geo;
    geo->in_loop = true;
    note_loop(&geo->loops_left_out, loop, false);
    if (dir > 0) {
        geo->loop_written = 0;
        count_pass(geo, loop, -geo->loop_count);
        set_epoch(geo,
                  geo->epoch + 1,
                  geo->resets,
                  geo->epoch_first,
                  geo->dist_shift);
    } else {
        count_pass(geo, loop, -1);
        set_epoch(geo,
                  geo->epoch - 1,
                  geo->resets,
                  store_at(&engine->store, loop->mate)->element,
                  geo->dist_shift);
    }
}

/* V.RTG.LOOP.ENABLED is FALSE where the path comes to the loop. */
static void leave_out_loop(struct engine *engine,
                           const struct piece *loop,
                           int dir) {
    struct geo *geo = &engine->geo;
    const struct piece *end =
        dir > 0 ? store_at(&engine->store, loop->mate) : loop;
    cross_loop(geo, loop, -dir);
    if (dir > 0) {
        note_loop(&geo->loops_left_out, loop, true);
        geo->loop_count = geo->loop_written = 0;
        if (loop->mate >= engine->store.done) {
            ATOMIC_SET(engine->store.done, loop->mate + 1);
        }
    }
    set_epoch(geo,
              geo->epoch + (dir > 0 ? 2u : -2u),
              geo->resets,
              dir > 0 ? end->element : loop->first_element,
              geo->dist_shift - dir * loop->loop_distance);
}

static void repeat_loop(struct engine *engine,
                        const struct piece *loop,
                        int dir) {
    struct geo *geo = &engine->geo;
    const struct piece *begin =
        dir > 0 ? store_at(&engine->store, loop->mate) : loop;
    cross_loop(geo, loop, dir);
    count_pass(geo, loop, dir);
    set_epoch(geo,
              geo->epoch,
              geo->resets,
              begin->element,
              loop->flags & NC_MODULO
                  ? geo->dist_shift
                  : geo->dist_shift + dir * loop->loop_distance);
}

static void leave_loop(struct geo *geo, const struct piece *loop, int dir) {
    geo->in_loop = false;
    if (dir > 0) {
        geo->loop_count++; /* this pass is over; the element told stays */
        set_epoch(geo,
                  geo->epoch + 1,
                  geo->resets,
                  geo->epoch_first,
                  geo->dist_shift);
    } else {
        set_epoch(geo,
                  geo->epoch - 1,
                  geo->resets,
                  loop->first_element,
                  geo->dist_shift);
    }
}

/* An end of a real-time loop, forward or backward: `again` says that the loop
 * is driven. What the copy in the run ring does not know yet the store does. */
static void run_loop_end(struct engine *engine, const struct piece *piece) {
    const struct piece *loop = store_at(&engine->store, piece->origin);
    int dir = piece->dir;
    bool entry = (piece->type == NC_RT_LOOP_BEGIN) == (dir > 0);
    if (entry && piece->again) {
        enter_loop(engine, loop, dir);
    } else if (entry) {
        leave_out_loop(engine, loop, dir);
    } else if (piece->again) {
        repeat_loop(engine, loop, dir);
    } else {
        leave_loop(&engine->geo, loop, dir);
    }
}

void geo_begin_distance(struct engine *engine) {
    set_epoch(&engine->geo,
              engine->push.epoch,
              engine->push.resets,
              engine->store.element_head,
              0.0);
}

void geo_go_on(struct engine *engine) {
    set_epoch(&engine->geo,
              engine->push.epoch,
              engine->push.resets,
              engine->store.element_head,
              engine->geo.dist_shift);
}

static void run_reset(struct geo *geo, const struct piece *piece) {
    store_f64_relaxed(&geo->dist, piece->dir > 0 ? 0.0 : piece->dist0);
    if (piece->dir > 0) {
        set_epoch(geo, geo->epoch + 1, geo->resets + 1, piece->element, 0.0);
    } else {
        set_epoch(geo, geo->epoch - 1, geo->resets - 1, piece->mate, 0.0);
    }
}

/* The cell takes commands out of a small ring; what it cannot hold is counted.
 */
static void tell_command(struct engine *engine, const struct piece *piece) {
    uint64_t head = engine->path_commands.head;
    external_command(engine, piece->value);
    if (head - ATOMIC_GET(engine->path_commands.tail) >= COMMANDS_MAX) {
        engine->path_commands.lost++;
        return;
    }
    struct engine_command *engine_command =
        &engine->path_commands.entries[head % COMMANDS_MAX];
    engine_command->value = piece->value;
    engine_command->cycle = engine->geo.cycle;
    engine_command->line = piece->line;
    memcpy(engine_command->position,
           engine->geo.position,
           sizeof engine_command->position);
    ATOMIC_SET(engine->path_commands.head, head + 1);
}

/* M00, or M01 while it counts. */
static bool stops_program(const struct engine *engine,
                          const struct piece *piece) {
    return piece->code == 0
           || (piece->code == 1 && engine->orders.m01 && engine->geo.v <= 0.0);
}

static void run_event(struct engine *engine, struct piece *piece) {
    struct geo *geo = &engine->geo;
    if (piece->inserted && piece->type == NC_M) {
        ATOMIC_SET(engine->stops.done, engine->stops.done + 1);
    }
    if (piece->flags & NC_OUTPUT) {
        techno_output(engine,
                      piece->replay ? piece
                                    : store_at(&engine->store, piece->origin));
    }
    switch (piece->type) {
    case NC_DISTANCE_RESET:
        run_reset(geo, piece);
        break;
    case NC_EVENT:
        if (piece->code == NC_EVENT_COMMAND && piece->dir > 0) {
            tell_command(engine, piece);
        }
        if (piece->code == NC_EVENT_RT_LOOP && piece->dir > 0) {
            program_enables_loops(engine, piece->value != 0.0);
        }
        if (piece->code == NC_EVENT_RT_COUNT && piece->dir > 0) {
            loop_count_set(geo, piece->value);
        }
        if (piece->code == NC_EVENT_OVERRIDE) {
            ATOMIC_SET(engine->orders.override_ignored, piece->value == 0.0);
        }
        if (piece->code == NC_EVENT_STORAGE_CLEAR && piece->dir > 0) {
            ATOMIC_SET(engine->store.first, piece->origin + 1);
        }
        if (piece->dir > 0) {
            prediction_time(engine,
                            piece->code - NC_EVENT_ESA_TIME,
                            piece->value);
        }
        break;
    case NC_RT_LOOP_BEGIN:
    case NC_RT_LOOP_END:
        run_loop_end(engine, piece);
        break;
    case NC_T:
        geo->tool = piece->code;
        break;
    case NC_M:
        if (!engine->hli.segment) {
            break; /* nobody there who could continue */
        }
        if (stops_program(engine, piece)) {
            geo->waiting_continue = true;
        }
        break;
    default:
        break;
    }
}

static void leave_piece(struct engine *engine) {
    struct geo *geo = &engine->geo;
    struct piece *piece = piece_at(&engine->run, geo->piece);
    if (is_motion(piece)) {
        place_on_path(geo, piece, piece->length);
        memcpy(geo->position, piece->end, sizeof geo->position);
        geo->s = piece->length;
        if (piece->mapped) {
            element_map_position(engine, piece);
        }
    } else {
        run_event(engine, piece);
    }
    geo->dwelling = false;
    ATOMIC_SET(engine->run.done, geo->piece + 1);
    bool whole = piece->from + piece->length >= piece->whole - 1e-9;
    bool of_program = piece->dir > 0 && !piece->inserted;
    if (of_program && whole && piece->origin >= engine->store.done) {
        ATOMIC_SET(engine->store.done, piece->origin + 1);
    }
}

void end_phase_at(struct geo *geo, double t) {
    geo->now.time = t;
    geo->now.last = false;
}

/* The tail was taken: its next phase, or, once it is used up, standstill until
 * the planner has taken note. */
static bool fetch_from_tail(struct engine *engine) {
    struct geo *geo = &engine->geo;
    if (!geo->in_tail) {
        return false;
    }
    if (geo->leaves && geo->tail_next > engine->rejoin.phase) {
        geo->in_tail = geo->leaves = false;
        ATOMIC_SET(
            engine->rejoin.state,
            REJOIN_NONE); /* from here on the buffer is the planner's again */
        return fetch_phase(engine);
    }
    const struct tail *tail = &engine->commit.tails[geo->tail_index];
    if (geo->tail_next < tail->count) {
        geo->now = tail->phases[geo->tail_next++];
        if (geo->leaves && geo->tail_next > engine->rejoin.phase) {
            end_phase_at(geo, engine->rejoin.t);
        }
        return true;
    }
    geo->in_tail = false; /* from here on the buffer is the planner's again */
    geo->v = 0.0;
    ATOMIC_SET(engine->commit.tail_done, 1);
    return false;
}

/* The next phase: committed motion, or the stored tail when the planner is
 * late. */
static bool fetch_phase(struct engine *engine) {
    struct geo *geo = &engine->geo;
    uint64_t word = ATOMIC_GET(engine->commit.word);
    if (geo->in_tail || (word & 1)) {
        return fetch_from_tail(engine);
    }
    if (geo->consumed < word >> 2) {
        geo->now = engine->commit.ring[geo->consumed & (PHASE_RING - 1)];
        ATOMIC_SET(geo->consumed, geo->consumed + 1);
        return true;
    }
    uint32_t index = (word >> 1) & 1;
    if (geo->v <= 0.0 && geo->consumed == word >> 2) {
        return false;
    }
    if (!__atomic_compare_exchange_n(&engine->commit.word,
                                     &word,
                                     word | 1,
                                     false,
                                     __ATOMIC_ACQ_REL,
                                     __ATOMIC_ACQUIRE)) {
        return fetch_phase(engine);
    }
    uint64_t beyond =
        geo->consumed - (word >> 2); /* taken back too late: the tail begins
                                        with phases that are driven already */
    geo->in_tail = true;
    geo->tail_index = index;
    geo->tail_next = engine->commit.tails[index].first + (uint32_t)beyond;
    ATOMIC_SET(geo->consumed, word >> 2);
    return fetch_phase(engine);
}

static bool begin_phase(struct engine *engine) {
    struct geo *geo = &engine->geo;
    if (!fetch_phase(engine)) {
        return false;
    }
    geo->has_phase = true;
    geo->t = 0.0;
    if (geo->now.piece != geo->piece || geo->piece == UINT64_MAX) {
        bool stood = geo->v <= 0.0;
        enter_piece(engine, geo->now.piece);
        const struct piece *piece = piece_at(&engine->run, geo->piece);
        bool new_block = is_motion(piece) && piece->new_block;
        if (stood && new_block && engine->orders.single) {
            geo->waiting_continue = geo->stands_single = true;
        }
    }
    return true;
}

/* The planner may cut the piece behind what is committed. */
static double phase_position(const phase *ph,
                             const struct piece *piece,
                             double t,
                             double *v) {
    double s = ph->s0 + (ph->v0 + 0.5 * ph->a * t) * t;
    *v = ph->v0 + ph->a * t;
    if (ph->jerk != 0.0 || ph->snap != 0.0) {
        const jerk_law law = law_of_phase(ph);
        jerk_state at;
        jerk_at(&law, t, &at);
        s = at.s;
        *v = at.v;
    }
    return fmin(load_f64_relaxed(&piece->length), s);
}

static void end_phase(struct engine *engine) {
    struct geo *geo = &engine->geo;
    geo->has_phase = false;
    geo->s = phase_position(&geo->now,
                            piece_at(&engine->run, geo->piece),
                            geo->now.time,
                            &geo->v);
    if (geo->v < GEO_STANDS) {
        geo->v = 0.0;
    }
    if (geo->now.last) {
        leave_piece(engine);
    }
}

static void add_consumed(struct geo *geo, double t) {
    double sum = geo->consumed_s + t;
    __atomic_store(&geo->consumed_s, &sum, __ATOMIC_RELEASE);
}

void geo_advance(struct engine *engine, double dt) {
    struct geo *geo = &engine->geo;
    geo->waiting_techno = false;
    while (dt > 0.0 && !geo->waiting_continue) {
        if (!geo->has_phase && !begin_phase(engine)) {
            return;
        }
        if (geo->waiting_continue) {
            return;
        }
        const struct piece *piece = piece_at(&engine->run, geo->piece);
        if (!is_motion(piece) && techno_blocked(engine, piece)) {
            geo->waiting_techno = true;
            engine->technology.wait_cycles++;
            return;
        }
        bool begins = is_motion(piece) && geo->v <= 0.0 && geo->t <= 0.0;
        if (begins && (piece->moving & engine->orders.held_axes)) {
            return; /* a held axis would begin to move */
        }
        double remainder = geo->now.time - geo->t;
        if (remainder > dt) {
            geo->t += dt;
            add_consumed(geo, dt);
            return;
        }
        dt -= remainder;
        add_consumed(geo, remainder);
        end_phase(engine);
    }
}

void geo_evaluate(struct engine *engine) {
    struct geo *geo = &engine->geo;
    if (geo->piece == UINT64_MAX || engine->run.done > geo->piece) {
        return; /* stands at the end of what is done */
    }
    if (ATOMIC_GET(engine->withdrawal.state) == WITHDRAW_DONE) {
        return; /* stands; the planner looks at the position */
    }
    const struct piece *piece = piece_at(&engine->run, geo->piece);
    if (geo->has_phase) {
        double s = phase_position(&geo->now, piece, geo->t, &geo->v);
        if (is_motion(piece)) {
            geo->s = s;
        }
    }
    if (!is_motion(piece)) {
        return;
    }
    place_on_path(geo, piece, geo->s);
    if (piece->mapped) {
        element_map_position(engine, piece);
    }
    piece_position(engine, piece, geo->s, geo->position);
}

bool geo_drained(struct engine *engine) {
    return ATOMIC_GET(engine->store.done) >= ATOMIC_GET(engine->store.head)
           && !engine->geo.has_phase && !engine->geo.waiting_continue;
}
