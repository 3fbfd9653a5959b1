/* Whether a polynomial lies within the tolerance of the programmed contour. */
#ifndef SMOOTH_CERTIFY_H
#define SMOOTH_CERTIFY_H
#include "stages/smoothing/state.h"

typedef struct contour {
    const struct node *nodes; /* chords from nodes[0] on, of the section */
    int count;
} contour;
typedef struct verdict {
    double worst;    /* largest deviation over what is allowed */
    double t;        /* where */
    double distance; /* scaled: at the most, to what was programmed and left out
                        too */
} verdict;
/* A piece, by its Bernstein coefficients (used up), over t0..t1. `chord`: where
 * to begin looking, left where the piece ends. */
struct verdict certify_piece(nc_smooth *smooth,
                             double hull[][ORDER],
                             double t0,
                             double t1,
                             const contour *path,
                             int *chord);
#endif
