/* Tuning of the way into the jerk-limited planner: every number, its unit and
 * effect.
 */
#ifndef ENGINE_JERK_ADAPTER_TUNING_H
#define ENGINE_JERK_ADAPTER_TUNING_H

/* Window. Evidence: planner's page, solving times and motion times by window.
 */
/* stopping distances from full speed that the window holds */
#define BRAKES_AHEAD 1.6
/* knots: of the window for each block, on the whole */
#define KNOTS_PER_BLOCK 3.0
#define MAX_KNOTS 1000.0 /* knots of the window at the most */

/* Places of a curve that are remembered while one interval is made: its ends,
 * its middle and its quarter. */
#define SPOTS 4

/* Intervals of curves. Evidence: jerk sampled on curves stays within the limit
 * (tests/unit/jerk/test_curve_derivatives.py). */
#define INTERVAL_TURN 0.1 /* rad of turn over an interval */
/* share of the third derivative: beyond it an interval is halved, ... */
#define CURVE_MISS 0.001
#define CURVE_HALVINGS 3    /* halvings: ... so often at the most, ... */
#define CURVE_SHORTEST 2e-3 /* mm: ... but none shorter than that, or ... */
/* cycles: ... than is driven in that at the speed the third derivative
 * allows */
#define CURVE_UNSEEN 0.25
/* share of the jerk limit: a miss below it matters at no speed */
#define CURVE_NOISE 1e-3
/* share of a limit, however small the program asks for */
#define LEAST_SHARE 1e-4f
/* share of the time in which an axis comes to its acceleration: the path takes
 * no less to its own. Less is not felt, and windows would end ahead of a long
 * way to rest. Evidence: tests/unit/planning/test_limits_of_the_path.py */
#define LEAST_RAMP 0.2
/* of the main axes, by the length of a curve: none */
#define LEAST_RATE 1e-9
/* mm: of an interval of a curve, however much it bends */
#define LEAST_MM 1e-6

/* Stands. Evidence: times over sharp corners,
 * tests/unit/engine/test_corner_standstills.py.
 */
/* share of the jerk limit that a corner may use, as in jerk/path/grid.c */
#define CORNER_SHARE 0.5
/* share of the acceleration limit that it may use */
#define CORNER_ACC_SHARE 0.012
/* mm/s: corners that had to be passed slower are stood at; ... */
#define STAND_SPEED 1.0
/* s: ... with little jerk only those slower than what each axis reaches from
 * rest in twice this time, for there a stand takes long */
#define STAND_S 0.007
/* A corner that is passed costs so many cycles, times the share of the jerk
 * that its jump takes, times the acceleration come to (twice that was measured
 * to where neither gains); ... */
#define PASSING_COSTS 1.5
/* mm/s: faster ones are not looked at */
#define PASSED_SPEED 200.0
/* share of the stopping distance: a nearer stand is not tried */
#define STOP_MARGIN 0.98

/* Commits. */
/* s: a commit ends where the prediction expected it */
#define SAME_TIME_PREDICTED 1e-6
#define SAME_SPEED_PREDICTED 1e-6 /* relative: ... as fast as expected */
/* s: a place to rejoin at is so far ahead of GEO; plans take up to 4 ms */
#define REJOIN_MARGIN_S 0.010

#endif
