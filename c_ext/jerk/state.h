/* Inside of the jerk-limited planner: path ring, planner grid, solver work,
 * plan.
 *
 * Scaled quantities: x = v^2/F^2, u = a/F^2, c = (du/ds)/F^2, with F the speed
 * scale of the machine; lengths stay mm. Over an interval h of the grid c
 * changes linearly from c0 to c1, which are free: the jerk limit can hold at
 * both ends.
 */
#ifndef JERK_INTERNAL_H
#define JERK_INTERNAL_H
#include <math.h>
#include <stdbool.h>
#include "jerk/planner.h"

#define LANES 4
typedef double vec __attribute__((vector_size(32)));
typedef long long ivec __attribute__((vector_size(32)));

#define HANDED_MAX 512 /* laws that can be taken back */
#define GRADED_EXTRA                                                           \
    96 /* room beyond window_knots for the finer grid near rests */
#define ACC_USABLE 0.998 /* share of the limits that is planned with */
#define JERK_USABLE 0.998
#define VEL_USABLE 1.0
#define CHECK_SLACK 1.012 /* the checker's bound, over the machine's limits */
#define SLOW_TIME                                                              \
    0.01 /* s: intervals need not be shorter than what is driven in it */
#define FEED_SLACK 1.0015 /* of speed over the feed */

/* One interval of the planner's grid: a part of a pushed interval. */
typedef struct segment {
    const jerk_interval *q; /* derivatives over this part */
    double h;
    double cap;  /* hard cap on x (scaled), both ends */
    double soft; /* cap by feed and override; may lie below the present speed */
    double slower; /* share of that which is planned with, and which `soft` is
                      lowered by */
    uint64_t at;   /* ring index of the pushed interval */
    double bulge;  /* jerk inside over that at the ends, at the last check */
    double *tight; /* share of the jerk limit, lowered where a check failed: the
                      ring interval's; on a line its own */
    double own;    /* on a line */
    double before; /* *tight when the grid was made */
    double excess, fast; /* ratios of the last check (limits; feed) where they
                            were too large, else 0 */
    double leave; /* of the jerk limit, that the last check has asked it to
                     leave to kinks; else 0 */
    double jump;  /* share of the jerk limit that jumps of derivatives nearby
                     leave */
    double share; /* share that is planned with: jump * tight */
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
    double finest; /* no step at a standstill is longer: the window has to have
                      some */
    double finer; /* share of the steps that is taken: short stops have few, and
                     rows hold the jerk at the faster end of each */
    double land_cap;           /* x of the feed there */
    double land_from, land_to; /* mm from the start: here a ramp down must not
                                  fall below the feed (empty: none) */
    int n, used, max;
    bool rest_start,
        stands; /* starts at rest; ends at a stand or at the end of the path */
} grid;

/* What the rows of LANES stages share.  At either end the jerk rows read root
 * (b z) + half x_t <= bound, with the tangent of root x^(-1/2) at the present
 * x_t. */
typedef struct block {
    vec h, x[2], u[2], c[2]; /* at the start and the end of the stages */
    vec root[2], half[2], bound[2];
} block;

typedef struct two_sided { /* |b z| <= 1 (accelerations), +-b z + m <= 1.5
                              (jerks); z: x, u, c at one end */
    vec b[3], s[2], l[2], is[2], r[2], ds[2], dl[2];
} two_sided;

typedef struct one_sided { /* b (x, u, c0, c1) <= bound */
    vec b[4], bound, s, l, is, r, ds, dl;
} one_sided;

/* Caps of x at the start and at the control points behind it and ahead of the
 * end: x keeps them everywhere between. */
enum {
    ROW_CAP,
    ROW_FLOOR,
    ROW_RISE,
    FIRST_C_ROW,
    ROW_FALL = FIRST_C_ROW,
    ROW_MID_FLOOR,
    ONE_SIDED_ROWS
};

/* Stage cost of the Newton step. */
typedef struct stage_cost {
    double *xx, *xu, *uu, *xc[2], *uc[2], *cc[3]; /* cc: c0 c0, c0 c1, c1 c1 */
} stage_cost;

typedef struct stage_grad {
    double *x, *u, *c[2];
} stage_grad;

/* Feedback of a stage: dc = k (dx, du) + what is free. */
typedef struct gain {
    double h, kx[2], ku[2];
    double xx, xu, ux, uu; /* of the state behind it, by the state */
    double inverse[3];     /* of the Hessian by dc, as cc */
} gain;

typedef struct problem {
    int n, first, blocks, axes,
        acc_sets; /* intervals; first stage with rows; blocks of LANES stages;
                     axes that move */
    int axis[JERK_AXES]; /* which they are */
    bool rest_start;
    double *h, *x, *u, *c[2]; /* stages */
    double *dx, *du, *dc[2];
    double *guess;       /* knots: x the floors refer to */
    double *weight;      /* objective: minus the gradient by x */
    double *root[2];     /* scale of the jerk rows at both ends */
    double *calm;        /* quadratic cost of c0 and c1 */
    double *on;          /* 1 where a stage has jerk rows */
    struct block *block; /* of the present iterate */
    two_sided *jerk, *acc,
        *mid; /* [block][rows]; mid: accelerations in the middle of stages */
    struct one_sided *one;
    struct stage_cost cost;
    struct stage_grad grad, corr,
        cent; /* affine gradient; corrector and centring parts */
    struct gain *gain;
    double *free[2];   /* c without feedback */
    double start_cost; /* by the end speed of an interval from rest */
    double x0, u0;
    double terminal; /* 1.5 h of the last interval */
    double convex;   /* what keeps a cost of c^2 positive: 1, less where c is
                        large (very slow machines) */
    int iterations;
    double pause;        /* the solver stops once at this gap; 0: it does not */
    bool paused;         /* it has, and goes on from there */
    double missed, dual; /* shares of the first residuals that are left */
    bool solved;
    double gap;
} problem;

/* An accepted plan: from `next` on it is the stored tail, and it ends at rest.
 */
typedef struct plan {
    double *h, *x, *u; /* x, u at the n + 1 knots */
    double *c[2];      /* at the ends of segments */
    double *time, *jerk, *snap, *crackle,
        *pop; /* s, mm/s3 to mm/s6 of the law; time 0: not known yet */
    double *offset;
    uint64_t *tag;
    uint8_t *last; /* as jerk_law.last */
    int n, next;   /* next: first segment not handed out */
    int since;     /* handed out since it was planned */
    bool final;    /* converged: it need not be planned again */
    bool rest_start,
        stands;   /* starts at rest; ends where the axes must stand */
    uint64_t end; /* ring index of the first interval that it does not finish */
    double length; /* mm from `next` to the end */
    double
        lasts; /* mm: with more than that left it need not be planned again */
    double
        refresh; /* share of it after which it is planned again all the same */
    uint64_t edition; /* of the plan: see jerk_edition */
} plan;

/* What the limits along an interval ask of the grid, mm. */
typedef struct steps {
    double longest, finest; /* planner interval; step at a standstill */
    double least;           /* none need be shorter where nothing changes */
    double rest; /* from or to rest: over so much of a line the jerk is constant
                    in any case */
    double bent_rest; /* over so much of a curve the axes follow a constant path
                         jerk */
    double turn, shortest; /* longest by what it turns, or by what a plan has
                              shown; the shortest that this may come to */
    double bend, even; /* largest third derivative over the jerk limit, s3/mm3;
                          mm over which they change by so much */
    bool little;       /* it turns next to not at all */
    double knots;      /* such intervals, of the whole interval as pushed */
} steps;

/* What operator and program ask for: mm/s in place of all feeds (< 0: none),
 * and the overrides. */
typedef struct speeds {
    double command, feed, rapid;
} speeds;

#define TURNED_MAX 64u

/* A joint that was passed: where (see `driven`), how fast in mm/s, and by how
 * much the direction has turned. */
typedef struct turned {
    double at, v, by[JERK_AXES];
} turned;

/* A law that was handed out, and the state ahead of it. */
typedef struct handed {
    jerk_interval interval; /* at the head of the ring */
    uint64_t head, tag;
    double x, u, c[2], length, time, jerk, snap, crackle, pop, offset;
    double at_x, at_u, behind_mm, behind_share, driven;
    bool at_rest, rest_start;
    uint8_t last;
} handed;

struct jerk_planner {
    jerk_config cfg;
    double scale; /* F */
    jerk_interval *ring;
    double *tight;       /* as `ring` */
    struct steps *steps; /* as `ring` */
    uint64_t head, tail,
        mask; /* intervals head..tail-1; the head one may be trimmed */
    bool finished, hold, changed, at_rest;
    const uint64_t
        *gone; /* no plan is accepted once bit 0 is set; NULL: always */
    double feed_factor, rapid_factor;
    double command_speed; /* mm/s; < 0: none */
    struct speeds was;    /* under which the present plan was made */
    int capacity;         /* segments a grid can hold */
    double behind_mm,
        behind_share; /* reach of a jump behind the head, and what it leaves */
    double driven;    /* mm handed out */
    struct turned turned[TURNED_MAX]; /* ring of the joints passed last */
    uint64_t turned_count;
    double x, u; /* scaled state at the head */
    struct grid grid;
    struct problem prob;
    plan plan;
    double *scratch; /* capacity + LANES */
    double
        reach; /* mm: windows this long are solved; longer ones have failed */
    int finer_tries; /* so often may solutions still ask for finer steps */
    bool finer;      /* the last one has */
    int wait;        /* segments to hand out before the next plan is tried */
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

/* What c0 and c1 make of the state at the start of an interval h. */
static inline double x_behind(double h,
                              double x,
                              double u,
                              double c0,
                              double c1) {
    return x + 2.0 * h * u + h * h * (2.0 * c0 + c1) / 3.0;
}
static inline double u_behind(double h, double u, double c0, double c1) {
    return u + 0.5 * h * (c0 + c1);
}

/* path.c */
void interval_part(const jerk_interval *in,
                   double from,
                   double to,
                   int axes,
                   jerk_interval *out);
void ring_consume(jerk_planner *planner, double length, bool whole);

/* step_size.c */
double reached_speed(double v, double a, double j);
struct steps interval_steps(const jerk_planner *planner,
                            const jerk_interval *interval);

/* grid.c */
void grid_window(jerk_planner *planner, struct grid *grid, double reach);
bool grid_to(jerk_planner *p, struct grid *g, double distance);
void segment_limits(const jerk_planner *planner, struct segment *segment);
void jump_passed(jerk_planner *planner,
                 const jerk_interval *left,
                 const jerk_interval *right);
void knot_caps(const jerk_planner *planner, struct grid *grid);
void turn_passed(jerk_planner *planner,
                 const jerk_interval *left,
                 const jerk_interval *right);
void turns_back(jerk_planner *planner, double driven);
void turn_caps(const jerk_planner *planner, struct grid *grid);

/* constraints.c */
void problem_from_grid(jerk_planner *planner,
                       const struct grid *grid,
                       double x0,
                       double u0);
void bound_rows(jerk_planner *planner, const struct grid *grid);
void tighten_rows(struct problem *problem, int k, double by);

/* initial_guess.c */
bool guess_window(jerk_planner *p,
                  const struct grid *g,
                  bool warm,
                  double shrink);
bool guess_bump(jerk_planner *p, const struct grid *g);
bool guess_from(jerk_planner *p, const struct grid *g, const double *x);
bool guess_stop(jerk_planner *p, const struct grid *g);
bool guess_stop_like(jerk_planner *p, const struct grid *g, double length);

/* riccati.c */
bool riccati_factor(struct problem *b);
void riccati_solve(struct problem *problem,
                   const struct stage_grad *stage_grad);

/* interior_point.c, interior_point_avx2.c */
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define JERK_AVX2
bool ipm_solve_avx2(problem *b, int max_iterations);
#endif
bool ipm_solve_base(struct problem *b, int max_iterations);
bool ipm_solve(struct problem *b, int max_iterations);

/* verify.c */
double plan_check(const jerk_planner *planner,
                  struct grid *grid,
                  struct problem *problem);
double bend_inside(const jerk_planner *planner,
                   const struct segment *segment,
                   double x,
                   double u,
                   const double c[2],
                   double *more);

/* replan.c */
bool plan_accept(jerk_planner *p, const struct grid *g, bool final);
bool plan_window(jerk_planner *p);
bool solve_guess(
    jerk_planner *p,
    struct grid *g,
    int tries,
    int iterations); /* from the guess that stands in the problem */
bool solve_window(jerk_planner *p, struct grid *g, bool warm, double shrink);
void allow_present(jerk_planner *planner,
                   struct grid *grid,
                   double reach,
                   double top);

/* straight_line.c */
bool plan_straight(jerk_planner *p);

/* take_back.c */
void remember_law(jerk_planner *planner,
                  int k,
                  const jerk_law *law,
                  bool whole);
void forget_laws(jerk_planner *planner);
void forget_plan(jerk_planner *planner);

/* planner.c */
double hand_out_again(jerk_planner *planner, double seconds);
void planner_copy(jerk_planner *to, const jerk_planner *from);

/* stop.c */
bool plan_stop(jerk_planner *p);
bool plan_ramp(jerk_planner *p);

/* motion_law.c */
double law_jerk(const jerk_law *law, double t);
void law_between(jerk_law *law,
                 double h,
                 double v0,
                 double a0,
                 double j0,
                 double v1,
                 double a1,
                 double j1);
void law_from(jerk_law *law,
              double h,
              double x,
              double u,
              double x1,
              double u1,
              const double c[2],
              double scale);
#endif
