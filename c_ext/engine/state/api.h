/* The engine: prepared rows in, motion and HLI out.
 *
 * Three actors share one engine. SDA (block preparation) pushes rows, the
 * planner commits motion phases some milliseconds ahead, GEO (the interpolator)
 * evaluates them once a cycle, publishes, and serves the control units. In
 * lockstep and free run all three are pumped on one thread by engine_run; in
 * real time planner, GEO and the immediate service have threads of their own.
 * Lengths mm, speeds mm/s, times s unless a name says otherwise.
 */
#ifndef ENGINE_H
#define ENGINE_H
#include <stdint.h>
#include "rows/nc_block.h"

/* cdef begin */
/* No sample shows more jerk than this times the acceleration over a cycle. */
#define ENGINE_JERK_SEEN 3
/* results of engine_run and engine_wait */
#define ENGINE_DONE 0 /* the cycles asked for have run */
/* preparation is to push rows (or to declare the end) */
#define ENGINE_NEED_BLOCKS 1
/* everything pushed has been executed; reported once per engine_expect_drain */
#define ENGINE_DRAINED 2
#define ENGINE_PROGRAM_END 3 /* program end; reported once */
/* lockstep: the PLC has not finished its scans within the time slice */
#define ENGINE_PLC_WAIT 4
#define ENGINE_RECORD_FULL 5 /* the sample buffer is full */
/* program ended and the PLC needs the cell no longer */
#define ENGINE_PLC_FINISHED 6
#define ENGINE_FAULT 7 /* internal fault, see engine_state.fault */
/* the PLC has sent a mode command that the cell has to carry out */
#define ENGINE_MODE_COMMAND 8
/* the PLC has not shown that it lives; reported once */
#define ENGINE_WATCHDOG 9
#define ENGINE_PLC_ERROR 10 /* the PLC has sent an error record */
/* the path is driven forward again behind backward motion; reported once */
#define ENGINE_RETRACED 11
/* the path has stood for as long as engine_tell_standstill says; reported once
 * a standstill */
#define ENGINE_STANDS 12
/* one of several channels: the path has passed commands of its program */
#define ENGINE_COMMANDS 13

/* why the path stands: bits of stop_condition_r, ... */
#define ENGINE_STOP_FEEDHOLD 0x1
#define ENGINE_STOP_AXIS_HOLD 0x2
#define ENGINE_STOP_OVERRIDE 0x4
#define ENGINE_STOP_SINGLE_BLOCK 0x8
#define ENGINE_STOP_M00 0x10
#define ENGINE_STOP_M01 0x20
#define ENGINE_STOP_FUNCTION 0x40
#define ENGINE_STOP_DWELL 0x100
#define ENGINE_STOP_ERROR 0x200
#define ENGINE_STOP_MODE 0x400
#define ENGINE_STOP_INSERTED 0x800
#define ENGINE_STOP_RELEASE 0x1000
#define ENGINE_STOP_NO_BLOCKS 0x2000
/* ... and what it has no bit for */
#define ENGINE_STOP_RAPID_OVERRIDE 0x10000
#define ENGINE_STOP_EXTERNAL_SPEED 0x20000
#define ENGINE_STOP_UNKNOWN 0x40000
#define ENGINE_STOP_BACKWARD 0x80000

/* what limits the speed: index of engine_state.time_by_cause */
#define ENGINE_CAUSE_FEED 0
#define ENGINE_CAUSE_OVERRIDE 1
#define ENGINE_CAUSE_VELOCITY 2 /* of an axis */
#define ENGINE_CAUSE_ACCELERATION 3
#define ENGINE_CAUSE_JERK 4
#define ENGINE_CAUSE_EXACT_CORNER 5 /* ramps at a corner driven exactly */
#define ENGINE_CAUSE_EXACT_STOP 6   /* ramps at a stop of the program */
#define ENGINE_CAUSE_DWELL 7
#define ENGINE_CAUSE_WAIT 8
#define ENGINE_CAUSES 9
#define ENGINE_CAUSE_NONE 99

#define ENGINE_SPINDLES 6

/* errors of engine_push (negative) */
#define ENGINE_BAD_ROW -904001
#define ENGINE_NOT_FINITE -904002
#define ENGINE_NO_MEMORY -904003
/* the planner refuses a piece: derivatives that are no numbers */
#define ENGINE_BAD_PATH -904009
#define ENGINE_LOOP_TOO_LONG -904004

/* interpolator functions that act here (P-CHAN-00650) */
#define ENGINE_FCT_CONTOUR_LAH 1
#define ENGINE_FCT_CALC_TIME 2
#define ENGINE_FCT_CALC_POS_V_0 4
#define ENGINE_FCT_CALC_STATE_AT_T 8
#define ENGINE_ESA_TIMES 3

typedef struct engine_config {
    double cycle_s;
    double v_max[NC_AXES];
    double a_max[NC_AXES];
    double j_max[NC_AXES];
    double start[NC_AXES];
    int32_t axis_count;
    int32_t guest_count; /* the last of them are places without an axis */
    int32_t main[3];     /* channel index of X, Y, Z; -1 if absent */
    uint32_t window;     /* look-ahead blocks N */
    uint32_t functions;  /* ENGINE_FCT_... */
    double esa_time[ENGINE_ESA_TIMES]; /* P-CHAN-00324, s; 0: none */
    uint32_t log_max;                  /* P-CHAN-00658 */
    uint32_t fb_storage_size;          /* P-STUP-00033, bytes; 0 = none */
    uint32_t channel;                  /* index of the channel area */
    uint32_t axis_base;                /* index of its first axis area */
    uint32_t service;                  /* HLI_SERVICE_... */
    uint32_t clock;                    /* HLI_CLOCK_... */
    uint32_t rapid_override_mode;      /* P-CHAN-00181 */
    double retrace_feed;       /* of backward motion, mm/s; 0: as programmed */
    uint32_t axis_id[NC_AXES]; /* logical axis numbers */
    uint32_t
        spindle_count; /* their axis areas follow those of the channel's axes */
    uint32_t spindle_id[ENGINE_SPINDLES];
} engine_config;

/* The axis that stands at a place of the channel. */
typedef struct engine_axis {
    double v_max, a_max, j_max; /* mm/s, mm/s2, mm/s3 */
    double position;            /* mm */
    int32_t area;    /* index of its axis area; -1: there is no axis */
    uint16_t number; /* logical axis number; 0: there is no axis */
    uint16_t type;   /* as in the HLI */
    char name[16];
} engine_axis;

#define ENGINE_RT_CYCLES 16
#define ENGINE_RT_OPS 512  /* of one real-time cycle */
#define ENGINE_RT_DEPTH 32 /* values that an expression holds */
/* what is done to a real-time cycle */
#define ENGINE_RT_DELETED 0
#define ENGINE_RT_HELD 1
#define ENGINE_RT_RUNNING 2
#define ENGINE_RT_STARTED 3 /* running, its $IF ONCE forget what they saw */
/* instructions */
#define ENGINE_RT_CONSTANT 0
#define ENGINE_RT_LOOP_ENABLED 1
#define ENGINE_RT_LOOP_COUNT 2
#define ENGINE_RT_POSITION 3 /* mm: `at` is the axis */
#define ENGINE_RT_EXTERNAL 4 /* `area`, `kind` its type, `at` its byte */
#define ENGINE_RT_SET_ENABLED 5
#define ENGINE_RT_SET_EXTERNAL 6
#define ENGINE_RT_UNARY 7
#define ENGINE_RT_BINARY 8
#define ENGINE_RT_JUMP 9    /* to `at` */
#define ENGINE_RT_UNLESS 10 /* to `at` if the value is not true */
#define ENGINE_RT_ONCE 11
#define ENGINE_RT_EDGE 12
#define ENGINE_RT_ALWAYS 13
#define ENGINE_RT_SET_COUNT 14
/* `kind` of ENGINE_RT_UNARY */
#define ENGINE_RT_MINUS 0
#define ENGINE_RT_ABS 1
#define ENGINE_RT_SQR 2
#define ENGINE_RT_SQRT 3
#define ENGINE_RT_EXP 4
#define ENGINE_RT_LN 5
#define ENGINE_RT_DEXP 6
#define ENGINE_RT_LOG 7
#define ENGINE_RT_INT 8
#define ENGINE_RT_FRACT 9
#define ENGINE_RT_CEIL 10
#define ENGINE_RT_FLOOR 11
#define ENGINE_RT_ROUND 12
#define ENGINE_RT_SIN 13
#define ENGINE_RT_COS 14
#define ENGINE_RT_TAN 15
#define ENGINE_RT_COT 16
#define ENGINE_RT_ASIN 17
#define ENGINE_RT_ACOS 18
#define ENGINE_RT_ATAN 19
#define ENGINE_RT_INV 20
#define ENGINE_RT_NOT 21
#define ENGINE_RT_ACOT 22
/* `kind` of ENGINE_RT_BINARY */
#define ENGINE_RT_OR_ELSE 0
#define ENGINE_RT_EITHER 1
#define ENGINE_RT_AND_ALSO 2
#define ENGINE_RT_OR 3
#define ENGINE_RT_XOR 4
#define ENGINE_RT_AND 5
#define ENGINE_RT_EQUAL 6
#define ENGINE_RT_UNEQUAL 7
#define ENGINE_RT_AT_LEAST 8
#define ENGINE_RT_AT_MOST 9
#define ENGINE_RT_LESS 10
#define ENGINE_RT_GREATER 11
#define ENGINE_RT_PLUS 12
#define ENGINE_RT_DIFFERENCE 13
#define ENGINE_RT_TIMES 14
#define ENGINE_RT_OVER 15
#define ENGINE_RT_MOD 16
#define ENGINE_RT_POWER 17
#define ENGINE_RT_ATAN2 18
#define ENGINE_RT_MIN 19
#define ENGINE_RT_MAX 20

typedef struct engine_rt_op {
    uint16_t code;
    uint8_t kind, area;
    uint32_t at;
    double value;
} engine_rt_op;

typedef struct engine_state {
    double position[NC_AXES];
    double path;  /* mm driven since program start */
    double speed; /* mm/s along the path */
    uint64_t cycle;
    uint64_t element;  /* active element */
    uint64_t elements; /* elements pushed */
    uint64_t overruns;
    uint64_t requests_mode1, requests_mode2, requests_bad, bad_commands;
    double plan_cpu_s;    /* CPU time of the planner */
    double motion_time_s; /* committed motion, dwells included */
    double consumed_s;    /* of it driven */
    uint64_t phases;
    int32_t fault;
    uint32_t log_dropped;       /* entries lost to contour_lookahead_log_max */
    uint32_t log_ignored_areas; /* LOG ON after a completed area */
    uint32_t log_stray_params;  /* LOG PARAM outside an area */
    uint32_t log_on_closed;     /* LOG ON that closed an active area */
    uint32_t
        log_disabled; /* LOG commands while the function is not configured */
    int32_t program_end;
    int32_t plc_attached;
    int32_t rt_loop, rt_loop_count; /* V.RTG.LOOP.ENABLED, .COUNT */
    uint64_t record_lost;
    uint64_t techno_functions; /* put out to the PLC */
    uint64_t
        techno_unseen; /* acknowledged at once because plc_present_w is FALSE */
    uint64_t techno_wait_cycles; /* cycles spent waiting for acknowledgements */
    int32_t waiting_techno;
    int32_t fill;
    uint32_t mode_warnings; /* mode commands whose from_mode or from_state was
                               wrong */
    uint32_t errors_lost;   /* error records that found no room in the queue */
    uint64_t rows_taken,
        row_done;     /* rows pushed; rows below it have been executed */
    int32_t retraced; /* the path is driven backward, or once more */
    /* that, or it is at what the PLC has put into it: the line of a deleted
     * distance to go, an inserted stop */
    int32_t off_program;
    double time_by_cause[ENGINE_CAUSES]; /* s of cycles of programs */
    uint64_t infeasible; /* planner: state that could not be continued legally;
                            must stay 0 */
    uint64_t planner_late; /* times the path braked or stood for the planner */
    uint64_t planner_late_cycles; /* cycles that this took */
    double planner_away_s;        /* longest time its thread had no processor */
    double planner_us_per_ms[3];  /* its CPU time for each ms of motion, over
                                     commits: p50, p99, most */
} engine_state;

/* What a halt has left out. */
typedef struct engine_left {
    uint64_t row;         /* rows below it have been executed */
    uint64_t path;        /* the first row whose motion is left out */
    double driven, whole; /* mm of it, and its length */
} engine_left;

/* Where the path stands and why. */
typedef struct engine_standstill {
    uint32_t conditions;    /* ENGINE_STOP_...; 0: it moves, or no program is
                               active */
    uint32_t held_axes;     /* bit per axis with feed hold */
    uint64_t since;         /* cycle in which it began */
    uint64_t cycle;         /* of this answer */
    uint32_t line, n, file; /* of the block; line 0: before the first one */
} engine_standstill;

/* HLI_PROC_TRANS_TO_MODE_STATE as the PLC wrote it; `parameter` ends with NUL.
 */
typedef struct engine_mode_command {
    uint32_t from_mode, from_state, to_mode, to_state;
    uint32_t state; /* the state in which it came */
    char parameter[300];
} engine_mode_command;

/* An error for the PLC (MC_ERROR); line 0: not of an NC program. */
typedef struct engine_error {
    uint32_t id, line, column, n, reaction_class, recovery_class;
    char program[256];
} engine_error;

/* A command of the program that the path has passed (NC_EVENT_COMMAND). */
typedef struct engine_command {
    double value, position[NC_AXES];
    uint64_t cycle;
    uint32_t line;
} engine_command;

/* One cycle as it is recorded. `acceleration` and `jerk` are the changes of
 * `speed` over the cycle: means, whatever the planner. */
typedef struct engine_sample {
    uint64_t cycle;
    uint64_t element;          /* active element */
    double path;               /* mm driven since program start */
    double dist;               /* dist_prog_start, 0.1 um */
    double known;              /* max_dist_prog_start, 0.1 um */
    double speed;              /* along the path, mm/s */
    double acceleration, jerk; /* mm/s2, mm/s3 */
    double feed;               /* commanded, mm/s; 0: rapid */
    double override;           /* 1.0 = 100 % */
    double planner_us_per_ms;  /* CPU time of the last commit for each ms */
    uint32_t n, count, line;   /* of the active block */
    uint32_t stops;            /* stop_condition_r */
    uint32_t state;            /* of the operation mode */
    uint32_t elements, phases; /* ahead: prepared elements, phases */
    uint32_t overruns;         /* counted so far */
    uint32_t flags;            /* ENGINE_SAMPLE_... */
    int32_t tool;
    double position[]; /* as many as the channel has axes, mm */
} engine_sample;
#define ENGINE_SAMPLE_RAPID 1
#define ENGINE_SAMPLE_BACKWARD 2
#define ENGINE_SAMPLE_TAIL 4 /* GEO follows the stopping tail */

/* A technology function: cycles, 0 where it did not come to that. */
typedef struct engine_function {
    uint64_t issued, fetched, acknowledged;
    double value;
    int32_t code;
    uint32_t type; /* NC_M, NC_H, NC_S, NC_T */
    uint32_t n, count, line, synch;
    uint32_t seen; /* 0: no PLC was there, it counts as acknowledged */
    uint32_t fill;
} engine_function;

/* A request of the contour look-ahead; mode 0: not of finite numbers. */
typedef struct engine_request {
    uint64_t cycle;       /* completed when the service saw it */
    double start, length; /* as the PLC wrote them */
    uint32_t mode, elements;
    uint64_t answer_ns; /* wall time from there to the answer */
} engine_request;

/* An element of the contour as the look-ahead tells it. */
typedef struct engine_element {
    uint64_t element;
    double start, length, programmed_radius, compensated_radius, angle,
        length_min, turn;
    uint32_t type, n, count, epoch;
} engine_element;

/* what is recorded, for engine_record_take */
#define ENGINE_RECORD_SAMPLES 0
#define ENGINE_RECORD_FUNCTIONS 1
#define ENGINE_RECORD_REQUESTS 2

typedef struct engine engine;

/* `segment`: mapped HLI segment with a valid head, or NULL to run without one
 * (offline planning). NULL on no memory. */
struct engine *engine_new(const engine_config *config, void *segment);
void engine_free(struct engine *engine);

/* Synchronisation (P-CHAN-00041, 00027, tool.synch) of one M, H function (kind
 * NC_M, NC_H) or of T (NC_T, nr 0), with m_pre_outp (P-CHAN-00070: 0.1 um for
 * MEP, us for MET). 0, or -1: unknown kind or number, no memory. */
int engine_set_synch(struct engine *engine,
                     int kind,
                     uint32_t nr,
                     uint32_t synch,
                     double pre_output);

/* The same for spindle functions: what 3, 4, 5, 19 for M3, M4, M5, M19, or 0
 * for an S word alone. */
int engine_set_spindle_synch(struct engine *engine,
                             uint32_t what,
                             uint32_t synch);

/* Axis exchange: what stands at a place from now on. The channel stands and has
 * executed everything; no thread of it runs. 0, or -1: no such place, no
 * memory. */
int engine_set_axis(struct engine *engine,
                    int32_t place,
                    const engine_axis *axis);

/* A program starts where the axes stand; no thread may run. Until then the
 * engine only serves and publishes. */
void engine_begin_program(struct engine *engine);
/* No program is active: nothing is prepared or driven until
 * engine_begin_program. */
void engine_stand_by(struct engine *engine);
/* Brake, leave out the rest, report ENGINE_PROGRAM_END. No row may be pushed
 * after it. */
void engine_abort(struct engine *engine);
void engine_reset_channel(struct engine *engine);
/* prog_name_r, and error_id_r with error_r (0: none); published by the next
 * cycle. */
void engine_set_program_name(struct engine *engine, const char *name);
void engine_set_error(struct engine *engine, uint32_t id);
/* Technology functions are not put out but count as acknowledged (execution
 * mode 0x2000). */
void engine_suppress_functions(struct engine *engine, int suppressed);
void engine_set_mode(struct engine *engine, uint32_t mode, uint32_t state);
uint32_t engine_mode_state(struct engine *engine);
/* 1 and the command that ENGINE_MODE_COMMAND told of, or 0. */
int engine_take_mode_command(struct engine *engine,
                             struct engine_mode_command *out);
/* The same, and the command stays to be taken. */
int engine_see_mode_command(struct engine *engine,
                            struct engine_mode_command *out);
void engine_post_error(struct engine *engine, const engine_error *error);
int engine_take_plc_error(struct engine *engine,
                          uint32_t *id,
                          uint32_t *reaction_class);

/* External variables, area 0 of the channel, 1 global: the copy that each cycle
 * latches (`bytes` from the start of the area), NULL on no memory; and a write
 * that the next cycle puts out: 1, 0 if the queue is full, -1 if it is no
 * place. */
uint8_t *engine_external(struct engine *engine, uint32_t area, uint32_t bytes);
int engine_write_external(struct engine *engine,
                          uint32_t area,
                          uint32_t offset,
                          const uint8_t *data,
                          uint32_t length);
/* Commands on the path (NC_EVENT_COMMAND) shown in the global area: at `offset`
 * a block with how many have been passed, then `slots` blocks, number k (from
 * 0) in block k % slots. After engine_external; 0, or -1: no such place. */
int engine_show_commands(struct engine *engine,
                         uint32_t offset,
                         uint32_t slots);

/* A real-time cycle, from the next cycle on: `state` and, with `count` above 0,
 * new instructions; `program`: it ends with the program. 1, 0 if too
 * many wait for the next cycle, -1 if it cannot run. */
int engine_rt_cycle(struct engine *engine,
                    uint32_t slot,
                    uint32_t state,
                    uint32_t program,
                    const engine_rt_op *ops,
                    uint32_t count);

/* Take rows in order; returns how many were taken (fewer when the ring is
 * full), or a negative error for the first row. */
int64_t engine_push(struct engine *engine,
                    const nc_block *rows,
                    int64_t count,
                    const double *pool,
                    int64_t pool_n);
/* No further rows will come. */
void engine_finish(struct engine *engine);
/* Report ENGINE_DRAINED when every row pushed so far has been executed. */
void engine_expect_drain(struct engine *engine);
/* Ask for no rows before the next cycle has passed: preparation waits for what
 * the machine and the PLC do. */
void engine_expect_cycle(struct engine *engine);
/* Brake, leave out what has been pushed, report ENGINE_DRAINED; the program
 * goes on behind engine_resync. */
void engine_halt(struct engine *engine);
/* HOLD and its end come as ENGINE_MODE_COMMAND (1), or are carried out here
 * (0); engine_hold does so for the cell. While a macro runs, the transient
 * state stays until the cell sets another one. */
void engine_hold_by_cell(struct engine *engine, int by_cell);
void engine_hold(struct engine *engine, int hold);
void engine_macro_runs(struct engine *engine, int runs);
/* What that has left out. Of the rows from `row` on, up to `most` that have
 * been executed all the same go to `done`: rows of a block are not executed in
 * their order. Returns how many. Ahead of engine_resync. */
int32_t engine_left_out(struct engine *engine,
                        engine_left *out,
                        uint64_t *done,
                        int32_t most);
/* The path goes on from where the axes stand; behind ENGINE_DRAINED alone.
 * `in_block`: within a block that has begun. */
void engine_resync(struct engine *engine, int in_block);
/* What is pushed next waits for the acknowledgement of all functions that were
 * put out and wait for one. */
void engine_await_functions(struct engine *engine);
/* 1 and the next command that the path has passed, or 0. */
int engine_take_command(struct engine *engine, struct engine_command *out);
/* Motion held before the program start (1) or released (0). */
void engine_hold_start(struct engine *engine, int hold);
/* Stay behind the program's end although the PLC is finished:
 * ENGINE_PLC_FINISHED is not reported. */
void engine_stay(struct engine *engine, int stay);
/* Record every cycle, function and request through rings of `rows`; 0 or -1 (no
 * memory). engine_run stops with ENGINE_RECORD_FULL when one is full, a
 * real-time GEO counts what it loses. */
int engine_record(struct engine *engine, int64_t rows);
/* Bytes of an engine_sample with its positions. */
int64_t engine_sample_bytes(const struct engine *engine);
/* Take up to max_rows rows of ENGINE_RECORD_...; one thread at a time. */
int64_t engine_record_take(struct engine *engine,
                           int what,
                           void *out,
                           int64_t max_rows);
/* Rows of this kind that found no room. */
uint64_t engine_record_lost(const struct engine *engine, int what);
/* Write what is still open, functions that were not acknowledged; no thread may
 * run. */
void engine_record_end(struct engine *engine);
/* Elements from number `first` on, by the thread that pushes. */
int64_t engine_elements(const struct engine *engine,
                        uint64_t first,
                        engine_element *out,
                        int64_t max_rows);

/* Pump planner and GEO for up to n cycles on this thread. `wait_ns`: longest
 * time with a lockstep PLC. */
int engine_run(struct engine *engine, int64_t count, int64_t wait_ns);
/* The channels of one CNC: in each cycle one after the other in this order.
 * The first one keeps the clock and the threads that they share.  Before the
 * first cycle, once; 1 to 12 engines on one segment. -1: too many. */
int engine_join(struct engine *const *engines, uint32_t count);
/* As engine_run and engine_wait for all channels that were joined with this
 * first one; `who`: index of the channel whose event is returned. */
int engine_run_all(struct engine *first,
                   int64_t count,
                   int64_t wait_ns,
                   uint32_t *who);
int engine_wait_all(struct engine *first, int64_t timeout_ns, uint32_t *who);
/* Real time: start and stop the planner and GEO threads; wait for an event. */
int engine_start(struct engine *engine, int use_fifo);
int engine_wait(struct engine *engine, int64_t timeout_ns);

void engine_stop(struct engine *engine);
/* Tests of the threads on one thread (interleave.c): up to `cycles` cycles;
 * result as of engine_run, -1: not built for it. */
int engine_interleaved(struct engine *engine,
                       int64_t cycles,
                       uint64_t seed,
                       int geo_first,
                       int rehearse);
/* Most turns of the planner in a row after which the path stood unasked, since
 * the last call. */
int64_t engine_interleaved_stood(void);
/* Tests: what a real-time GEO does just ahead of a cycle. */
void engine_rehearse(struct engine *engine);
/* Measure the first `rows` real-time cycles: ns a cycle took, ns it began late,
 * ns of the rehearsal ahead of it. Set before engine_start. */
void engine_time(struct engine *engine,
                 int64_t *cycle_ns,
                 int64_t *late_ns,
                 int64_t *rehearsal_ns,
                 int64_t rows);
int64_t engine_timed(const struct engine *engine);
/* The reference beside it: a bare clock_nanosleep loop; ns it woke late. 0, or
 * -1 if no thread could be started. */
int engine_bare_loop(int64_t period_ns,
                     int64_t *late_ns,
                     int64_t rows,
                     int use_fifo);
/* Immediate service of the contour look-ahead by a thread of its own. */
int engine_serve_start(struct engine *engine);
void engine_serve_stop(struct engine *engine);

void engine_get_state(struct engine *engine, engine_state *out);
void engine_get_standstill(struct engine *engine, engine_standstill *out);
/* ENGINE_STANDS after so many cycles of a standstill that is no dwell; 0:
 * never. Before any thread runs. */
void engine_tell_standstill(struct engine *engine, uint64_t cycles);
void engine_set_phase(struct engine *engine, uint32_t phase);
/* Committed override (1.0 = 100 %) for offline tests of live changes; real
 * cells take it from the HLI. */
void engine_set_override(struct engine *engine, double factor, int hold);
/* Fault injection: a planner that does not get its turn (1) or gets it again
 * (0). GEO then follows the stopping tail. */
void engine_stall_planner(struct engine *engine, int stalled);
/* cdef end */
#endif
