/* The dispatch's jobs that need standstill: turning back, leaving out what is
 * left of a motion, ending the program. */
#ifndef ENGINE_RUN_STANDSTILL_JOBS_H
#define ENGINE_RUN_STANDSTILL_JOBS_H
#include "engine/state/state.h"

bool standstill_job_pending(struct engine *engine);
void dispatch_begin_program(struct engine *engine);
void do_standstill_jobs(struct engine *engine);
#endif
