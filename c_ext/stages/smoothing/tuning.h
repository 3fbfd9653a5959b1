/* Tuning constants of the smoothing stage, in one table.
 *
 * Each entry says what the constant does, in which unit, and what shows its
 * effect (a test by its name, or a bench). */
#ifndef SMOOTH_TUNING_H
#define SMOOTH_TUNING_H

/* ---- Which points make a section (sections.c, smoothing.c) ---- */

/* Shorter ways are no motion. Unit: mm, scaled. Evidence: rounding. */
#define ZERO 1e-9

/* Points closer to the last one are left out. Unit: share of the tolerance.
 * Evidence: tests/property/test_smoothing.py. */
#define LEAVE_OUT 0.25

/* The same of a figure that would be left out altogether. Unit: share of its
 * size. Evidence: test_smoothing_small_figures. */
#define FIGURE 0.1

/* Collinear points within it are left out. Unit: share of the tolerance.
 * Evidence: bench/test_bench_smoothing.py. */
#define MERGE 0.01

/* The most of it. Unit: mm. Evidence: bench/test_bench_smoothing.py. */
#define MERGE_MAX 1e-4

/* Left out on one chord at the most. Unit: points. Evidence:
 * bench/test_bench_smoothing.py. */
#define MERGED 128

/* That the chords of an arc use up. Unit: share of the tolerance. Evidence:
 * tests/property/test_smoothing.py. */
#define SAGITTA 0.05

/* An arc that needs more chords than that is driven exactly, which keeps every
 * tolerance; no tolerance, however small, makes the stage work for long. Unit:
 * chords. Evidence: tests/unit/stages/test_hand_made_rows.py. */
#define ARC_CHORDS 200000.0

/* A curve that stays so close to its chord is driven as the chord. Unit:
 * share of the tolerance. Evidence:
 * tests/unit/frontend/isons/test_isons_bends.py. */
#define BULGE 0.5

/* A chord whose curve turns away from it by more is a chord only. Unit: cosine.
 * Evidence: as above. */
#define BEND_COS 0.25

/* Turn that one knot span may take. Unit: rad. Evidence:
 * bench/test_bench_smoothing.py. */
#define TURN_PER_SPAN 0.18

/* Longer chords are driven exactly in their middle; at corners 1. Unit: run-
 * outs. Evidence: bench/test_bench_smoothing.py. */
#define LONG_LINE 1.5

/* Main axes that turn by more are at a corner, even if the path with all axes
 * is not. Unit: cosine. Evidence: test_smoothing_turn_back. */
#define TURN_BACK -0.866

/* Run-out of a curve at a kink. Unit: tolerances over the turn. Evidence:
 * bench/test_bench_smoothing.py. */
#define KINK 24.0

/* Of the way that two corner blends want: with less, a curve takes both
 * corners. Unit: share. Evidence: bench/test_bench_smoothing.py. */
#define CROWDED 0.7

/* Run-out of a curve that hardly bends. Unit: mm. Evidence:
 * bench/test_bench_smoothing.py. */
#define FAST_LEAST 0.5

/* In which jerk builds up the acceleration that a run-out counts with. Unit: s.
 * Evidence: bench/test_bench_smoothing.py, test_same_motion. */
#define RISE_S 0.1

/* Turns below it are blended by curves; with limited jerk all are. Unit: rad.
 * Evidence: bench/test_bench_smoothing.py. */
#define SHARP_FROM 1.2

/* Turns above it are blended as corners. Unit: rad. Evidence:
 * bench/test_bench_smoothing.py. */
#define SHARP_TO 1.6

/* Of the main axes in a chord: with less the path is too short for the turns
 * of the others. Unit: share. Evidence: test_smoothing_turn_back. */
#define MAIN_LEAST 0.02

/* Held back: then the section is ended. Unit: rows. Evidence:
 * bench/test_bench_smoothing.py. */
#define HELD_MAX 8192

/* Smaller turns need no blend. Unit: rad. Evidence: rounding. */
#define STRAIGHT 1e-7

/* ---- Spans and nodes of a window (knots.c, window.c) ---- */

/* Steps of the contour parameter, a power of two. Unit: 1/mm. Evidence:
 * test_smoothing_for_time, test_isons_restart. */
#define PARAMETER_PARTS 1073741824.0

/* A turn that a curve may be unable to pass: it becomes an exact corner where
 * none is found. Unit: rad. Evidence: test_same_motion. */
#define SHARP_TURN 0.8

/* Growth of the wanted span length with the distance from a kink. Unit: mm
 * per mm. Evidence: bench/test_bench_smoothing.py. */
#define SIZE_GROWTH 0.7

/* Knot span at a standstill, from which the speed rises steeply. Unit:
 * tolerances. Evidence: test_unequal_jerk, test_same_motion. */
#define REST_SIZE 2.0

/* That make a window worth solving. Unit: spans. Evidence:
 * bench/test_bench_smoothing.py. */
#define SPANS_FULL 60

/* The same of windows that are made faster: what is not written is refined in
 * vain, and the next one takes it up. Unit: wanted spans. Evidence:
 * bench/tube_oracle.py. */
#define SPANS_FASTER 90

/* With fewer, nodes are waited for. Unit: spans. Evidence:
 * bench/test_bench_smoothing.py. */
#define SPANS_LEAST 50

/* A window can hold at the most. Unit: spans. Evidence:
 * bench/test_bench_smoothing.py. */
#define SPANS_ROOM 240

/* Committed of a full window. Unit: spans. Evidence:
 * bench/test_bench_smoothing.py. */
#define COMMIT_SPANS 40

/* Of the section in work. Unit: nodes. Evidence:
 * bench/test_bench_smoothing.py. */
#define NODES 2048

/* Passed before a knot is set all the same. Unit: nodes. Evidence:
 * bench/test_bench_smoothing.py. */
#define NODES_PER_SPAN 8

/* What is written, and the control points it shares with what follows, feel
 * no later knot. Unit: knots. Evidence: tests/property/test_smoothing.py. */
#define HEAD_KNOTS 10

/* Of a coarse window before, its last ones are laid anew: they did not know
 * what follows. Unit: spans. Evidence: bench/tube_oracle.py. */
#define LOOSE 10

/* ---- Points that pull (sites.c) ---- */

/* That points of smooth dense data get at the least. Unit: share of the
 * tolerance. Evidence: bench/test_bench_smoothing.py. */
#define POINT 0.01

/* The most of it. Unit: mm. Evidence: bench/test_bench_smoothing.py. */
#define POINT_MAX 1e-4

/* Of what such points scatter, that they get. Unit: factor. Evidence:
 * bench/test_bench_smoothing.py. */
#define NOISE 2.0

/* That all other points get: humps lie between them. Unit: share of the
 * tolerance. Evidence: tests/property/test_smoothing.py. */
#define SHARE 0.92

/* First weight of a span's points against its fairness. Unit: 1. Evidence:
 * bench/test_bench_smoothing.py. */
#define STIFF 300.0

/* ---- Iteration of weights (iterate.c) ---- */

/* Of one window at the most. Unit: solutions. Evidence:
 * bench/test_bench_smoothing.py. */
#define ITERATIONS 40

/* Before one is looked at. Unit: solutions. Evidence:
 * bench/test_bench_smoothing.py. */
#define SETTLE 5

/* That the points of a span that fails get at the least. Unit: share of the
 * tolerance. Evidence: bench/test_bench_smoothing.py. */
#define WISH_FAILED 0.3

/* Of the largest weight in its span: more is not given to a point where a
 * hump was. Unit: factor. Evidence: bench/test_bench_smoothing.py. */
#define HUMP_WEIGHT 10.0

/* Of a weight from one solution to the next. Unit: factor. Evidence:
 * bench/test_bench_smoothing.py. */
#define GROWTH 100.0

/* From which on weights grow by what the curve gives; before, too much
 * changes at a time. Unit: solutions. Evidence:
 * bench/test_bench_smoothing.py. */
#define GIVE_FROM 11

/* A weight's largest growth over its first. Unit: factor. Evidence:
 * bench/test_bench_smoothing.py. */
#define WEIGHT_SPREAD 1e7

/* Growth of a target that is not met although more would be allowed. Unit:
 * factor. Evidence: bench/test_bench_smoothing.py. */
#define RELAX 1.5

/* Least factor on a weight once the window settles. Unit: factor. Evidence:
 * bench/test_bench_smoothing.py. */
#define RELEASE 1.0

/* The same of points whose closeness is only wished. Unit: factor. Evidence:
 * bench/test_bench_smoothing.py. */
#define WISH_LEAST 0.9

/* The largest growth of their weights. Unit: factor. Evidence:
 * bench/test_bench_smoothing.py. */
#define WISH_SPREAD 1e4

/* With more at a point the spans need not be looked at. Unit: share of the
 * tolerance. Evidence: bench/test_bench_smoothing.py. */
#define NEAR 1.5

/* Least factor on a span's fairness. Unit: share. Evidence:
 * bench/test_bench_smoothing.py. */
#define RHO_MIN 1e-5

/* ---- A certified curve made faster at its own speed (law.c, refine.c) ---- */

/* A window whose knots are that many for each point is coarse: its knots are
 * set closer. With 0.4 dense circles have so many pieces that a window of 30
 * blocks is too short. Unit: factor. Evidence: bench/tube_oracle.py,
 * test_unequal_jerk. */
#define COARSE 0.65

/* Knot spans of a coarse window. Unit: factor on their wanted length. Evidence:
 * bench/tube_oracle.py. */
#define COARSE_SIZE 0.4

/* Run-out of a curve at a kink, of machines with limited jerk. Unit: tolerances
 * over the turn. Evidence: bench/tube_oracle.py. */
#define KINK_JERK 120.0

/* Jerk of a blend: cube of the speed over the square of its run-out. Unit: 1.
 * Evidence:
 * test_smoothing_for_time. */
#define BLEND_JERK 12.0

/* Places of a span that are looked at. Unit: count. Evidence:
 * bench/tube_oracle.py.
 */
#define LAW_PLACES 3

/* Cost of the fourth power of the jerk over its limit, beside the time. Unit:
 * 1. Evidence: as above. */
#define LAW_JERK 0.07

/* Cost of the square of ln v above the feed. Unit: 1. Evidence: as above. */
#define LAW_TOP 100.0

/* Added to the diagonal of a step's equations. Unit: share. Evidence: as above.
 */
#define LAW_DAMP 1e-3

/* Largest change of ln v in one step. Unit: 1. Evidence: as above. */
#define LAW_STEP 0.4

/* Steps for the first law at the most. Unit: count. Evidence: as above. */
#define LAW_STEPS 12

/* Gain that ends them. Unit: share of the cost. Evidence: as above. */
#define LAW_SETTLED 1e-3

/* Shares of a step that are tried, each half of the one before. Unit: count.
 * Evidence: test_same_motion. */
#define LAW_TRIES 6

/* Growth of v^1.5 along the way in the first guess. Unit: roots of the jerk.
 * Evidence: as above. */
#define LAW_SLOPE 0.75

/* Taken off the first guess of ln v, which has to be slow. Unit: 1. Evidence:
 * as above. */
#define LAW_SLOWER 0.2

/* Speed at which a section leaves its standstill. Unit: that which the jerk
 * gives over a span. Evidence: as above. */
#define LAW_REST 1.0

/* Slowest jerk over that of an axis: quicker ones count as this. Unit: share.
 * Evidence: as above. */
#define QUICKEST 0.01

/* Weight of places without jerk. Unit: square of the jerk's limit. Evidence: as
 * above. */
#define LAW_FLOOR 0.05

/* Solutions of a refinement. Unit: count. Evidence: as above. */
#define REFINE 26

/* The first of them, which try what is to be gained. Unit: count. Evidence:
 * test_same_motion, bench/test_bench_pair.py. */
#define TRIAL 4

/* Gain of these that is worth going on for: two to four times as much comes of
 * it. Unit: share of the cost. Evidence: as above. */
#define WORTH 0.012

/* Penalties change while the cost is below so many times the time. Unit:
 * factor. Evidence: random polylines of several windows. */
#define LAW_SUITS 1.25

/* From which one on the penalties of the jerk change. Unit: count. Evidence: as
 * above. */
#define REWEIGH_FROM 3

/* Least penalty of a jerk far below its limit. Unit: factor. Evidence: as
 * above. */
#define PENALTY_LEAST 0.4

/* Cost of being near the tolerance, at first. Unit: share of the cost for each
 * wall. Evidence: as above. */
#define WALL_FIRST 1e-3

/* Its change from one solution to the next. Unit: factor. Evidence: as above.
 */
#define WALL_NEXT 0.8

/* The same at the end. Unit: share. Evidence: as above. */
#define WALL_LAST 1e-5

/* Where the walls stand: humps lie between points. Unit: share of the
 * tolerance. Evidence: as above. */
#define WALL 0.9995

/* The same around the place where the next window goes on, which needs room.
 * Unit: share of the tolerance. Evidence: as above. */
#define WALL_JOIN 0.9

/* Which are around it: before. Unit: spans. Evidence: as above. */
#define JOIN_BEFORE 2

/* And behind. Unit: spans. Evidence: as above. */
#define JOIN_BEHIND 6

/* A wall stands behind the curve in any case. Unit: factor on its residual.
 * Evidence: rounding. */
#define WALL_BEHIND 1.0005

/* Walls of a span. Unit: count. Evidence: bench/tube_oracle.py. */
#define WALLS 3

/* Two walls are not closer. Unit: share of the span. Evidence: as above. */
#define WALLS_APART 0.01

/* Shares of a step that are tried. Unit: count. Evidence: as above. */
#define TRIES 12

/* What is taken of a step, over the try before. Unit: factor. Evidence: as
 * above. */
#define TRY_NEXT 0.6

/* So many fewer are kept of the window before where the certificate fails.
 * Unit: control points. Evidence: as above. */
#define KEPT_LESS 4

/* ---- Certificate and output (certify.c, emit.c) ---- */

/* A part is halved so often when the hull is too wide. Unit: count. Evidence:
 * tests/property/test_smoothing.py. */
#define DEPTH 4

/* Smallest speed of the curve along it. Unit: share of the chord. Evidence:
 * test_smoothing_turn_back. */
#define FORWARD 0.02

/* Pieces that differ by less are the same. Unit: mm. Evidence: rounding. */
#define SAME 1e-9

/* Rounding leaves less between two pieces. Unit: mm. Evidence: rounding. */
#define NOTHING 1e-9

#endif
