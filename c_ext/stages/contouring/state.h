/* Shared by contouring.c and corner.c. */
#ifndef CONTOUR_INTERNAL_H
#define CONTOUR_INTERNAL_H
#include <stdbool.h>
#include "stages/contouring/contouring.h"
#include "curve/curve.h"

#define CONTOUR_SKIPPED 16 /* short blocks between two rounded ones */
#define CONTOUR_HELD 512   /* rows between two motions */
#define CONTOUR_NUMBERS 65536

/* How corners are rounded: an NC_CONTOUR row, unpacked. */
typedef struct contour_mode {
    int mode; /* NC_CONTOUR_OFF, ... */
    bool active, const_vel;
    uint8_t action;
    double path_dev, pre, post, track_dev, relevant_path, relevant_track,
        remain, max_angle, share;
    double interim[NC_AXES];
} contour_mode;

/* One block of a corner: `length` of what is left of it, `whole` as programmed.
 */
typedef struct leg {
    nc_block row;
    double start[NC_AXES];
    double length, whole;
    double centre[2], radius, angle0; /* circle */
    int axis1, axis2;
} leg;

typedef struct corner {
    double coef[2][NC_AXES][5]; /* over 0..1 each */
    double length[2], mid[NC_AXES];
    double pre, post; /* corner distances */
    double deviation;
} corner;

void leg_set(const nc_contour_config *cfg,
             struct leg *leg,
             const nc_block *row,
             const double *start);
void leg_at(const nc_contour_config *cfg,
            const struct leg *leg,
            double s,
            double *position,
            double *d1,
            double *d2);
void leg_cut_end(const nc_contour_config *cfg,
                 struct leg *leg,
                 double distance);
void leg_cut_start(const nc_contour_config *cfg,
                   struct leg *leg,
                   double distance);
double leg_track(const nc_contour_config *cfg, const struct leg *leg);

/* The curve from a to b; `skipped` blocks between them are left out. False: the
 * corner stays as it is. */
bool corner_make(const nc_contour_config *cfg,
                 const struct contour_mode *mode,
                 const struct leg *before,
                 const struct leg *behind,
                 const struct leg *skipped,
                 int skipped_count,
                 struct corner *out,
                 bool *irregular);
#endif
