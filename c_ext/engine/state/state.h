/* The engine: one member a room, and the accessors that every room shares. */
#ifndef ENGINE_STATE_H
#define ENGINE_STATE_H
#include "engine/state/types.h"

struct engine {
    engine_config cfg;
    HLI_SEGMENT *segment;
    HLI_CHANNEL *channel;
    HLI_SIDECAR *side;
    /* SDA side */
    double last_end[NC_AXES];
    double last_tangent[3];
    bool has_tangent, has_motion_piece;
    struct motion_limits limits[2]; /* of feed motions and of rapid motions
                                       pushed from here on */
    double distance;                /* 0.1 um, start of the next element */
    uint32_t push_epoch;
    uint64_t epoch_element; /* first element of the present epoch */
    bool stop_pending, m01_pending;
    double element_end[NC_AXES]; /* programmed end of the last element */
    struct carried carried;
    uint64_t map_element; /* where the pieces pushed so far end in the elements
                             ... */
    double map_from;      /* ... and mm behind its start */
    uint32_t last_count;  /* block_count of the last motion */
    uint64_t loop_begin; /* piece that begins the real-time loop being pushed */
    bool in_loop;
    double loop_path, loop_tangent[3]; /* where it begins: path, direction of
                                          its first element */
    struct element *elements;
    uint64_t element_mask;
    uint64_t element_head;
    /* The store: pieces in program order. SDA fills it, the feeder copies out
     * of it; what the path has left behind stays for backward motion as long as
     * P-STUP-00033 gives room. */
    struct piece *store;
    uint64_t store_mask, store_kept;
    uint64_t store_head;  /* pushed */
    uint64_t store_done;  /* executed at least once */
    uint64_t store_floor; /* pieces below it may be overwritten */
    uint64_t
        store_first; /* #BACKWARD STORAGE CLEAR: backward motion ends here */
    /* The run ring: pieces in the order in which they are driven. */
    struct feeder feed;
    struct piece *pieces;
    uint64_t piece_mask;
    struct curve *curves;    /* of the store's pieces that are polynomials */
    struct curve next_curve; /* checked, for the row that is pushed next */
    double next_tangents[6]; /* of an element whose geometry lies in other
                                coordinates */
    uint64_t piece_head;     /* fed */
    uint64_t piece_done;     /* executed by GEO */
    struct engine_command commands[COMMANDS_MAX];
    uint64_t command_head, command_tail, commands_lost;
    int override_ignored;
    int hold_to_cell,
        macro_runs; /* HOLD and back are for the cell to carry out; it does */
    uint64_t rows_taken,
        halt_row; /* rows pushed; the one in which a halt left the path */
    double halt_s, halt_whole;
    uint64_t blocks_from; /* no rows are asked for before this cycle */
    float end_speed;      /* of the motion pushed last */
    int finished, expect_drain, hold_start, stay;
    uint64_t drain_at, drain_from;
    marked_log log;
    /* planner to GEO: head << 2 | tail << 1 | taken, one atomic word */
    phase *phase_ring;
    uint64_t commit;
    planner plan;
    const struct planner_ops *planner;
    struct planner_traits traits;
    struct drive drive;
    struct geo geo;
    int tail_done;
    struct rejoin rejoin;
    double override_now, rapid_now;
    int single_now, m01_now, rt_loop_now, backward_now, simulate_now,
        active_now;
    uint32_t shortcut_requests,
        shortcut_mask; /* delete distance to go: rising edges, end marks */
    bool shortcut_seen;
    struct insert_cmd insert_request;
    uint32_t insert_requests;
    inserted_stop stops[STOPS_MAX];
    uint64_t stops_fed, stops_done;
    /* withdrawal: GEO answers where it stands */
    int withdraw;
    int waits_now; /* GEO waits for the PLC: as of its last cycle */
    uint64_t stand_piece;
    double stand_s;
    int hold_now;
    /* service */
    uint32_t answered; /* elements in the last answer */
    uint64_t requests_mode1, requests_mode2, requests_bad, bad_commands,
        overruns;
    int serve_running, run_running;
    pthread_t serve_thread, geo_thread, plan_thread;
    bool serve_started, threads_started;
    int end_reported, program_end;
    double *record; /* ring: written by GEO, taken by the recorder */
    int64_t record_rows, record_head, record_tail;
    uint64_t record_lost;
    int64_t *cycle_ns, *late_ns,
        *rehearsal_ns; /* measurement of the first cycles */
    int64_t timed_rows, timed;
    int32_t fault;
    /* technology functions */
    struct synch_table m_synch, h_synch;
    uint32_t tool_synch;
    struct techno_counts pushed, gated, pending_gate; /* SDA */
    bool has_pending_gate;
    uint32_t std_block, std_index, behind_count;
    nc_block behind[BEHIND_MAX];
    uint64_t
        std_base; /* functions pushed ahead of the block in the std array */
    double pushed_path; /* mm since program start */
    struct early_output early[EARLY_MAX];
    uint64_t early_head, early_done;
    struct techno_counts done, done_again; /* GEO; functions on stretches driven
                                              before, and inserted ones */
    struct techno_slot std_slots[HLI_TU_CH_STD_SYNC_MAXIDX + 1],
        late_slots[HLI_TU_CH_LATE_SYNC_MAXIDX + 1];
    uint32_t std_open, late_open, std_used;
    uint64_t techno_functions, techno_unseen, techno_wait_cycles;
    /* spindle functions: axis areas behind those of the channel's axes */
    uint32_t spindle_synch[20];
    struct techno_slot spindle_slots[ENGINE_SPINDLES]
                                    [HLI_TU_AX_STD_SYNC_MAXIDX + 1];
    uint32_t spindle_open[ENGINE_SPINDLES], spindle_used;
    double spindle_rev;   /* SDA: rev/min */
    int spindle_move;     /* SDA: 3, 4, 5 */
    bool spindle_pending; /* SDA: an S word that no M function of its block has
                             taken */
    nc_block spindle_row;
    /* modes, watchdogs, errors: modes.c */
    uint32_t mode, mode_state, mode_warnings;
    struct external_vars *external;
    int suppressed, units_cleared, name_changed;
    uint32_t error_id;
    char program_name[260];
    int stopped, mode_pending, program_active, abort_now;
    struct engine_mode_command mode_command;
    bool watch_alive, watch_missed;
    double watch_since;
    int watchdog_event, retraced_event, errors_lock;
    bool was_backward; /* the last motion */
    engine_error errors[ERRORS_MAX];
    uint64_t errors_head, errors_done;
    uint32_t errors_lost, plc_error_id, plc_error_class;
    double ext_speed;   /* external command speed mm/s, NEVER: none */
    bool feedhold_now;  /* the channel's feed hold as commanded */
    bool released;      /* all axes of the channel */
    uint32_t held_axes; /* bit per axis with ipo_mc_control.feedhold */
    uint32_t log_dropped, log_ignored_areas, log_stray_params, log_on_closed,
        log_disabled;
    struct foresight *foresight; /* NULL: none of its functions is configured */
};

static inline struct piece *piece_at(struct engine *engine, uint64_t i) {
    return &engine->pieces[i & engine->piece_mask];
}

static inline struct piece *store_at(struct engine *engine, uint64_t i) {
    return &engine->store[i & engine->store_mask];
}

static inline struct element *element_at(struct engine *engine, uint64_t i) {
    return &engine->elements[i & engine->element_mask];
}

static inline bool is_motion(const struct piece *piece) {
    return piece->kind != PIECE_EVENT;
}

/* Of two numbers; without fmin's care for NaN, which the checks at the entry
 * keep away. */
static inline double lesser(double a, double b) {
    return a < b ? a : b;
}

static inline double greater(double a, double b) {
    return a > b ? a : b;
}

static inline uint32_t spans_max(const struct engine *engine) {
    return engine->cfg.window > WIDE_WINDOW ? SPANS_FEW : SPANS_MANY;
}

static inline struct span *spans_of(const struct engine *engine, uint64_t i) {
    return engine->plan.span_slots[i & engine->plan.span_mask].spans;
}

static inline const struct curve *curve_of(const struct engine *engine,
                                           const struct piece *piece) {
    return &engine->curves[piece->origin & engine->store_mask];
}

static inline double piece_v_max(const struct engine *engine,
                                 const struct piece *piece,
                                 int axis) {
    return engine->cfg.v_max[axis] * (double)piece->limits.velocity[axis];
}

static inline double piece_a_max(const struct engine *engine,
                                 const struct piece *piece,
                                 int axis) {
    return engine->cfg.a_max[axis] * (double)piece->limits.acceleration[axis];
}

#endif
