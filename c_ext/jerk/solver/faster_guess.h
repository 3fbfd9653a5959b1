/* A guess near to the limits. */
#ifndef JERK_FASTER_GUESS_H
#define JERK_FASTER_GUESS_H
#include "jerk/state/problem.h"

/* The guess, made faster where its nearest profile leaves the limits unused.
 * Needs that profile, the rows of jerk and acceleration, `cap` and `brake`.
 * `growth`: room for count + 1 values. False: there is no such profile. */
bool faster_guess(struct problem *problem, double *growth);
#ifdef JERK_AVX2
bool faster_guess_avx2(struct problem *problem, double *growth);
#endif
#endif
