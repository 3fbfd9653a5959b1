/* Inside of the engine: the ring of elements and pieces, planner, GEO, and what
 * its files offer each other. Not seen by Python. */
#ifndef ENGINE_INTERNAL_H
#define ENGINE_INTERNAL_H
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

/* limits.c */
void limits_reset(struct engine *engine);
bool limits_row_check(const struct engine *e, const nc_block *row);
void limits_set(struct engine *engine, const nc_block *row);
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

/* piece.c */
void piece_build(struct engine *engine,
                 struct piece *piece,
                 const nc_block *row);
void piece_position(const struct engine *engine,
                    const struct piece *piece,
                    double s,
                    double *q);
void piece_tangent(const struct engine *engine,
                   const struct piece *piece,
                   double s,
                   double *u);
void piece_cut(const struct engine *engine,
               struct piece *piece,
               double u0,
               double u1);
void piece_shortcut(const struct engine *engine,
                    struct piece *piece,
                    const double *q,
                    double path,
                    double dist);

/* piece_curve.c */
bool curve_row_check(struct engine *e,
                     const nc_block *row,
                     const double *pool,
                     int64_t pool_n);
void curve_piece_build(struct engine *engine, struct piece *piece);
void curve_piece_position(const struct engine *engine,
                          const struct piece *piece,
                          double s,
                          double *q);
void curve_piece_tangent(const struct engine *engine,
                         const struct piece *piece,
                         double s,
                         double *u);
/* A stretch of a piece with the acceleration that jumps use up on it. */
typedef struct strip {
    double length;
    const double *reserve;
} strip;
double curve_cell_behind(const struct curve *curve,
                         const struct piece *piece,
                         double s,
                         int *cell);
void curve_cell_span(const struct engine *engine,
                     const struct piece *piece,
                     int cell,
                     const double *reserve,
                     double length,
                     struct span *out);

/* curve_spans.c */
double curve_cruise2(struct engine *engine,
                     struct piece *piece,
                     const double *reserve,
                     double wanted);
void curve_piece_spans(struct engine *engine,
                       struct piece *piece,
                       span_room *has,
                       const strip *strips,
                       int count,
                       bool stands);

/* element_map.c */
void map_behind_element(struct engine *engine);
void map_piece(struct engine *engine, struct piece *piece, double programmed);
void map_position(struct engine *engine, const struct piece *piece);

/* short_motions.c */
bool carry_row(struct engine *e, const nc_block *row);
void carry_build(struct engine *engine,
                 struct piece *piece,
                 const nc_block *row);
void carry_flush(struct engine *engine);

/* push.c */
void push_programmed(struct engine *engine, const nc_block *row);
void push_piece(struct engine *engine,
                struct piece *piece,
                const nc_block *row);
bool ring_has_room(struct engine *e);
struct piece *store_slot(struct engine *engine, const nc_block *row);
void store_publish(struct engine *engine);
double angle_between(const double *a, const double *b);

/* dispatch.c */
void feed(struct engine *engine);
bool feed_further(struct engine *e);
void feed_store_floor(struct engine *engine);
bool feed_job_pending(struct engine *e);
void feed_do_jobs(struct engine *engine);
void feed_begin_program(struct engine *engine);

/* external.c */
void external_cycle(struct engine *engine);
void external_command(struct engine *engine, double value);
void external_free(struct engine *engine);

/* modes.c */
void mode_cycle(struct engine *engine, bool present);
void mode_publish_state(struct engine *engine);
void mode_publish_errors(struct engine *engine);

/* marked_log.c */
void log_marker(struct engine *engine, const nc_block *row);
void log_element(struct engine *engine, const struct element *el);
void log_program_end(struct engine *engine);
void log_reset(struct engine *engine);
void log_loop_begin(struct engine *engine);
void log_loop_end(struct engine *engine, double length);
const HLI_CONTOUR_LOOKAHEAD_BLOCK *log_entry(const struct engine *engine,
                                             uint32_t i);
bool log_available(const struct engine *e);

/* curved_span.c */
/* What is driven over a stretch may differ from the chord of its rows: q' of an
 * axis by `above`, its acceleration by u |u| + x x. */
typedef struct bent_loss {
    double above[NC_AXES], u[NC_AXES], x[NC_AXES];
} bent_loss;
uint32_t bent_rows(const struct engine *engine,
                   const struct piece *piece,
                   const struct knot *knot,
                   const struct knot *knot_b,
                   const double *room,
                   const bent_loss *lost,
                   struct span *out,
                   double *rows);
double bent_need(const struct span *sp, double s, double soft2, double next);
bent_step bent_forward(const struct span *sp,
                       double s,
                       double x,
                       double soft2,
                       double next,
                       bool braking);

/* spans.c */
bool spans_new(struct engine *e);
void spans_free(struct engine *engine);
span_room spans_first(const struct engine *engine, const span_room *room);
void spans_grow(const struct engine *engine,
                span_room *room,
                double count,
                uint32_t per_axis);
bool spans_known(const struct engine *e, uint64_t i);
void piece_spans(struct engine *engine, uint64_t i, const struct piece *next);
bool can_cruise(struct engine *e,
                struct piece *p,
                const struct piece *next,
                bool known,
                double speed,
                double end2);

/* corner_zones.c */
/* Acceleration that jumps use up over some mm from one end of a piece on. */
typedef struct zone_use {
    double reach;
    const double *reserve; /* of every axis, where reach > 0; `sum`, or that of
                              a corner */
    double sum[NC_AXES];
} zone_use;
bool zones_new(struct engine *e);
double corner_zone(const struct engine *engine,
                   double v,
                   const struct piece *piece);
void zones_follow(struct engine *engine, uint64_t i);
void zones_note(struct engine *engine,
                uint64_t i,
                const struct piece *before,
                double v);
void zones_use(struct engine *engine,
               const struct piece *piece,
               const struct piece *next,
               zone_use *first,
               zone_use *last);
bool zones_known(struct engine *e,
                 const struct piece *p,
                 const struct piece *next);

/* lookahead.c */
void corner_caps(struct engine *engine);
double reachable(const struct piece *piece, double override);
uint64_t window_end(struct engine *engine);
void backward_pass(struct engine *engine, uint64_t end);
bool needs_hold(const struct engine *e);
void settle_spans(struct engine *engine, uint64_t i, double need2);

/* technology.c */
bool techno_has_room(const struct engine *e);
bool techno_push(struct engine *e, const nc_block *row);
void techno_block_end(struct engine *engine);
void techno_spindle_word(struct engine *engine);
void techno_before_motion(struct engine *engine, const nc_block *row);
void techno_expl_syn(struct engine *engine, const nc_block *row);
bool gate_open(const struct techno_counts *done,
               const struct techno_counts *need);
struct techno_counts techno_done(const struct techno_counts *counts);
bool techno_blocked(struct engine *e, const struct piece *p);
void techno_output(struct engine *engine, struct piece *piece);
void techno_cycle(struct engine *engine);
void techno_clear_units(struct engine *engine);
static inline bool stands_before(const struct engine *engine,
                                 const struct piece *piece) {
    if ((piece->m01 && engine->plan.m01)
        || (piece->new_block && engine->plan.single)
        || (piece->moving & engine->plan.held_axes)) {
        return true;
    }
    return piece->stop_before
           || (piece->gated
               && !gate_open(piece->replay ? &engine->plan.done_again
                                           : &engine->plan.done,
                             &piece->need));
}

double curve_piece_main_rate(const struct engine *engine,
                             const struct piece *piece,
                             double s);
void curve_piece_derivatives(const struct engine *engine,
                             const struct piece *piece,
                             double s,
                             double *d1,
                             double *d2,
                             double *d3);
double curve_piece_cell_end(const struct engine *engine,
                            const struct piece *piece,
                            double s);

/* adapter.c */
bool drive_new(struct engine *e);
jerk_planner *drive_spare(const struct engine *engine);
bool drive_stands_behind(struct engine *e, uint64_t i);
void drive_free(struct engine *engine);
void drive_commit(struct engine *engine);
bool drive_shorten_tail(struct engine *e);
void drive_cut_run(struct engine *engine, uint64_t head);
void drive_shorten(struct engine *engine, uint64_t i, double s);

/* cpu_clock.c */
void watch_start(struct engine *engine);
void watch_window(struct engine *engine);
void watch_stop(struct engine *engine);

/* profile.c */
typedef struct writer {
    struct engine *e;
    phase *out; /* linear buffer, or NULL for the ring */
    uint32_t count, max;
    uint64_t piece;
    double s, v, seconds, budget;
    double motion; /* s; of that what the jerk-limited planner has handed out */
    double least; /* s; so much is committed although more of the path might let
                     it drive faster */
    uint64_t too_fast; /* corners and stands that it passes too fast, ... */
    bool refused;      /* ... by more than rounding */
    bent_left left;
} writer;
void write_phase(struct writer *writer, const phase *ph);
bool writer_full(const struct writer *w);
void pass_event(struct writer *writer);
void drive_window(struct writer *writer, uint64_t end);
double ahead_s(struct engine *engine);
double commit_high(const struct engine *engine);
double commit_low(const struct engine *engine);
double soft_cap(const struct engine *engine, const struct piece *piece);
bool profile_write(struct engine *e, struct writer *w, struct tail *t);
int planner_pump(struct engine *engine);
void planner_store_tail(struct engine *engine);

/* adapter.c */
bool drive_write(struct engine *e, struct writer *w, struct tail *t);

/* recall.c */
void recall_commit(struct engine *engine);

/* rejoin.c */
bool rejoin_settled(struct engine *e);
bool rejoin_possible(struct engine *e);
void rejoin_offer(struct engine *engine);
double drive_take_back(struct engine *engine, double seconds);

/* interpolate.c */
void geo_cycle(struct engine *engine);
void geo_rehearse(struct engine *engine);
double geo_path_speed(const struct engine *engine);
bool geo_drained(struct engine *e);
void geo_begin_distance(struct engine *engine);

/* publish.c */
void take_commands(struct engine *engine);
void publish(struct engine *engine);
void publish_again(struct engine *engine);
void publish_initial(struct engine *engine);

/* prediction.c */
bool foresight_new(struct engine *e);
void foresight_free(struct engine *engine);
void foresight_plan(struct engine *engine, bool pumped);
void foresight_publish(struct engine *engine);
void foresight_time(struct engine *engine, int index, double seconds);
void foresight_begin_program(struct engine *engine);

/* lookahead_service.c */
int serve_request(struct engine *engine);

/* memory.c */
void memory_large(void *memory, size_t bytes);
void memory_touch(void *memory, size_t bytes);

/* engine.c */
int pending_event(struct engine *engine);
double max_dist_prog_start(struct engine *engine);
#endif
