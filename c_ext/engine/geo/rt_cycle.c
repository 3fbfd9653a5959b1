/* Real-time cycles run through in every cycle of GEO, beside the path.
 *
 * Preparation compiles them to a few instructions of a stack machine. Jumps go
 * forward only, so that a run ends; the depth is checked once, when they are
 * handed over. A ring of mail goes from preparation to GEO.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "engine/geo/rt_cycle.h"
#include "engine/geo/commands.h"
#include "engine/geo/external.h"
#include "engine/state/state.h"
#include "maths/plain.h"

#define DEGREES (180.0 / M_PI)
#define MAIL (2u * ENGINE_RT_CYCLES)

typedef struct rt_code {
    uint32_t state; /* ENGINE_RT_DELETED .. */
    uint32_t program, count;
    engine_rt_op ops[ENGINE_RT_OPS];
} rt_code;

struct rt_cycles {
    struct rt_code codes[ENGINE_RT_CYCLES];
    uint8_t seen[ENGINE_RT_CYCLES][ENGINE_RT_OPS]; /* of $IF ONCE and others */
    struct rt_code mail[MAIL];
    uint32_t slot[MAIL];
    uint64_t asked, taken; /* preparation, GEO */
};

/* Operands that an instruction takes, and what it leaves. */
static int taken_by(const engine_rt_op *op) {
    switch (op->code) {
    case ENGINE_RT_BINARY:
        return 2;
    case ENGINE_RT_SET_ENABLED:
    case ENGINE_RT_SET_EXTERNAL:
    case ENGINE_RT_SET_COUNT:
    case ENGINE_RT_UNARY:
    case ENGINE_RT_UNLESS:
    case ENGINE_RT_ONCE:
    case ENGINE_RT_EDGE:
    case ENGINE_RT_ALWAYS:
        return 1;
    default:
        return 0;
    }
}

static int left_by(const engine_rt_op *op) {
    return op->code != ENGINE_RT_SET_ENABLED && op->code != ENGINE_RT_SET_COUNT
           && op->code != ENGINE_RT_SET_EXTERNAL && op->code != ENGINE_RT_JUMP
           && op->code != ENGINE_RT_UNLESS;
}

static bool fits(const struct engine *engine, const engine_rt_op *op) {
    bool external =
        op->code == ENGINE_RT_EXTERNAL || op->code == ENGINE_RT_SET_EXTERNAL;
    if (external) {
        return op->area <= 1 && op->kind < EXTERNAL_TYPES && op->at % 8 == 0
               && op->at <= sizeof(HLI_EXT_VAR) - 8;
    }
    return op->code <= ENGINE_RT_SET_COUNT
           && (op->code != ENGINE_RT_UNARY || op->kind <= ENGINE_RT_ACOT)
           && (op->code != ENGINE_RT_BINARY || op->kind <= ENGINE_RT_MAX)
           && (op->code != ENGINE_RT_POSITION
               || op->at < (uint32_t)engine->cfg.axis_count);
}

/* Jumps go forward and to places where nothing is held; so does the end. */
static bool sound(const struct engine *engine,
                  const engine_rt_op *ops,
                  uint32_t count) {
    uint8_t target[ENGINE_RT_OPS + 1] = {0};
    int depth = 0;
    for (uint32_t i = 0; i < count; i++) {
        bool jump =
            ops[i].code == ENGINE_RT_JUMP || ops[i].code == ENGINE_RT_UNLESS;
        if ((target[i] && depth) || !fits(engine, &ops[i])
            || depth < taken_by(&ops[i])) {
            return false;
        }
        depth += left_by(&ops[i]) - taken_by(&ops[i]);
        if (depth > ENGINE_RT_DEPTH || (jump && depth)
            || (jump && (ops[i].at <= i || ops[i].at > count))) {
            return false;
        }
        if (jump) {
            target[ops[i].at] = 1;
        }
    }
    return depth == 0;
}

int engine_rt_cycle(struct engine *engine,
                    uint32_t slot,
                    uint32_t state,
                    uint32_t program,
                    const engine_rt_op *ops,
                    uint32_t count) {
    if (slot >= ENGINE_RT_CYCLES || state > ENGINE_RT_STARTED
        || count > ENGINE_RT_OPS || !sound(engine, ops, count)) {
        return -1;
    }
    if (!engine->rt_cycles) {
        struct rt_cycles *made = calloc(1, sizeof *made);
        if (!made) {
            return -1;
        }
        ATOMIC_SET(engine->rt_cycles, made);
    }
    struct rt_cycles *rt = engine->rt_cycles;
    if (rt->asked - ATOMIC_GET(rt->taken) >= MAIL) {
        return 0;
    }
    struct rt_code *mail = &rt->mail[rt->asked % MAIL];
    rt->slot[rt->asked % MAIL] = slot;
    mail->state = state;
    mail->program = program;
    mail->count = count;
    memcpy(mail->ops, ops, count * sizeof *ops);
    ATOMIC_SET(rt->asked, rt->asked + 1);
    return 1;
}

void rt_cycles_free(struct engine *engine) {
    free(engine->rt_cycles);
}

void rt_cycles_begin_program(struct engine *engine) {
    struct rt_cycles *rt = engine->rt_cycles;
    for (uint32_t i = 0; rt && i < ENGINE_RT_CYCLES; i++) {
        if (rt->codes[i].program) {
            rt->codes[i].state = ENGINE_RT_DELETED;
        }
    }
    if (rt) {
        rt->taken = rt->asked;
    }
}

static void take_mail(struct rt_cycles *rt) {
    const struct rt_code *mail = &rt->mail[rt->taken % MAIL];
    uint32_t slot = rt->slot[rt->taken % MAIL];
    struct rt_code *code = &rt->codes[slot];
    if (mail->count) {
        code->count = mail->count;
        code->program = mail->program;
        memcpy(code->ops, mail->ops, mail->count * sizeof *code->ops);
    }
    if (mail->count || mail->state == ENGINE_RT_STARTED) {
        memset(rt->seen[slot], 0, sizeof rt->seen[slot]);
    }
    code->state = mail->state;
    ATOMIC_SET(rt->taken, rt->taken + 1);
}

/* Multiples of 90 degrees give exact values; what is not finite has no angle.
 */
static double sine(double degrees) {
    if (!isfinite(degrees)) {
        return NAN;
    }
    double turns = rint(fmod(degrees, 360.0) / 90.0);
    double rest = (fmod(degrees, 360.0) - 90.0 * turns) / DEGREES;
    int quadrant = (int)turns & 3;
    double value = quadrant & 1 ? plain_cos(rest) : plain_sin(rest);
    return (quadrant > 1 ? -value : value) + 0.0;
}

static double cosine(double degrees) {
    return fabs(degrees) < 1e6 ? sine(degrees + 90.0)
                               : plain_cos(degrees / DEGREES);
}

/* Beyond what a whole number holds there is no result. */
static double bits(double a, double b, int kind) {
    if (!(fabs(a) < 0x1p62 && fabs(b) < 0x1p62)) {
        return NAN;
    }
    int64_t x = (int64_t)round(a), y = (int64_t)round(b);
    return (double)(kind == ENGINE_RT_OR    ? x | y
                    : kind == ENGINE_RT_XOR ? x ^ y
                                            : x & y);
}

static double unary(int kind, double x) {
    switch (kind) {
    case ENGINE_RT_MINUS:
        return -x;
    case ENGINE_RT_ABS:
        return fabs(x);
    case ENGINE_RT_SQR:
        return x * x;
    case ENGINE_RT_SQRT:
        return sqrt(x);
    case ENGINE_RT_EXP:
        return plain_exp(x);
    case ENGINE_RT_LN:
        return plain_log(x);
    case ENGINE_RT_DEXP:
        return plain_pow(10.0, x);
    case ENGINE_RT_LOG:
        return log10(x);
    case ENGINE_RT_INT:
        return trunc(x);
    case ENGINE_RT_FRACT:
        return x - trunc(x);
    case ENGINE_RT_CEIL:
        return ceil(x);
    case ENGINE_RT_FLOOR:
        return floor(x);
    case ENGINE_RT_ROUND:
        return round(x);
    case ENGINE_RT_SIN:
        return sine(x);
    case ENGINE_RT_COS:
        return cosine(x);
    case ENGINE_RT_TAN:
        return sine(x) / cosine(x);
    case ENGINE_RT_COT:
        return cosine(x) / sine(x);
    case ENGINE_RT_ASIN:
        return plain_asin(x) * DEGREES;
    case ENGINE_RT_ACOS:
        return plain_acos(x) * DEGREES;
    case ENGINE_RT_ATAN:
        return plain_atan(x) * DEGREES;
    case ENGINE_RT_ACOT:
        return 90.0 - plain_atan(x) * DEGREES;
    case ENGINE_RT_INV:
        return -round(x) - 1.0;
    default:
        return x == 0.0;
    }
}

static double binary(int kind, double a, double b) {
    switch (kind) {
    case ENGINE_RT_OR_ELSE:
        return a != 0.0 || b != 0.0;
    case ENGINE_RT_EITHER:
        return (a != 0.0) != (b != 0.0);
    case ENGINE_RT_AND_ALSO:
        return a != 0.0 && b != 0.0;
    case ENGINE_RT_OR:
    case ENGINE_RT_XOR:
    case ENGINE_RT_AND:
        return bits(a, b, kind);
    case ENGINE_RT_EQUAL:
        return a == b;
    case ENGINE_RT_UNEQUAL:
        return a != b;
    case ENGINE_RT_AT_LEAST:
        return a >= b;
    case ENGINE_RT_AT_MOST:
        return a <= b;
    case ENGINE_RT_LESS:
        return a < b;
    case ENGINE_RT_GREATER:
        return a > b;
    case ENGINE_RT_PLUS:
        return a + b;
    case ENGINE_RT_DIFFERENCE:
        return a - b;
    case ENGINE_RT_TIMES:
        return a * b;
    case ENGINE_RT_OVER:
        return a / b;
    case ENGINE_RT_MOD:
        return fmod(a, b);
    case ENGINE_RT_POWER:
        return plain_pow(a, b);
    case ENGINE_RT_ATAN2:
        return plain_atan2(a, b) * DEGREES;
    case ENGINE_RT_MIN:
        return b < a ? b : a;
    default:
        return b > a ? b : a;
    }
}

/* $IF ONCE, EDGE, ALWAYS: what counts of a condition. */
static bool counts(const engine_rt_op *op, bool now, uint8_t *seen) {
    bool before = *seen != 0;
    *seen = op->code == ENGINE_RT_EDGE ? now : before || now;
    return op->code == ENGINE_RT_ALWAYS ? *seen : now && !before;
}

static double load(struct engine *engine, const engine_rt_op *op) {
    switch (op->code) {
    case ENGINE_RT_LOOP_ENABLED:
        return ATOMIC_GET(engine->orders.rt_loop) != 0;
    case ENGINE_RT_LOOP_COUNT:
        return loop_count_told(&engine->geo);
    case ENGINE_RT_POSITION:
        return engine->geo.position[op->at];
    case ENGINE_RT_EXTERNAL:
        return external_number(engine, op);
    default:
        return op->value;
    }
}

/* A value that is no number changes nothing, and is counted. */
static void store(struct engine *engine, const engine_rt_op *op, double value) {
    if (!isfinite(value)) {
        engine->orders.bad++;
    } else if (op->code == ENGINE_RT_SET_EXTERNAL) {
        external_set(engine, op, value);
    } else if (op->code == ENGINE_RT_SET_COUNT) {
        loop_count_set(&engine->geo, value);
    } else {
        program_enables_loops(engine, value != 0.0);
    }
}

/* A condition is true from 0.5 on, as of $IF, if it has a finite value. */
static bool truth(double value) {
    return isfinite(value) && fabs(value) >= 0.5;
}

static void run_through(struct engine *engine,
                        const struct rt_code *code,
                        uint8_t *seen) {
    double held[ENGINE_RT_DEPTH + 1];
    int n = 0;
    for (uint32_t i = 0; i < code->count; i++) {
        const engine_rt_op *op = &code->ops[i];
        switch (op->code) {
        case ENGINE_RT_UNARY:
            held[n - 1] = unary(op->kind, held[n - 1]);
            break;
        case ENGINE_RT_BINARY:
            n--;
            held[n - 1] = binary(op->kind, held[n - 1], held[n]);
            break;
        case ENGINE_RT_SET_ENABLED:
        case ENGINE_RT_SET_EXTERNAL:
        case ENGINE_RT_SET_COUNT:
            store(engine, op, held[--n]);
            break;
        case ENGINE_RT_JUMP:
            i = op->at - 1;
            break;
        case ENGINE_RT_UNLESS:
            i = truth(held[--n]) ? i : op->at - 1;
            break;
        case ENGINE_RT_ONCE:
        case ENGINE_RT_EDGE:
        case ENGINE_RT_ALWAYS:
            held[n - 1] = counts(op, truth(held[n - 1]), &seen[i]);
            break;
        default:
            held[n++] = load(engine, op);
        }
    }
}

void rt_cycles_run(struct engine *engine) {
    struct rt_cycles *rt = ATOMIC_GET(engine->rt_cycles);
    if (!rt) {
        return;
    }
    while (ATOMIC_GET(rt->asked) != rt->taken) {
        take_mail(rt);
    }
    for (uint32_t i = 0; i < ENGINE_RT_CYCLES; i++) {
        bool lives = !rt->codes[i].program || !engine->program.end;
        if (lives && rt->codes[i].state >= ENGINE_RT_RUNNING) {
            run_through(engine, &rt->codes[i], rt->seen[i]);
        }
    }
}
