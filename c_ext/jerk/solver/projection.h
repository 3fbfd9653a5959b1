/* Speed profiles that meet the dynamics. */
#ifndef JERK_PROJECTION_H
#define JERK_PROJECTION_H
#include "jerk/state/problem.h"

/* x, accel and inputs of the profile that is nearest to the guess; `stiffness`:
 * weight of its accelerations and of the axes' jerks against the distance;
 * `goes_on`: x, accel and inputs meet the dynamics already. Needs the jerk rows
 * and `brake`. False: there is none. */
bool nearest_profile(struct problem *problem, double stiffness, bool goes_on);
#ifdef JERK_AVX2
bool nearest_profile_avx2(struct problem *problem,
                          double stiffness,
                          bool goes_on);
#endif
#endif
