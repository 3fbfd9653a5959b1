/* Each sample of a path against the limits of its axes. */
#ifndef FUZZ_JUDGE_H
#define FUZZ_JUDGE_H
#include <stdbool.h>

#include "calls.h"

struct judge {
    double position[NC_AXES], speed[NC_AXES];
    char *samples; /* room for JUDGE_ROWS */
    size_t bytes;  /* of a sample */
    uint64_t seen;
};

#define JUDGE_ROWS 512

void judge_start(struct judge *judge, const struct engine *engine);
void judge_end(struct judge *judge);
/* Take what the engine has recorded. `legal`: its rows kept what rows have to
 * keep, so its samples keep the limits; they are finite in any case. */
void judge_take(struct judge *judge,
                struct engine *engine,
                const engine_config *config,
                bool legal);

#endif
