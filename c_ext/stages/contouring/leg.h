/* One block of a corner: where it runs, and what is cut off it. */
#ifndef CONTOUR_LEG_H
#define CONTOUR_LEG_H
#include <stdbool.h>
#include "stages/contouring/contouring.h"

#define QUARTER 1.5707963267948966 /* rad: a right angle */

/* One block of a corner: `length` of what is left of it, `whole` as programmed.
 */
typedef struct leg {
    nc_block row;
    double start[NC_AXES];
    double length, whole;
    double centre[2], radius, angle0; /* circle */
    int axis1, axis2;
} leg;

/* Block `row` from `start` on. */
void leg_set(const nc_contour_config *cfg,
             struct leg *leg,
             const nc_block *row,
             const double *start);
/* Position and derivatives by path length, s from the present start. */
void leg_at(const nc_contour_config *cfg,
            const struct leg *leg,
            double s,
            double *position,
            double *d1,
            double *d2);
/* `distance` less at its end. */
void leg_cut_end(const nc_contour_config *cfg,
                 struct leg *leg,
                 double distance);
/* `distance` less at its start. */
void leg_cut_start(const nc_contour_config *cfg,
                   struct leg *leg,
                   double distance);
/* Largest way of an axis that is no main axis. */
double leg_track(const nc_contour_config *cfg, const struct leg *leg);

/* Distance of a position from the block, main axes. */
double leg_distance(const nc_contour_config *cfg,
                    const struct leg *leg,
                    const double *position);

/* Distance of two positions, main axes. */
double main_distance(const nc_contour_config *cfg,
                     const double *from,
                     const double *to);

/* Whether an axis is a main axis. */
bool is_main(const nc_contour_config *cfg, int axis);
#endif
