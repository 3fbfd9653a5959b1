/* State of the jerk-limited planner: the pushed path, and grid, problem and
 * plan over it.  One thread uses it; `gone` alone is written by another one. */
#ifndef JERK_STATE_H
#define JERK_STATE_H
#include <math.h>
#include "jerk/state/plan.h"
#include "jerk/state/problem.h"
#include "jerk/state/segments.h"
#include "jerk/state/tuning.h"
#include "maths/order.h"

/* What operator and program ask for: mm/s in place of all feeds (< 0: none),
 * and the overrides. */
typedef struct speeds {
    double command, feed, rapid;
} speeds;

/* A joint that was passed: where (see `driven`), how fast in mm/s, and by how
 * much the direction has turned. */
typedef struct turned {
    double at, v, by[JERK_AXES];
} turned;

/* A plan that may come back (history.c). */
typedef struct kept {
    enum keeping state;
    plan plan;
    struct speeds was;        /* under which it was made */
    uint64_t handed, edition; /* laws handed out before, and the plan's */
} kept;

struct jerk_planner {
    jerk_config cfg; /* the limits behind those of the axes: the path's own */
    int axes;        /* that have rows: those of cfg, and the path as one more
                        where a limit of its own was pushed */
    double scale;    /* F */
    jerk_interval *ring;
    double *tight;       /* as `ring` */
    double *acc_tight;   /* as `ring` */
    struct steps *steps; /* as `ring` */
    uint64_t head, tail,
        mask; /* intervals head..tail-1; the head one may be trimmed */
    uint64_t stand_end; /* behind the last of them that ends at a stand */
    bool finished, hold, changed, at_standstill;
    const uint64_t
        *gone; /* no plan is accepted once bit 0 is set; NULL: always */
    double feed_factor, rapid_factor;
    double command_speed; /* mm/s; < 0: none */
    bool is_read;         /* somebody reads the plan */
    struct speeds was;    /* under which the present plan was made */
    int capacity;         /* segments a grid can hold */
    double behind_mm,
        behind_share; /* reach of a jump behind the head, and what it leaves */
    double driven;    /* mm handed out */
    double driven_s;  /* s handed out */
    double other_s;   /* of them when other speeds were last asked for */
    bool hurried;     /* other speeds were asked for shortly before that too */
    struct turned turned[TURNED_MAX]; /* ring of the joints passed last */
    uint64_t turned_count;
    double x, accel; /* scaled state at the head */
    struct grid grid;
    struct problem prob;
    plan plan;
    plan found; /* what the solver had found when it asked for finer steps: no
                   segments where it did not */
    struct kept kept;
    double *scratch; /* capacity + LANES */
    double
        reach; /* mm: windows this long are solved; longer ones have failed */
    int finer_tries; /* so often may solutions still ask for finer steps */
    bool finer;      /* the last one has */
    bool near; /* the present plan is a first answer: it reaches to rest only */
    double credit; /* work that motion has earned for windows */
    bool scarce;   /* little of it is left: SCARCE */
    double most;   /* stats.spent up to which the present plan may go */
    int wait;      /* laws to hand out before the next plan is tried */
    double again_s,
        waited_s; /* s to hand out before what has changed is tried again (no
                     plan for it was found), and at the last try */
    jerk_stats stats;
    struct handed *handed; /* ring of the last HANDED_MAX laws */
    uint64_t handed_count;
    void *arena;
};

static inline const jerk_interval *ring_at(const jerk_planner *planner,
                                           uint64_t i) {
    return &planner->ring[i & planner->mask];
}

/* Work for the window: iterations, each times the intervals, as of no more than
 * SPACE_AXES that move. What an interval takes grows with its rows, so with the
 * axes. */
static inline uint64_t work_of(const jerk_planner *planner, int iterations) {
    const struct problem *problem = &planner->prob;
    int axes = problem->axes > SPACE_AXES ? problem->axes : SPACE_AXES;
    int all = iterations * problem->count * (1 + axes);
    return (uint64_t)(all / (1 + SPACE_AXES));
}

/* Limits of an axis on an interval. */
static inline double share_of(float share) {
    return share > 0.0f ? (double)share : 1.0;
}
static inline double acc_max(const jerk_planner *planner,
                             const jerk_interval *interval,
                             int axis) {
    return planner->cfg.a_max[axis] * share_of(interval->acc_share[axis]);
}
static inline double jerk_max(const jerk_planner *planner,
                              const jerk_interval *interval,
                              int axis) {
    return planner->cfg.j_max[axis] * share_of(interval->jerk_share[axis]);
}

/* The same of two neighbours: the smaller one. */
static inline double least_acc(const jerk_planner *planner,
                               const jerk_interval *left,
                               const jerk_interval *right,
                               int axis) {
    return lesser(acc_max(planner, left, axis), acc_max(planner, right, axis));
}
static inline double least_jerk(const jerk_planner *planner,
                                const jerk_interval *left,
                                const jerk_interval *right,
                                int axis) {
    return lesser(jerk_max(planner, left, axis),
                  jerk_max(planner, right, axis));
}

/* How the first and the second derivative of an axis jump between neighbours.
 */
static inline double turn_of(const jerk_interval *left,
                             const jerk_interval *right,
                             int axis) {
    return right->d1[0][axis] - left->d1[1][axis];
}
static inline double bend_of(const jerk_interval *left,
                             const jerk_interval *right,
                             int axis) {
    return right->d2[0][axis] - left->d2[1][axis];
}

/* The larger magnitude. */
static inline double larger(double one, double other) {
    return greater(fabs(one), fabs(other));
}

/* Speed that the operator and the program ask for over q, mm/s. */
static inline double asked_under(const struct speeds *speeds,
                                 const jerk_interval *interval) {
    if (speeds->command >= 0.0) {
        return speeds->command;
    }
    if (interval->flags & JERK_FIXED && interval->feed > 0) {
        return interval->feed;
    }
    return interval->feed > 0
               ? interval->feed
                     * (interval->flags & JERK_RAPID ? speeds->rapid
                                                     : speeds->feed)
               : 1e30;
}

static inline struct speeds speeds_now(const jerk_planner *planner) {
    return (struct speeds){planner->command_speed,
                           planner->feed_factor,
                           planner->rapid_factor};
}

static inline double asked_speed(const jerk_planner *planner,
                                 const jerk_interval *interval) {
    const struct speeds now = speeds_now(planner);
    return asked_under(&now, interval);
}

/* Along the path at the head, mm/s and mm/s2. */
static inline double speed_at_head(const jerk_planner *planner) {
    return planner->scale * sqrt(planner->x);
}
static inline double acceleration_at_head(const jerk_planner *planner) {
    return planner->scale * planner->scale * planner->accel;
}

/* No plan is accepted any more. */
static inline bool plan_is_gone(const jerk_planner *planner) {
    return planner->gone
           && __atomic_load_n(planner->gone, __ATOMIC_ACQUIRE) & 1;
}

static inline const struct steps *steps_at(const jerk_planner *planner,
                                           uint64_t i) {
    return &planner->steps[i & planner->mask];
}

/* Planner intervals that ring interval i takes at the least; of the head one a
 * part may be left. */
static inline double knots_at(const jerk_planner *planner, uint64_t i) {
    return i == planner->head ? ceil(ring_at(planner, i)->length
                                     / steps_at(planner, i)->longest)
                              : steps_at(planner, i)->knots;
}
#endif
