/* One corner: distances, curve, deviation. */
#ifndef CONTOUR_CORNER_H
#define CONTOUR_CORNER_H
#include "stages/contouring/leg.h"

/* How corners are rounded: an NC_CONTOUR row, unpacked. */
typedef struct contour_mode {
    int mode; /* NC_CONTOUR_OFF, ... */
    bool active, const_vel;
    uint8_t action;
    double path_dev, pre, post, track_dev, relevant_path, relevant_track,
        remain, max_angle, share;
    double interim[NC_AXES];
} contour_mode;

typedef struct corner {
    double coef[2][NC_AXES][5]; /* over 0..1 each */
    double length[2], mid[NC_AXES];
    double pre, post; /* corner distances */
    double deviation;
} corner;

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
