/* Caps of speed on segments and at knots, and the shares of the limits that
 * jumps of derivatives leave around them. */
#include <math.h>
#include "jerk/path/caps.h"
#include "jerk/path/joints.h"
#include "jerk/path/ring.h"
#include "jerk/state/state.h"
#include "maths/order.h"

/* Largest path jerk (scaled) over the rest interval s: at distance d from the
 * standstill x ~ d^(4/3), and every axis jerk is jerk * |q' +- 9 d q'' + 4.5
 * d^2 q'''| (minus where the interval ends at rest). */
static double standstill_jerk(const jerk_planner *planner,
                              const struct segment *segment,
                              int at_end) {
    jerk_interval half;
    double most = 0.0;
    double length = segment->length;
    double sign = at_end ? -1.0 : 1.0;
    interval_part(segment->interval, 0.0, 0.5 * length, planner->axes, &half);
    for (int axis = 0; axis < planner->axes; axis++) {
        const jerk_interval *interval = segment->interval;
        int far = !at_end;
        double near = interval->d1[at_end][axis];
        double middle = 0.5 * length;
        double mid = half.d1[1][axis] + sign * 9.0 * middle * half.d2[1][axis]
                     + 4.5 * middle * middle * half.d3[1][axis];
        double end = interval->d1[far][axis]
                     + sign * 9.0 * length * interval->d2[far][axis]
                     + 4.5 * length * length * interval->d3[far][axis];
        double value = greater(fabs(near), larger(mid, end));
        most = greater(most,
                       value
                           / (segment->share * JERK_USABLE
                              * jerk_max(planner, interval, axis)));
    }
    return most > 0.0
               ? 1.0 / (most * planner->scale * planner->scale * planner->scale)
               : 1e30;
}

static double velocity_cap(const jerk_planner *planner,
                           const jerk_interval *interval) {
    double v = interval->v_hard > 0 ? interval->v_hard : 1e30;
    for (int axis = 0; axis < planner->axes; axis++) {
        double length = interval->length;
        double mid =
            0.5 * (interval->d1[0][axis] + interval->d1[1][axis])
            + 0.125 * length * (interval->d2[0][axis] - interval->d2[1][axis]);
        double most =
            greater(fabs(mid),
                    larger(interval->d1[0][axis], interval->d1[1][axis]));
        if (most * v > planner->cfg.v_max[axis]) {
            v = planner->cfg.v_max[axis] / most;
        }
    }
    v = lesser(v, 10.0 * planner->scale) / planner->scale;
    return v * v;
}

/* Where the path bends so little that no row bounds it, the tangent terms still
 * do; a cap keeps x bounded. */
void segment_limits(const jerk_planner *planner, struct segment *segment) {
    const jerk_interval *interval = segment->interval;
    double feed = lesser(1e15, asked_speed(planner, interval) / planner->scale);
    segment->length = interval->length;
    segment->jump = 1.0;
    segment->share = 1.0;
    for (int axis = 0; axis < planner->axes; axis++) {
        segment->acc[axis] = 1.0;
    }
    segment->excess = 0.0;
    segment->lowered = 0.0;
    segment->heavy = 0.0;
    segment->fast = 0.0;
    segment->leave = 0.0;
    segment->cap = velocity_cap(planner, interval);
    segment->soft = lesser(segment->cap, feed * feed);
    segment->asked = segment->soft;
    segment->slower = 1.0;
}

/* Share of the jerk limit that jumps of q' and q'' take when they are passed
 * with x. */
static double jump_used(const jerk_planner *planner,
                        const jerk_interval *left,
                        const jerk_interval *right,
                        double x) {
    double dt = planner->cfg.cycle_s;
    double scale = planner->scale;
    double used = 0.0;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        double bend =
            STEP_SEEN * scale * scale * fabs(bend_of(left, right, axis));
        double corner = scale / dt * fabs(turn_of(left, right, axis));
        used = greater(used,
                       (bend * x + corner * sqrt(x))
                           / (least_jerk(planner, left, right, axis) * dt));
    }
    return used;
}

/* Largest x <= cap at which the jumps take no more than their share. */
double jump_cap(const jerk_planner *planner,
                const jerk_interval *left,
                const jerk_interval *right,
                double cap) {
    double dt = planner->cfg.cycle_s;
    double scale = planner->scale;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        double room = JUMP_SHARE * least_jerk(planner, left, right, axis) * dt;
        double bend =
            STEP_SEEN * scale * scale * fabs(bend_of(left, right, axis));
        double corner = scale / dt * fabs(turn_of(left, right, axis));
        double v =
            2.0 * room
            / (corner + sqrt(corner * corner + 4.0 * bend * room) + 1e-300);
        double acc = JOINTS_FREE * least_acc(planner, left, right, axis);
        if (corner * v > acc) {
            v = acc / corner;
        }
        cap = lesser(cap, v * v); /* bend x + corner sqrt(x) <= room */
    }
    return cap;
}

/* A jump shows in samples up to one and a half cycles away; the speed may rise
 * from x as fast as the path allows, with as much acceleration there as the
 * jerk takes away before the speed is zero. */
static double jump_reach(const jerk_planner *planner,
                         const jerk_interval *left,
                         const jerk_interval *right,
                         double x) {
    double jerk = 1e30;
    double t = 1.5 * planner->cfg.cycle_s;
    for (int axis = 0; axis < planner->axes; axis++) {
        double behind = right->d1[0][axis];
        double along = larger(left->d1[1][axis], behind);
        jerk = lesser(jerk,
                      greater(jerk_max(planner, left, axis),
                              jerk_max(planner, right, axis))
                          / fmax(1e-9, along));
    }
    double v = sqrt(x) * planner->scale;
    double acc = sqrt(2.0 * jerk * v);
    return t * (v + acc * t / 2.0 + jerk * t * t / 6.0) + 1e-9;
}

/* Where q' jumps at the head, the path acceleration makes a step of the axes'
 * accelerations: the share of the jerk limit that it takes. */
static double kink_used(const jerk_planner *planner,
                        const jerk_interval *left,
                        const jerk_interval *right) {
    double f2 = planner->scale * planner->scale;
    double step = STEP_SEEN * fabs(planner->accel) * f2 / planner->cfg.cycle_s;
    double used = 0.0;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        double turn = fabs(turn_of(left, right, axis));
        double jerk = least_jerk(planner, left, right, axis);
        used = greater(used, step * turn / jerk);
    }
    return used;
}

/* The jump between two intervals that is passed at the head: it still shows in
 * what comes next. */
void jump_passed(jerk_planner *planner,
                 const jerk_interval *left,
                 const jerk_interval *right) {
    double used = jump_used(planner, left, right, planner->x)
                  + kink_used(planner, left, right);
    turn_passed(planner, left, right);
    if (used < SMALL_JUMP) {
        return;
    }
    planner->behind_share = fmax(1.0 - used, LEAST_SHARE);
    planner->behind_mm = jump_reach(planner, left, right, planner->x);
}

/* Jumps within reach of each other add up in the samples. */
static void take_share(struct segment *segment, double used) {
    segment->jump = greater(segment->jump - used, LEAST_SHARE);
}

/* The joint at knot k is passed less than a cycle behind other ones: where
 * their bends jump the samples show all of it at once. Alone it has its cap;
 * so it has beside those inside an arc, where nothing jumps. */
static void cap_bends(const jerk_planner *planner, struct grid *grid, int k) {
    double dt = planner->cfg.cycle_s;
    double scale = planner->scale;
    double cap = INFINITY;
    double top = 0.0;
    double alone[JERK_AXES];
    double jump[JERK_AXES] = {0};
    int first = k;
    for (int axis = 0; axis < planner->cfg.axes; axis++) {
        const jerk_interval *left = grid->seg[k - 1].interval;
        alone[axis] = bend_of(left, grid->seg[k].interval, axis);
    }
    for (int i = k; i > 0; i--) {
        top = greater(top, grid->top[i]);
        double reach = dt * scale * sqrt(top);
        if (grid->from_start[k] - grid->from_start[i] >= reach) {
            break;
        }
        if (!grid->seg[i - 1].last) {
            continue;
        }
        const jerk_interval *left = grid->seg[i - 1].interval;
        const jerk_interval *right = grid->seg[i].interval;
        for (int axis = 0; axis < planner->cfg.axes; axis++) {
            jump[axis] += bend_of(left, right, axis);
            double seen = STEP_SEEN * scale * scale * fabs(jump[axis]);
            double room =
                JUMP_SHARE * least_jerk(planner, left, right, axis) * dt;
            bool more =
                fabs(jump[axis] - alone[axis]) > SMALL_JUMP * fabs(jump[axis]);
            if (more && seen * cap > room) {
                cap = room / seen;
                first = i;
            }
        }
    }
    for (int i = first; i <= k; i++) {
        grid->knot_cap[i] = lesser(grid->knot_cap[i], cap);
    }
}

/* Cap at knot k by what jumps there; whether that may need room around it. */
static bool knot_jump(const jerk_planner *planner, struct grid *grid, int k) {
    const jerk_interval *left = grid->seg[k - 1].interval;
    const jerk_interval *right = grid->seg[k].interval;
    if (!grid->seg[k - 1].last) {
        return false;
    }
    grid->knot_cap[k] = jump_cap(planner, left, right, grid->knot_cap[k]);
    return jump_used(planner, left, right, grid->knot_cap[k]) >= SMALL_JUMP;
}

/* Share of the jerk limit that the jump at knot k takes, at the speed with
 * which it may be passed; 0: it needs no room. */
static double knot_used(const jerk_planner *planner,
                        const struct grid *grid,
                        int k) {
    const jerk_interval *left = grid->seg[k - 1].interval;
    const jerk_interval *right = grid->seg[k].interval;
    double x = lesser(grid->knot_cap[k], grid->top[k]);
    double used =
        grid->seg[k - 1].last ? jump_used(planner, left, right, x) : 0.0;
    return used < SMALL_JUMP ? 0.0 : used;
}

/* What is left of the jerk limit around knot k. */
static void knot_share(const jerk_planner *planner, struct grid *grid, int k) {
    const jerk_interval *left = grid->seg[k - 1].interval;
    const jerk_interval *right = grid->seg[k].interval;
    double used = knot_used(planner, grid, k);
    if (used == 0.0) {
        return;
    }
    double x = lesser(grid->knot_cap[k], grid->top[k]);
    double reach = jump_reach(planner, left, right, x);
    for (int i = k - 1;
         i >= 0 && grid->from_start[k] - grid->from_start[i + 1] < reach;
         i--) {
        take_share(&grid->seg[i], used);
    }
    for (int i = k;
         i < grid->count && grid->from_start[i] - grid->from_start[k] < reach;
         i++) {
        take_share(&grid->seg[i], used);
    }
}

/* Room around the jumps, at the speeds in reach: caps first, they lower them.
 */
static void jump_room(const jerk_planner *planner, struct grid *grid) {
    for (int k = 1; k < grid->count; k++) {
        if (knot_used(planner, grid, k) > 0.0) {
            cap_bends(planner, grid, k);
        }
    }
    for (int k = 1; k < grid->count; k++) {
        knot_share(planner, grid, k);
    }
}

/* What jumps of the derivatives ask of the grid: caps, and room around them. */
static void jumps(const jerk_planner *planner, struct grid *grid) {
    bool any = false;
    for (int k = 1; k < grid->count; k++) {
        any = knot_jump(planner, grid, k) || any;
    }
    int joint = first_joint(planner, grid);
    if (!any && joint == 0 && planner->turned_count == 0) {
        return;
    }
    top_speeds(planner, grid);
    if (any) {
        jump_room(planner, grid);
    }
    turn_caps(planner, grid, joint);
}

void knot_caps(const jerk_planner *planner, struct grid *grid) {
    grid->from_start[0] = 0.0;
    for (int k = 0; k <= grid->count; k++) {
        double left = k > 0 ? grid->seg[k - 1].cap : 1e30;
        double right = k < grid->count ? grid->seg[k].cap : 1e30;
        grid->knot_cap[k] = lesser(left, right);
        if (k < grid->count) {
            grid->from_start[k + 1] = grid->from_start[k] + grid->seg[k].length;
        }
    }
    jumps(planner, grid);
    for (int k = 0; k < grid->count; k++) {
        if (grid->from_start[k] < planner->behind_mm) {
            take_share(&grid->seg[k], 1.0 - planner->behind_share);
        }
        struct segment *segment = &grid->seg[k];
        segment->share = segment->jump * *segment->tight;
    }
    for (int k = 0; k < grid->count; k++) {
        grid->seg[k].jerk_up =
            k == 0 ? standstill_jerk(planner, &grid->seg[k], 0) : 0.0;
        grid->seg[k].jerk_down =
            k == grid->count - 1 ? standstill_jerk(planner, &grid->seg[k], 1)
                                 : 0.0;
    }
}
