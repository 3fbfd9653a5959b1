/* The present plan, driven more slowly: an answer to a lower override that
 * needs no solver.
 *
 * Let p be the squared speed of the plan, and let share p be the squared speed
 * of another motion over the same path.  With a constant share below 1 every
 * axis has less speed, acceleration and jerk than in the plan.  So this is
 * legal, and only the way from share 1 down to the share wanted is looked for.
 *
 * From knot to knot the share falls as fast as the limits let it, as long as
 * it can stay constant from some knot on: that is tried with all of the
 * limits.  Where it could not, the way that was tried last is followed.  So
 * there is always a way on.  The checker has the last word.
 */
#include <math.h>
#include "jerk/path/grid.h"
#include "jerk/state/state.h"
#include "jerk/window/slower.h"
#include "jerk/window/window.h"

typedef struct pace { /* of a motion at a knot, scaled */
    double x, accel;
} pace;

/* A fall of the share along the plan. */
typedef struct course {
    jerk_planner *planner;
    const struct grid *grid;
    struct states plan; /* at the knots */
    double *least; /* at the knots: share that keeps to what is asked for from
                      there on */
} course;

/* Interval k from a state: `base` is c of the plan times the share. */
typedef struct step {
    int k;
    pace from, plan[2];
    double length, base[2], bow;
} step;

/* A way to a constant share: so much more than `base`, interval by interval. */
typedef struct landing {
    double more[SLOWER_STEPS];
    int count, next;
} landing;

typedef struct span {
    double low, high;
} span;

static step step_from(const course *course, int k, pace from) {
    double length = course->grid->seg[k].length;
    step out = {.k = k, .from = from, .length = length};
    for (int end = 0; end < 2; end++) {
        out.plan[end].x = course->plan.x[k + end];
        out.plan[end].accel = course->plan.accel[k + end];
    }
    const pace *plan = out.plan;
    double share = from.x / plan[0].x;
    inputs_between(length,
                   plan[0].x,
                   plan[0].accel,
                   plan[1].x,
                   plan[1].accel,
                   out.base);
    out.base[0] *= share;
    out.base[1] *= share;
    out.bow = share * course->grid->seg[k].bow;
    return out;
}

static pace end_of(const step *step, double more) {
    pace from = step->from;
    double length = step->length;
    double c0 = step->base[0] + more;
    double c1 = step->base[1] + more;
    pace end;
    end.x = x_after(length, from.x, from.accel, c0, c1);
    end.accel = accel_after(length, from.accel, c0, c1);
    return end;
}

/* With so much more the share does not change at the end. */
static double levels_with(const step *step) {
    double slope = step->plan[1].accel / step->plan[1].x;
    pace end = end_of(step, 0.0);
    double falls = end.accel - end.x * slope;
    return -falls / (step->length * (1.0 - step->length * slope));
}

/* Values d that keep |form + slope d| <= most. */
static void keep(span *span, double form, double slope, double most) {
    if (fabs(slope) < SLOWER_NO_SLOPE) {
        return;
    }
    double one = (most - form) / slope;
    double other = (-most - form) / slope;
    span->low = fmax(span->low, fmin(one, other));
    span->high = fmin(span->high, fmax(one, other));
}

/* Derivatives of an axis by the path at one place. */
typedef struct bend {
    double d1, d2, d3;
} bend;

static bend bend_at(const jerk_interval *part, int end, int axis) {
    bend out;
    out.d1 = part->d1[end][axis];
    out.d2 = part->d2[end][axis];
    out.d3 = part->d3[end][axis];
    return out;
}

/* Axis jerk over the speed, and axis acceleration. */
static double jerk_form(bend axis, pace at, double input) {
    return axis.d3 * at.x + 3.0 * axis.d2 * at.accel + axis.d1 * input;
}
static double acc_form(bend axis, pace at) {
    return axis.d2 * at.x + axis.d1 * at.accel;
}

/* What axis i leaves of it: its jerk at both ends, its acceleration at the end
 * and in the middle. */
static void keep_axis(const course *course,
                      const step *step,
                      int i,
                      span *span) {
    const jerk_planner *planner = course->planner;
    const struct segment *segment = &course->grid->seg[step->k];
    const jerk_interval *part = segment->interval;
    double length = step->length;
    double f2 = planner->scale * planner->scale;
    double f3 = f2 * planner->scale;
    double acc = ACC_USABLE * segment->acc[i] * acc_max(planner, part, i) / f2;
    double jerk =
        JERK_USABLE * segment->share * jerk_max(planner, part, i) / f3;
    bend first = bend_at(part, 0, i);
    bend last = bend_at(part, 1, i);
    bend half = {0.5 * (first.d1 + last.d1), 0.0, 0.0};
    half.d2 = 0.5 * (first.d2 + last.d2);
    pace from = step->from;
    pace end = end_of(step, 0.0);
    pace middle = {0.5 * (from.x + end.x), 0.0};
    middle.accel = from.accel + 0.5 * length * step->base[0];
    pace by = {length * length, length}; /* of the end, by c */
    double slowest = fmax(0.5 * from.x, fmin(end.x, from.x));
    double starts = jerk_form(first, from, step->base[0] - step->bow);
    double ends = jerk_form(last, end, step->base[1] - step->bow);
    keep(span, starts, first.d1, jerk / sqrt(from.x));
    keep(span, ends, jerk_form(last, by, 1.0), jerk / sqrt(slowest));
    keep(span, acc_form(last, end), acc_form(last, by), acc);
    keep(span, acc_form(half, middle), 0.5 * half.d1 * length, acc);
}

static span room_of(const course *course, const step *step) {
    span span = {-1e30, 1e30};
    for (int i = 0; i < course->planner->axes; i++) {
        keep_axis(course, step, i, &span);
    }
    return span;
}

/* The share stops to change as soon as it can; `*ends`: at this value. */
static bool lands(const course *course,
                  int k,
                  pace from,
                  landing *way,
                  double *ends) {
    int last = course->grid->count - 2;
    way->next = 0;
    for (way->count = 0; k < last && way->count < SLOWER_STEPS; k++) {
        step step = step_from(course, k, from);
        span room = room_of(course, &step);
        double levels = levels_with(&step);
        double more = fmin(levels, room.high);
        if (more < room.low) {
            return false;
        }
        way->more[way->count++] = more;
        from = end_of(&step, more);
        if (!(from.x > 0.0)) {
            return false;
        }
        if (levels <= room.high) {
            *ends = from.x / step.plan[1].x;
            return true;
        }
    }
    return false;
}

/* As much more as falls deepest and still lands; the way on follows. */
static double deepest(const course *course, const step *step, landing *way) {
    double known = way->next < way->count ? way->more[way->next] : 0.0;
    double more = room_of(course, step).low;
    for (int i = 0; i < SLOWER_HALVINGS && more < known; i++) {
        landing other;
        double ends;
        pace to = end_of(step, more);
        if (to.x > LEAST_KEPT * step->from.x
            && lands(course, step->k + 1, to, &other, &ends)
            && ends
                   >= SLOWER_CLOSE * course->least[step->k + 1 + other.count]) {
            *way = other;
            return more;
        }
        more = 0.5 * (more + known);
    }
    way->next += way->next < way->count;
    return known;
}

/* From here on the share stays as it is. */
static bool has_landed(const course *course,
                       const step *step,
                       const landing *way) {
    bool levels = way->next >= way->count && step->k > 0;
    double low = course->least[step->k] * step->plan[0].x;
    bool ends = step->k >= course->grid->count - 2;
    return levels && (ends || step->from.x <= low);
}

/* The whole fall, into the problem's states and inputs. */
static bool fall(const course *course, struct problem *problem) {
    pace at = {course->planner->x, course->planner->accel};
    landing way = {.count = 0};
    bool landed = false;
    for (int k = 0; k < course->grid->count; k++) {
        step step = step_from(course, k, at);
        landed = landed || has_landed(course, &step, &way);
        if (!landed && k >= course->grid->count - 2) {
            return false;
        }
        double more = landed ? 0.0 : deepest(course, &step, &way);
        problem->input[0][k] = step.base[0] + more;
        problem->input[1][k] = step.base[1] + more;
        problem->bow[k] = step.bow;
        double share = at.x / step.plan[0].x;
        pace end = step.plan[1];
        pace same = {share * end.x, share * end.accel};
        at = landed ? same : end_of(&step, more);
    }
    return true;
}

/* The largest constant shares that keep to what is asked for. */
static void set_least(const course *course) {
    const struct grid *grid = course->grid;
    double share = 1.0;
    for (int k = grid->count; k > 0; k--) {
        const struct segment *behind = &grid->seg[k < grid->count ? k : k - 1];
        double asked = fmin(grid->seg[k - 1].asked, behind->asked);
        double most = SLOWER_UNDER * asked / fmax(TINY, course->plan.x[k]);
        share = asked > 0.0 ? fmin(share, most) : share; /* 0: a stop */
        course->least[k] = share;
    }
    course->least[0] = share;
}

/* Where the checker has found too much, less of the limits is used. */
static void use_less(struct grid *grid) {
    for (int k = 0; k < grid->count; k++) {
        struct segment *segment = &grid->seg[k];
        double leave = fmin(1.0, 1.0 - segment->leave);
        double less =
            segment->excess > 0.0 ? SLOWER_AIM / segment->excess : 1.0;
        segment->share = fmin(segment->share * less, fmax(TIGHTEST, leave));
        for (int i = 0; i < JERK_AXES; i++) {
            segment->acc[i] *= less;
        }
        segment->leave = 0.0;
    }
}

static void set_problem(jerk_planner *planner) {
    struct problem *problem = &planner->prob;
    problem->count = planner->grid.count;
    problem->first = 0;
    problem->from_standstill = false;
    problem->solved = false;
    problem->x0 = planner->x;
    problem->u0 = planner->accel;
}

/* A legal fall stands in the problem. */
static bool find_fall(course *course) {
    jerk_planner *planner = course->planner;
    struct grid *grid = &planner->grid;
    set_problem(planner);
    for (int i = 0; i < SLOWER_TRIES && fall(course, &planner->prob); i++) {
        planner->stats.spent += work_of(planner, BESIDE_ITERATIONS / 2);
        if (check_plan(planner, grid) <= CHECK_SLACK) {
            return true;
        }
        use_less(grid);
    }
    return false;
}

/* Along the present plan; false: it does not move, or does not fit. */
static bool along_plan(jerk_planner *planner, course *course) {
    struct problem *problem = &planner->prob;
    *course = (struct course){.planner = planner, .grid = &planner->grid};
    course->plan = (struct states){problem->guess, problem->dx};
    course->least = problem->du;
    if (planner->at_standstill
        || !grid_of_plan(planner, &planner->grid, &course->plan)) {
        return false;
    }
    set_least(course);
    allow_tail(planner, &planner->grid, INFINITY);
    return true;
}

/* A share below 1 is wanted, and a legal fall to it is there. */
static bool take_fall(course *course) {
    return course->least[0] < 1.0 && find_fall(course)
           && plan_accept(course->planner, &course->planner->grid, false);
}

bool slow_down(jerk_planner *planner) {
    course course;
    return along_plan(planner, &course)
           && (course.least[0] >= 1.0 || take_fall(&course));
}

bool slow_to(jerk_planner *planner, double share) {
    course course;
    if (!along_plan(planner, &course)) {
        return false;
    }
    for (int k = 0; k <= planner->grid.count; k++) {
        course.least[k] = fmin(course.least[k], share);
    }
    return take_fall(&course);
}
