/* Tuning of the engine: what is committed ahead, fed ahead, kept behind. Every
 * number, its unit and effect; those of a planner are in its own room.
 */
#ifndef ENGINE_STATE_TUNING_H
#define ENGINE_STATE_TUNING_H

/* Commits. Evidence: worst plans of 0.9 to 1.4 ms, planner's page. */
/* s: less motion ahead of GEO, and more is committed, ... */
#define COMMIT_LOW_S 0.010
#define COMMIT_HIGH_S 0.020 /* s: ... up to this */
/* s: ... or up to this, pumped on one thread without jerk, where no order has
 * changed since the last commit ... */
#define COMMIT_FAR_S 1.0
/* pieces: ... and no further than so many, so that the window keeps its room */
#define FAR_PIECES 40u
#define COMMIT_LOW_CYCLES 2.0  /* cycles: at least so many, ... */
#define COMMIT_HIGH_CYCLES 4.0 /* cycles: ... and so many */
/* cycles: the lower bound where every cycle pumps and phases are not cut */
#define PUMPED_CYCLES 3.0
/* cycles ahead below which GEO may take the tail in this cycle */
#define LAST_CYCLES 1.5
#define PARTS_MAX 64    /* parts of a phase */
#define SHORT_PART 0.05 /* cycles: no part of a phase is shorter */
#define SAME_TIME 1e-9  /* s: times that are the same */
#define EXACT_PUMPS 64  /* pumps timed each by the CPU clock, later ones ... */
#define TIMED_SHARE 16  /* ... one in so many, at random */

/* Causes of time (time_causes.c). Evidence: tests/unit/planning/
 * test_time_by_cause.py. */
/* share of the speed: less change in a cycle is none */
#define CAUSE_FLAT 1e-4
#define CAUSE_REACHED 0.99 /* share of a limit that has reached it */
/* rad, about: a smaller change of direction is none */
#define CAUSE_TURN 1e-4
#define CAUSE_NEAR_CYCLES 2 /* cycles: a corner so long ago is a low end */
/* pieces of a cycle that are looked at, at the most */
#define CAUSE_PIECES 64

/* Taking back and rejoining. Evidence: feed hold against a search over all
 * stops, tests/unit/engine/test_feed_hold_distance.py. */
/* s: motion left to GEO while a planner thread computes the stop, ... */
#define RECALL_MARGIN_S 0.006
#define RECALL_MARGIN_CYCLES 2.0 /* cycles: ... and at least so many */
/* cycles: a place to rejoin at is at least so far ahead of GEO */
#define REJOIN_MARGIN_CYCLES 3.0
/* cycles of the tail behind it: for less it is driven to its end */
#define REJOIN_LEFT_CYCLES 5.0

/* Dispatch. Evidence: blocks per second of `bench planner`. */
/* pieces beyond the window: what corner limits mostly look at, ... */
#define FED_NEAR 64u
#define FED_AT_ONCE 8u  /* pieces: ... of which so many may be missing, ... */
#define FED_AHEAD 1064u /* pieces: ... and at the most */
/* pieces beyond the window in a real-time loop, whose end is decided late */
#define LOOP_AHEAD 8u

/* Motions too short to be driven. */
#define SHORT_MM 1e-7 /* mm: together they are not longer, ... */
/* rows: ... nor more than so many; the PLC goes from element to element */
#define SHORT_ROWS 2048u
/* mm: shorter arcs and polynomials take no displacement */
#define FADE_MM 1e-4

/* Limits of pieces. */
/* share of the acceleration for the normal direction; 0.6 is left for the
 * tangent */
#define ARC_NORMAL 0.8
/* share of the acceleration that constant bounds plan with */
#define POLYNOMIAL_USABLE 0.98
/* mm by which a row's length and start may differ from its coefficients' */
#define LENGTH_MISS 1e-6
/* mm: what is left of a cell counts as the next one's */
#define CELL_LEAST 1e-7
#define BOUND_POINTS 5 /* points of a cell at which bounds are taken */
/* the largest override: plans under a lower one hold when it comes */
#define OVER_FEED 2.0
#define BETWEEN 1.2 /* factor: v2 may be that much larger between points */

/* Threads. Evidence: wake times of `bench cycle`. */
/* SCHED_FIFO: GEO goes first; the planner goes ahead of all that keeps no
 * deadline. As an ordinary thread it was away in the middle of a plan for up to
 * 0.42 s where others wanted the core, and the path stood. */
#define GEO_PRIORITY 50
#define PLANNER_PRIORITY 40
/* ns: awake for the PLC's turn; a scan in Python takes 10 us, a wake across
 * cores 20 */
#define TURN_SPIN_NS 500000
/* ns: the planner sleeps when nothing was committed */
#define PLANNER_IDLE_NS 500000
#define ROUND_POLL_NS 20000  /* ns between looks for the end of a round */
#define EVENT_POLL_NS 500000 /* ns between looks for events */
/* ns: the service stays awake behind a request, ... */
#define SERVICE_SPIN_NS 2000000
#define SERVICE_POLL_NS 1000000 /* ns: ... then looks so often */
/* ns: GEO waits awake for so long at the most, ... */
#define EARLY_MAX_NS 100000
#define EARLY_PART 10      /* ... and for this part of a cycle */
#define REHEARSAL_NS 10000 /* ns: the last of it is for the rehearsal, ... */
#define REHEARSAL_PART 50  /* ... this part of a cycle at the most */
#define EARLIER_NS 2000    /* ns: behind a wake that was late for it, ... */
/* ns: ... and behind the others: one in two hundred is late */
#define LATER_NS 10

#endif
