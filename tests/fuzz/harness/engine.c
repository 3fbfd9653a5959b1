/* Rows and orders of a PLC as one stream of operations: rows are pushed when
 * the engine asks for them, some cycles run, an order comes. Samples keep the
 * limits while the rows kept what rows have to keep. */
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "chain.h"
#include "engine/state/types.h"
#include "judge.h"
#include "plc.h"
#include "targets.h"
#include "verdict.h"

#define CYCLES 700
#define BATCH 64
#define RING 4096
#define SLOW_S 30.0
#define PATIENCE 2000 /* pushes that find the ring full */

enum {
    LONG_CYCLE = 1,
    NO_JERK = 2,
    NEAR = 4,
    STORE = 8
};
enum {
    WITH_PLC = 16,
    ORDERS = 32,
    STAGES = 64,
    FORESIGHT = 128
};

struct trial {
    engine_config config;
    struct engine *engine;
    HLI_SEGMENT *segment;
    struct judge judge;
    struct rows_in in;
    struct chain *chain; /* NULL: rows go to the engine as they are */
    nc_block rows[BATCH];
    int64_t first, count;
    int mode, left; /* cycles */
    bool ended, over;
    double began_s;
};

static double cpu_s(void) {
    struct timespec now;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return (double)now.tv_sec + (double)now.tv_nsec * 1e-9;
}

static void configure(engine_config *config, int mode, int axes) {
    *config = (engine_config){.cycle_s = mode & LONG_CYCLE ? 0.004 : 0.001,
                              .axis_count = axes,
                              .window = mode & NEAR ? 5 : 16,
                              .functions = mode & FORESIGHT ? 15 : 1,
                              .esa_time = {0.05},
                              .log_max = 16,
                              .fb_storage_size = mode & STORE ? 17600 : 0,
                              .clock = 1};
    for (int i = 0; i < axes; i++) {
        config->v_max[i] = 300;
        config->a_max[i] = 3000;
        config->j_max[i] = mode & NO_JERK ? 0 : 50000;
        config->axis_id[i] = (uint32_t)i + 1;
    }
    for (int i = 0; i < 3; i++) {
        config->main[i] = i < axes ? i : -1;
    }
}

static bool is_legal(const struct trial *trial) {
    return trial->in.consistent && !trial->chain;
}

static int run(struct trial *trial, int cycles) {
    int event = engine_run(trial->engine, cycles, 0);
    engine_state state;
    judge_take(&trial->judge, trial->engine, &trial->config, is_legal(trial));
    engine_get_state(trial->engine, &state);
    if (state.fault && is_legal(trial)) {
        fuzz_broken("fault %d", state.fault);
    }
    if (event == ENGINE_FAULT) {
        trial->over = true;
    }
    return event;
}

static void push_batch(struct trial *trial, const struct batch *batch) {
    int64_t first = 0;
    for (int i = 0; first < batch->count && i < PATIENCE && !trial->over; i++) {
        int64_t taken = engine_push(trial->engine,
                                    batch->rows + first,
                                    batch->count - first,
                                    batch->pool,
                                    batch->pool_n);
        first += taken < 0 ? 1 : taken;
        if (taken == 0) {
            run(trial, 20);
        }
    }
}

static void through_stages(struct trial *trial) {
    struct batch batch =
        batch_copy(trial->rows, trial->count, trial->in.pool, trial->in.pool_n);
    struct batch out = chain_push(trial->chain, &batch, trial->ended);
    push_batch(trial, &out);
    batch_free(&batch);
    batch_free(&out);
    trial->count = 0;
}

/* The engine asks for rows. */
static void give(struct trial *trial) {
    if (trial->first >= trial->count) {
        trial->first = trial->count = 0;
        while (trial->count < BATCH && trial->in.bytes.left > 2) {
            trial->count += fuzz_row(&trial->in, &trial->rows[trial->count]);
        }
        trial->ended = !trial->count;
        if (trial->chain) {
            through_stages(trial);
        }
        if (trial->ended) {
            engine_finish(trial->engine);
            return;
        }
    }
    if (trial->first < trial->count) {
        int64_t taken = engine_push(trial->engine,
                                    trial->rows + trial->first,
                                    trial->count - trial->first,
                                    trial->in.pool,
                                    trial->in.pool_n);
        if (taken < 0) {
            trial->in.consistent = false;
        }
        trial->first += taken < 0 ? 1 : taken;
    }
}

/* Behind a halt: the rows that come start where the axes stand. */
static void go_on(struct trial *trial) {
    engine_state state;
    engine_get_state(trial->engine, &state);
    memcpy(trial->in.position, state.position, sizeof state.position);
    trial->first = trial->count;
    engine_resync(trial->engine);
}

static void turn(struct trial *trial) {
    struct bytes *bytes = &trial->in.bytes;
    bool orders = (trial->mode & ORDERS) != 0;
    int event = run(trial, orders ? 1 + take_byte(bytes) % 8 : 51);
    engine_mode_command command;
    uint32_t id, reaction;
    trial->left -= orders ? 4 : 50;
    switch (event) {
    case ENGINE_MODE_COMMAND:
        engine_take_mode_command(trial->engine, &command);
        return;
    case ENGINE_PLC_ERROR:
        engine_take_plc_error(trial->engine, &id, &reaction);
        return;
    case ENGINE_DRAINED:
        go_on(trial);
        return;
    case ENGINE_PROGRAM_END:
    case ENGINE_PLC_FINISHED:
        trial->over = true;
        return;
    case ENGINE_NEED_BLOCKS:
        if (!trial->ended) {
            give(trial);
        }
        break;
    default:
        break;
    }
    if (orders && trial->mode & WITH_PLC) {
        if (fuzz_order(bytes, trial->segment)) {
            engine_halt(trial->engine);
        }
    }
}

static bool start(struct trial *trial, const uint8_t *data, size_t size) {
    fuzz_rows_start(&trial->in, data, size);
    trial->mode = take_byte(&trial->in.bytes);
    trial->in.axes = 2 + take_byte(&trial->in.bytes) % 5;
    fuzz_rows_pool(&trial->in);
    trial->in.raw_too = !(trial->mode & STAGES);
    configure(&trial->config, trial->mode, trial->in.axes);
    trial->left = CYCLES;
    trial->began_s = cpu_s();
    size_t room = (sizeof *trial->segment + 63) / 64 * 64;
    trial->segment = aligned_alloc(64, room);
    memset(trial->segment, 0, sizeof *trial->segment);
    trial->segment->channel[0].head.plc_present_w = 1;
    trial->engine = engine_new(&trial->config,
                               trial->mode & WITH_PLC ? trial->segment : NULL);
    if (!trial->engine) {
        return false;
    }
    if (trial->mode & STAGES) {
        trial->chain = chain_new(trial->in.axes, trial->in.position);
    }
    engine_record(trial->engine, RING);
    engine_set_synch(trial->engine, NC_M, 20, SYNCH_MVS_SVS, 0);
    judge_start(&trial->judge, trial->engine);
    return true;
}

int fuzz_engine(const uint8_t *data, size_t size) {
    if (size < 12) {
        return -1;
    }
    struct trial *trial = calloc(1, sizeof *trial);
    if (start(trial, data, size)) {
        while (trial->left > 0 && !trial->over) {
            turn(trial);
            if (cpu_s() - trial->began_s > SLOW_S) {
                fuzz_broken("%d cycles take over %g s",
                            CYCLES - trial->left,
                            SLOW_S);
                break;
            }
        }
        judge_end(&trial->judge);
        engine_free(trial->engine);
    }
    if (trial->chain) {
        chain_free(trial->chain);
    }
    free(trial->segment);
    free(trial);
    return 0;
}
