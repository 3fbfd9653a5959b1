/* Jerk-limited path planning over a receding horizon of path intervals.
 *
 * The module knows neither the engine nor the HLI.  The caller pushes intervals
 * of a path.  It takes laws of motion, one after the other, which a cyclic
 * interpolator evaluates in constant time.  The part of the plan that has not
 * been taken always ends at rest, whatever happens to the solver.
 * docs/explanation/planner.md has the mathematics and the argument for
 * legality.  Only jerk_new and topp2_new allocate.
 */
#ifndef JERK_PLANNER_H
#define JERK_PLANNER_H
#include <stdint.h>

/* cdef begin */
#define JERK_AXES 10

/* Flags of an interval: the axes must stand at its end; `feed` is the rapid
 * speed, to which the rapid override applies; `feed` holds whatever the
 * override. */
#define JERK_STAND 1u
#define JERK_RAPID 2u
#define JERK_FIXED 4u

/* Why an interval or a configuration is refused. */
#define JERK_BAD_LENGTH -1
#define JERK_NOT_FINITE -2
#define JERK_BAD_LIMITS -3

typedef struct jerk_config {
    int axes; /* below JERK_AXES: the last place is the path's own */
    /* mm/s, mm/s2, mm/s3; rotary axes in degrees */
    double v_max[JERK_AXES], a_max[JERK_AXES], j_max[JERK_AXES];
    /* s: jumps of derivatives are bounded by what samples at this cycle show */
    double cycle_s;
    /* look-ahead in blocks, and in planner intervals */
    int window_blocks;
    int window_knots;
    /* mm: longest planner interval; 0: from the limits */
    double spacing_mm;
    /* share of the window that is used up before it is planned again; 0: 0.2 */
    double refresh;
} jerk_config;

/* One interval of the path; index 0 of the derivatives is its start, 1 its end,
 * from inside the interval. */
typedef struct jerk_interval {
    double length;           /* mm */
    double d1[2][JERK_AXES]; /* dq/ds */
    double d2[2][JERK_AXES]; /* d2q/ds2, 1/mm */
    double d3[2][JERK_AXES]; /* d3q/ds3, 1/mm2 */
    double feed;             /* mm/s along the path; <= 0: none */
    /* mm/s: further limit that no override lifts; <= 0: none */
    double v_hard;
    /* the caller's own, and where the interval starts on what it names */
    double offset;
    uint64_t tag;
    /* shares of the axes' limits on this interval; <= 0: all of it */
    float acc_share[JERK_AXES], jerk_share[JERK_AXES];
    /* mm/s2, mm/s3: further limits of the acceleration and the jerk along the
     * path, whose way is told behind the axes' derivatives; <= 0: none */
    float path_acc, path_jerk;
    /* 1/mm2: by how much d3 is another between the ends than the polynomial
     * through them says */
    float miss[JERK_AXES];
    /* program blocks that end with the interval, for window_blocks */
    uint32_t blocks;
    uint32_t flags;
} jerk_interval;

/* A law of motion: s'' = a0 + jerk t + snap t^2/2 + crackle t^3/6 + pop t^4/24
 * for 0 <= t <= time. */
typedef struct jerk_law {
    uint64_t tag;
    double s0, v0, a0;               /* mm on what `tag` names, mm/s, mm/s2 */
    double jerk, snap, crackle, pop; /* mm/s3 to mm/s6 */
    double time, length;             /* s, mm */
    uint32_t flags;                  /* JERK_STAND: at rest at the end */
    /* 1: the caller's interval ends with this law; 3: and a program block */
    uint32_t last;
} jerk_law;

typedef struct jerk_state {
    double s, v, a;
} jerk_state;

/* A hold that has not come: mm that are driven before it acts, mm/s there, mm
 * from there to rest. */
typedef struct jerk_preview {
    double before, v, way;
} jerk_preview;

typedef struct jerk_stats {
    uint64_t solves, failed, refused, slower, holds, hold_solves, laws,
        iterations;
    uint64_t work;  /* iterations, each times the planner intervals; more with
                       more than three axes */
    uint64_t spent; /* the same, and what solves have beside it */
    uint64_t straight;  /* lines from rest to rest, without the solver */
    uint64_t segments;  /* planner intervals handed out */
    double worst_ratio; /* largest ratio in an accepted plan */
} jerk_stats;

typedef struct jerk_planner jerk_planner;

/* NULL: no memory or bad limits. */
jerk_planner *jerk_new(const jerk_config *config, int capacity);
void jerk_free(jerk_planner *planner);

/* 0, or JERK_BAD_LIMITS. */
int jerk_check_config(const jerk_config *config);

/* Planner intervals from full speed to rest. */
double jerk_stop_knots(const jerk_config *config);

/* Intervals that can be pushed now. */
int64_t jerk_room(const jerk_planner *planner);

/* Returns how many were taken, or a JERK_ error of the first one. */
int64_t jerk_push(jerk_planner *planner,
                  const jerk_interval *intervals,
                  int64_t count);

/* Third derivative of an axis that the planner takes at the share t. */
double jerk_third(const jerk_interval *interval, double t, int axis);

/* No more intervals will come (or they will again). */
void jerk_finish(jerk_planner *planner, int finished);

void jerk_override(jerk_planner *planner, double feed, double rapid);
void jerk_hold(jerk_planner *planner, int hold);

/* Somebody reads the plan: windows cover the whole look-ahead behind a change
 * of speeds too. */
void jerk_read_plan(jerk_planner *planner, int read);
/* mm/s in place of feed and override; < 0: no longer. */
void jerk_command_speed(jerk_planner *planner, double speed);

/* Changes of a path that has been pushed.  Intervals are counted from the one
 * the planner is in: of the first one perhaps only a part is left. */
int64_t jerk_ahead(const jerk_planner *planner);
const jerk_interval *jerk_path(const jerk_planner *planner, int64_t i);

/* The axes must stand (need not) at the end of interval i. */
void jerk_stand(jerk_planner *planner, int64_t i, int stand);

/* Whether the present plan runs over the end of interval i. */
int jerk_passes(const jerk_planner *planner, int64_t i);

/* Keep `length` mm of interval i and nothing behind it. */
void jerk_cut(jerk_planner *planner, int64_t i, double length);

/* The part of the plan not handed out becomes the shortest stop. */
void jerk_brake(jerk_planner *planner);

/* At rest, without a path. */
void jerk_reset(jerk_planner *planner);

/* mm, estimated on a straight line from here. */
double jerk_stop_distance(const jerk_planner *planner);

/* A hold after `later` seconds more; the content of `scratch`, made with the
 * same configuration, is lost. */
void jerk_stop_preview(const jerk_planner *planner,
                       jerk_planner *scratch,
                       double later,
                       jerk_preview *out);

/* s, from rest to rest over a line of this direction. */
double jerk_line_time(const jerk_planner *planner,
                      const double *direction,
                      double length,
                      double speed);

/* mm/s at the end of what was handed out; 0: at rest. */
double jerk_speed(const jerk_planner *planner);

/* Once bit 0 of the word is set the plan stays as it is; NULL: no word. */
void jerk_watch(jerk_planner *planner, const uint64_t *word);

/* `seconds` of the plan as it is are handed out; returns how many they were. */
double jerk_advance(jerk_planner *planner, double seconds);

/* Whether enough is known to go on without planning a stop too early. */
int jerk_ready(const jerk_planner *planner);

/* 1: a law was handed out; 0: at rest, nothing to do. */
int jerk_next(jerk_planner *planner, jerk_law *law);

/* As jerk_next, at most `seconds` of the law. */
int jerk_next_within(jerk_planner *planner, jerk_law *law, double seconds);

/* Laws over `seconds`; returns their number. */
int64_t jerk_take(jerk_planner *planner,
                  jerk_law *laws,
                  int64_t max,
                  double seconds);

/* Laws from what was handed out to rest. */
int64_t jerk_tail(const jerk_planner *planner, jerk_law *laws, int64_t max);

/* Laws that jerk_tail can give at the most, with those that jerk_take_back can
 * reach. */
int64_t jerk_laws_max(const jerk_config *config);

/* The last `seconds` that were handed out are the plan's again; returns how
 * many they were: less where a law could not be cut. */
double jerk_take_back(jerk_planner *planner, double seconds);

/* From here on the present plan is kept where another one takes its place. */
void jerk_keep(jerk_planner *planner);

/* The `seconds` that were handed out since jerk_keep are taken back, and the
 * plan of then follows; returns as jerk_take_back, below 0: it cannot be done.
 */
double jerk_go_back(jerk_planner *planner, double seconds);

/* As long as the edition is the same, the plan loses only what is handed out:
 * jerk_used tells how many of its laws that are as a whole. */
uint64_t jerk_edition(const jerk_planner *planner);
int64_t jerk_used(const jerk_planner *planner);

/* Whether the plan is made for what is wanted now: not if no plan for the last
 * change has been found yet. */
int jerk_as_wanted(const jerk_planner *planner);

/* The tail was executed: go on from its end, at rest. */
void jerk_tail_driven(jerk_planner *planner);

/* State at the time t since the start of a law. */
void jerk_at(const jerk_law *law, double t, jerk_state *out);

/* The law becomes the part of it behind the time t. */
void jerk_begin_at(jerk_law *law, double t);

/* States every `dt` over consecutive laws; `phase`: time of the first sample in
 * the first law, left as that behind the last one. */
int64_t jerk_sample(const jerk_law *laws,
                    int64_t count,
                    double dt,
                    double *phase,
                    jerk_state *out,
                    int64_t max);
void jerk_get_stats(const jerk_planner *planner, jerk_stats *out);
/* cdef end */
#endif
