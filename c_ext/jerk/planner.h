/* Jerk-limited path planning: a receding horizon over knots of a path, and the
 * acceleration-limited sibling.
 *
 * The module knows neither the engine nor the HLI.  The caller pushes intervals
 * of a path (length, derivatives of the axes by path length at both ends, feed)
 * and takes time laws, one after the other, that a cyclic interpolator
 * evaluates in constant time.  Whatever happens to the solver, what has not
 * been taken yet always ends at rest. Mathematics and argument for legality:
 * docs/explanation/planner.md.  No function but jerk_new and topp2_new allocates.
 */
#ifndef JERK_PLANNER_H
#define JERK_PLANNER_H
#include <stdint.h>

/* cdef begin */
#define JERK_AXES 9
#define JERK_STAND 1u /* the axes must stand at the end of the interval */
#define JERK_RAPID                                                             \
    2u /* `feed` is the rapid speed: the rapid override applies to it */
#define JERK_FIXED 4u /* `feed` holds as it is, whatever the override */
#define JERK_BAD_LENGTH -1
#define JERK_NOT_FINITE -2
#define JERK_BAD_LIMITS -3

typedef struct jerk_config {
    int axes;
    double v_max[JERK_AXES], a_max[JERK_AXES],
        j_max[JERK_AXES]; /* mm/s, mm/s2, mm/s3; rotary axes: degrees */
    double cycle_s; /* jumps of derivatives are bounded by what samples at this
                       cycle show */
    int window_blocks; /* look-ahead in blocks */
    int window_knots;  /* look-ahead in planner intervals; at most the workspace
                          made by jerk_new */
    double spacing_mm; /* longest planner interval; 0: from the limits */
    double refresh;    /* share of the window that may be used up before it is
                          planned again; 0: 0.2 */
} jerk_config;

/* One interval of the path; index 0 of the derivatives is its start, 1 its end,
 * from inside the interval. */
typedef struct jerk_interval {
    double length;           /* mm */
    double d1[2][JERK_AXES]; /* dq/ds */
    double d2[2][JERK_AXES]; /* d2q/ds2, 1/mm */
    double d3[2][JERK_AXES]; /* d3q/ds3, 1/mm2 */
    double feed;             /* mm/s along the path; <= 0: none */
    double v_hard; /* mm/s: further limit that no override lifts; <= 0: none */
    double offset; /* where the interval starts on what `tag` names */
    uint64_t tag;  /* the caller's own */
    float acc_share[JERK_AXES],
        jerk_share[JERK_AXES]; /* of the axes' limits, on this interval; <= 0:
                                  all of it */
    float miss[JERK_AXES]; /* by how much d3 is another between the ends than
                              the polynomial through them says, 1/mm2 */
    uint32_t blocks;       /* program blocks that end with the interval, for
                              window_blocks */
    uint32_t flags;
} jerk_interval;

/* s'' = a0 + jerk t + snap t^2/2 + crackle t^3/6 + pop t^4/24 for 0 <= t <=
 * time. */
typedef struct jerk_law {
    uint64_t tag;
    double s0, v0, a0;               /* mm on what `tag` names, mm/s, mm/s2 */
    double jerk, snap, crackle, pop; /* mm/s3 to mm/s6 */
    double time, length;             /* s, mm */
    uint32_t flags;                  /* JERK_STAND: at rest at the end */
    uint32_t last; /* 1: the caller's interval ends with this law; 3: and a
                      program block with it */
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
    double worst_solve_s; /* CPU seconds of the slowest plan */
    uint64_t straight; /* lines from rest to rest, planned without the solver */
    uint64_t segments; /* planner intervals handed out */
    double worst_ratio; /* largest true row the checker has seen in an accepted
                           plan */
} jerk_stats;

typedef struct jerk_planner jerk_planner;

jerk_planner *jerk_new(const jerk_config *config,
                       int capacity); /* NULL: no memory or bad limits */
void jerk_free(jerk_planner *planner);
int jerk_check_config(const jerk_config *config);
double jerk_stop_knots(
    const jerk_config *config); /* such intervals from full speed to rest */

int64_t jerk_room(const jerk_planner *planner);
int64_t jerk_push(jerk_planner *planner,
                  const jerk_interval *intervals,
                  int64_t count); /* taken, or a JERK_ error */
double jerk_third(
    const jerk_interval *interval,
    double t,
    int axis); /* third derivative that the planner takes at the share t of q */
void jerk_finish(
    jerk_planner *planner,
    int finished); /* no more intervals will come (or they will again) */
void jerk_override(jerk_planner *planner, double feed, double rapid);
void jerk_hold(jerk_planner *planner, int hold);

void jerk_command_speed(
    jerk_planner *planner,
    double speed); /* mm/s in place of feed and override; < 0: no longer */

/* Changes of a path that has been pushed.  Intervals are counted from the one
 * the planner is in. */
int64_t jerk_ahead(
    const jerk_planner *planner); /* intervals pushed and not handed out; of the
                                     first perhaps a part */
const jerk_interval *jerk_path(const jerk_planner *planner, int64_t i);
void jerk_stand(
    jerk_planner *planner,
    int64_t i,
    int stand); /* the axes must stand (need not) at the end of interval i */
int jerk_passes(
    const jerk_planner *planner,
    int64_t i); /* the present plan runs over the end of interval i */
void jerk_cut(
    jerk_planner *planner,
    int64_t i,
    double length); /* keep `length` mm of interval i and nothing behind it */
void jerk_brake(jerk_planner *planner); /* what is left of the plan becomes the
                                           shortest stop */
void jerk_reset(jerk_planner *planner); /* at rest, without a path */
double jerk_stop_distance(
    const jerk_planner
        *planner); /* mm, estimated on a straight line from here */
void jerk_stop_preview(const jerk_planner *planner,
                       jerk_planner *scratch,
                       double later,
                       jerk_preview *out);
double jerk_line_time(const jerk_planner *planner,
                      const double *direction,
                      double length,
                      double speed);            /* s, from rest to rest */
double jerk_speed(const jerk_planner *planner); /* mm/s at the end of what was
                                                   handed out; 0: at rest */

void jerk_watch(jerk_planner *planner,
                const uint64_t *word); /* once bit 0 of it is set the plan stays
                                          as it is; NULL: no longer */
double jerk_advance(
    jerk_planner *planner,
    double seconds); /* `seconds` of the plan as it is are handed out; returns
                        how many they were */

int jerk_ready(const jerk_planner *planner); /* enough is known to go on without
                                                planning a stop too early */
int jerk_next(
    jerk_planner *planner,
    jerk_law *law); /* 1: a law was handed out; 0: at rest, nothing to do */
int jerk_next_within(
    jerk_planner *planner,
    jerk_law *law,
    double seconds); /* as jerk_next, at most `seconds` of the law */
int64_t jerk_take(jerk_planner *planner,
                  jerk_law *laws,
                  int64_t max,
                  double seconds); /* `seconds` of them */
int64_t jerk_tail(const jerk_planner *planner,
                  jerk_law *laws,
                  int64_t max); /* from what was handed out to rest */
int64_t jerk_laws_kept(void);   /* laws that jerk_take_back can reach */
/* The last `seconds` that were handed out are the plan's again; returns how
 * many it were: less where a law could not be cut. */
double jerk_take_back(jerk_planner *planner, double seconds);
/* As long as the edition is the same, what is left of the plan is what was left
 * before less what was handed out since: jerk_used tells how many of its laws
 * that are as a whole. */
uint64_t jerk_edition(const jerk_planner *planner);
int64_t jerk_used(const jerk_planner *planner);
void jerk_tail_driven(jerk_planner *planner); /* the tail was executed: go on
                                                 from its end, at rest */
void jerk_at(const jerk_law *law, double t, jerk_state *out);
void jerk_begin_at(
    jerk_law *law,
    double t); /* what is left of it: its state becomes that at the time t */
int64_t jerk_sample(const jerk_law *laws,
                    int64_t count,
                    double dt,
                    double *phase,
                    jerk_state *out,
                    int64_t max);
void jerk_get_stats(const jerk_planner *planner, jerk_stats *out);
/* cdef end */
#endif
