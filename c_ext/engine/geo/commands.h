/* What the PLC commands the channel, once a cycle: levels, overrides,
 * shortcuts, inserted stops. */
#ifndef ENGINE_GEO_COMMANDS_H
#define ENGINE_GEO_COMMANDS_H
#include "engine/state/state.h"

#define OVERRIDE_FULL 1000u /* 0.1 %: as commanded and shown */
#define OVERRIDE_MAX 2000u

void take_commands(struct engine *engine);

/* The condition of real-time loops: as the PLC commands, else the program's. */
void take_rt_loop(struct engine *engine);

/* V.RTG.LOOP.ENABLED of the program: counts where the PLC commands nothing. */
void program_enables_loops(struct engine *engine, bool enabled);

/* V.RTG.LOOP.COUNT: passes of the present or last loop that are over, from what
 * was written on. */
int32_t loop_count_told(const struct geo *geo);
void loop_count_set(struct geo *geo, double count);
#endif
