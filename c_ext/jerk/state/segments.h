/* The planner's grid over the path: its intervals, their caps, and how long
 * they may be. */
#ifndef JERK_SEGMENTS_H
#define JERK_SEGMENTS_H
#include <stdbool.h>
#include "jerk/state/api.h"

/* One interval of the planner's grid: a part of a pushed interval. */
typedef struct segment {
    const jerk_interval *interval; /* derivatives over this part */
    double length;
    double cap;  /* hard cap on x (scaled), both ends */
    double soft; /* cap by feed and override; may lie below the present speed */
    double asked;  /* the same, where a faster plan is not allowed to go on */
    double slower; /* share of that which is planned with, and which `soft` is
                      lowered by */
    uint64_t at;   /* ring index of the pushed interval */
    double bulge;  /* jerk inside over that at the ends, at the last check */
    double *tight; /* share of the jerk limit, lowered where a check failed: the
                      ring interval's; on a line its own */
    double own;    /* on a line */
    double *acc_tight;   /* the same of the acceleration limits: the ring
                            interval's */
    double before;       /* *tight when the grid was made */
    double bow;          /* of the input (problem.h), scaled */
    double excess, fast; /* ratios of the last check (limits; feed) where they
                            were too large, else 0 */
    double heavy;        /* the same of the acceleration limits alone */
    double lowered; /* `excess` of the check before, for which the limit was
                       lowered, else 0 */
    double leave;   /* of the jerk limit, that the last check has asked it to
                       leave to kinks; else 0 */
    double jump;    /* share of the jerk limit that jumps of derivatives nearby
                       leave */
    double share;   /* share that is planned with: jump * tight */
    double acc[JERK_AXES]; /* shares of the acceleration limits that joints
                              nearby leave (joints.c) */
    double jerk_up,
        jerk_down; /* path jerk (scaled) allowed when it starts, ends at rest */
    bool last;     /* the pushed interval ends with it */
} segment;

typedef struct grid {
    struct segment *seg;  /* n */
    jerk_interval *parts; /* storage of subdivided intervals */
    double *knot_cap;     /* n + 1: hard caps including jumps of derivatives */
    double *from_start;   /* n + 1: distance from the start, mm */
    double *top;          /* n + 1: x with which it is passed at the most */
    double *step;         /* grid step at the knots of the pushed intervals */
    double *grade;        /* growth of the steps over each pushed interval */
    double *reach;        /* squared speed at their knots at the most, mm2/s2 */
    double finest; /* no step at a standstill is longer: the window has to have
                      some */
    double finer; /* share of the steps that is taken: short stops have few, and
                     rows hold the jerk at the faster end of each */
    double lowest; /* x: steps are for feeds that are no lower */
    bool cut;      /* a window that ends ahead of what it might reach */
    bool sinks;  /* where more than `asked` is allowed the speed should fall */
    double ramp; /* mm: over so much of it */
    double usable; /* share of the jerk limits that is planned with */
    bool stops;    /* a stop, or the fall ahead of one */
    int count, used, max;
    bool from_standstill,
        stands; /* starts at rest; ends at a stand or at the end of the path */
} grid;

/* What the limits along an interval ask of the grid, mm. */
typedef struct steps {
    double longest, finest;  /* planner interval; step at a standstill */
    double least;            /* none need be shorter where nothing changes */
    double line_standstill;  /* from or to rest: over so much of a line the jerk
                     is constant in any case */
    double curve_standstill; /* over so much of a curve the axes follow a
                         constant path jerk */
    double turn, shortest;   /* longest by what it turns, or by what a plan has
                                shown; the shortest that this may come to */
    double kept;             /* `turn` with which a plan was found */
    double bend, even; /* largest third derivative over the jerk limit, s3/mm3;
                          mm over which they change by so much */
    bool peaks;        /* inside it is larger than at the ends */
    bool little;       /* it turns next to not at all */
    double top[2]; /* squared speed that the bend at its ends allows, mm2/s2 */
    double along;  /* largest acceleration along the path, mm/s2 */
    double knots;  /* such intervals, of the whole interval as pushed */
    double knots_before; /* knots and blocks of all that was pushed ahead */
    int64_t blocks_before;
} steps;
#endif
