#include "cell.h"

#include <string.h>

#include "engine/state/types.h"
#include "verdict.h"

#define VARIABLES 240u /* bytes of an area */
#define OPS 24u
#define LOOKED_AT 16

/* M and H functions 10 .. 19 are of these types; M20 is of inputs that know no
 * others. */
static const uint32_t types[] = {SYNCH_MOS,
                                 SYNCH_MVS_SVS,
                                 SYNCH_MVS_SNS,
                                 SYNCH_MNS_SNS,
                                 SYNCH_MVS_SLM,
                                 SYNCH_MVS_SLP,
                                 SYNCH_MEP_SVS,
                                 SYNCH_MET_SVS,
                                 SYNCH_MVS_SVS | SYNCH_BWD,
                                 SYNCH_MVS_SVS | SYNCH_FWD};
#define TYPES (sizeof types / sizeof *types)

void cell_start(struct bytes *bytes, struct engine *engine) {
    double ahead = take_byte(bytes) * 1000.0; /* 0.1 um, or us */
    for (uint32_t i = 0; i < TYPES; i++) {
        engine_set_synch(engine, NC_M, 10 + i, types[i], ahead);
        engine_set_synch(engine, NC_H, 10 + i, types[i], ahead);
    }
    uint8_t tool = take_byte(bytes);
    engine_set_synch(engine, NC_T, 0, types[tool % TYPES], 0);
    engine_hold_start(engine, tool > 250);
    for (uint32_t i = 0; i < 20; i++) {
        engine_set_spindle_synch(engine, i, types[i % 4]);
    }
    engine_external(engine, 0, VARIABLES);
    engine_external(engine, 1, VARIABLES);
    engine_show_commands(engine, 0, 4);
    engine_tell_standstill(engine, 5);
}

/* Operands that an instruction takes. */
static uint32_t taken_by(uint32_t code) {
    switch (code) {
    case ENGINE_RT_BINARY:
        return 2;
    case ENGINE_RT_CONSTANT:
    case ENGINE_RT_LOOP_ENABLED:
    case ENGINE_RT_LOOP_COUNT:
    case ENGINE_RT_POSITION:
    case ENGINE_RT_EXTERNAL:
    case ENGINE_RT_JUMP:
        return 0;
    default:
        return 1;
    }
}

static bool is_jump(const engine_rt_op *op) {
    return op->code == ENGINE_RT_JUMP || op->code == ENGINE_RT_UNLESS;
}

static uint32_t held_behind(const engine_rt_op *op, uint32_t held) {
    bool takes_only =
        op->code >= ENGINE_RT_SET_ENABLED && op->code <= ENGINE_RT_SET_EXTERNAL;
    takes_only |= is_jump(op) || op->code == ENGINE_RT_SET_COUNT;
    return held - taken_by(op->code) + !takes_only;
}

static engine_rt_op operation(struct bytes *bytes, int axes) {
    uint8_t what = take_byte(bytes), place = take_byte(bytes);
    engine_rt_op op = {.code = what & 15, .area = what >> 4 & 1};
    bool outside =
        op.code == ENGINE_RT_EXTERNAL || op.code == ENGINE_RT_SET_EXTERNAL;
    op.kind = outside ? place % 9 : place;
    op.at =
        op.code == ENGINE_RT_POSITION ? place % (uint32_t)axes : place / 9 * 8u;
    if (op.code == ENGINE_RT_UNARY) {
        op.kind %= ENGINE_RT_ACOT + 1;
    } else if (op.code == ENGINE_RT_BINARY) {
        op.kind %= ENGINE_RT_MAX + 1;
    } else if (op.code == ENGINE_RT_CONSTANT) {
        op.value = take_number(bytes);
    }
    return op;
}

/* Instructions whose depths fit; jumps go to the end. */
static uint32_t program(struct bytes *bytes, engine_rt_op *ops, int axes) {
    uint32_t count = 0, held = 0, wanted = take_byte(bytes) % OPS;
    while (count < wanted && bytes->left) {
        engine_rt_op op = operation(bytes, axes);
        bool jumps_full = is_jump(&op) && held > taken_by(op.code);
        if (op.code > ENGINE_RT_SET_COUNT || held < taken_by(op.code)
            || jumps_full) {
            op.code = ENGINE_RT_LOOP_COUNT;
        }
        held = held_behind(&op, held);
        ops[count++] = op;
    }
    for (; held; held--) {
        ops[count++] = (engine_rt_op){.code = ENGINE_RT_SET_EXTERNAL,
                                      .kind = held % 9,
                                      .at = held * 8};
    }
    for (uint32_t i = 0; i < count; i++) {
        if (is_jump(&ops[i])) {
            ops[i].at = count;
        }
    }
    return count;
}

static void rt_cycle(struct bytes *bytes, struct engine *engine, int axes) {
    engine_rt_op ops[2 * OPS];
    uint8_t what = take_byte(bytes);
    uint32_t count = what & 4 ? program(bytes, ops, axes) : 0;
    engine_rt_cycle(engine, what >> 4 & 3, what & 3, what >> 3 & 1, ops, count);
}

static void write_external(struct bytes *bytes, struct engine *engine) {
    uint8_t data[8], what = take_byte(bytes);
    for (size_t i = 0; i < sizeof data; i++) {
        data[i] = take_byte(bytes);
    }
    engine_write_external(engine, what & 1, what >> 1, data, 1 + what % 8);
}

static void post_error(struct bytes *bytes, struct engine *engine) {
    engine_error error = {.id = take_byte(bytes), .line = take_byte(bytes)};
    engine_post_error(engine, &error);
    engine_set_error(engine, error.id);
    engine_set_program_name(engine, error.line & 1 ? "part.nc" : "");
}

/* What the cell may read at any time. */
static void look(struct engine *engine) {
    engine_standstill standstill;
    engine_element elements[LOOKED_AT];
    engine_command command;
    engine_get_standstill(engine, &standstill);
    engine_elements(engine, 0, elements, LOOKED_AT);
    while (engine_take_command(engine, &command)) {
    }
}

enum cell_wish cell_act(struct bytes *bytes,
                        struct engine *engine,
                        const engine_config *config,
                        bool alone) {
    uint8_t act = take_byte(bytes), more = act >> 4;
    switch (act % 16) {
    case 0:
    case 1:
    case 2:
        rt_cycle(bytes, engine, config->axis_count);
        break;
    case 3:
        write_external(bytes, engine);
        break;
    case 4:
        engine_hold_by_cell(engine, more & 1);
        engine_hold(engine, more >> 1 & 1);
        break;
    case 5:
        engine_macro_runs(engine, more & 1);
        break;
    case 6:
        engine_set_mode(engine, 2, 3 + more % 4);
        break;
    case 7:
        engine_suppress_functions(engine, more & 1);
        break;
    case 8:
        post_error(bytes, engine);
        break;
    case 9:
        engine_stall_planner(engine, more & 1);
        break;
    case 10: /* held by cell_start alone: it is for axes that stand */
        engine_hold_start(engine, 0);
        break;
    case 11:
        if (alone) {
            engine_set_override(engine, more / 8.0, take_byte(bytes) & 1);
        }
        break;
    case 12:
        engine_rehearse(engine);
        break;
    case 13:
        engine_expect_cycle(engine);
        look(engine);
        break;
    case 14:
        if (more & 1) {
            engine_expect_drain(engine);
            return CELL_DRAIN;
        }
        break;
    default:
        if (more > 12) {
            engine_abort(engine);
            return CELL_ABORT;
        }
    }
    return CELL_NOTHING;
}
