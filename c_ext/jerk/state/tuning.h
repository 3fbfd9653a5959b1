/* Tuning constants of the planners, in one table.
 *
 * Each entry says what the constant does, in which unit, and what shows its
 * effect (a test by its name, or a bench).  A change needs that evidence again.
 */
#ifndef JERK_TUNING_H
#define JERK_TUNING_H

/* ---- What is planned with, and what the checker lets pass ---- */

/* Share of the acceleration limits that is planned with: the rest covers what
 * rows at knots miss between them. Unit: share. Evidence:
 * test_jerk_planner_limits, test_unequal_jerk. */
#define ACC_USABLE 0.998

/* Share of the jerk limits that is planned with: costs 0.07 % of the time.
 * Unit: share. Evidence: bench/planner_parts.py, test_planner_optimum. */
#define JERK_USABLE 0.998

/* The checker's bound over the machine's limits: a plan above it is refused.
 * Unit: share. Evidence: test_jerk_planner_limits, test_unequal_jerk. */
#define CHECK_SLACK 1.012

/* Speed over the feed that the checker lets pass. Unit: share. Evidence:
 * test_low_feeds. */
#define FEED_SLACK 1.0015

/* Jumps over the room that is set aside for them. Unit: share. Evidence:
 * test_joints_in_a_cycle. */
#define JUMP_SLACK 1.01

/* Jumps below it need no room. Unit: share of the jerk limit. Evidence:
 * test_joints_in_a_cycle. */
#define SMALL_JUMPS 5e-3

/* Parts of an interval in each of which the acceleration changes its sign
 * once at most. Unit: count. Evidence: test_jerk_planner. */
#define TURN_PARTS 4

/* Secant steps to such a place. Unit: count. Evidence: test_jerk_planner. */
#define TURN_STEPS 4

/* Smallest squared speed inside an interval over the largest: below it the
 * plan is none. Unit: share. Evidence: test_jerk_planner. */
#define LEAST_DIP 1e-4

/* ---- Life of a plan ---- */

/* Laws that can be taken back. Unit: laws. Evidence: test_rejoin,
 * test_place_of_standstill. */
#define HANDED_MAX 512

/* Room beyond window_knots for the finer grid near standstills. Unit:
 * intervals. Evidence: bench/planner_parts.py, test_planner_optimum. */
#define GRADED_EXTRA 96

/* Least size of the ring of pushed intervals. Unit: intervals. Evidence:
 * `bench planner`. */
#define RING_MIN (1024 + HANDED_MAX)

/* Share of a window that is used up before it is planned again. Unit: share.
 * Evidence: `bench planner`, bench/planner_parts.py. */
#define DEFAULT_REFRESH 0.2

/* In windows below it the rest of the window counts. Unit: blocks. Evidence:
 * `bench planner`, bench/planner_parts.py. */
#define SHORT_WINDOW 50

/* DEFAULT_REFRESH of such windows. Unit: share. Evidence: `bench planner`,
 * bench/planner_parts.py. */
#define SHORT_REFRESH 0.12

/* Shorter parts of a law are not handed out. Unit: mm. Evidence:
 * test_jerk_planner. */
#define LEAST_PART 1e-7

/* Shorter times are none when laws are handed out or taken back. Unit: s.
 * Evidence: test_rejoin. */
#define LEAST_TIME 1e-9

/* The old plan is followed so long where no stop or slower plan is found.
 * Unit: s. Evidence: test_feed_hold_distance. */
#define TRY_AGAIN_S 0.008

/* That time doubles for other speeds, up to this. Unit: s. Evidence:
 * test_feed_hold_distance. */
#define TRY_AGAIN_MAX_S 0.05

/* A plan this much slower than the tail over the tail's way is not taken.
 * Unit: share. Evidence: `bench planner`, bench/planner_parts.py. */
#define SLOWER 1.002

/* The same where nothing asks for the tail's rest: from there it has to speed
 * up again. Also to each place ahead of where the tail brakes for it. Unit:
 * share. Evidence: test_tangential_joints, test_same_motion. */
#define SLOWER_THAN_REST 1.15

/* A plan is not made anew while so many of them are left of it. Unit:
 * stopping ways. Evidence: `bench planner`, bench/planner_parts.py. */
#define LASTS 2.5

/* Nor while so many of its intervals are left: at a crawl one is longer than
 * the stopping way, and the plan brakes in it. Unit: count. Evidence:
 * test_low_feeds. */
#define LAST_INTERVALS 5

/* A shorter plan begins to brake for its end soon. Unit: stopping ways.
 * Evidence: `bench planner`, bench/planner_parts.py. */
#define JUST_COVERS 2.6

/* Such a plan is made anew after so much of it. Unit: share. Evidence: `bench
 * planner`, bench/planner_parts.py. */
#define JUST_REFRESH 0.1

/* A window must be so much longer than what is left of the plan. Unit: share.
 * Evidence: `bench planner`, bench/planner_parts.py. */
#define TAIL_MORE 1.15

/* Squared speed over the tail's that is allowed where the feeds before allow
 * it. Unit: share. Evidence: test_feed_hold_distance. */
#define TAIL_AND 1.003

/* The same elsewhere: plan upon plan it adds up. Unit: share. Evidence:
 * test_feed_hold_distance. */
#define TAIL_ONLY 1.0005

/* Squared speed over the cap before: room for a solver that starts at the
 * cap. Unit: share. Evidence: test_feed_hold_distance. */
#define ABOVE_BEFORE 1.001

/* A reach beyond it is no longer shortened by an old failure. Unit: mm.
 * Evidence: `bench planner`, bench/planner_parts.py. */
#define REACH_FORGOTTEN 1e4

/* A window that fails is solved again over so much of it. Unit: share.
 * Evidence: `bench planner`, bench/planner_parts.py. */
#define SHORTER 0.5

/* So often. Unit: count. Evidence: `bench planner`, bench/planner_parts.py. */
#define SHORTER_TRIES 4

/* After a success the reach grows by it. Unit: factor. Evidence: `bench
 * planner`, bench/planner_parts.py. */
#define LONGER 2.0

/* Of the guess, at the second try from rest. Unit: share. Evidence:
 * test_extreme_limits. */
#define SHRINK 0.25

/* A slow move from rest to rest is slowed down by it until it is legal. Unit:
 * share. Evidence: test_extreme_limits. */
#define FALLBACK_SCALE 0.7

/* So often. Unit: count. Evidence: test_extreme_limits. */
#define FALLBACK_TRIES 40

/* So much slower over a quarter of the way than before: the move is limited by
 * its length, and no shorter one is tried. Unit: share. Evidence:
 * test_curve_tips. */
#define FALLBACK_SLOWER 0.5

/* Quarters of quarters of the window that such a move is tried over: where axes
 * outrun the path it may begin with nanometres. Unit: count. Evidence:
 * test_extreme_limits, test_a_way_that_begins_with_nanometres. */
#define FALLBACK_LENGTHS 16

/* ---- The solver's use, between solver and checker ---- */

/* At the most: a window that fails costs more than that. More than half of
 * those that fail would end within 60 to 100 and gain no time. Unit:
 * iterations. Evidence: bench/planner_parts.py, test_planner_optimum. */
#define WINDOW_ITERATIONS 50

/* Of the limits: with less acceleration at the guess a block has no rows for
 * it, and with less speed none for caps and floors.  With 0.6 programs that
 * acceleration binds take 1.4 times the iterations. Unit: share. Evidence:
 * `bench planner`, test_bows.
 */
#define ROWS_FAR 0.4

/* Of the jerk that turns an acceleration from limit to limit within an
 * interval: with more of it the rows of acceleration are there from the start.
 * With 0.25 the same, with 0.5 windows fail. Unit: share. Evidence:
 * test_quick_axes. */
#define QUICK 0.125

/* The same at a pause: with more it gets them. Unit: share. Evidence: `bench
 * planner`. */
#define ROWS_NEAR 0.8

/* Of the guess: below it an unfinished solution creeps and is not taken.
 * Unit: share. Evidence: bench/planner_parts.py, test_planner_optimum. */
#define CREEPS 0.1

/* Gap at which the solver stops once, looks inside the intervals and sets their
 * bows. 0.1, with a second time at 0.01: 5 to 12 % more work. Unit: share of
 * the objective. Evidence: `bench planner`. */
#define PAUSE 0.3

/* The same at the second time. Unit: share of the objective. Evidence: `bench
 * planner`. */
#define PAUSE_AGAIN 0.03

/* Ratio of a solution that the solver goes on from. Unit: share. Evidence:
 * `bench planner`. */
#define NEARLY 1.05

/* Rows that were changed meanwhile, over the first residuals: with 1e-3 8 %
 * more work. Unit: share. Evidence: `bench planner`, test_slower_plan. */
#define MISSED_SO 1e-4

/* Solutions that are checked before a window or a stop has failed. With 3 the
 * stops of test_feed_hold_on_bends are longer. Unit: count. Evidence:
 * bench/planner_parts.py, test_planner_optimum, test_feed_hold_on_bends. */
#define TIGHTENINGS 4

/* Beyond this ratio of the checker nothing is lowered. Unit: share. Evidence:
 * test_jerk_planner_limits, test_unequal_jerk. */
#define TIGHTEN_UP_TO 1.6

/* Of the jerk limit: it is never lowered below it. Unit: share. Evidence:
 * test_jerk_planner_limits, test_unequal_jerk. */
#define TIGHTEST 0.3

/* Ratio that a lowered interval should come to. Unit: share. Evidence:
 * test_jerk_planner_limits, test_unequal_jerk. */
#define AIM 1.003

/* Of the cap on the squared speed where the feed was exceeded inside an
 * interval. Unit: share. Evidence: test_low_feeds. */
#define SLOWER_BY 0.99

/* Of the limit: jerks below it do not matter inside an interval. Unit: share.
 * Evidence: bench/planner_parts.py, test_planner_optimum. */
#define FORESEEN 0.9

/* Of jerk inside to that at the ends: above it a bow is asked for, and what the
 * bow leaves lowers the limit. Unit: share.
 * Evidence: bench/planner_parts.py, test_planner_optimum. */
#define FORESEEN_FROM 1.003

/* Jerks at the ends of an interval count as no further below the limit: they
 * may be higher inside. 0.02 and 0.1: up to 5 % more work. Unit: share.
 * Evidence: `bench planner`. */
#define BOW_NEAR 0.05

/* The most that a bow may take. 0.07 saves no work, and one of 150 programs on
 * unequal axes takes 1.04 of its time; without bows arcs take twice the work.
 * Unit: share of the jerk limit. Evidence: `bench planner`. */
#define BOW_MOST 0.05

/* Ahead of a check an interval is looked at at the ends of so many parts of its
 * time. Unit: count. Evidence: `bench planner`. */
#define FORESEEN_PARTS 4

/* Where the third derivative or the speed changes much over an interval the
 * check looks at the ends of so many parts as well. Unit: count. Evidence:
 * legality of random programs. */
#define UNEVEN_PARTS 9

/* The speed does where its square comes to less than so much of what it was.
 * Unit: share. Evidence: legality of random programs. */
#define UNEVEN_SPEEDS 0.25

/* It looks there too where the path jerk changes its sign while an acceleration
 * comes so near to its limit. Unit: share. Evidence:
 * test_an_acceleration_is_largest_between_the_places_looked_at. */
#define SWING_NEAR 0.85

/* And where the jerk of an axis changes from so much of its limit to as much
 * with the other sign. Unit: share. Evidence: test_unequal_jerk (blends). */
#define SWING_JERK 0.5

/* Ratio inside an interval from which it is made finer. Unit: share.
 * Evidence: test_jerk_planner_limits, test_unequal_jerk. */
#define FINER_FROM 1.08

/* It is made finer too where so little of the limit is planned with; where
 * work is scarce already on the way. Unit: share. Evidence:
 * test_jerk_planner_limits, test_unequal_jerk. */
#define FINER_BELOW 0.85

/* Of what was above the limit: where a lower limit leaves more, an interval is
 * made finer. Unit: share. Evidence: test_same_motion. */
#define FINER_STAYS 0.5

/* Of the length, that a finer interval has. Unit: share. Evidence:
 * bench/planner_parts.py, test_planner_optimum. */
#define FINER_STEPS 0.55

/* Grids that are made finer before a window has failed. Unit: count.
 * Evidence: bench/planner_parts.py, test_planner_optimum. */
#define FINER_TRIES 4

/* The same of shorter windows. Unit: count. Evidence: bench/planner_parts.py,
 * test_planner_optimum. */
#define FINER_SHORTER 2

/* Lowered limits that cost more make intervals finer. Unit: share of the
 * time. Evidence: bench/planner_parts.py, test_planner_optimum. */
#define FINER_LOSS 2e-3

/* Of the limit: intervals below it are made finer then. Unit: share.
 * Evidence: bench/planner_parts.py, test_planner_optimum. */
#define FINER_TIGHT 0.98

/* They are made finer for so much more inside, of second order in the step.
 * Unit: share. Evidence: bench/planner_parts.py, test_planner_optimum. */
#define FINER_BULGE 0.02

/* Of the length, at once. Unit: share. Evidence: bench/planner_parts.py,
 * test_planner_optimum. */
#define FINER_LEAST 0.4

/* Of the length: less gains nothing. Unit: share. Evidence:
 * bench/planner_parts.py, test_planner_optimum. */
#define FINER_ENOUGH 0.8

/* ---- Feed hold and ramps down ---- */

/* Of a brake that is integrated in time, over the longest one. Unit: steps.
 * Evidence: test_feed_hold_distance. */
#define BRAKE_STEPS 300

/* Of the time on a line: no brake lasts longer. Unit: share. Evidence:
 * test_feed_hold_distance. */
#define BRAKE_LONGEST 3.0

/* Of the limits, that such a brake uses. Unit: share. Evidence:
 * test_feed_hold_distance. */
#define BRAKE_SHARE 0.987

/* Of the likely way to rest: a brake may be so much longer. Unit: ways.
 * Evidence: test_feed_hold_distance. */
#define BRAKE_WAYS 3.0

/* Halvings of the moment when its second ramp begins. Unit: count. Evidence:
 * test_feed_hold_distance. */
#define BRAKE_TRIES 16

/* An axis that follows the path with less of its speed limits no brake. Unit:
 * of the direction. Evidence: test_feed_hold_distance. */
#define BRAKE_LEAST_RATE 0.02

/* Of the stored tail: a stop has to be shorter. Unit: share. Evidence:
 * test_feed_hold_distance. */
#define ALMOST 0.999

/* Of the solver, for a fall that is a guess only. Unit: iterations. Evidence:
 * test_feed_hold_on_bends. */
#define FALL_ITERATIONS 18

/* Of the plan's squared speed: to this it is slowed down where no stop is found
 * yet. Unit: share. Evidence: test_feed_hold_on_bends. */
#define SLOWER_FOR_NOW 0.0625

/* Of the squared speed that is asked for: there the fall has ended. Unit:
 * share. Evidence: test_feed_hold_on_bends. */
#define FALL_ENDS 2.25

/* Of the estimated way of such a stop: the first one that is tried is so much
 * longer. Unit: share. Evidence: test_feed_hold_on_bends. */
#define STOP_MORE 0.01

/* With each failure that grows so. Unit: factor. Evidence:
 * test_feed_hold_on_bends. */
#define STOP_MORE_GROWS 3.0

/* So many are tried. Unit: count. Evidence: test_feed_hold_on_bends. */
#define STOPS_NEAR 4

/* Of the stop that was found: none is looked for that is shorter by less. Unit:
 * share. Evidence: test_feed_hold_on_bends. */
#define STOP_NEARLY_SHORTEST 0.02

/* Of the least gap so far: with a larger one the solver gives a stop up. It
 * saves a sixth of the work of holds. Unit: factor. Evidence: `bench planner`
 * (live). */
#define STOP_GAP_RISES 10.0

/* Of the solver, for one stopping distance. Unit: iterations. Evidence:
 * test_feed_hold_distance. */
#define STOP_ITERATIONS 28

/* Of the rows' first residuals: a stop or a fall that fails with less left is
 * tried again, with lowered limits. Unit: share.
 * Evidence: test_feed_hold_distance, `bench planner` (live). */
#define NEARLY_MET 0.02

/* Share of the jerk limits that shorter stops are planned with: with
 * JERK_USABLE the circle misses 1.05. Unit: share. Evidence:
 * test_feed_hold_distance (circle). */
#define STOP_USABLE 1.006

/* Of the stop that was found: the next one is so much shorter, half of it where
 * there is none. Unit: share. Evidence: test_feed_hold_distance (circle). */
#define STOP_SHORTER 0.04

/* So many are tried: from a slowed plan to a third of its way. With 10 one hold
 * of a hundred took 1.05 to 1.24 of the shortest. Unit: count. Evidence:
 * test_feed_hold_on_bends. */
#define STOPS_SHORTER 30

/* Of the stop on a straight line: a plan that is longer by less stays. Unit:
 * share. Evidence: test_feed_hold_distance. */
#define CLOSE_ENOUGH 0.01

/* As TRY_AGAIN_S, in a preview. Unit: s. Evidence: test_place_of_standstill. */
#define PREVIEW_STEP_S 0.003

/* It grows by this, so that looking ahead takes a bounded time. Unit: factor.
 * Evidence: test_place_of_standstill. */
#define PREVIEW_GROWS 1.3

/* Of the speed that is lost while the deceleration ends: with less the path
 * comes to rest first. Unit: share. Evidence: test_feed_hold_distance. */
#define MUST_REST 1.1

/* A stored tail so much longer than the estimate is a stop already. Unit:
 * share. Evidence: test_feed_hold_distance. */
#define NEAR_ENOUGH 1.05

/* ---- Work that motion earns ---- */

/* Work that a second of motion earns for windows: iterations, each times the
 * intervals. Planning then takes about a twentieth of the motion time at the
 * most. 2e5: up to a sixth more work on saw-teeth, which take as long. Unit:
 * 1/s. Evidence: `bench planner` (hostile), test_unequal_jerk,
 * test_work_earned. */
#define WINDOW_WORK_PER_S 1.8e5

/* Iterations' worth of guess, grid and check that a solve has beside them.
 * Unit: iterations. Evidence: `bench planner`. */
#define BESIDE_ITERATIONS 6

/* An iteration of an interval with more axes than these is more work than one
 * unit: it takes as long as 1 + axes. On one machine that is 0.30 us with 3,
 * 0.35 with 4, 0.46 with 5 and 6. Unit: axes. Evidence: test_work_earned. */
#define SPACE_AXES 3

/* So much is there at first, is kept for harder places, and may be owed for
 * what the operator asks for. With three times as much saw-teeth of 1 to 4 s
 * take up to 0.11 of the motion time for planning, and 0.92 to 1.07 of it for
 * their motion; with half as much they take 1.02 to 1.3. Unit: as spent.
 * Evidence: `bench planner` (saw-teeth), test_work_earned. */
#define WORK_KEPT 1e5

/* A window may take so much in any case: from rest something must be planned.
 * Unit: as spent. Evidence: `bench planner` (saw-teeth), test_work_earned. */
#define LEAST_WORK 1e4

/* Of what is kept: with less there, work is scarce. Windows are longer then,
 * fewer of their intervals are made finer, and what was found over longer steps
 * is the guess. Unit: share. Evidence: `bench planner` (saw-teeth). */
#define SCARCE 0.7

/* Room for more intervals where work is scarce: of a longer window more is
 * driven before it brakes for its end. Unit: intervals. Evidence: `bench
 * planner` (saw-teeth). */
#define SCARCE_EXTRA 400

/* ---- Other speeds while it moves ---- */

/* Other speeds that come sooner behind the last ones are answered by a short
 * window first. Unit: s of motion. Evidence: `bench planner` (wave),
 * test_lookahead_epochs. */
#define CALM_S 0.05

/* A plan whose speeds are below it does not depend on what is asked for. Unit:
 * share of the speed asked for. Evidence: test_changed_override. */
#define FAR_BELOW 0.95

/* Work that a second of motion earns for other speeds that come all the time:
 * iterations, each times the intervals. Unit: 1/s. Evidence: `bench planner`
 * (wave). */
#define WORK_PER_S 4e4

/* They wait no longer than this. Unit: s. Evidence: `bench planner` (wave). */
#define EARNED_MAX_S 0.03

/* But for plans so dear that they would take more than a twentieth of the
 * motion time. Unit: 1/s. Evidence: random programs under waves and ramps. */
#define WORK_MAX_PER_S 2.2e5

/* Of the way to rest: a window for other speeds is so long. Unit: ways.
 * Evidence: `bench planner` (live). */
#define NEAR_WAYS 1.3

/* A plan for other speeds counts so long before the next one. Unit: s.
 * Evidence: `bench planner` (live). */
#define NEAR_S 0.03

/* Of the way to rest from the speed asked for: a window behind a change of
 * speeds is so long, and ... Over the whole look-ahead it takes up to twice the
 * work of planning. Unit: ways. Evidence: `bench planner` (live). */
#define CHANGE_WAYS 3.0

/* ... so much longer. Unit: s. Evidence: `bench planner` (live). */
#define CHANGE_S 0.1

/* Times such a window: the plan that follows it reaches so far, for what is
 * told of the path ahead. Unit: factor. Evidence: test_lookahead_epochs. */
#define REFILL_WAYS 6.0

/* A first answer is driven so long before a plan follows that reaches further.
 * Unit: s. Evidence: test_lookahead_epochs. */
#define NEXT_COMMIT_S 0.0101

/* A fall of the speed that goes on is driven so long before the next plan.
 * With 0.01 the contour with steps of the override takes 1.3 times the work,
 * with 0.04 the deepest fall on arcs 142 instead of 112 ms. Unit: s. Evidence:
 * test_orders_take_effect, `bench planner` (live). */
#define FALL_SEEN_S 0.03

/* Of the shortest time down: a fall that takes longer goes on. Unit: share.
 * Evidence: test_orders_take_effect, `bench planner` (live). */
#define FALL_TIMES 1.2

/* Such windows are tried before the present plan stays. Unit: count.
 * Evidence: `bench planner` (live). */
#define NEAR_TRIES 3

/* Each is so much longer than the last. Unit: factor. Evidence: `bench
 * planner` (live). */
#define NEAR_LONGER 1.8

/* Of the shortest way down: so long is that of the first guess. Unit: share.
 * Evidence: `bench planner` (live). */
#define FALL_WAYS 1.5

/* Of the objective's other parts: speed that is too high counts so much of
 * them. 1.0: twice as many falls fail. Unit: factor. Evidence: `bench planner`
 * (live). */
#define PULL 0.05

/* Of the squared speed that is asked for, or of the guess: a fall goes no
 * deeper. Unit: share. Evidence: test_orders_take_effect. */
#define FALL_FLOOR 0.95

/* Of the present squared speed: one plan falls no deeper. Unit: share.
 * Evidence: `bench planner` (live). */
#define DEEPEST_FALL 0.25

/* Of the squared speed that is asked for: a plan that comes to no more may stop
 * to be planned from rest. Unit: share. Evidence: test_orders_take_effect. */
#define NEXT_TO_REST 1e-4

/* Ways to rest over which the present plan is looked at in short parts: a fall
 * ends there. Unit: ways. Evidence: test_a_deep_drop_ahead_of_a_long_line. */
#define FINE_WAYS 3.0

/* Of these ways: such a part. Unit: count. Evidence:
 * test_a_deep_drop_on_arcs. */
#define FINE_PARTS 24.0

/* Of the squared speed that is asked for: a plan above it comes down. Unit:
 * share. Evidence: test_low_feeds. */
#define FASTER 1.004

/* Of the same: more is too fast. Unit: share. Evidence: rounding. */
#define ABOVE_ASKED 1.000001

/* ---- The plan, slowed down (slower.c) ---- */

/* In which a fall of the speed must be able to end. Unit: intervals. Evidence:
 * test_slower_plan. */
#define SLOWER_STEPS 160

/* Between the deepest step and the known way, until one lands. Unit: count.
 * Evidence: test_slower_plan. */
#define SLOWER_HALVINGS 12

/* Falls that are checked, each with less of the limits where the last one had
 * too much. Unit: count. Evidence: test_slower_plan. */
#define SLOWER_TRIES 4

/* Ratio that such a place should come to. Unit: share. Evidence:
 * test_slower_plan. */
#define SLOWER_AIM 0.98

/* Of the squared speed asked for: what a fall aims at. TAIL_ONLY times that is
 * less, so behind the fall the next window reaches what is asked for. Unit:
 * share. Evidence: test_channel_control (external speed). */
#define SLOWER_UNDER 0.9994

/* Of that: no fall goes below it. Unit: share. Evidence: test_slower_plan. */
#define SLOWER_CLOSE 0.999

/* An axis that c moves by less says nothing of it. Unit: 1, scaled. Evidence:
 * rounding. */
#define SLOWER_NO_SLOPE 1e-12

/* Of the solver, for a fall that is deeper than that of the plan. Unit:
 * iterations. Evidence: `bench planner` (live). */
#define SINK_ITERATIONS 16

/* Solutions that are checked for such a fall. Unit: count. Evidence:
 * `bench planner` (live). */
#define SINK_TRIES 2

/* ---- Length of planner intervals ---- */

/* Over the ramp from rest to full acceleration. Unit: intervals. Evidence:
 * bench/planner_parts.py, test_planner_optimum. */
#define RAMP_PARTS 5.5

/* Over the way from full speed to rest. Unit: intervals. Evidence:
 * bench/planner_parts.py, test_planner_optimum. */
#define STOP_PARTS 80.0

/* Parts of that ramp next to a standstill. Unit: intervals. Evidence:
 * bench/planner_parts.py, test_planner_optimum. */
#define STANDSTILL_PARTS 60.0

/* Of that ramp on a line: one interval from rest, over which constant jerk is
 * exact. Unit: parts. Evidence: bench/planner_parts.py, test_planner_optimum.
 */
#define JOINED_PARTS 6.0

/* Of the longest interval: no step at a standstill is finer. Unit: parts.
 * Evidence: test_extreme_limits. */
#define FINEST_PARTS 2000.0

/* No speed counts that is not reached from rest over it. Unit: mm. Evidence:
 * test_extreme_limits. */
#define LONGEST_WAY 1e4

/* No interval need be shorter: it counts on machines below 1 mm/s. Unit: mm.
 * Evidence: test_extreme_limits. */
#define SLOW_STEP 2e-4

/* No interval need be shorter than the way in it. Unit: s. Evidence:
 * test_extreme_limits. */
#define SLOW_TIME 0.01

/* In one planner interval. 0.12 takes 5 % less work and 0.02 % more time on
 * contours. Unit: rad. Evidence: bench/planner_parts.py, test_planner_optimum.
 */
#define MAX_TURN 0.085

/* Change of an axis rate over its jerk limit in one interval, of the largest
 * such rate. Unit: share. Evidence: test_jerk_planner_limits,
 * test_unequal_jerk. */
#define LEAN 0.14

/* No interval need be shorter than the way driven in so much of a cycle, at
 * the speed in reach. 0.25: a quarter more work with quick axes, 0.01 % of the
 * time, a trochoid 0.1 %. 1.0: a third less, up to 0.6 % of the time. Unit:
 * cycles. Evidence: test_same_motion. */
#define FAST_CYCLES 0.5

/* The way driven in so much of a cycle is short enough for that: saw-teeth with
 * jerk limits 138 times apart take a third of the work. Unit: cycles. Evidence:
 * `bench planner` (saw-teeth), test_unequal_jerk. */
#define LEAN_CYCLES 0.25

/* Of either from rest: under constant path jerk the axes see nine times the
 * change. Unit: share. Evidence: bench/planner_parts.py,
 * test_planner_optimum. */
#define STANDSTILL_TURN 0.08

/* Of that or of the pushed interval: the finest that an interval is made
 * later on. Unit: parts. Evidence: bench/planner_parts.py,
 * test_planner_optimum. */
#define LEAST_PARTS 16.0

/* Nor is it made shorter than is driven in so much of a cycle: tips of curves
 * would fill the window. 0.1: twice the work where jerk limits are far apart.
 * 0.25: up to 1.5 % of the time there. Unit: cycles. Evidence: test_curve_tips,
 * test_work_earned. */
#define LEAST_CYCLES 0.2

/* A pushed interval so much shorter than what it may turn by turns next to
 * not at all. Unit: factor. Evidence: bench/planner_parts.py,
 * test_planner_optimum. */
#define LITTLE_TURN 3.0

/* Growth of the spacing with the distance from a standstill. 0.35 or 0.5
 * saves no iterations or costs 0.5 %, 0.15 halves the blocks a second. Unit:
 * mm per mm. Evidence: bench/planner_parts.py, test_planner_optimum. */
#define GRADING 0.25

/* The same near a standstill on curves. Unit: mm per mm. Evidence:
 * bench/planner_parts.py, test_planner_optimum. */
#define STANDSTILL_GRADING 0.1

/* Of a window that ends at a stand: no step at a standstill is longer. 24: up
 * to 1.6 % more time between stands; 400: 4 % more work. Unit: parts. Evidence:
 * test_same_motion. */
#define STAND_PARTS 250.0

/* The same where a window or a stop ends at rest somewhere else. Unit: parts.
 * Evidence: test_orders_take_effect. */
#define END_PARTS 24.0

/* Over so many of them STANDSTILL_GRADING holds. Unit: longest steps. Evidence:
 * bench/planner_parts.py, test_planner_optimum. */
#define RAMP_STEPS 6.0

/* Of a line, that one interval from rest may take: half of the way is four
 * ramps of jerk. Unit: share. Evidence: bench/planner_parts.py,
 * test_planner_optimum. */
#define STANDSTILL_SHARE (1.0 / 20.0)

/* Of the way in which jerk changes the feed, for the same interval. Unit:
 * share. Evidence: test_low_feeds. */
#define STANDSTILL_FEED (1.0 / 12.0)

/* Of the pushed interval, that it may take in any case. Unit: share.
 * Evidence: bench/planner_parts.py, test_planner_optimum. */
#define STANDSTILL_MOST (1.0 / 3.0)

/* Of its length: the step behind it. Unit: share. Evidence:
 * bench/planner_parts.py, test_planner_optimum. */
#define BEHIND_STANDSTILL 0.2

/* Of a stop at least. Unit: intervals. Evidence: test_feed_hold_distance. */
#define STOP_STEPS 60

/* Change of the third derivatives in one interval, of the largest. Unit:
 * share. Evidence: bench/planner_parts.py, test_planner_optimum. */
#define BEND_STEP 0.5

/* Of the third derivatives at the ends of an interval: one in the middle that
 * is so much larger counts, and BEND_STEP then as soon as it reaches the limit.
 * Unit: factor. Evidence: test_same_motion. */
#define PEAKS 1.2

/* BEND_STEP counts where at the speed in reach it would take so many times the
 * jerk limit. Unit: factor. Evidence: bench/planner_parts.py,
 * test_planner_optimum. */
#define BEND_MATTERS 10.0

/* BEND_FINER counts where it would take so many times and the interval turns
 * next to not at all. Unit: factor. Evidence: bench/planner_parts.py,
 * test_planner_optimum. */
#define BEND_DECIDES 50.0

/* As BEND_STEP, in blends of small angles. Unit: share. Evidence:
 * bench/planner_parts.py, test_planner_optimum. */
#define BEND_FINER 0.2

/* Of the length in which jerk changes a low speed: the grid step there. Unit:
 * share. Evidence: test_low_feeds. */
#define SLOW 0.5

/* The same at a knot that is passed slowly. 0.5: chains of tangential arcs take
 * 1.02 to 1.04 of their time. 0.05: 0.97 to 0.99, but each plan differs from
 * the last, so what is told of it is off by up to 8 %. Unit: share. Evidence:
 * test_arcs_between_jumps, test_lookahead_epochs. */
#define SLOW_KNOT 0.25

/* Of the step at a standstill: the finest where the path goes on slowly.
 * Unit: share. Evidence: test_low_feeds. */
#define SLOWEST_STEP 0.1

/* The same at knots that are passed slowly, between which it grows again.
 * Unit: share. Evidence: test_low_feeds. */
#define SLOWEST_KNOT 2e-3

/* Of the speed at the end of the window, where the plan comes to rest. Unit:
 * share. Evidence: bench/planner_parts.py, test_planner_optimum. */
#define SLOW_TAIL 0.6

/* ---- Jumps of the derivatives at knots ---- */

/* That jumps of derivatives may use. Joints that use more of it together leave
 * the rest to the intervals around. Unit: share of the jerk limit. Evidence:
 * test_joints_in_a_cycle, test_corners_to_and_fro_within_cycles. */
#define JUMP_SHARE 0.5

/* An acceleration step over the cycle shows as a jerk of so much in samples.
 * Unit: share. Evidence: test_joints_in_a_cycle. */
#define STEP_SEEN 0.75

/* That the continuous motion keeps beside jumps and between joints. Unit: share
 * of the limits of acceleration and jerk. Evidence: test_joints_in_a_cycle. */
#define LEAST_SHARE 0.25

/* What the path does where only the axes limit it stays far below so much of
 * what all of them do together. Unit: times. Evidence:
 * tests/unit/planning/test_limits_of_the_path.py. */
#define PATH_FREE 10.0

/* Jumps below it at the present cap need no reserve. Unit: share of the jerk
 * limit. Evidence: test_joints_in_a_cycle. */
#define SMALL_JUMP 1e-3

/* That a jump of the direction, or joints together, may use: nothing is set
 * aside for it. Unit: share of the acceleration limit. Evidence:
 * test_joints_in_a_cycle. */
#define JOINTS_FREE 0.012

/* That joints use together: beyond it they are passed more slowly. Unit: share
 * of the limit of acceleration, and of jerk where they turn to and fro.
 * Evidence: test_joints_in_a_cycle, test_corners_a_few_cycles_apart. */
#define JOINTS_MOST 0.75

/* A smaller change of it is none. Unit: of the direction. Evidence: rounding.
 */
#define NO_TURN 1e-9

/* That are remembered behind the head. Unit: joints. Evidence:
 * test_joints_in_a_cycle. */
#define TURNED_MAX 64u

/* ---- Rows of the window's problem ---- */

/* Path jerk inside an interval over that at its ends that is left to the
 * checker. Unit: share. Evidence: bench/planner_parts.py,
 * test_planner_optimum, test_osai_dynamics. */
#define SWELLS 1.003

/* The most of it that is set aside, by the guess. Unit: share. Evidence:
 * bench/planner_parts.py, test_planner_optimum. */
#define SWELLS_MOST 1.1

/* Cost of the squared jerk: it keeps solutions from chattering. Unit: share
 * of the objective. Evidence: bench/planner_parts.py, test_planner_optimum. */
#define CALM 1e-3

/* Behind the start, whose rows have more room. Unit: intervals. Evidence:
 * bench/planner_parts.py, test_planner_optimum. */
#define ENTRY_STAGES 8

/* Room of the first of them: without it every thirtieth window has no
 * solution. Unit: share. Evidence: bench/planner_parts.py,
 * test_planner_optimum. */
#define ENTRY_SLACK 0.01

/* First step of a window that begins in motion: of the squared speed over the
 * acceleration there. The squared speed changes by twice that share over it.
 * With 0.2 a window that begins in the steepest rise fails. Unit: share.
 * Evidence: test_windows_in_a_rise. */
#define ENTRY_STEP 0.1

/* Rows that differ by less are the same. Unit: share. Evidence: rounding. */
#define SAME_ROW 1e-6

/* Of the largest squared speed: below it a gain counts no more. Unit: share.
 * Evidence: bench/planner_parts.py, test_planner_optimum. */
#define SLOWEST 1e-5

/* Of its limit, that an axis needs at full speed: below it it has no rows.
 * Unit: share. Evidence: test_extreme_limits. */
#define IDLE 1e-7

/* Rows by the input of a machine that does 10 mm/s. Unit: 1, scaled.
 * Evidence: test_extreme_limits. */
#define ORDINARY 1e-3

/* Of the guess, below which the squared speed may not fall. 0.04 costs 6 % on
 * the raster. Unit: share. Evidence: bench/planner_parts.py,
 * test_planner_optimum. */
#define GUESS_FLOOR 0.2

/* ---- The solver's start ---- */

/* Of the acceleration limits, that the guess uses. Unit: share. Evidence:
 * bench/planner_parts.py, test_planner_optimum. */
#define EASY_ACC 0.45

/* Of the jerk limits, that the guess uses. 0.6 takes 5 % fewer iterations and
 * is slower where limits are unequal. Unit: share. Evidence:
 * bench/planner_parts.py, test_planner_optimum. */
#define EASY_JERK 0.5

/* Of the squared speed at which a bend alone takes all of an acceleration: a
 * guess that is made faster has no more. Unit: factor. Evidence:
 * test_quick_axes. */
#define HARD_BEND 2.0

/* Of the caps of feed and machine, that the guess uses. Unit: share.
 * Evidence: bench/planner_parts.py, test_planner_optimum. */
#define EASY_SPEED 0.9

/* Of what curvature allows, that the guess uses. Unit: share. Evidence:
 * bench/planner_parts.py, test_planner_optimum. */
#define EASY_BEND 0.6

/* A guess is not below it, and what divides neither. Unit: squared speed,
 * scaled. Evidence: rounding. */
#define TINY 1e-14

/* Keeps the projection's cost positive. Unit: 1, scaled. Evidence:
 * test_extreme_limits. */
#define GUESS_LEAST_COST 1e-12

/* Of what the inputs make of x over an interval: their least cost where the
 * speed is a thousandth of others, or rounding decides. Unit: share. Evidence:
 * test_a_deep_drop_on_arcs. */
#define GUESS_SHARE 1e-8

/* Of the squared speed from one knot to the next while it brakes. Unit:
 * share. Evidence: test_feed_hold_distance. */
#define LEAST_KEPT 0.05

/* Weight of jerk against the distance from the profile. Unit: share.
 * Evidence: bench/planner_parts.py, test_planner_optimum. */
#define STIFFNESS 0.05

/* The same for profiles that a solution may be near to: stops, and what was
 * solved for before. Unit: share. Evidence: test_feed_hold_distance,
 * bench/planner_parts.py. */
#define CLOSE_STIFFNESS 0.01

/* A guess is made faster so often. Unit: count. Evidence: `bench planner`. */
#define GROW_ROUNDS 4

/* Of the limits, that it then uses. Unit: share. Evidence: `bench planner`
 * (0.6 to 1.0 take the same work). */
#define GROW_GOAL 0.75

/* Its squared speed grows at most so much at a time. Unit: factor. Evidence:
 * `bench planner`. */
#define GROW_MOST 2.0

/* Such growths differ so much from knot to knot. Unit: factor. Evidence: `bench
 * planner`. */
#define GROW_STEP 1.25

/* Where the nearest profile is below so much of it, a guess stays. Unit:
 * share. Evidence: `bench planner`. */
#define GROW_LEAST 0.3

/* Growth below it is none. Unit: share, in the mean. Evidence: `bench planner`.
 */
#define GROWN 0.03

/* ---- The interior-point method ---- */

/* Of the guess: tangents, and the slope of the time, are not taken below it.
 * Unit: share. Evidence: bench/planner_parts.py, test_planner_optimum. */
#define LOWEST 0.3

/* Of the way to the boundary, that a step takes. Unit: share. Evidence:
 * `bench planner`. */
#define TO_BOUNDARY 0.995

/* Of a step: below it slacks of missed rows are opened. Without, 15 of 157
 * windows of the contour fail instead of two. Unit: share. Evidence: `bench
 * planner`. */
#define STUCK 0.03

/* The step of the multipliers is at most so many times that of the iterate:
 * the time curves, so both belong together. Without, windows of saw-teeth and
 * waves diverge. Unit: factor. Evidence: test_work_earned, `bench planner`. */
#define DUAL_STEP 4.0

/* Barrier of the first iterate, over all rows. Unit: share of the objective.
 * Evidence: `bench planner`. */
#define START_MU 2.0

/* Least slack of the first iterate. Unit: share of the bound. Evidence:
 * `bench planner`. */
#define START_SLACK 0.3

/* Least product of slack and multiplier, over the product that the step aims
 * at. Unit: share. Evidence: `bench planner`. */
#define CENTRED 0.1

/* The solver has ended below it. Unit: share of the objective. Evidence:
 * bench/planner_parts.py, test_planner_optimum. */
#define GAP 3e-4

/* The same where the speed should fall: it weighs little where it has. With GAP
 * it stays 0.8 % below what is asked for. Unit: share of the objective.
 * Evidence: test_slower_plan. */
#define FALL_GAP 6e-6

/* A gap that has grown to it is given up. 1e6: up to 14 % more work with steps
 * of the override, for stops that are too short. Unit: share of the objective.
 * Evidence: test_extreme_limits, `bench planner` (live). */
#define HOPELESS 1e2

/* Cost of a change of the jerk within an interval where nothing is gained by
 * it. Unit: times CALM. Evidence: bench/planner_parts.py,
 * test_planner_optimum. */
#define EVEN 170.0

/* Keeps every stage's cost positive. Unit: 1, scaled. Evidence:
 * test_extreme_limits. */
#define STAGE_LEAST_COST 1e-14

/* Of the first residuals: rows with less left are met. Unit: share. Evidence:
 * test_jerk_planner_limits, test_unequal_jerk. */
#define ROWS_MET 1e-6

/* ---- Laws and lines ---- */

/* Newton steps to the time over an interval. Unit: count. Evidence:
 * test_jerk_planner. */
#define DURATION_STEPS 12

/* A step below it ends them: what is left is about its square. Unit: share.
 * Evidence: rounding. */
#define DURATION_CLOSE 1e-7

/* Of the way by the time, over the mean speed: it is one root, and stays it
 * with other roundings. Unit: share. Evidence: test_jerk_planner. */
#define LEAST_SLOPE 0.1

/* Lines that differ by less are one line. Unit: of the direction. Evidence:
 * rounding. */
#define SAME_DIRECTION 1e-12

/* Shorter phases are left out. Unit: s. Evidence: rounding. */
#define LEAST_PHASE 1e-12

/* Of the time that the present plan takes over the line: a profile to its end
 * is quicker, though it rests there. Unit: share. Evidence:
 * test_a_raised_override_ends_a_crawl_on_lines. */
#define LINE_QUICKER 0.5

/* Halvings of the speed by way of which a line is driven, or of its braking.
 * Unit: 1. Evidence: rounding. */
#define LINE_HALVINGS 60

/* ---- The acceleration-limited sibling (topp2.c) ---- */

/* Share of the acceleration limits that is planned with. Unit: share.
 * Evidence: bench/planner_programs.py, test_acceleration_limited. */
#define TOPP2_USABLE 0.9995

/* Longest interval where the caller names none. Unit: mm. Evidence:
 * bench/planner_programs.py, test_acceleration_limited. */
#define TOPP2_SPACING_MM 1.0

/* At least between two stands. Unit: intervals. Evidence:
 * bench/planner_programs.py, test_acceleration_limited. */
#define TOPP2_STOP_PARTS 8

/* Of the window that is used up before the backward pass runs again: 2.2 to
 * 3.3 steps a block. Unit: share. Evidence: test_acceleration_planner_work. */
#define TOPP2_BATCH 0.25

/* Needs that differ by less are the same. Unit: share. Evidence: rounding. */
#define TOPP2_SAME 1e-12

#endif
