/* Speed profiles that meet the dynamics. */
#ifndef JERK_PROJECTION_H
#define JERK_PROJECTION_H
#include "jerk/state/problem.h"

/* x, accel and inputs of the profile that is nearest to the guess; `stiffness`:
 * weight of its accelerations and of the axes' jerks against the distance.
 * Needs the jerk rows and `brake`. False: there is none. */
bool nearest_profile(struct problem *problem, double stiffness);

/* The same from a profile that meets the dynamics, for another guess. */
bool nearer_profile(struct problem *problem, double stiffness);
#endif
