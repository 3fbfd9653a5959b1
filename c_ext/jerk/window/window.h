/* One window: guess, solve, check, and the plan that comes of it. */
#ifndef JERK_WINDOW_H
#define JERK_WINDOW_H
#include "jerk/state/state.h"

/* The checker over the present problem: legal up to CHECK_SLACK. */
double check_plan(jerk_planner *planner, struct grid *grid);

/* Solve from the guess that stands in the problem; true: a legal plan stands
 * there. */
bool solve_guess(jerk_planner *planner,
                 struct grid *grid,
                 int tries,
                 int iterations);

/* A few iterations from the guess, for the guess of another problem. False:
 * they led nowhere. */
bool solve_roughly(jerk_planner *planner, int iterations);

/* Guess and solve over the grid; true: a legal plan stands in the problem. */
bool solve_window(jerk_planner *planner,
                  struct grid *grid,
                  bool warm,
                  double shrink);

/* The checked problem becomes the plan; false if the watched word is set. */
bool plan_accept(jerk_planner *planner, const struct grid *grid, bool final);

/* Way from the speed v to rest with the smallest limits along the path, mm;
 * axes that outrun it have less of theirs to give. */
double way_from(const jerk_planner *planner,
                const jerk_interval *interval,
                double v);

/* What iterates took off limits and steps is given back. */
void give_back(jerk_planner *planner, struct grid *grid);

/* What the stored tail drives stays allowed over `reach` mm. */
void allow_tail(jerk_planner *planner, struct grid *grid, double reach);

/* So do the feeds that the plan was made under, up to x = `top`. */
void allow_present(jerk_planner *planner,
                   struct grid *grid,
                   double reach,
                   double top);
#endif
