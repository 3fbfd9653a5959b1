/* One block of a corner: a line or a circle, by its length. */
#include <math.h>
#include <string.h>
#include "stages/contouring/leg.h"
#include "stages/square.h"
#include "maths/plain.h"

bool is_main(const nc_contour_config *cfg, int axis) {
    return axis == cfg->main_axis[0] || axis == cfg->main_axis[1]
           || axis == cfg->main_axis[2];
}

void leg_set(const nc_contour_config *cfg,
             struct leg *leg,
             const nc_block *row,
             const double *start) {
    static const int planes[3][2] = {
        {0, 1},
        {2, 0},
        {1, 2},
    };
    leg->row = *row;
    memcpy(leg->start, start, sizeof leg->start);
    leg->length = leg->whole = row->length;
    if (row->type != NC_CIRCULAR) {
        return;
    }
    leg->axis1 = cfg->main_axis[planes[row->plane - 17][0]];
    leg->axis2 = cfg->main_axis[planes[row->plane - 17][1]];
    memcpy(leg->centre, row->center, sizeof leg->centre);
    double e1 = start[leg->axis1] - row->center[0];
    double e2 = start[leg->axis2] - row->center[1];
    leg->radius = hypot(e1, e2);
    leg->angle0 = plain_atan2(e2, e1);
}

/* Position and derivatives by path length, s from the block's present start. */
void leg_at(const nc_contour_config *cfg,
            const struct leg *leg,
            double s,
            double *position,
            double *d1,
            double *d2) {
    double share = s / leg->length;
    for (int axis = 0; axis < cfg->axes; axis++) {
        double way = leg->row.end[axis] - leg->start[axis];
        d1[axis] = way / leg->length;
        d2[axis] = 0.0;
        position[axis] = leg->start[axis] + d1[axis] * s;
    }
    if (leg->row.type != NC_CIRCULAR) {
        return;
    }
    double rate = leg->row.angle / leg->length;
    double angle = leg->angle0 + leg->row.angle * share;
    double x = leg->radius * plain_cos(angle);
    double y = leg->radius * plain_sin(angle);
    position[leg->axis1] = leg->centre[0] + x;
    position[leg->axis2] = leg->centre[1] + y;
    d1[leg->axis1] = -rate * y;
    d1[leg->axis2] = rate * x;
    d2[leg->axis1] = -rate * rate * x;
    d2[leg->axis2] = -rate * rate * y;
}

static void set_length(struct leg *leg, double length) {
    double share = length / leg->length;
    leg->row.angle *= share;
    leg->row.length_min *= share;
    leg->row.length = leg->length = length;
}

void leg_cut_end(const nc_contour_config *cfg,
                 struct leg *leg,
                 double distance) {
    double position[NC_AXES], d1[NC_AXES], d2[NC_AXES];
    double length = leg->length - distance;
    leg_at(cfg, leg, length, position, d1, d2);
    memcpy(leg->row.end, position, sizeof *position * (size_t)cfg->axes);
    set_length(leg, length);
}

void leg_cut_start(const nc_contour_config *cfg,
                   struct leg *leg,
                   double distance) {
    double position[NC_AXES], d1[NC_AXES], d2[NC_AXES];
    leg_at(cfg, leg, distance, position, d1, d2);
    memcpy(leg->start, position, sizeof *position * (size_t)cfg->axes);
    if (leg->row.type == NC_CIRCULAR) {
        leg->angle0 += leg->row.angle * (distance / leg->length);
    }
    set_length(leg, leg->length - distance);
}

/* Largest way of an axis that is no main axis. */
double leg_track(const nc_contour_config *cfg, const struct leg *leg) {
    double most = 0.0;
    for (int axis = 0; axis < cfg->axes; axis++) {
        if (!is_main(cfg, axis)) {
            double way = leg->row.end[axis] - leg->start[axis];
            most = fmax(most, fabs(way));
        }
    }
    return most;
}

double main_distance(const nc_contour_config *cfg,
                     const double *from,
                     const double *to) {
    double sum = 0.0;
    for (int i = 0; i < 3; i++) {
        int axis = cfg->main_axis[i];
        if (axis >= 0) {
            sum += square(from[axis] - to[axis]);
        }
    }
    return sqrt(sum);
}

/* Distance of q from the block, main axes. */
double leg_distance(const nc_contour_config *cfg,
                    const struct leg *leg,
                    const double *position) {
    double at[NC_AXES], d1[NC_AXES], d2[NC_AXES], s;
    if (leg->row.type == NC_CIRCULAR) {
        double along = plain_atan2(position[leg->axis2] - leg->centre[1],
                                   position[leg->axis1] - leg->centre[0])
                       - leg->angle0;
        double turn = fmod(leg->row.angle > 0 ? along : -along, 4.0 * QUARTER);
        if (turn < 0) {
            turn += 4.0 * QUARTER;
        }
        double whole = fabs(leg->row.angle);
        if (turn > whole) {
            turn = turn - whole < 4.0 * QUARTER - turn ? whole : 0.0;
        }
        s = turn / whole * leg->length;
    } else {
        double dot = 0.0;
        for (int i = 0; i < 3; i++) {
            int axis = cfg->main_axis[i];
            if (axis >= 0) {
                dot += (position[axis] - leg->start[axis])
                       * (leg->row.end[axis] - leg->start[axis]);
            }
        }
        s = fmin(fmax(dot / leg->length, 0.0), leg->length);
    }
    leg_at(cfg, leg, s, at, d1, d2);
    return main_distance(cfg, at, position);
}
