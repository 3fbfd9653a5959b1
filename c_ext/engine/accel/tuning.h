/* Tuning of the acceleration-limited planner: every number, its unit and
 * effect.
 *
 * Shares are of a limit, 1 = all of it. v2: a speed squared, (mm/s)^2.
 * Evidence is named for each group; the planner's page has the measurements.
 */
#ifndef ENGINE_ACCEL_TUNING_H
#define ENGINE_ACCEL_TUNING_H
#include "engine/state/state.h"
#include "rows/nc_block.h"

/* Corners. Evidence: second differences of samples at corners stay within the
 * limit (tests/property/test_path_control.py). */
#define CORNER 0.7 /* share: acceleration that jumps at corners may use */
/* cycles of acceleration by which the speed may differ beside a corner */
#define SLACK 0.3
#define NEGLIGIBLE 0.01 /* share: reserves below it need no zone */
#define NO_CORNER 1e-6  /* share: a jump below it is rounding */

/* Stretches of lines and arcs. Evidence: motion times of arcs against constant
 * bounds, planner's page, 'Without jerk'. */
#define USABLE 0.999   /* share: acceleration that is planned with */
#define TURN_STEP 0.15 /* rad: an arc between knots, ... */
/* rad: ... where the axes cannot follow its feed, ... */
#define LIMITED_STEP 0.08
/* rad: ... where one axis of its plane is much slower */
#define LEAST_STEP 0.04
#define RAMP_STEP 0.035  /* rad: ... where the speed has to change much, ... */
#define LEAST_RAMP 0.015 /* rad: ... at least */
#define KEPT_SPEED2 0.8  /* ratio of v2: a change to less is much */
#define RAMP_PIECES 8    /* pieces looked at to either side for such a change */
#define STOP_PARTS 8     /* stretches at least between two standstills */
/* share: tangent of an arc of too many turns for knots, sqrt(1 -
 * ARC_NORMAL^2) */
#define ARC_TANGENT 0.6
/* ratio of v2: up to it the chords of axis speeds let everything pass */
#define SURE 0.75
#define ROUNDED 1.000001 /* factor: rounding of a speed that is kept */
#define ENDS 3.0         /* stretches of an arc that zones can add */
#define TINY_MM 1e-9     /* mm: lengths that are rounding */

/* Memory of stretches. Evidence: blocks per second of `bench planner`. */
/* stretches that most pieces do with: they lie close together */
#define FEW 12u
#define FEW_ROOM (FEW + 1u) /* stretches: room for those */
#define MORE_ROOM 1.25      /* factor: room of a piece that needs more */
#define SLOTS 2u /* pieces, events among them, over motions of a window */
/* pieces: what a curve has is fetched into the cache so far ahead of its use */
#define FETCHED_AHEAD 2u
#define FETCHED 3u /* stretches of the pieces beside it: the same */

/* Parts of polynomials. Evidence: ratio to TOPP2 within 0.01 mm and blocks per
 * second, planner's page, 'Without jerk'. */
#define LITTLE 0.02 /* share: acceleration that a stretch may lose unseen */
/* share: beyond it constant bounds are better, if there is no room for rows */
#define GIVEN_UP 0.3
#define SIGNS 4 /* rows of an axis that carry along what they lose */
/* stretches that a certificate of a whole piece is cut into, ... */
#define AT_ONCE 12
#define OF_PART 4 /* ... and one of a part */
#define CLEARLY 2 /* times that: cut in halves without being looked at */
/* times fewer stretches that a half needs by its own certificate, about */
#define TIGHTER 4
#define HALVINGS 8            /* halvings of a piece at the most */
#define SHORTEST_PART_MM 1e-5 /* mm: no part of a polynomial is shorter */
/* mm, or relative: places on a polynomial that are the same */
#define ROUNDING 1e-9
/* share: acceleration that a stretch may lose before it is cut, ... */
#define LOSS 0.01
/* share: ... the same of pieces that take longer than ... */
#define LOSS_LONG 0.003
#define LONG_S 0.02 /* s: ... this, where stretches cost nothing */
/* factor of LOSS where there would be too many stretches, ... */
#define MORE_LOSS 1.5
#define MOST_LOSS 1.0   /* share: ... up to that */
#define STOP_HALVINGS 3 /* halvings at least, between two standstills */

/* Gentle polynomials keep constant bounds. Evidence: as above; five axes. */
/* share: acceleration that constant bounds may lose, ... */
#define GENTLE_ACCEL 0.1
#define GENTLE_RAMP 0.03  /* share: ... where a ramp takes many pieces, ... */
#define MANY_PIECES 8.0   /* pieces: ... so many */
#define GENTLE_SPEED 0.01 /* share: v2 that they may lose */
/* share: acceleration up to which the rows let everything pass */
#define KEPT_ACCEL 0.97
#define KEPT_SPEED 0.75 /* share: v2 that may be kept all over a piece */
/* parts that a piece is looked at in for that: 1, 2, 4 */
#define KEPT_PARTS 4

/* Steps over curved stretches. Evidence: acceleration sampled on arcs and
 * polynomials with override steps and holds is at most 1.011 of the limit. */
/* share: v2 of a brake below which the remainder is braked too */
#define NEAR_REST 5e-4
#define MOST_ROWS (4 * NC_AXES) /* rows of a stretch */
#define STANDS 1e-12            /* v2: less is a standstill */
#define SHORTEST_STEP_MM 1e-12  /* mm: no step is shorter */
/* share: limits that the chord of a row over a part may miss */
#define INSIDE 0.0005
/* relative change of q' up to which that tangent is taken */
#define TANGENT_SHARE 0.5
/* parts of a stretch that a feed hold brakes over, each as hard as it may */
#define HOLD_PARTS 6.0
/* share: limits used between two standstills without a knot between */
#define HOP 0.5
/* share of a ramp's way: longer stretches may need more than one u */
#define LONG 0.5
/* ratio: they do, if one u reaches less of what is possible */
#define WORTH 0.8
#define NEAR 0.95 /* ratio of v2 that are nearly the same */
#define PARTS 12  /* lengths tried */
/* mm: shorter stretches are stepped over whole */
#define SHORT_STRETCH_MM 1e-3

/* Commits. Evidence: `infeasible` stays 0 in all tests; times of pumps. */
/* times that the window is moved on while it is driven through */
#define MOVES 3
#define LEAST_CYCLES 1.0 /* cycles: a commit is at least so long */
/* s: a place to rejoin at is so far ahead of GEO */
#define REJOIN_QUICK_MARGIN_S 0.004
#define FEASIBLE 1.0000001 /* factor: v2 that misses by rounding */
/* factor: v2 inside a curved stretch, by what its chord is off */
#define FEASIBLE_CURVED 1.002
/* times the speed that a corner or stand allows, and ... */
#define REFUSED_FROM 1.01
#define REFUSED_MM_S 0.01  /* mm/s more: no commit passes that fast */
#define TINY_STEP_MM 1e-12 /* mm: parts of a step that are rounding */
#define SAME_SPEED 1e-12   /* relative: the feed is kept */

#endif
