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
#include "jerk/state/api.h"

#define TENTH_UM 10000.0 /* 0.1 um per mm */
/* Fuzzing: an engine is made at once, and a short program goes round its rings.
 */
#ifdef ENGINE_SMALL_RINGS
#define RUN_RING_MAX 4096u
#define STORE_AHEAD 896u
#define PHASE_RING 512u
#else
/* pieces of the run ring at the most; fewer where the window is small */
#define RUN_RING_MAX 16384u
/* pieces prepared ahead of those the path has reached */
#define STORE_AHEAD 16384u
#define PHASE_RING 4096u
#endif
#define RUN_MORE                                                               \
    (1064u + KEPT_BEHIND + PHASE_RING                                          \
     + 64u) /* beyond the window: fed ahead, kept, committed */
/* pieces on each side of a corner that the planner looks at */
#define CORNERS_BEHIND 1000u
/* executed pieces that stay readable, more than the planner looks back */
#define KEPT_BEHIND 1024u
#define STORE_KEPT_MAX (1u << 20)
#define STORE_BYTES 176u /* P-STUP-00033: what one stored block counts */

#define NEVER 1e300
#define GEO_STANDS 1e-9 /* mm/s: GEO takes less for a standstill */
/* the jerk-limited planner steps over what is shorter */
#define STEPPED_OVER_MM 2e-9
/* mm/s: slower than this, GEO may take it for a standstill, where it waits
 * and takes no tail */
#define GEO_MOVES 1e-6

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
/* of a piece that is shortened under GEO: between its end and its length */
#define store_f64_release(p, v)                                                \
    (interleave(), store_f64_release(p, v), interleave())
#else
#define ATOMIC_GET(x) __atomic_load_n(&(x), __ATOMIC_ACQUIRE)
#define ATOMIC_SET(x, v) __atomic_store_n(&(x), (v), __ATOMIC_RELEASE)
#endif

/* An element is what the programmer wrote and the PLC sees: the HLI facts of
 * one motion row. */
typedef struct element {
    HLI_CONTOUR_LOOKAHEAD_BLOCK facts;
    uint32_t epoch;  /* number of distance resets, and of begins and ends of
                        real-time loops, before it */
    uint32_t resets; /* ... of distance resets alone */
    uint32_t loop;   /* number of the real-time loop that `role` is about */
    uint8_t role;    /* LOOP_... */
    double other_variation; /* tangent_variation where the loop has been
                               repeated (first in it) or left out (first
                               behind it) */
} element;

#define LOOP_NONE 0u
#define LOOP_FIRST 1u  /* first element in a real-time loop */
#define LOOP_INSIDE 2u /* any other in it */
#define LOOP_BEHIND 3u /* first one behind it */

/* What the extension tells of an element beside its facts; mm, mm/s. */
typedef struct element_more {
    double start[NC_AXES], end[NC_AXES];
    double tangent_in[3], tangent_out[3]; /* of the main axes; 0: none moves */
    double feed;                          /* 0: rapid */
    double covered, driven; /* so much of it is covered by pieces, which are so
                               long; service: read while SDA adds */
    bool rapid;
} element_more;

/* A function or a dwell where it is programmed. */
typedef struct ahead_event {
    uint64_t element; /* in front of it */
    double distance;  /* 0.1 um, as facts.start_position */
    double value;
    uint32_t epoch, resets, block_type, n, count;
    int32_t code;
} ahead_event;

/* Synchronisation types (P-CHAN-00041) that act; values of hli_reference 6.4.
 */
#define SYNCH_MOS 0x1u
#define SYNCH_MVS_SVS 0x2u
#define SYNCH_MVS_SNS 0x4u
#define SYNCH_MNS_SNS 0x8u
#define SYNCH_MVS_SLM 0x4000u
#define SYNCH_MVS_SLP 0x8000u
#define SYNCH_BWD 0x400000u /* flag: waited for in backward motion too */
/* flag: as configured in simulated forward motion too */
#define SYNCH_FWD 0x800000u
#define SYNCH_MEP_SVS 0x1000000u
#define SYNCH_MET_SVS 0x2000000u
/* Groups of them: what a function does to the path and its units. */
#define WAITS                                                                  \
    (SYNCH_MVS_SVS | SYNCH_MVS_SNS | SYNCH_MNS_SNS | SYNCH_MEP_SVS             \
     | SYNCH_MET_SVS)
#define EARLY (SYNCH_MEP_SVS | SYNCH_MET_SVS)
#define LATE (SYNCH_MVS_SLM | SYNCH_MVS_SLP)
#define BEHIND (SYNCH_MVS_SNS | SYNCH_MNS_SNS)
#define STD_UNITS (HLI_TU_CH_STD_SYNC_MAXIDX + 1u)
#define LATE_UNITS (HLI_TU_CH_LATE_SYNC_MAXIDX + 1u)
#define SYNCH_NUMBERS 65536u
/* code of an NC_EVENT piece: waits until its gate is open */
#define EVENT_GATE 1
#define NC_OUTPUT 0x8000u /* flag of a function piece: it goes to the PLC */

/* How many functions have got so far; what a gate needs. */
typedef struct techno_counts {
    uint64_t std_freed, std_acked, late_freed, slm_acked, slp_acked;
} techno_counts;

typedef struct techno_slot {
    bool used, acked, replay;
    uint32_t synch;
    uint32_t generation; /* of the PLC to which it was put out */
    struct engine_function recorded;
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
/* ... and what there is room for at first, if a piece may have so many */
#define SPANS_FIRST 161u
#define ROWS_FIRST 191u /* of every axis */
#define SPAN_ROW 8u     /* numbers of a row in a curved one */

/* A stretch of a piece for the acceleration-limited planner. Straight: |u| <=
 * accel, v <= v_hard. Curved (rows; curved_span.c): per axis |r0 u + r1 x| <= 1
 * at its start, |r2 u + r3 x| <= 1 at its end, x <= v2_limit at both. */
typedef struct span {
    double length, accel;
    union {
        double v_hard; /* straight */
        double stand;  /* curved: path acceleration that the rows allow at a
                          standstill */
    };
    double controllable_v2; /* largest speed squared at the start from which
                     everything ahead can be met */
    double v2_limit[2];
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
typedef struct curved_remainder {
    uint64_t piece, made;
    double s, v, to, x1, soft, end2;
} curved_remainder;

/* What the end of a commit has left of a phase: from s with v, over `time` with
 * a, to s1 with v1. It holds in the pass over the needs that it was found in.
 */
typedef struct run_remainder {
    uint64_t piece, pass;
    double s, v, a, time, s1, v1;
    bool last;
} run_remainder;

typedef struct curved_step {
    double u, h,
        x1; /* path acceleration, over how many mm, speed squared behind them */
} curved_step;

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

/* How far the marked log was. */
typedef struct logged {
    uint64_t elements; /* of the store, logged or not */
    uint32_t count;
    bool active, complete, ignoring;
} logged;

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
    bool again;    /* end of a real-time loop, as it comes: the loop is driven,
                      for the first time or once more */
    uint32_t loop; /* real-time loop: its number */
    uint64_t first_element; /* real-time loop: first element ahead of it that
                               its distance goes on from */
    double loop_distance; /* real-time loop: displayed distance of a pass, mm */
    bool shortcut;        /* line of a deleted distance to go */
    bool inserted;        /* stop or function that the PLC has inserted */
    uint32_t n, count, line;
    int32_t code;
    uint16_t flags, file;
    uint8_t kind, type, axis1, axis2;
    uint16_t moving;  /* bit per axis that moves */
    bool stop_before; /* standstill at the start */
    bool gated;       /* standstill at the start unless `need` is met */
    bool m01; /* M01, or the motion behind it: standstill while m01_stop_enable
               */
    bool new_block; /* motion of another block than the motion before it */
    bool put_out;   /* function: has gone to the PLC (GEO; in the store) */
    struct logged logged; /* ahead of it */
    struct techno_counts need;
    uint32_t synch, unit;
    bool stop_after;
    /* planner; not copied from the store */
    uint64_t told_line_n; /* line << 32 | n, and the file: what GEO tells while
                             the planner may write the piece anew */
    uint32_t told_file;
    bool capped;
    bool spanned; /* its stretches are final, as far as what lies behind is
                     known */
    bool settled; /* controllable_v2 is the last backward pass's */
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
    double controllable_v2; /* largest speed squared at the start from which
                     everything ahead can be met */
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

/* What is planned, as places and times (plan/timetable.h). */
typedef struct timetable {
    uint32_t edition, count;
    bool complete;   /* at rest at its end, and nothing comes behind */
    bool full;       /* the plan goes on behind its end */
    double override; /* that it was planned with, 1: 100 % */
    HLI_AHEAD_KNOT knot[HLI_AHEAD_KNOT_MAXIDX + 1];
} timetable;

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

#endif
