/* The accepted plan, and the laws of it that were handed out. */
#ifndef JERK_PLAN_H
#define JERK_PLAN_H
#include <stdbool.h>
#include "jerk/state/api.h"

/* An accepted plan: from `next` on it is the stored tail, and it ends at rest.
 */
typedef struct plan {
    double *lengths, *x, *accel; /* x, u at the n + 1 knots */
    double *input[2];            /* at the ends of segments */
    double *time, *jerk, *snap, *crackle,
        *pop; /* s, mm/s3 to mm/s6 of the law; time 0: not known yet */
    double *offset;
    uint64_t *tag;
    uint8_t *last;   /* as jerk_law.last */
    int count, next; /* next: first segment not handed out */
    int since;       /* handed out since it was planned */
    bool final;      /* converged: it need not be planned again */
    bool from_standstill,
        stands;   /* starts at rest; ends where the axes must stand */
    uint64_t end; /* ring index of the first interval that it does not finish */
    double remaining; /* mm from `next` to the end */
    double
        lasts; /* mm: with more than that left it need not be planned again */
    double
        refresh; /* share of it after which it is planned again all the same */
    uint64_t edition; /* of the plan: see jerk_edition */
} plan;

/* Its arrays of numbers. */
#define PLAN_ARRAYS(plan)                                                      \
    {&(plan)->lengths,                                                         \
     &(plan)->x,                                                               \
     &(plan)->accel,                                                           \
     &(plan)->time,                                                            \
     &(plan)->input[0],                                                        \
     &(plan)->input[1],                                                        \
     &(plan)->jerk,                                                            \
     &(plan)->snap,                                                            \
     &(plan)->crackle,                                                         \
     &(plan)->pop,                                                             \
     &(plan)->offset}

enum keeping {
    KEEP_NONE,
    KEEP_WANTED, /* the present plan, once another takes its place */
    KEEP_DONE
};

/* A law that was handed out, and the state ahead of it. */
typedef struct handed {
    jerk_interval interval; /* at the head of the ring */
    uint64_t head, tag;
    double x, accel, input[2], length, time, jerk, snap, crackle, pop, offset;
    double at_x, at_u, behind_mm, behind_share, driven;
    bool at_standstill, from_standstill;
    uint8_t last;
} handed;
#endif
