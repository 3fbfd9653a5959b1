/* Joints of the path where its direction jumps, several of them in a cycle:
 * what they add up to in the samples' accelerations.
 *
 * A jump dv of an axis' velocity at a time t adds dv/dt * w to the acceleration
 * measured around a sample, w the triangle of half-width one cycle. Alone it
 * stays below what needs no room (grid.c); those of a curve that is driven as
 * many short lines add up to the curve's own acceleration, and only what they
 * leave is there for everything else. Those that turn to and fro do not.  They
 * add up in the jerk, which is the difference of that half a cycle behind and
 * half a cycle ahead.
 */
#include <math.h>
#include "jerk/path/joints.h"
#include "jerk/path/plan_law.h"
#include "jerk/state/state.h"
#include "maths/order.h"

/* The direction behind a joint less that ahead of it; false: it goes straight
 * on. */
static bool turn_between(const jerk_planner *planner,
                         const jerk_interval *left,
                         const jerk_interval *right,
                         double *turn) {
    double most = 0.0;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        turn[axis] = turn_of(left, right, axis);
        most = greater(most, fabs(turn[axis]));
    }
    return most > NO_TURN;
}

void turn_passed(jerk_planner *planner,
                 const jerk_interval *left,
                 const jerk_interval *right) {
    struct turned *turned =
        &planner->turned[planner->turned_count % TURNED_MAX];
    if (!turn_between(planner, left, right, turned->by)) {
        return;
    }
    turned->at = planner->driven;
    turned->v = speed_at_head(planner);
    planner->turned_count++;
}

/* Laws were taken back to where so much was driven: what lies ahead again has
 * not been passed. */
void turns_back(jerk_planner *planner, double driven) {
    planner->driven = driven;
    while (planner->turned_count > 0
           && planner->turned[(planner->turned_count - 1) % TURNED_MAX].at
                  > driven) {
        planner->turned_count--;
    }
}

/* Speed (scaled, squared) that is asked for at knot k at the most, now or when
 * the present plan was made: it changes with the override only above 1. */
static double asked_speed2(const jerk_planner *planner,
                           const struct grid *grid,
                           int k) {
    const struct speeds *was = &planner->was;
    double feed = greater(planner->feed_factor, was->feed);
    double rapid = greater(planner->rapid_factor, was->rapid);
    const struct speeds usual = {planner->command_speed,
                                 greater(1.0, feed),
                                 greater(1.0, rapid)};
    double x = grid->knot_cap[k];
    if (planner->command_speed >= 0.0 || was->command >= 0.0) {
        return x;
    }
    int first = k > 0 ? k - 1 : k;
    for (int i = first; i <= k && i < grid->count; i++) {
        double v = asked_under(&usual, grid->seg[i].interval) / planner->scale;
        if (v * v < x) {
            x = v * v;
        }
    }
    return x;
}

/* How much x can change over a segment. */
static double rise_over(const jerk_planner *planner,
                        const struct segment *segment) {
    double acc = 1e30;
    for (int axis = 0; axis < planner->axes; axis++) {
        acc = lesser(acc,
                     acc_max(planner, segment->interval, axis)
                         / greater(1e-9,
                                   larger(segment->interval->d1[0][axis],
                                          segment->interval->d1[1][axis])));
    }
    return 2.0 * segment->length * acc / (planner->scale * planner->scale);
}

/* On the way down what the stored tail drives stays possible. */
static void allow_tail_on_top(const jerk_planner *planner, struct grid *grid) {
    struct tail_walk walk = {.next = planner->plan.next};
    double *x = grid->top;
    for (int k = 0; k < grid->count && walk.next < planner->plan.count; k++) {
        double most = tail_most(planner, &walk, grid->from_start[k + 1]);
        x[k] = greater(x[k], lesser(most, grid->knot_cap[k]));
        x[k + 1] = greater(x[k + 1], lesser(most, grid->knot_cap[k + 1]));
    }
}

void top_speeds(const jerk_planner *planner, struct grid *grid) {
    double *x = grid->top;
    for (int k = 0; k <= grid->count; k++) {
        x[k] = asked_speed2(planner, grid, k);
    }
    allow_tail_on_top(planner, grid);
    x[0] = planner->at_standstill ? 0.0 : planner->x;
    for (int k = 1; k <= grid->count; k++) {
        double rise = rise_over(planner, &grid->seg[k - 1]);
        x[k] = lesser(x[k], x[k - 1] + rise);
    }
    for (int k = grid->count - 1; k > 0; k--) {
        double rise = rise_over(planner, &grid->seg[k]);
        x[k] = lesser(x[k], x[k + 1] + rise);
    }
}

/* Changes of the axes' velocities that show at a knot, and how these changes
 * differ from those a cycle earlier, half a cycle ahead of the knot and behind
 * it. */
typedef struct shown {
    double there[JERK_AXES], ahead[JERK_AXES], behind[JERK_AXES];
    int count;  /* joints within a cycle */
    int beside; /* and those further away that make the differences */
} shown;

/* Of a jump so many cycles away, what shows. */
static double triangle(double cycles) {
    return greater(0.0, 1.0 - fabs(cycles));
}

/* What a turn passed at v1, `distance` mm behind a knot that is passed at v,
 * adds to what shows there. */
static void add_turn(const jerk_planner *planner,
                     const double *turn,
                     double distance,
                     double v,
                     double v1,
                     struct shown *sum) {
    double per_mm = 2.0 / ((v + v1) * planner->cfg.cycle_s);
    double cycles = distance != 0.0 ? distance * per_mm : 0.0;
    double there = v1 * triangle(cycles);
    double ahead = there - v1 * triangle(cycles + 1.0);
    double behind = v1 * triangle(cycles - 1.0) - there;
    sum->count += fabs(cycles) < 1.0;
    sum->beside += fabs(cycles) < 2.0;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        sum->there[axis] += there * turn[axis];
        sum->ahead[axis] += ahead * turn[axis];
        sum->behind[axis] += behind * turn[axis];
    }
}

/* What shows at knot k, passed at v. */
static struct shown turns_around(const jerk_planner *planner,
                                 const struct grid *grid,
                                 int k,
                                 double v) {
    struct shown sum = {.count = 0};
    double turn[JERK_AXES];
    double at = grid->from_start[k];
    double way = 2.0 * v * planner->cfg.cycle_s;
    for (int side = -1; side <= 1; side += 2) {
        for (int i = side < 0 ? k : k + 1;
             i > 0 && i < grid->count && fabs(grid->from_start[i] - at) < way;
             i += side) {
            if (grid->seg[i - 1].last
                && turn_between(planner,
                                grid->seg[i - 1].interval,
                                grid->seg[i].interval,
                                turn)) {
                add_turn(planner,
                         turn,
                         grid->from_start[i] - at,
                         v,
                         planner->scale * sqrt(grid->top[i]),
                         &sum);
            }
        }
    }
    for (uint64_t i = planner->turned_count;
         i-- > 0 && i + TURNED_MAX >= planner->turned_count;) {
        const struct turned *turned = &planner->turned[i % TURNED_MAX];
        if (planner->driven - turned->at + at >= way) {
            break;
        }
        add_turn(planner,
                 turned->by,
                 turned->at - planner->driven - at,
                 v,
                 turned->v,
                 &sum);
    }
    return sum;
}

/* Share of each axis' acceleration limit that the joints around knot k use; the
 * largest. `jerk`: of the jerk limits, the largest. */
static double used_at(const jerk_planner *planner,
                      const struct grid *grid,
                      int k,
                      double v,
                      double *used,
                      double *jerk) {
    const struct shown sum = turns_around(planner, grid, k, v);
    const jerk_interval *left = grid->seg[k > 0 ? k - 1 : 0].interval;
    const jerk_interval *right = grid->seg[k].interval;
    double dt = planner->cfg.cycle_s;
    double most = 0.0;
    *jerk = 0.0;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        double acc = least_acc(planner, left, right, axis);
        used[axis] = fabs(sum.there[axis]) / (dt * acc);
        most = greater(most, used[axis]);
        *jerk =
            greater(*jerk,
                    larger(sum.ahead[axis], sum.behind[axis])
                        / (dt * dt * least_jerk(planner, left, right, axis)));
    }
    if (sum.beside < 2) {
        *jerk = 0.0; /* a single one has its cap (caps.c) ... */
    }
    return sum.count < 2 ? 0.0 : most; /* ... and needs no room */
}

static void leave(const jerk_planner *planner,
                  struct segment *segment,
                  const double *used) {
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        segment->acc[axis] = lesser(
            segment->acc[axis],
            greater(LEAST_SHARE, 1.0 - greater(0.0, used[axis] - JOINTS_FREE)));
    }
}

/* Intervals so near to knot k: the first one, and the one behind the last. */
static int around(const struct grid *grid, int k, double way, int *first) {
    const double *from = grid->from_start;
    double at = from[k];
    int end = k;
    *first = k;
    while (*first > 0 && at - from[*first] < way) {
        --*first;
    }
    while (end < grid->count && from[end] - at < way) {
        end++;
    }
    return end;
}

/* Intervals so near to knot k are planned with such a share of the jerk. */
static void leave_jerk(struct grid *grid, int k, double way, double share) {
    int i;
    int end = around(grid, k, way, &i);
    for (; i < end; i++) {
        grid->seg[i].jump = lesser(grid->seg[i].jump, share);
    }
}

/* What the motion around the joint at knot k, or around the head (k 0), is left
 * with. */
static void turn_cap(const jerk_planner *planner, struct grid *grid, int k) {
    double used[JERK_AXES];
    double v = planner->scale * sqrt(grid->top[k]);
    double way = v * planner->cfg.cycle_s;
    double jerk;
    double most = used_at(planner, grid, k, v, used, &jerk);
    if (jerk > JOINTS_MOST && k > 0) {
        double by = JOINTS_MOST / jerk;
        grid->knot_cap[k] = lesser(grid->knot_cap[k], grid->top[k] * by * by);
    }
    if (jerk > JUMP_SHARE) {
        leave_jerk(grid, k, 1.5 * way, 1.0 - lesser(jerk, JOINTS_MOST));
    }
    if (most <= JOINTS_FREE) {
        return;
    }
    if (most > JOINTS_MOST && k > 0) {
        grid->knot_cap[k] =
            lesser(grid->knot_cap[k], grid->top[k] * JOINTS_MOST / most);
    }
    int i;
    int end = around(grid, k, way, &i);
    for (; i < end; i++) {
        leave(planner, &grid->seg[i], used);
    }
}

/* Whether the direction jumps at knot k. */
static bool is_joint(const jerk_planner *planner,
                     const struct grid *grid,
                     int k) {
    double turn[JERK_AXES];
    return grid->seg[k - 1].last
           && turn_between(planner,
                           grid->seg[k - 1].interval,
                           grid->seg[k].interval,
                           turn);
}

int first_joint(const jerk_planner *planner, const struct grid *grid) {
    for (int k = 1; k < grid->count; k++) {
        if (is_joint(planner, grid, k)) {
            return k;
        }
    }
    return 0;
}

void turn_caps(const jerk_planner *planner, struct grid *grid, int first) {
    if (first == 0 && planner->turned_count == 0) {
        return;
    }
    turn_cap(planner, grid, 0);
    for (int k = first; k > 0 && k < grid->count; k++) {
        if (is_joint(planner, grid, k)) {
            turn_cap(planner, grid, k);
        }
    }
}
