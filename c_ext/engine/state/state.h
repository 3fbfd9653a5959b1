/* The engine: one member a room, and the accessors that every room shares.
 *
 * Order of the rooms. Includes and calls run down this list, never up:
 *   engine.c, threads.c, events.c, program.c, interleave.c
 *   geo, plan, accel, jerk_adapter, run, store, commit, path, state
 * Below them, without the engine: stages, jerk, curve, rows, hli.
 * A low room tells a high one by data (flags, rings, words) or through the
 * planner_ops of commit/planner.h. No file calls in a circle either; headers
 * with hot inline functions (commit/commit.h, path/stands.h,
 * path/speed_caps.h) count with their .c file.
 */
#ifndef ENGINE_STATE_H
#define ENGINE_STATE_H
#include "engine/state/rooms.h"
#include "maths/order.h"

struct engine {
    /* constant from engine_new on */
    engine_config cfg;
    const struct planner_ops *planner;
    struct planner_traits traits;
    struct shared_areas hli;
    struct engine_group group;

    /* preparation */
    struct push_state push;
    struct element_map element_map;
    struct technology_rows technology_rows;
    /* preparation; read by GEO and the service */
    struct marked_log log;
    /* preparation; `done` by GEO, `floor` by the planner */
    struct piece_store store;
    /* preparation and the cell; the planner where the path is left, `end` by
     * GEO */
    struct program_state program;
    /* preparation fills it, GEO empties it */
    struct early_outputs early;

    /* planner */
    struct dispatch dispatch;
    /* planner; `done` by GEO */
    struct run_ring run;
    struct inserted_stops stops;
    /* planner; `word` is exchanged with GEO, `tail_done` is GEO's */
    struct commit_state commit;
    /* planner */
    struct plan_conditions plan;
    struct accel_state accel;
    struct jerk_adapter jerk_adapter;
    /* planner offers, GEO answers */
    struct rejoin rejoin;
    struct withdrawal withdrawal;
    /* planner fills buffers, GEO reads the latest; NULL: none of its functions
     * is configured */
    struct prediction *prediction;
    struct shown_timetable timetable;

    /* GEO */
    struct geo geo;
    struct technology_state technology;
    struct orders orders;
    struct lateness lateness;
    struct watchdog watchdog;
    struct retracing retracing;
    struct time_causes time_causes;
    /* GEO; `event` is taken by the cell, which sets `tell_after` */
    struct standstill standstill;
    /* GEO writes, the cell takes */
    struct path_commands path_commands;
    struct recording recording;
    struct cycle_timing timing;
    /* GEO and the cell */
    struct mode_unit modes;
    struct external_vars *external;
    struct rt_cycles *rt_cycles;
    /* preparation, the cell and GEO, under its lock */
    struct error_queue errors;

    /* service, or GEO where it answers with the cycle */
    struct lookahead_service service;
    /* who starts and stops the threads */
    struct engine_threads threads;
    /* planner or preparation: ENGINE_FAULT's number */
    int32_t fault;
};

/* The first channel keeps what all channels share. */
static inline struct engine *first_channel(const struct engine *engine) {
    return engine->group.all[0];
}

/* A program has ended, and no channel executes one. */
static inline bool all_ended(const struct engine_group *group) {
    bool ended = false;
    for (uint32_t i = 0; i < group->count; i++) {
        if (ATOMIC_GET(group->all[i]->program.active)) {
            return false;
        }
        ended |= ATOMIC_GET(group->all[i]->program.end) != 0;
    }
    return ended;
}

/* Functions (P-CHAN-00650) that tell of the plan. */
#define FORESEES                                                               \
    (ENGINE_FCT_CALC_TIME | ENGINE_FCT_CALC_POS_V_0                            \
     | ENGINE_FCT_CALC_STATE_AT_T)

/* Whether anybody is told of the plan: by those, or by the PLC's
 * `plan_enable_w`. */
static inline bool plan_is_read(const struct engine *engine) {
    return (engine->cfg.functions & FORESEES) != 0
           || ATOMIC_GET(engine->orders.timetable);
}

static inline struct piece *piece_at(const struct run_ring *run, uint64_t i) {
    return &run->pieces[i & run->mask];
}

static inline struct piece *store_at(const struct piece_store *store,
                                     uint64_t i) {
    return &store->pieces[i & store->mask];
}

static inline struct element_more *more_at(const struct piece_store *store,
                                           uint64_t i) {
    return &store->more[i & store->element_mask];
}

static inline struct ahead_event *ahead_event_at(
    const struct piece_store *store,
    uint64_t i) {
    return &store->events[i & store->element_mask];
}

static inline struct element *element_at(const struct piece_store *store,
                                         uint64_t i) {
    return &store->elements[i & store->element_mask];
}

static inline bool is_motion(const struct piece *piece) {
    return piece->kind != PIECE_EVENT;
}

static inline uint32_t spans_max(const engine_config *cfg) {
    return cfg->window > WIDE_WINDOW ? SPANS_FEW : SPANS_MANY;
}

static inline struct span *spans_of(const struct accel_state *accel,
                                    uint64_t i) {
    return accel->span_slots[i & accel->span_mask].spans;
}

static inline const struct curve *curve_of(const struct piece_store *store,
                                           const struct piece *piece) {
    return &store->curves[piece->origin & store->mask];
}

static inline double piece_v_max(const engine_config *cfg,
                                 const struct piece *piece,
                                 int axis) {
    return cfg->v_max[axis] * (double)piece->limits.velocity[axis];
}

static inline double piece_a_max(const engine_config *cfg,
                                 const struct piece *piece,
                                 int axis) {
    return cfg->a_max[axis] * (double)piece->limits.acceleration[axis];
}

#endif
