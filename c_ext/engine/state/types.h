/* What the engine is made of: elements, pieces, phases, tails, and the state of
 * its parts. state.h puts them together. */
#ifndef ENGINE_TYPES_H
#define ENGINE_TYPES_H
#include <pthread.h>
#include <stdbool.h>
#include "curve/curve.h"
#include "engine/state/api.h"
#include "hli/hli_layout.h"
#include "hli/sync.h"
#include "jerk/planner.h"

#define TENTH_UM 10000.0 /* 0.1 um per mm */
#define PIECE_RING                                                             \
    16384u /* pieces of the run ring at the most; fewer where the window is    \
              small */
#define RUN_MORE                                                               \
    (1064u + KEPT_BEHIND + PHASE_RING                                          \
     + 64u) /* beyond the window: fed ahead, kept, committed */
#define CORNERS_BEHIND                                                         \
    1000u /* pieces on each side of a corner that the planner looks at */
#define KEPT_BEHIND                                                            \
    1024u /* executed pieces that stay readable, more than the planner looks   \
             back */
#define STORE_AHEAD                                                            \
    16384u /* pieces prepared ahead of those the path has reached */
#define STORE_KEPT_MAX (1u << 20)
#define STORE_BYTES 176u /* P-STUP-00033: what one stored block counts */
#define PHASE_RING 4096u
#define LOG_CHUNK 4096u
#define LOG_CHUNKS 65536u
#define COMMIT_LOW_S 0.010 /* motion committed ahead of GEO, */
#define COMMIT_HIGH_S 0.020
#define COMMIT_LOW_CYCLES 2.0 /* ... and at least so many cycles */
#define COMMIT_HIGH_CYCLES 4.0
#define NEVER 1e300
#define GEO_STANDS 1e-9 /* mm/s: GEO takes less for a standstill */
#define STEPPED_OVER_MM                                                        \
    2e-9 /* the jerk-limited planner steps over what is shorter */
#define GEO_MOVES                                                              \
    1e-6 /* mm/s: slower than this, GEO may take it for a standstill, where it \
            waits and takes no tail */

#ifdef ENGINE_INTERLEAVE /* tests: every atomic access is a place to switch to \
                            the other thread (interleave.c) */
void interleave(void);
#define ATOMIC_GET(x) (interleave(), __atomic_load_n(&(x), __ATOMIC_ACQUIRE))
#define ATOMIC_SET(x, v)                                                       \
    (interleave(), __atomic_store_n(&(x), (v), __ATOMIC_RELEASE), interleave())
#define __atomic_load(...) (interleave(), __atomic_load(__VA_ARGS__))
#define __atomic_store(...)                                                    \
    (interleave(), __atomic_store(__VA_ARGS__), interleave())
#define __atomic_compare_exchange_n(...)                                       \
    (interleave(), __atomic_compare_exchange_n(__VA_ARGS__))
#else
#define ATOMIC_GET(x) __atomic_load_n(&(x), __ATOMIC_ACQUIRE)
#define ATOMIC_SET(x, v) __atomic_store_n(&(x), (v), __ATOMIC_RELEASE)
#endif

/* An element is what the programmer wrote and the PLC sees: the HLI facts of
 * one motion row. */
typedef struct element {
    HLI_CONTOUR_LOOKAHEAD_BLOCK facts;
    uint32_t epoch; /* number of distance resets before it */
    uint32_t fill;
} element;

/* Synchronisation types (P-CHAN-00041) that act; values of hli_reference 6.4.
 */
#define SYNCH_MOS 0x1u
#define SYNCH_MVS_SVS 0x2u
#define SYNCH_MVS_SNS 0x4u
#define SYNCH_MNS_SNS 0x8u
#define SYNCH_MVS_SLM 0x4000u
#define SYNCH_MVS_SLP 0x8000u
#define SYNCH_BWD 0x400000u /* flag: waited for in backward motion too */
#define SYNCH_FWD                                                              \
    0x800000u /* flag: as configured in simulated forward motion too */
#define SYNCH_MEP_SVS 0x1000000u
#define SYNCH_MET_SVS 0x2000000u
#define SYNCH_NUMBERS 65536u
#define EVENT_GATE                                                             \
    1 /* code of an NC_EVENT piece: waits until its gate is open */
#define NC_OUTPUT 0x8000u /* flag of a function piece: it goes to the PLC */
#define EARLY_MAX 1024u
#define BEHIND_MAX 64u

/* How many functions have got so far; what a gate needs. */
typedef struct techno_counts {
    uint64_t std_freed, std_acked, late_freed, slm_acked, slp_acked;
} techno_counts;

typedef struct techno_slot {
    bool used, acked, replay;
    uint32_t synch;
} techno_slot;

typedef struct early_output {
    double path, distance,
        time; /* synchronisation position mm; ahead of it by mm, or by s */
    uint64_t piece, free_before;
} early_output;

typedef struct synch_table {
    uint32_t *synch;
    double *pre; /* m_pre_outp, 0.1 um or us */
} synch_table;

typedef enum piece_kind {
    PIECE_LINE,
    PIECE_ARC,
    PIECE_CURVE,
    PIECE_EVENT
} piece_kind;

#define SPANS_MANY 512u /* stretches of a piece at the most, ... */
#define SPANS_FEW 64u   /* ... and where the window is wide */
#define WIDE_WINDOW 512u
#define SPANS_FIRST                                                            \
    161u /* ... and what there is room for at first, if a piece may have so    \
            many */
#define ROWS_FIRST 191u /* of every axis */
#define SPAN_ROW 8u     /* numbers of a row in a curved one */

/* A stretch of a piece for the acceleration-limited planner. Straight: |u| <=
 * accel, v <= v_hard. Curved (rows; curved_span.c): per axis |r0 u + r1 x| <= 1
 * at its start, |r2 u + r3 x| <= 1 at its end, x <= cap2 at both. */
typedef struct span {
    double length, accel;
    union {
        double v_hard; /* straight */
        double stand;  /* curved: path acceleration that the rows allow at a
                          standstill */
    };
    double need2; /* largest speed squared at the start from which everything
                     ahead can be met */
    double cap2[2];
    const double *rows; /* NULL: straight; r0 to r3 of each axis, and what they
                           bound (curved_span.c) */
    float bend; /* 1 / bend: speed squared that the axes allow while u is zero,
                   about */
    uint8_t n_rows;
} span;

/* Where the stretches of a piece are. */
typedef struct span_room {
    struct span *spans;
    double *rows;
    uint32_t count, row_numbers; /* that there is room for */
} span_room;

/* Whose stretches are in a slot, and where: in its share of the room for a few,
 * or in its own for many. */
typedef struct span_slot {
    uint64_t owner;
    struct span *spans;
    span_room many;
} span_slot;

/* The stretch of a piece that was looked at last, and where it begins. */
typedef struct span_cursor {
    uint64_t piece;
    uint32_t k;
    double from;
} span_cursor;

/* One place of a curved piece, mm of the piece as it is driven; w: parameter of
 * a polynomial. */
typedef struct knot {
    double s, w, bend;
    double d1[NC_AXES], d2[NC_AXES];
} knot;

/* What the end of a commit has left of a step over a curved stretch: from s
 * with v to `to` with x1, found for these bounds. It holds as long as the
 * stretches of the piece are those that were `made` then. */
typedef struct bent_left {
    uint64_t piece, made;
    double s, v, to, x1, soft, end2;
} bent_left;

/* What the end of a commit has left of a phase: from s with v, over `time` with
 * a, to s1 with v1. It holds in the pass over the needs that it was found in.
 */
typedef struct run_left {
    uint64_t piece, pass;
    double s, v, a, time, s1, v1;
    bool last;
} run_left;

typedef struct bent_step {
    double u, h,
        x1; /* path acceleration, over how many mm, speed squared behind them */
} bent_step;

/* What a program asks of its motions beyond the machine's own limits
 * (NC_DYNAMICS). Shares of the axes' limits are above 0 and at most 1 (jerk: at
 * most 1e4); limits of the path are 0 where there is none, mm and s. */
typedef struct motion_limits {
    float velocity[NC_AXES], acceleration[NC_AXES], jerk[NC_AXES];
    float path_velocity, path_acceleration, radial_acceleration,
        transition_acceleration, path_jerk, radial_jerk;
    uint8_t
        profile; /* #SLOPE: 0 STEP (no jerk limit), 1 TRAPEZ, 2 SIN2, 3 HSC */
} motion_limits;

/* A piece is what the machine executes: axis-space geometry with the id of its
 * element, or an event. */
typedef struct piece {
    double start[NC_AXES], end[NC_AXES];
    double slope[NC_AXES]; /* dq/ds of the axes that move linearly with s */
    double length;
    double feed;   /* 0 = rapid */
    double v_hard; /* axis speeds and normal acceleration */
    double accel;  /* no acceleration along it is larger; without jerk */
    double
        entry_speed; /* largest speed at the start that the program asks for */
    double centre[2], radius, angle0, sweep; /* arc */
    double plane_speed; /* arc: speed in the plane over path speed */
    double curvature;   /* arc: normal acceleration over path speed squared */
    double tangent_in[NC_AXES], tangent_out[NC_AXES];
    double jump[NC_AXES]; /* |change of direction| per axis at the start */
    struct motion_limits limits;
    uint64_t element; /* element id; events: id of the next element */
    bool mapped;      /* covers part of the elements from `element` to before
                         `element_end` (element_map.c) */
    uint64_t element_end;
    double value;
    uint64_t mate;       /* real-time loop: its other end in the store; distance
                            reset: first element before it */
    double path0, dist0; /* at the start of the whole piece: mm since program
                            start, displayed distance mm */
    double path_rate,
        dist_rate;   /* change of both over a mm of the piece as it is driven */
    uint64_t origin; /* place in the store */
    uint64_t row;    /* number of the row it comes from */
    double from, whole; /* where in the whole piece this one begins, and the
                           whole piece's length */
    int8_t dir;         /* 1 forward, -1 backward */
    bool replay;   /* on a stretch that has been driven before: functions have
                      units of their own */
    bool again;    /* end of a real-time loop: it is driven once more */
    bool shortcut; /* line of a deleted distance to go */
    bool inserted; /* stop or function that the PLC has inserted */
    uint32_t n, count, line;
    int32_t code;
    uint16_t flags;
    uint8_t kind, type, axis1, axis2;
    uint16_t moving;  /* bit per axis that moves */
    bool stop_before; /* standstill at the start */
    bool gated;       /* standstill at the start unless `need` is met */
    bool m01; /* M01, or the motion behind it: standstill while m01_stop_enable
               */
    bool new_block; /* motion of another block than the motion before it */
    bool put_out;   /* function: has gone to the PLC (GEO; in the store) */
    struct techno_counts need;
    uint32_t synch, unit;
    bool stop_after;
    /* planner; not copied from the store */
    bool capped;
    bool spanned; /* its stretches are final, as far as what lies behind is
                     known */
    bool settled; /* need2 is the last backward pass's */
    bool cruises; /* ... which is the feed's, and that can be kept all over it:
                     nothing is known of its stretches */
    double cruise2;   /* of a polynomial: a speed squared that can be kept all
                         over it; below 0: not looked at */
    double corner_v;  /* speed limit at the start */
    double at;        /* of the start: mm that have been capped before it */
    uint64_t corners; /* that use up acceleration, up to its start: their number
                         in the list of the planner */
    double
        reserve[NC_AXES]; /* acceleration the jumps use up around the start */
    uint32_t span_count;
    uint64_t spans_made; /* which stretches they are: counted over all pieces */
    double need2; /* largest speed squared at the start from which everything
                     ahead can be met */
} piece;

/* Committed motion over a time, on one piece: s'' = a + jerk t + ... + pop
 * t^4/24 (planner.h); acceleration-limited: a. */
typedef struct phase {
    uint64_t piece;
    double s0, v0, a, jerk, snap, crackle, pop, time;
    bool last; /* the piece ends with it */
} phase;

static inline jerk_law law_of_phase(const phase *ph) {
    return (jerk_law){.s0 = ph->s0,
                      .v0 = ph->v0,
                      .a0 = ph->a,
                      .jerk = ph->jerk,
                      .snap = ph->snap,
                      .crackle = ph->crackle,
                      .pop = ph->pop};
}

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
} marked_log;

typedef struct tail {
    phase *phases; /* first .. count - 1 */
    uint32_t first, count;
    uint64_t piece; /* where it comes to rest */
    double s;
    uint64_t edition; /* of the jerk-limited plan that it was written from (0:
                         none); */
    int64_t from; /* law `from + i` of it, with the events ahead of it, begins
                     at place[i] */
    uint32_t *place;
} tail;

typedef struct need_key {
    double override, rapid, ext_speed;
    bool hold;
} need_key;

/* CPU time of the planner (cpu_clock.c). */
typedef struct stopwatch {
    double clock_s, passing_s; /* what reading the CPU clock takes, and that of
                                  the passing time */
    uint64_t pumps, chance;    /* which pumps are timed */
    double
        weight; /* how many pumps the next one stands for; 0: it is not timed */
    double from, cpu_before;
} stopwatch;

/* A corner whose jumps use up acceleration: the start of a piece. */
typedef struct used_corner {
    uint64_t piece;
    double at, zone, accel; /* as `at` of the piece; mm that it reaches; largest
                               path acceleration beside it */
} used_corner;

/* What the rooms below a planner have to know of it: constant from engine_new
 * on. */
typedef struct planner_traits {
    double rejoin_margin_s; /* a place to rejoin at is so far ahead of GEO */
    uint32_t fed_ahead;     /* pieces fed beyond the window */
    bool feeds_in_batches;  /* some pieces at a time are fed */
    bool cuts_phases;       /* phases are always written cycle by cycle */
    bool tries_stops;       /* the prediction needs a spare planner */
    bool uses_cpu_clock;    /* every pump is timed by the CPU clock */
    bool uses_spans;        /* pieces have stretches */
    bool exact_arcs; /* limits along arcs and curves are found by the planner;
                        else those of a piece hold anywhere on it */
} planner_traits;

typedef struct planner {
    uint64_t piece; /* where committed motion ends */
    double s, v;
    uint64_t capped; /* pieces below this index have final corner limits, ... */
    double capped_at;            /* ... and this many mm */
    struct used_corner *corners; /* as many as the run ring has pieces:
                                    `corners_first` .. `corners_head` - 1 */
    uint64_t corners_first, corners_head;
    uint64_t zones_from, zones_to; /* pieces capped one behind the other */
    uint64_t unsettled; /* first piece whose needs the last pass could not
                           settle; UINT64_MAX: none */
    uint64_t need_end; /* end of the last pass over need2, 0: none that is still
                          true */
    uint64_t fixed_to; /* the needs of pieces below it are the same whatever
                          comes behind the window of that pass */
    uint64_t passed_at; /* where committed motion ended at the last pass */
    uint64_t passes;    /* over the window, as many as there have been */
    run_left rest;
    uint64_t window_from, window_to; /* the window as counted last ... */
    uint32_t window_motions;         /* ... and the motions in it */
    bent_left left;
    uint64_t spans_made; /* for a piece, as often as that was */
    struct span *spans; /* room for the stretches of the pieces in the window: a
                           few of each, which mostly do, ... */
    double *rows;       /* ... and for their rows */
    span_slot *span_slots;
    uint64_t span_mask;
    span_room made; /* in which those of a polynomial are made */
    span_cursor cursor;
    need_key need_key;
    double reserve_override;
    double override, committed_s;
    bool hold;
    bool late; /* GEO will take the tail: nothing is committed until then */
    int stalled;
    struct tail tails[2];
    bool fed_anew; /* what lies ahead has been fed anew since the last commit,
                      while the path moved */
    bool tail_due; /* the stored tail is not written yet: planner_store_tail */
    uint64_t tail_end; /* the window that it was planned in */
    uint32_t tail_max;
    uint64_t written; /* phases written, published by the commit word */
    double target_s;  /* commit until this much motion is ahead */
    double cpu_s;
    struct stopwatch watch;
    uint64_t phases, infeasible;
    struct techno_counts done,
        done_again; /* as the caps were computed with, like the two below */
    bool single, m01;
    uint32_t held_axes;
    double rapid; /* override of rapid motion */
    double ext_speed;
} planner;

/* Way of the run ring into the jerk-limited planner (adapter.c); `planner`
 * NULL: acceleration-limited. */
typedef struct drive {
    jerk_planner *planner;
    uint64_t next; /* piece of the run ring whose path is pushed next ... */
    double at;     /* ... from there on, mm of it */
    uint64_t last; /* motion pushed last */
    bool has_last,
        open;     /* open: whether the axes stand behind it is not known yet */
    bool restart; /* the path stands elsewhere than where the planner is: where
                     the stored tail begins */
    jerk_law *laws; /* room for a stopping tail */
    int64_t laws_max;
} drive;

#define REJOIN_NONE 0
#define REJOIN_OFFERED 1 /* by the planner */
#define REJOIN_TAKEN                                                           \
    2 /* GEO drives the tail to the place, then what was offered */
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

/* insert_cmd as the PLC gave it (hli_reference 5.3); distances mm. */
typedef struct insert_cmd {
    double value, base; /* base: where the channel was when the command came */
    int mode, axis, m_function; /* axis: 0 distance, else index + 1 */
    int32_t add;
} insert_cmd;

/* Motions that were too short to be driven (short_motions.c). */
typedef struct carried {
    nc_block row;      /* the last of them */
    uint32_t rows;     /* how many; 0: none */
    double path;       /* mm, together */
    double programmed; /* mm of elements that those flagged NC_PIECE cover */
    uint64_t element, number; /* of the last one */
} carried;

#define COMMANDS_MAX 1024u
#define ERRORS_MAX 16u
#define STOPS_MAX 64u /* inserted stops that are fed and not yet reached */
typedef struct inserted_stop {
    double dist, position[NC_AXES]; /* mm as displayed */
} inserted_stop;

#define INSERT_RELATIVE_REPEATED 0
#define INSERT_ABSOLUTE 1
#define INSERT_RELATIVE_ONCE 2

/* The planner takes committed phases back while the path stands. */
#define WITHDRAW_NONE 0
#define WITHDRAW_ASKED 1
#define WITHDRAW_DONE 2

/* What is fed next into the run ring (planner's side). */
typedef struct feeder {
    uint64_t next; /* piece of the store */
    double at;     /* where in it, mm from its start */
    int dir;
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
    /* jobs that need standstill */
    uint32_t shortcuts; /* requests that have been done */
    /* inserted stop: armed at a distance, mm as displayed, or where an axis is
     * at `target` */
    struct insert_cmd insert;
    bool armed, dropped_stop;
    bool displaced; /* the path stands beside the programmed one: the next
                       motion leads straight to its end */
    double target;
    uint32_t inserts; /* commands taken */
} feeder;

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
    uint32_t epoch;
    uint64_t epoch_first;
    double path; /* mm since program start, real-time loops counted as often as
                    they are driven */
    double dist; /* mm: as displayed, real-time loops counted once */
    double path_shift, dist_shift; /* mm: what passes of real-time loops add */
    uint64_t saved_first;          /* epoch_first ahead of a real-time loop */
    uint32_t loop_count; /* passes of the real-time loop driven last */
    uint32_t marks; /* odd while epoch, epoch_first and dist_shift change */
    bool continue_seen;
    bool stands_single;
    bool dwelling;
    int32_t tool;
    uint32_t count, n;
    double feed;
    bool rapid;
} geo;
#endif
