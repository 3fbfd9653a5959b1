/* Memory of a planner: one block, made once. */
#ifndef JERK_MEMORY_H
#define JERK_MEMORY_H
#include "jerk/state/state.h"

/* `to`, made with the same configuration, becomes the same planner. */
void planner_copy(jerk_planner *to, const jerk_planner *from);
#endif
