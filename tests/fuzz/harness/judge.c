#include "judge.h"

#include <math.h>
#include <stdlib.h>
#include <string.h>

#include "verdict.h"

void judge_start(struct judge *judge, const struct engine *engine) {
    memset(judge, 0, sizeof *judge);
    judge->bytes = (size_t)engine_sample_bytes(engine);
    judge->samples = malloc(JUDGE_ROWS * judge->bytes);
}

void judge_end(struct judge *judge) {
    free(judge->samples);
}

static void sample(struct judge *judge,
                   const engine_sample *taken,
                   const engine_config *config,
                   bool legal) {
    for (int i = 0; i < config->axis_count; i++) {
        double position = taken->position[i];
        double speed = (position - judge->position[i]) / config->cycle_s;
        double acceleration = (speed - judge->speed[i]) / config->cycle_s;
        bool slow = fabs(speed) <= config->v_max[i] * 1.001 + 1e-6;
        bool soft = fabs(acceleration) <= config->a_max[i] * 1.02 + 1e-3;
        if (!isfinite(position)) {
            fuzz_broken("axis %d is nowhere in cycle %llu",
                        i,
                        (unsigned long long)taken->cycle);
        } else if (legal && !(slow && soft)) {
            fuzz_broken("axis %d in cycle %llu: speed %.4f, acceleration %.4f "
                        "of the limits",
                        i,
                        (unsigned long long)taken->cycle,
                        fabs(speed) / config->v_max[i],
                        fabs(acceleration) / config->a_max[i]);
        }
        judge->position[i] = position;
        judge->speed[i] = speed;
    }
    judge->seen++;
}

void judge_take(struct judge *judge,
                struct engine *engine,
                const engine_config *config,
                bool legal) {
    int64_t count;
    while ((count = engine_record_take(engine,
                                       ENGINE_RECORD_SAMPLES,
                                       judge->samples,
                                       JUDGE_ROWS))
           > 0) {
        for (int64_t i = 0; i < count; i++) {
            char *at = judge->samples + (size_t)i * judge->bytes;
            sample(judge, (engine_sample *)at, config, legal);
        }
    }
    engine_function function[16];
    engine_request request[16];
    while (engine_record_take(engine, ENGINE_RECORD_FUNCTIONS, function, 16)
           > 0) {
    }
    while (engine_record_take(engine, ENGINE_RECORD_REQUESTS, request, 16)
           > 0) {
    }
}
