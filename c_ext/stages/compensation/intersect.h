/* Plane geometry of compensated elements. Tangents are unit vectors, offsets
 * positive to the left. */
#ifndef OFFSET_GEOMETRY_H
#define OFFSET_GEOMETRY_H
#include "stages/compensation/offset.h"

#define OFFSET_PI 3.14159265358979323846
#define OFFSET_ZERO_MM 1e-9 /* shorter motions do not move */
/* gaps of outer corners up to this are closed without an inserted row */
#define OFFSET_JOIN_MM 1e-5
/* an element may come out negative by this: rounding */
#define OFFSET_DAMAGE_MM 1e-7

/* Where two neighbours meet. `turn`: from one's tangent to the other's,
 * positive to the left. */
typedef struct corner {
    double point[2];
    double t[2][2];
    double curvature[2];
    double turn;
    double distance;
} corner;

double offset_turn(const double from[2], const double to[2]);
void offset_point(const double point[2],
                  const double t[2],
                  double distance,
                  double out[2]);
int offset_meet(const struct corner *corner, double out[2]);
int offset_is_outer(const struct corner *corner);
double offset_sweep(const nc_element *element,
                    const double start[2],
                    const double end[2]);
int offset_tangent_arc(const double from[2],
                       const double to[2],
                       const double t[2],
                       int at_end,
                       nc_block *row);
#endif
