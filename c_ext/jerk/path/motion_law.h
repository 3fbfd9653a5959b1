/* Laws of motion by time: the speed is a polynomial of degree 5. */
#ifndef JERK_MOTION_LAW_H
#define JERK_MOTION_LAW_H
#include "jerk/state/api.h"
#include <stdbool.h>

/* Of the power series in time: a division takes longer. */
#define PER_6 (1.0 / 6.0)
#define PER_24 (1.0 / 24.0)
#define PER_120 (1.0 / 120.0)
#define PER_720 (1.0 / 720.0)

/* Jerk of a law at the time t, mm/s3. */
double motion_law_jerk(const jerk_law *law, double t);

/* The law over a length between two states and the jerks there. */
void motion_law_between(jerk_law *law,
                        double length,
                        double v0,
                        double a0,
                        double j0,
                        double v1,
                        double a1,
                        double j1);

/* The law between two scaled states with the inputs there; x or x1 of 0: rest.
 */
void motion_law_from(jerk_law *law,
                     double length,
                     double x,
                     double accel,
                     double x1,
                     double u1,
                     const double input[2],
                     double scale);
#endif
