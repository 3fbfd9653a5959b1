/* Rows and orders of a PLC as one stream of operations: rows are pushed when
 * the engine asks for them, some cycles run, an order comes. Samples keep the
 * limits while the rows kept what rows have to keep. */
#include <stdlib.h>
#include <string.h>
#include <time.h>

#include "cell.h"
#include "chain.h"
#include "engine/state/types.h"
#include "judge.h"
#include "more_rows.h"
#include "plc.h"
#include "targets.h"
#include "verdict.h"

#define CYCLES 700 /* of a long input; a short one has .. */
#define CYCLES_LEAST 100
#define CYCLES_PER_BYTE 6 /* .. so many more a byte */
#define BATCH 64
#define RING 256
#define PROGRAMS 3 /* at the most */
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
/* Of a second byte, where it counts the axes too. */
enum {
    MORE = 1, /* all rows, orders and acts of the cell */
    NO_JERK_TOO = 2,
    IMMEDIATE = 4,
    RETRACE = 8,
    SPINDLE = 16
};

struct trial {
    engine_config config;
    struct engine *engine;
    struct judge judge;
    struct rows_in in;
    struct more_rows more_rows;
    struct bytes behind;  /* with MORE: the bytes of orders, behind the rows */
    struct bytes *orders; /* where orders are read */
    struct chain *chain;  /* NULL: rows go to the engine as they are */
    nc_block rows[BATCH];
    int64_t first, count;
    int mode, more, left; /* cycles */
    int programs;         /* that have ended */
    bool ended, over;
    double began_s;
};

static _Alignas(64) HLI_SEGMENT segment;

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

static void configure_more(engine_config *config, int more, int axes) {
    for (int i = 0; i < axes && more & NO_JERK_TOO; i++) {
        config->j_max[i] = 0;
    }
    if (more & IMMEDIATE) {
        config->service = HLI_SERVICE_IMMEDIATE;
    }
    if (more & RETRACE) {
        config->retrace_feed = 20;
        config->rapid_override_mode = 1;
    }
    if (more & SPINDLE) {
        config->spindle_count = 1;
        config->spindle_id[0] = 9;
        config->rapid_override_mode = 2;
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

static bool next_row(struct trial *trial) {
    nc_block *row = &trial->rows[trial->count];
    if (trial->more & MORE) {
        return more_row(&trial->more_rows, row);
    }
    bool made = fuzz_row(&trial->in, row);
    if (made) {
        more_rows_see(&trial->more_rows, row);
    }
    return made;
}

/* The engine asks for rows. Orders stand between them, so a batch of an input
 * with orders is short. */
static void give(struct trial *trial) {
    int64_t most = trial->more & MORE && trial->mode & ORDERS ? 8 : BATCH;
    if (trial->first >= trial->count) {
        trial->first = trial->count = 0;
        more_rows_batch(&trial->more_rows);
        while (trial->count < most && trial->in.bytes.left > 2) {
            trial->count += next_row(trial);
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
    trial->in.consistent &= !trial->more_rows.in_loop; /* left in the middle */
    more_rows_anew(&trial->more_rows);
    engine_resync(trial->engine, 0);
}

/* The first axis goes and another one comes to its place, a slower one. */
static void exchange_axis(struct trial *trial, const engine_state *state) {
    engine_config *config = &trial->config;
    config->v_max[0] *= 0.5;
    engine_axis axis = {.v_max = config->v_max[0],
                        .a_max = config->a_max[0],
                        .j_max = config->j_max[0],
                        .position = state->position[0],
                        .area = trial->mode & WITH_PLC ? 0 : -1,
                        .number = 7,
                        .name = "X2"};
    engine_set_axis(trial->engine, 0, &axis);
}

/* The next program begins where the axes stand, if there are bytes for one. */
static void program_end(struct trial *trial) {
    engine_state state;
    if (!(trial->more & MORE) || trial->in.bytes.left < 8
        || ++trial->programs >= PROGRAMS) {
        trial->over = true;
        return;
    }
    engine_get_state(trial->engine, &state);
    memcpy(trial->in.position, state.position, sizeof state.position);
    trial->first = trial->count;
    more_rows_anew(&trial->more_rows);
    trial->ended = false;
    engine_reset_channel(trial->engine);
    if (trial->more & RETRACE) {
        exchange_axis(trial, &state);
    }
    engine_begin_program(trial->engine);
}

static void cell(struct trial *trial) {
    enum cell_wish wish = cell_act(trial->orders,
                                   trial->engine,
                                   &trial->config,
                                   !(trial->mode & WITH_PLC));
    if (wish == CELL_ABORT) {
        trial->ended = true;
        trial->first = trial->count;
    }
}

static void order(struct trial *trial) {
    struct bytes *bytes = trial->orders;
    bool wide = (trial->more & MORE) != 0;
    bool plc = (trial->mode & WITH_PLC) != 0;
    if (wide && (!plc || take_byte(bytes) % 4 == 3)) {
        cell(trial);
    } else if (plc && fuzz_order(bytes, &segment, trial->in.axes, wide)) {
        engine_halt(trial->engine);
    }
}

static void turn(struct trial *trial) {
    struct bytes *bytes = trial->orders;
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
        program_end(trial);
        return;
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
    if (orders) {
        order(trial);
    }
}

static int cycles_for(size_t size) {
    size_t cycles = CYCLES_LEAST + CYCLES_PER_BYTE * size;
    return cycles < CYCLES ? (int)cycles : CYCLES;
}

static void clear_segment(const struct trial *trial) {
    memset(&segment, 0, sizeof segment);
    segment.channel[0].head.plc_present_w = 1;
    for (int i = 0; i <= trial->in.axes; i++) {
        segment.axis[i].head.plc_present_w = (trial->more & MORE) != 0;
    }
}

/* The second byte: axes, and more. */
static void take_settings(struct trial *trial) {
    trial->mode = take_byte(&trial->in.bytes);
    uint8_t second = take_byte(&trial->in.bytes);
    trial->in.axes = 2 + second % 5;
    trial->more = second / 5;
    fuzz_rows_pool(&trial->in);
    trial->in.raw_too = !(trial->mode & STAGES);
    configure(&trial->config, trial->mode, trial->in.axes);
    configure_more(&trial->config, trial->more, trial->in.axes);
}

/* Bytes of rows and of orders keep apart, so a change of one leaves the others
 * as they are. */
static void split(struct trial *trial) {
    struct bytes *rows = &trial->in.bytes;
    trial->orders = rows;
    if (trial->more & MORE) {
        uint8_t share = take_byte(rows);
        size_t kept = rows->left * share / 256;
        trial->behind = (struct bytes){rows->next + kept, rows->left - kept};
        trial->orders = &trial->behind;
        rows->left = kept;
    }
}

static bool start(struct trial *trial, const uint8_t *data, size_t size) {
    fuzz_rows_start(&trial->in, data, size);
    take_settings(trial);
    split(trial);
    trial->left = cycles_for(size);
    trial->began_s = cpu_s();
    clear_segment(trial);
    trial->engine =
        engine_new(&trial->config, trial->mode & WITH_PLC ? &segment : NULL);
    if (!trial->engine) {
        return false;
    }
    if (trial->mode & STAGES) {
        trial->chain = chain_new(trial->in.axes, trial->in.position);
    }
    more_rows_start(&trial->more_rows, &trial->in, !trial->chain);
    engine_record(trial->engine, RING);
    engine_set_synch(trial->engine, NC_M, 20, SYNCH_MVS_SVS, 0);
    if (trial->more & MORE) {
        cell_start(&trial->in.bytes, trial->engine);
    }
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
                            cycles_for(size) - trial->left,
                            SLOW_S);
                break;
            }
        }
        engine_record_end(trial->engine);
        judge_end(&trial->judge);
        engine_free(trial->engine);
    }
    if (trial->chain) {
        chain_free(trial->chain);
    }
    free(trial);
    return 0;
}
