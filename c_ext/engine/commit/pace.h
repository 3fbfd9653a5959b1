/* How long the planner takes for the motion that it commits. */
#ifndef ENGINE_COMMIT_PACE_H
#define ENGINE_COMMIT_PACE_H
struct engine;

/* A commit that was timed: its CPU time and the motion that it has added, s. */
void note_pace(struct engine *engine, double cpu_s, double committed_s);

/* CPU time for each ms of motion over all timed commits, us: half of them,
 * 99 of 100, and all take no more.  Zeros where none was timed. */
void pace_quantiles(const struct engine *engine, double us_per_ms[3]);
#endif
