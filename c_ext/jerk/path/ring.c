/* The path as it was pushed: a ring of intervals, its entry checks, and the
 * part of an interval. */
#include <math.h>
#include "jerk/path/ring.h"
#include "jerk/path/step_size.h"
#include "jerk/state/state.h"

/* Of the path's own. */
static bool has_limits(const jerk_interval *interval) {
    return interval->path_acc > 0.0f || interval->path_jerk > 0.0f;
}

static bool finite_interval(const jerk_interval *interval, int axes) {
    for (int end = 0; end < 2; end++) {
        for (int axis = 0; axis < axes; axis++) {
            if (!isfinite(interval->d1[end][axis])
                || !isfinite(interval->d2[end][axis])
                || !isfinite(interval->d3[end][axis])) {
                return false;
            }
        }
    }
    return isfinite(interval->length) && isfinite(interval->feed)
           && isfinite(interval->v_hard) && isfinite(interval->offset);
}

/* What was consumed last stays in the ring: it may be taken back. */
int64_t jerk_room(const jerk_planner *planner) {
    return (int64_t)(planner->mask + 1 - (planner->tail - planner->head))
           - HANDED_MAX;
}

/* What was pushed up to the end of ring interval i. */
static void count_to(const jerk_planner *planner,
                     uint64_t i,
                     double *knots,
                     int64_t *blocks) {
    const struct steps *steps = steps_at(planner, i);
    *knots = steps->knots_before + steps->knots;
    *blocks = steps->blocks_before + ring_at(planner, i)->blocks;
}

bool ring_reaches(const jerk_planner *planner) {
    double knots;
    int64_t blocks;
    if (planner->head == planner->tail) {
        return false;
    }
    const struct steps *first = steps_at(planner, planner->head);
    count_to(planner, planner->tail - 1, &knots, &blocks);
    knots += knots_at(planner, planner->head) - first->knots;
    return planner->stand_end > planner->head
           || knots - first->knots_before >= planner->cfg.window_knots
           || blocks - first->blocks_before >= planner->cfg.window_blocks;
}

void ring_find_stand(jerk_planner *planner) {
    uint64_t end = planner->tail;
    while (end > planner->head
           && !(ring_at(planner, end - 1)->flags & JERK_STAND)) {
        end--;
    }
    planner->stand_end = end > planner->head ? end : 0;
}

/* A limit of the path is one of an axis that moves as the path does. Where
 * there is none that axis does not move. */
static void set_path_axis(jerk_planner *planner, jerk_interval *interval) {
    int path = planner->cfg.axes;
    float acc = interval->path_acc / (float)planner->cfg.a_max[path];
    float jerk = interval->path_jerk / (float)planner->cfg.j_max[path];
    interval->acc_share[path] = acc > 0.0f ? acc : 1.0f;
    interval->jerk_share[path] = jerk > 0.0f ? jerk : 1.0f;
    interval->miss[path] = 0.0f;
    if (has_limits(interval)) {
        planner->axes = path + 1;
        return;
    }
    for (int end = 0; end < 2; end++) {
        interval->d1[end][path] = 0.0;
        interval->d2[end][path] = 0.0;
        interval->d3[end][path] = 0.0;
    }
}

int64_t jerk_push(jerk_planner *planner,
                  const jerk_interval *intervals,
                  int64_t count) {
    for (int64_t i = 0; i < count; i++) {
        const jerk_interval *interval = &intervals[i];
        if (jerk_room(planner) <= 0) {
            return i;
        }
        int64_t error =
            !finite_interval(interval, planner->cfg.axes + has_limits(interval))
                ? JERK_NOT_FINITE
            : !(interval->length > 1e-9) ? JERK_BAD_LENGTH
                                         : 0;
        if (error) {
            return i > 0 ? i : error;
        }
        struct steps *steps = &planner->steps[planner->tail & planner->mask];
        jerk_interval *pushed = &planner->ring[planner->tail & planner->mask];
        *pushed = *interval;
        set_path_axis(planner, pushed);
        planner->tight[planner->tail & planner->mask] = 1.0;
        planner->acc_tight[planner->tail & planner->mask] = 1.0;
        *steps = interval_steps(planner, pushed);
        if (planner->tail > 0) {
            count_to(planner,
                     planner->tail - 1,
                     &steps->knots_before,
                     &steps->blocks_before);
        }
        planner->tail++;
        if (interval->flags & JERK_STAND) {
            planner->stand_end = planner->tail;
        }
        planner->finished = false;
    }
    return count;
}

void jerk_finish(jerk_planner *planner, int finished) {
    planner->finished = finished != 0;
}

/* q', q'', q''' inside an interval: the polynomial of degree 5 for q' that
 * meets all three at both ends. */
static void inside(const jerk_interval *in,
                   double t,
                   int axis,
                   double *d1,
                   double *d2,
                   double *d3) {
    double length = in->length;
    double first = in->d1[0][axis];
    double slope = length * in->d2[0][axis];
    double bend = 0.5 * length * length * in->d3[0][axis];
    double first_left = in->d1[1][axis] - first - slope - bend;
    double slope_left = length * in->d2[1][axis] - slope - 2.0 * bend;
    double bend_left = 0.5 * (length * length * in->d3[1][axis] - 2.0 * bend);
    double c3 = 10.0 * first_left - 4.0 * slope_left + bend_left;
    double c4 = -15.0 * first_left + 7.0 * slope_left - 2.0 * bend_left;
    double c5 = 6.0 * first_left - 3.0 * slope_left + bend_left;
    double third = c3 + t * (c4 + t * c5);
    *d1 = first + t * (slope + t * (bend + t * third));
    *d2 = (slope
           + t * (2.0 * bend + t * (3.0 * c3 + t * (4.0 * c4 + t * 5.0 * c5))))
          / length;
    *d3 = (2.0 * bend + t * (6.0 * c3 + t * (12.0 * c4 + t * 20.0 * c5)))
          / (length * length);
}

double jerk_third(const jerk_interval *interval, double t, int axis) {
    double d1, d2, d3;
    inside(interval, t, axis, &d1, &d2, &d3);
    return d3;
}

/* The part of an interval between two lengths of it. */
void interval_part(const jerk_interval *in,
                   double from,
                   double to,
                   int axes,
                   jerk_interval *out) {
    bool whole_start = from <= 0.0, whole_end = to >= in->length;
    jerk_interval part = *in;
    for (int axis = 0; axis < axes; axis++) {
        if (!whole_start) {
            inside(in,
                   from / in->length,
                   axis,
                   &part.d1[0][axis],
                   &part.d2[0][axis],
                   &part.d3[0][axis]);
        }
        if (!whole_end) {
            inside(in,
                   to / in->length,
                   axis,
                   &part.d1[1][axis],
                   &part.d2[1][axis],
                   &part.d3[1][axis]);
        }
    }
    part.length = to - from;
    part.offset = in->offset + from;
    if (!whole_end) {
        part.flags &= ~JERK_STAND;
        part.blocks = 0;
    }
    *out = part;
}

/* A length of the path was handed out. */
void ring_consume(jerk_planner *planner, double length, bool whole) {
    jerk_interval *interval = &planner->ring[planner->head & planner->mask];
    if (whole) {
        planner->head++;
        return;
    }
    interval_part(interval, length, interval->length, planner->axes, interval);
}
