/* The fastest brake: all of the jerk down to all of the deceleration, then all
 * of the jerk back, so that speed and acceleration end together.
 *
 * When the second ramp begins is the one unknown.  Begun too early, the
 * acceleration ends before the speed; too late, after it.  So halving finds it,
 * and each try is one integration over the limits that the path leaves.  It is
 * a guess for the solver: nothing of it is driven unchecked.
 */
#include <math.h>
#include "jerk/solver/brake.h"

typedef struct room {
    double jerk[2], acc; /* mm/s3: least, most; mm/s2: the deepest */
} room;

/* The derivatives of an axis at the share t of a segment, linearly. */
static double mixed(const double at[2][JERK_AXES], int axis, double t) {
    double from = at[0][axis];
    return from + t * (at[1][axis] - from);
}

/* What an axis leaves of the room. */
static void narrow(const jerk_planner *planner,
                   const struct segment *segment,
                   int axis,
                   double t,
                   const double state[2],
                   room *out) {
    const jerk_interval *part = segment->interval;
    double v = state[0];
    double d1 = mixed(part->d1, axis, t);
    double d2 = mixed(part->d2, axis, t);
    double acc = segment->acc[axis] * acc_max(planner, part, axis);
    double jerk = BRAKE_SHARE * segment->share * jerk_max(planner, part, axis);
    double d3 = mixed(part->d3, axis, t);
    double along = fabs(d1);
    if (along < BRAKE_LEAST_RATE) {
        return;
    }
    double forward = d1 < 0.0 ? -v : v;
    double bend_acc = forward * d2 * v;
    double bend_jerk = forward * (3.0 * d2 * state[1] + d3 * v * v);
    out->jerk[0] = fmax(out->jerk[0], (-jerk - bend_jerk) / along);
    out->jerk[1] = fmin(out->jerk[1], (jerk - bend_jerk) / along);
    out->acc = fmax(out->acc, (-BRAKE_SHARE * acc - bend_acc) / along);
}

static room room_at(const jerk_planner *planner,
                    const struct segment *segment,
                    double t,
                    const double state[2]) {
    room least = {{-1e30, 1e30}, -1e30};
    for (int axis = 0; axis < planner->axes; axis++) {
        narrow(planner, segment, axis, t, state, &least);
    }
    return least;
}

/* The next step, over dt. Where the axes contradict each other it goes between
 * them. */
static void brake_step(const room *room,
                       brake_path *path,
                       double dt,
                       bool back) {
    int i = path->count++;
    double a = path->a[i];
    double most = room->jerk[1];
    double least = room->jerk[0];
    double jerk = back ? most : fmax(least, (room->acc - a) / dt);
    path->torn = path->torn || least > most;
    jerk = least <= most ? fmin(jerk, most) : 0.5 * (least + most);
    double mean_a = a + 0.5 * jerk * dt;
    double mean_v = path->v[i] + dt * (0.5 * a + jerk * dt / 6.0);
    path->a[i + 1] = a + jerk * dt;
    path->v[i + 1] = path->v[i] + dt * mean_a;
    path->s[i + 1] = path->s[i] + dt * mean_v;
}

/* The second ramp begins at `turn`: 1 if that was too early, -1 too late, 0:
 * the path does not let it. */
static int shoot(const jerk_planner *planner,
                 const struct grid *grid,
                 double dt,
                 double turn,
                 brake_path *path) {
    double t = 0.0;
    int k = 0;
    path->count = 0;
    path->beyond = false;
    path->torn = false;
    while (path->count < BRAKE_STEPS) {
        int i = path->count;
        while (k < grid->count && grid->from_start[k + 1] <= path->s[i]) {
            k++;
        }
        if (k >= grid->count) {
            path->beyond = true;
            return 1;
        }
        const struct segment *segment = &grid->seg[k];
        const double state[2] = {path->v[i], path->a[i]};
        double into = (path->s[i] - grid->from_start[k]) / segment->length;
        room room = room_at(planner, segment, into, state);
        bool back = t >= turn;
        double step = back ? dt : fmin(dt, turn - t);
        brake_step(&room, path, step, back);
        t += step;
        if (!(path->v[i + 1] > 0.0)) {
            return -1;
        }
        if (back && path->a[i + 1] >= 0.0) {
            return 1;
        }
    }
    return 0;
}

/* The last step ends at rest, with the acceleration at the end of the ramp. */
static void end_at_rest(brake_path *path) {
    int i = path->count - 1;
    double v = path->v[i];
    double a = fmin(path->a[i], -1e-9);
    path->s[i + 1] = path->s[i] + v * v / (1.5 * -a);
    path->v[i + 1] = path->a[i + 1] = 0.0;
}

enum brake_end brake_to_rest(const jerk_planner *planner,
                             const struct grid *grid,
                             double longest,
                             brake_path *out) {
    double low = 0.0;
    double high = longest;
    double dt = longest / BRAKE_STEPS;
    out->s[0] = 0.0;
    out->v[0] = speed_at_head(planner);
    out->a[0] = acceleration_at_head(planner);
    for (int i = 0; i < BRAKE_TRIES; i++) {
        double turn = 0.5 * (low + high);
        int found = shoot(planner, grid, dt, turn, out);
        if (found == 0) {
            return BRAKE_NONE;
        }
        *(found > 0 ? &low : &high) = turn;
    }
    bool beyond = out->beyond;
    bool rests = shoot(planner, grid, dt, high, out) < 0;
    if (out->torn) {
        return BRAKE_NONE;
    }
    if (!rests) {
        return beyond || out->beyond ? BRAKE_BEYOND : BRAKE_NONE;
    }
    end_at_rest(out);
    return BRAKE_RESTS;
}

/* Speed at the place s of the brake, mm/s; `from`: a step no later, moved on.
 */
static double speed_of(const brake_path *path, double s, int *from) {
    int i = *from;
    while (i + 1 < path->count && path->s[i + 1] <= s) {
        i++;
    }
    *from = i;
    double way = path->s[i + 1] - path->s[i];
    double t = way > 0.0 ? (s - path->s[i]) / way : 0.0;
    double x0 = path->v[i] * path->v[i];
    double x1 = path->v[i + 1] * path->v[i + 1];
    return sqrt(fmax(0.0, x0 + t * (x1 - x0)));
}

void brake_speeds(const jerk_planner *planner,
                  const struct grid *grid,
                  const brake_path *path,
                  double *x) {
    int from = 0;
    double whole = path->s[path->count];
    double longer = whole / grid->from_start[grid->count];
    for (int k = 0; k <= grid->count; k++) {
        double at = longer * grid->from_start[k];
        double v = speed_of(path, at, &from);
        double left = fmax(0.0, whole - at);
        if (from + 1 >= path->count) {
            double rest = whole - path->s[path->count - 1];
            v = path->v[path->count - 1]
                * cbrt(left * left / fmax(1e-30, rest * rest));
        }
        x[k] = v * v / (planner->scale * planner->scale);
    }
}
