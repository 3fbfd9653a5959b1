/* Memory that the planner writes is there before it plans, as it is in real
 * time (threads.c locks it): the first touch of a page takes the kernel longer
 * than the planner takes for a block. */
#ifndef ENGINE_STATE_MEMORY_H
#define ENGINE_STATE_MEMORY_H
#include "engine/state/state.h"

/* Large pages for what is touched in its time. */
void memory_large(void *memory, size_t bytes);
void memory_touch(void *memory, size_t bytes);
#endif
