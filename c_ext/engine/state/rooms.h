/* What each room keeps in the engine: one structure a room. state.h puts them
 * together and names the thread that writes each.
 */
#ifndef ENGINE_ROOMS_H
#define ENGINE_ROOMS_H
#include "engine/state/types.h"

/* ---- the channels of one CNC; an engine alone is a group of one */
typedef struct engine_group {
    struct engine *all[HLI_SYS_CH_MAXIDX + 1];
    uint32_t count;
} engine_group;

/* ---- the shared memory; NULL without a segment */
typedef struct shared_areas {
    HLI_SEGMENT *segment;
    HLI_CHANNEL *channel;
    HLI_AXIS
    *axis[NC_AXES];    /* of the axis at each place; NULL: none is there */
    HLI_AXIS *spindle; /* the first of the channel's spindles */
    HLI_AHEAD *ahead;
    HLI_SIDECAR *side;
} shared_areas;

/* ---- store: rows become elements and pieces */
/* Motions that were too short to be driven (short_motions.c). */
typedef struct short_motions {
    nc_block row;      /* the last of them */
    uint32_t rows;     /* how many; 0: none */
    double path;       /* mm, together */
    double programmed; /* mm of elements that those flagged NC_PIECE cover */
    uint64_t element, number; /* of the last one */
} short_motions;

/* What the next motion row goes on from. */
typedef struct push_state {
    double last_end[NC_AXES];
    double last_tangent[3];
    bool has_tangent, has_motion_piece;
    bool begun; /* the program has moved: each further block is a new one */
    struct motion_limits limits[2]; /* of feed motions and of rapid motions
                                       pushed from here on */
    double distance;                /* 0.1 um, start of the next element */
    uint32_t epoch, resets;
    uint64_t epoch_element; /* first element of the present epoch */
    bool stop_pending, m01_pending;
    double element_end[NC_AXES]; /* programmed end of the last element */
    bool element_elsewhere;      /* ... which lies in other coordinates than the
                                    axes' */
    struct short_motions short_motions;
    uint32_t last_count; /* block_count of the last motion */
    uint64_t loop_begin; /* piece that begins the real-time loop being pushed */
    bool in_loop;
    double loop_path, loop_distance; /* where it begins: mm, 0.1 um */
    uint32_t loop;                   /* number of the loop pushed last */
    uint64_t loop_first; /* its first element; UINT64_MAX: none yet */
    double loop_tangent[3], before_loop[3]; /* direction of its first element,
                                               and of the motion ahead of it */
    bool behind_loop, has_before_loop;
    uint64_t loop_behind;    /* first element behind it, or of the present
                                distance epoch */
    struct curve next_curve; /* checked, for the row that is pushed next */
    double next_tangents[6]; /* of an element whose geometry lies in other
                                coordinates */
    float end_speed;         /* of the motion pushed last */
    double path;             /* mm since program start */
    uint64_t rows_taken;     /* rows pushed */
} push_state;

/* Where the pieces pushed so far end in the elements. */
typedef struct element_map {
    uint64_t element;
    double from; /* mm behind its start */
} element_map;

/* Pieces in program order. Preparation fills it, the dispatch copies out of it;
 * what the path has left behind stays for backward motion as long as
 * P-STUP-00033 gives room. */
typedef struct piece_store {
    struct element *elements;
    struct element_more *more; /* one for each of `elements` */
    uint64_t element_mask;
    uint64_t element_head;
    struct ahead_event *events; /* as many as `elements`; the oldest go */
    uint64_t event_head;
    struct piece *pieces;
    struct curve *curves; /* of the pieces that are polynomials */
    uint64_t mask, kept;
    uint64_t head;  /* pushed */
    uint64_t done;  /* GEO: executed at least once */
    uint64_t floor; /* planner: pieces below it may be overwritten */
    uint64_t first; /* GEO and planner; #BACKWARD STORAGE CLEAR: backward motion
                       ends here */
} piece_store;

#define LOG_CHUNK 4096u
#define LOG_CHUNKS 65536u
typedef struct marked_log {
    HLI_CONTOUR_LOOKAHEAD_BLOCK *chunk[LOG_CHUNKS];
    uint64_t generation; /* odd while it is emptied */
    uint32_t count;
    uint32_t active;
    bool complete, ignoring;
    double shift; /* 0.1 um: what the copies of real-time loops add to the start
                     of later entries */
    bool in_loop;
    struct loop_item
        *items; /* what a real-time loop logs, until its end is known */
    uint32_t item_count, item_room;
    uint32_t dropped, ignored_areas, stray_params, on_closed, disabled;
} marked_log;

#define EARLY_MAX 1024u
#define BEHIND_MAX 64u
/* Rows of technology functions on their way into the store. */
typedef struct technology_rows {
    struct synch_table m_synch, h_synch;
    uint32_t tool_synch;
    struct techno_counts pushed, gated, pending_gate;
    bool has_pending_gate;
    uint32_t std_block, std_index, behind_count;
    nc_block behind[BEHIND_MAX];
    uint64_t behind_number[BEHIND_MAX]; /* of these rows */
    uint64_t
        std_base; /* functions pushed ahead of the block in the std array */
    uint32_t spindle_synch[20];
    double spindle_rev;   /* rev/min */
    int spindle_move;     /* 3, 4, 5 */
    bool spindle_pending; /* an S word that no M function of its block has
                             taken */
    nc_block spindle_row;
    uint64_t spindle_number; /* of that row */
} technology_rows;

/* Functions that go out ahead of their place: preparation to GEO. */
typedef struct early_outputs {
    struct early_output entries[EARLY_MAX];
    uint64_t head; /* preparation */
    uint64_t done; /* GEO */
} early_outputs;

/* ---- program: how far it has got */
#define ABORT_ASKED 1 /* program.abort: brake and leave out the rest */
#define ABORT_DONE 2  /* ... which is left out */
typedef struct program_state {
    uint64_t halt_piece; /* the first piece of the store that a halt left out */
    double halt_s, halt_whole; /* driven of it, and its length, mm */
    uint64_t blocks_from;      /* no rows are asked for before this cycle */
    int finished, expect_drain, hold_start, stay;
    uint64_t drain_at, drain_from;
    int end_reported, end; /* end: GEO */
    int active, abort;
    int name_changed;
    char name[260];
    int axes_changed; /* the places of the channel show other axes */
    engine_axis axes[NC_AXES];
} program_state;

/* ---- run: what is driven next */
#define STOPS_MAX 64u /* inserted stops that are fed and not yet reached */
typedef struct inserted_stop {
    double dist, position[NC_AXES]; /* mm as displayed */
} inserted_stop;

/* Stops that are fed and not yet reached. */
typedef struct inserted_stops {
    struct inserted_stop entries[STOPS_MAX];
    uint64_t fed;  /* planner */
    uint64_t done; /* GEO */
} inserted_stops;

#define INSERT_RELATIVE_REPEATED 0
#define INSERT_ABSOLUTE 1
#define INSERT_RELATIVE_ONCE 2
/* insert_cmd as the PLC gave it (hli_reference 5.3); distances mm. */
typedef struct insert_cmd {
    double value, base; /* base: where the channel was when the command came */
    int mode, axis, m_function; /* axis: 0 distance, else index + 1 */
    int32_t add;
} insert_cmd;

/* What is fed next into the run ring (planner's side). */
typedef struct dispatch {
    uint64_t next;        /* piece of the store */
    double at;            /* where in it, mm from its start */
    int dir;              /* 1 forward, -1 backward; GEO reads it */
    uint64_t frontier;    /* pieces of the store below it have been driven or
                             skipped before */
    uint64_t last_motion; /* in the run ring */
    bool has_motion, m01, stop;
    bool in_loop; /* pieces of a real-time loop lie between the path's present
                     end and `next` */
    uint64_t loop_begin;
    struct techno_counts pushed; /* functions on stretches driven before */
    uint64_t program_first;
    uint64_t run;   /* first piece of the run that the path is on: the one that
                       GEO stands in may be of the run before */
    uint32_t reach; /* pieces fed beyond the window */
    bool final;     /* nothing can come behind the run ring's head */
    bool ends;      /* nothing comes there before all of it has been driven */
    int drives_on;  /* turned forward: the way to the end is driven again, so
                       the program has not ended; GEO reads it */
    /* jobs that need standstill */
    uint32_t shortcuts; /* requests that have been done */
    /* inserted stop: armed at a distance, mm as displayed, or where an axis is
     * at `target` */
    struct insert_cmd insert;
    bool armed, dropped_stop;
    bool displaced; /* the path stands beside the programmed one: the next
                       motion leads straight to its end */
    double stand[NC_AXES]; /* where it stood as its run began, mm: GEO computes
                              its position anew in each cycle */
    double target;
    uint32_t inserts; /* commands taken */
} dispatch;

/* Pieces in the order in which they are driven. */
typedef struct run_ring {
    struct piece *pieces;
    uint64_t mask;
    uint64_t head; /* planner: fed */
    uint64_t done; /* GEO: executed */
} run_ring;

/* ---- commit: motion on its way to GEO */
/* CPU time of the planner (cpu_clock.c). */
typedef struct stopwatch {
    double clock_s, passing_s; /* what reading the CPU clock takes, and that of
                                  the passing time */
    uint64_t pumps, chance;    /* which pumps are timed */
    double
        weight; /* how many pumps the next one stands for; 0: it is not timed */
    double from, cpu_before;
    double spent_s, committed_s; /* of this pump: CPU time, motion before it */
} stopwatch;

#define PACE_STEPS 180

/* CPU time for each ms of committed motion (pace.c). */
typedef struct pace {
    uint64_t commits[PACE_STEPS]; /* that took so long */
    double most_us;
    double last_us; /* the planner writes it, GEO records it */
} pace;

/* What decides where the axes must stand: functions that open gates, on the way
 * and on a way that has been driven before; held axes, single block, M01. */
typedef struct stand_orders {
    struct techno_counts done, done_again;
    uint32_t held_axes;
    bool single, m01;
} stand_orders;

/* What operator and PLC may change while the path moves. */
typedef struct orders_seen {
    double override, rapid, ext_speed;
    int hold, rt_loop, backward, simulate;
    uint32_t shortcuts, inserts;
    struct stand_orders stands;
} orders_seen;

typedef struct commit_state {
    phase *ring;
    uint64_t word;  /* head << 2 | tail << 1 | taken: planner and GEO exchange
                       it */
    int tail_done;  /* GEO: the tail has been driven */
    uint64_t piece; /* where committed motion ends */
    double s, v;
    double committed_s;
    struct tail tails[2];
    uint64_t written;  /* phases written, published by the commit word */
    bool tail_due;     /* the stored tail is not written yet */
    uint64_t tail_end; /* the window that it was planned in */
    uint32_t tail_max;
    bool late; /* GEO will take the tail: nothing is committed until then */
    orders_seen under; /* the orders of the last commit, ... */
    bool far;          /* ... which may reach further than others */
    bool fed_anew; /* what lies ahead has been fed anew since the last commit,
                      while the path moved */
    int stalled;   /* tests: the planner gets no turn */
    double cpu_s;
    struct stopwatch watch;
    struct pace pace;
    uint64_t phases, infeasible;
} commit_state;

/* ---- plan: what the planner plans under, and how it takes motion back */
/* As the caps and stands were computed with. */
typedef struct plan_conditions {
    double override, rapid; /* of feed motion, of rapid motion */
    double ext_speed;
    double reserve_override; /* that zones are sized for */
    bool hold;
    struct stand_orders stands;
    uint32_t editions; /* of the timetable */
} plan_conditions;

/* GEO writes; the service reads a copy under `seq`. */
typedef struct shown_timetable {
    uint32_t seq;
    int valid;
    struct timetable table;
} shown_timetable;

#define REJOIN_NONE 0
#define REJOIN_OFFERED 1 /* by the planner */
/* GEO drives the tail to the place, then what was offered */
#define REJOIN_TAKEN 2
#define REJOIN_REFUSED 3
/* Motion that goes on from a place on the stored tail which GEO drives. */
typedef struct rejoin {
    int state;
    uint32_t phase; /* of the tail, ... */
    double t;       /* ... s of it */
    uint64_t word;  /* the commit from there on */
    uint64_t piece,
        written; /* where committed motion ended before, if it is refused */
    double s, v, committed_s;
    bool over; /* without jerk: too little of the tail is left, it is driven to
                  its end */
} rejoin;

/* The planner takes committed phases back while the path stands. */
#define WITHDRAW_NONE 0
#define WITHDRAW_ASKED 1
#define WITHDRAW_DONE 2
/* GEO answers where it stands. */
typedef struct withdrawal {
    int state;
    uint64_t piece;
    double s;
    int waits; /* GEO waits for the PLC: as of its last cycle */
} withdrawal;

/* ---- accel: the acceleration-limited planner */
/* A corner whose jumps use up acceleration: the start of a piece. */
typedef struct used_corner {
    uint64_t piece;
    double at, zone, accel; /* as `at` of the piece; mm that it reaches; largest
                               path acceleration beside it */
} used_corner;

typedef struct need_key {
    double override, rapid, ext_speed;
    bool hold;
} need_key;

typedef struct accel_state {
    uint64_t capped; /* pieces below this index have final corner limits, ... */
    double capped_at;            /* ... and this many mm */
    struct used_corner *corners; /* as many as the run ring has pieces:
                                    `corners_first` .. `corners_head` - 1 */
    uint64_t corners_first, corners_head;
    uint64_t zones_from, zones_to; /* pieces capped one behind the other */
    uint64_t unsettled; /* first piece whose needs the last pass could not
                           settle; UINT64_MAX: none */
    uint64_t need_end;  /* end of the last pass over controllable_v2, 0: none
                           that is still true */
    uint64_t fixed_to;  /* the needs of pieces below it are the same whatever
                           comes behind the window of that pass */
    uint64_t passed_at; /* where committed motion ended at the last pass */
    uint64_t passes;    /* over the window, as many as there have been */
    run_remainder remainder;
    uint64_t window_from, window_to; /* the window as counted last ... */
    uint32_t window_motions;         /* ... and the motions in it */
    curved_remainder left;
    uint64_t spans_made; /* for a piece, as often as that was */
    struct span *spans; /* room for the stretches of the pieces in the window: a
                           few of each, which mostly do, ... */
    double *rows;       /* ... and for their rows */
    span_slot *span_slots;
    uint64_t span_mask;
    span_room made; /* in which those of a polynomial are made */
    span_cursor cursor;
    need_key need_key;
} accel_state;

/* ---- jerk_adapter */
/* Way of the run ring into the jerk-limited planner (adapter.c). */
typedef struct jerk_adapter {
    jerk_planner *planner;
    uint64_t next; /* piece of the run ring whose path is pushed next ... */
    double at;     /* ... from there on, mm of it */
    uint64_t last; /* motion pushed last */
    bool has_last,
        open;     /* open: whether the axes stand behind it is not known yet */
    bool restart; /* the path stands elsewhere than where the planner is: where
                     the stored tail begins */
    uint64_t followed_of; /* the planner has come so far on the tail of this */
    double followed_s;    /* commit, s of motion, ... */
    double offered_s;     /* ... and offers so much behind it */
    jerk_law *laws;       /* room for a stopping tail */
    int64_t laws_max;
} jerk_adapter;

/* ---- geo: GEO's place on the path, and what the PLC asks for */
typedef struct geo {
    uint64_t cycle;
    uint64_t piece;    /* piece under the tool */
    uint64_t consumed; /* phases consumed */
    phase now;
    bool has_phase, in_tail, waiting_continue, waiting_techno;
    bool leaves; /* the tail, where `rejoin` says */
    uint32_t tail_next, tail_index;
    double t; /* time in the phase */
    double s, v;
    double consumed_s;
    double position[NC_AXES];
    uint64_t active;         /* active element */
    double element_distance; /* programmed distance in the active element, mm;
                                mapped pieces */
    uint32_t epoch, resets;
    uint64_t epoch_first;
    double path; /* mm since program start, real-time loops counted as often as
                    they are driven */
    double dist; /* mm: as displayed, real-time loops counted once */
    double path_shift, dist_shift; /* mm: what passes of real-time loops add */
    double shown_dist; /* 0.1 um: dist_prog_start as shown last; the service
                          reads it */
    bool in_loop;
    int32_t loop_count;   /* passes of the real-time loop driven last; below 0:
                             backward beyond the first one */
    int32_t loop_written; /* what V.RTG.LOOP.COUNT was set to, less the passes
                             that were over then */
    uint64_t loops_repeated, loops_left_out; /* bit per loop, the last 64 */
    uint32_t marks; /* odd while epoch, resets, epoch_first and dist_shift
                       change */
    bool continue_seen;
    bool stands_single;
    bool dwelling;
    int32_t tool;
    uint32_t count, n;
    double feed;
    bool rapid;
} geo;

/* The planner's lateness, as GEO sees it. */
typedef struct lateness {
    uint64_t times, cycles, cycles_now;
    uint64_t away_ns; /* longest time the planner's thread had no processor */
} lateness;

/* What the PLC, or a test, asks for. */
typedef struct orders {
    double override, rapid;
    double ext_speed; /* external command speed mm/s, NEVER: none */
    int hold, single, m01, rt_loop, backward, simulate;
    bool rt_loop_program; /* V.RTG.LOOP.ENABLED as the program has set it */
    int override_ignored;
    int timetable;      /* the PLC wants it */
    bool feedhold;      /* the channel's feed hold as commanded */
    bool released;      /* all axes of the channel */
    uint32_t held_axes; /* bit per axis with ipo_mc_control.feedhold */
    uint32_t shortcut_requests,
        shortcut_mask; /* delete distance to go: rising edges, end marks */
    bool shortcut_seen;
    struct insert_cmd insert_request;
    uint32_t insert_requests;
    uint64_t bad;
} orders;

#define COMMANDS_MAX 1024u
/* Commands that the path has passed: GEO to the cell. */
typedef struct path_commands {
    struct engine_command entries[COMMANDS_MAX];
    uint64_t head, lost; /* GEO */
    uint64_t tail;       /* the cell */
} path_commands;

/* Units of the PLC that hold functions. */
typedef struct technology_state {
    struct techno_counts done, done_again; /* functions on stretches driven
                                              before, and inserted ones */
    struct techno_slot std_slots[HLI_TU_CH_STD_SYNC_MAXIDX + 1],
        late_slots[HLI_TU_CH_LATE_SYNC_MAXIDX + 1];
    uint32_t std_open, late_open, std_used;
    uint64_t functions, unseen, wait_cycles;
    /* spindle functions: axis areas behind those of the channel's axes */
    struct techno_slot spindle_slots[ENGINE_SPINDLES]
                                    [HLI_TU_AX_STD_SYNC_MAXIDX + 1];
    uint32_t spindle_open[ENGINE_SPINDLES], spindle_used;
    int suppressed, units_cleared;
    uint32_t plc_generation;
    uint64_t again; /* units whose function is offered once more, a bit each */
} technology_state;

/* mode_unit.pending */
#define NO_COMMAND 0
#define COMMAND_COMES 1 /* GEO is about to show its transient state */
#define COMMAND_TAKEN 2 /* the cell has not seen it */

typedef struct mode_unit {
    uint32_t mode, state, warnings;
    int stopped, pending;
    int hold_to_cell,
        macro_runs; /* HOLD and back are for the cell to carry out; it does */
    struct engine_mode_command command;
} mode_unit;

typedef struct watchdog {
    bool alive, missed;
    double since;
    int event;
} watchdog;

/* Why the path stands (standstill.c). */
typedef struct standstill {
    uint32_t conditions; /* ENGINE_STOP_...; 0: it moves */
    uint32_t line, n, file;
    uint64_t since, piece;
    uint64_t tell_after; /* cycles; 0: never */
    int event;
} standstill;

/* Where the time goes (time_causes.c). */
typedef struct time_causes {
    double seconds[ENGINE_CAUSES];
    double falling[ENGINE_CAUSES]; /* s of a ramp whose low end is ahead */
    bool falls;
    uint32_t low; /* of the ramp up: ENGINE_CAUSE_... */
    double speed; /* of the cycle before */
    uint64_t piece;
    double tangent[NC_AXES]; /* at the end of the last motion come to */
    bool has_tangent;
    bool corner_ahead; /* the piece under the tool begins with a corner */
    uint64_t corner_cycle, stop_cycle; /* passed last */
} time_causes;

typedef struct retracing {
    int event;
    bool backward; /* the last motion */
} retracing;

#define ERRORS_MAX 16u
typedef struct error_queue {
    engine_error entries[ERRORS_MAX];
    int lock;
    uint64_t head, done;
    uint32_t lost, plc_id, plc_class;
    uint32_t channel_id; /* shown in the channel; 0: none */
} error_queue;

/* ---- measurements */
/* Rings of what is recorded: GEO or the service writes, the recorder takes.
 * Without a recorder there is no memory and nothing is written. */
typedef struct record_ring {
    char *rows;
    size_t bytes;             /* of a row */
    int64_t size, head, tail; /* rows */
    int64_t at;               /* place of the row behind `head` */
    uint64_t lost;
} record_ring;

typedef struct recording {
    struct record_ring samples, functions, requests;
    double speed, acceleration; /* of the sample before */
    double known; /* 0.1 um: end of the contour that is shown (published) */
    double path_speed; /* as published */
    uint32_t stops;    /* stop_condition_r as published */
} recording;

typedef struct cycle_timing {
    int64_t *cycle_ns, *late_ns,
        *rehearsal_ns; /* measurement of the first cycles */
    int64_t rows, done;
    uint64_t overruns;
} cycle_timing;

/* ---- threads */
typedef struct lookahead_service {
    uint32_t answered; /* elements in the last answer */
    uint32_t slot_answered[HLI_AHEAD_SLOT_MAXIDX + 1];
    uint64_t requests_mode1, requests_mode2, requests_bad;
    int running;
    bool started;
    pthread_t thread;
} lookahead_service;

typedef struct engine_threads {
    int running;
    bool started;
    /* of the first channel: GEO of all channels is one thread */
    int geo_running, in_round;
    bool geo_started;
    int fifo_result; /* as of engine_start */
    pthread_t geo, planner;
} engine_threads;
#endif
