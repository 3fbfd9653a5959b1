/* External variables (V.E): the program reads what the last cycle has latched
 * and writes for the next one.
 *
 * So a lockstep run is the same every time although preparation and a PLC's
 * scan run side by side.
 */
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include "engine/geo/external.h"
#include "engine/state/state.h"
#include "hli/sync.h"

#define EXTERNAL_WRITES 4096u
#define WRITE_BYTES 160u
#define EXTERNAL_BLOCK 24u

typedef struct external_write {
    uint32_t area, offset, length;
    uint8_t data[WRITE_BYTES];
} external_write;

struct external_vars {
    uint8_t latched[2][sizeof(HLI_EXT_VAR)];
    uint32_t bytes[2]; /* latched from each area */
    struct external_write writes[EXTERNAL_WRITES];
    uint64_t head, done;
    uint32_t commands_at, command_slots,
        commands; /* of the global area: bytes, blocks; how many so far */
};

static uint8_t *shared(struct engine *engine, uint32_t area) {
    return area == 0 ? (uint8_t *)&engine->hli.segment
                           ->ext_var_channel[engine->cfg.channel]
                     : (uint8_t *)&engine->hli.segment->ext_var_global;
}

uint8_t *engine_external(struct engine *engine, uint32_t area, uint32_t bytes) {
    if (area > 1 || bytes > sizeof(HLI_EXT_VAR)) {
        return NULL;
    }
    if (!engine->external) {
        engine->external = calloc(1, sizeof *engine->external);
    }
    if (!engine->external) {
        return NULL;
    }
    engine->external->bytes[area] = bytes;
    if (engine->hli.segment) {
        memcpy(engine->external->latched[area], shared(engine, area), bytes);
    }
    return engine->external->latched[area];
}

int engine_write_external(struct engine *engine,
                          uint32_t area,
                          uint32_t offset,
                          const uint8_t *data,
                          uint32_t length) {
    struct external_vars *external_vars = engine->external;
    bool fits = length <= WRITE_BYTES && offset <= sizeof(HLI_EXT_VAR)
                && length <= sizeof(HLI_EXT_VAR) - offset;
    if (!external_vars || area > 1 || !fits) {
        return -1;
    }
    uint64_t head = ATOMIC_GET(external_vars->head);
    if (head - ATOMIC_GET(external_vars->done) >= EXTERNAL_WRITES) {
        return 0;
    }
    struct external_write *external_write =
        &external_vars->writes[head % EXTERNAL_WRITES];
    external_write->area = area;
    external_write->offset = offset;
    external_write->length = length;
    memcpy(external_write->data, data, length);
    ATOMIC_SET(external_vars->head, head + 1);
    return 1;
}

int engine_show_commands(struct engine *engine,
                         uint32_t offset,
                         uint32_t slots) {
    struct external_vars *external_vars = engine->external;
    uint64_t end = offset + (uint64_t)(slots + 1) * EXTERNAL_BLOCK;
    bool fits = offset % EXTERNAL_BLOCK == 0 && end <= sizeof(HLI_EXT_VAR);
    if (!external_vars || !slots || !fits) {
        return -1;
    }
    external_vars->commands_at = offset;
    external_vars->command_slots = slots;
    return 0;
}

void external_command(struct engine *engine, double value) {
    struct external_vars *external_vars = engine->external;
    if (!external_vars || !engine->hli.segment
        || !external_vars->command_slots) {
        return;
    }
    uint8_t *counter = shared(engine, 1) + external_vars->commands_at,
            *slot = counter
                    + EXTERNAL_BLOCK
                          * (1
                             + external_vars->commands
                                   % external_vars->command_slots);
    uint64_t number = (uint32_t)(int32_t)value,
             count = ++external_vars->commands & INT32_MAX;
    store_u64_relaxed(slot, number);
    store_u64_release(counter, count);
}

/* Lowest and highest number of a type, and its bytes. */
static const struct {
    double low, high;
    uint32_t bytes;
} TYPES[EXTERNAL_TYPES] = {
    [EXTERNAL_BOOLEAN] = {0.0, 1.0, 1},
    [EXTERNAL_SGN08] = {INT8_MIN, INT8_MAX, 1},
    [EXTERNAL_UNS08] = {0.0, UINT8_MAX, 1},
    [EXTERNAL_SGN16] = {INT16_MIN, INT16_MAX, 2},
    [EXTERNAL_UNS16] = {0.0, UINT16_MAX, 2},
    [EXTERNAL_SGN32] = {INT32_MIN, INT32_MAX, 4},
    [EXTERNAL_UNS32] = {0.0, UINT32_MAX, 4},
};

double external_number(const struct engine *engine, const engine_rt_op *op) {
    if (!engine->external) {
        return 0.0;
    }
    uint64_t word =
        load_u64_relaxed(engine->external->latched[op->area] + op->at);
    double value;
    switch (op->kind) {
    case EXTERNAL_SGN08:
        return (int8_t)word;
    case EXTERNAL_SGN16:
        return (int16_t)word;
    case EXTERNAL_UNS16:
        return (uint16_t)word;
    case EXTERNAL_SGN32:
        return (int32_t)word;
    case EXTERNAL_UNS32:
        return (uint32_t)word;
    case EXTERNAL_REAL64:
        memcpy(&value, &word, sizeof value);
        return isfinite(value) ? value : 0.0;
    default:
        return (uint8_t)word;
    }
}

void external_set(struct engine *engine, const engine_rt_op *op, double value) {
    if (!engine->external || !engine->hli.segment) {
        return;
    }
    uint64_t word;
    uint32_t bytes = sizeof word;
    if (op->kind == EXTERNAL_REAL64) {
        memcpy(&word, &value, sizeof word);
    } else {
        double held =
            op->kind == EXTERNAL_BOOLEAN ? value != 0.0 : round(value);
        held = fmin(fmax(held, TYPES[op->kind].low), TYPES[op->kind].high);
        word = (uint64_t)(int64_t)held;
        bytes = TYPES[op->kind].bytes;
    }
    uint8_t *place = shared(engine, op->area) + op->at,
            *latched = engine->external->latched[op->area] + op->at;
    memcpy(place, &word, bytes);
    store_u64_relaxed(latched, load_u64_relaxed(place));
}

void external_free(struct engine *engine) {
    free(engine->external);
}

void external_cycle(struct engine *engine) {
    struct external_vars *external_vars = engine->external;
    if (!external_vars || !engine->hli.segment) {
        return;
    }
    for (uint64_t head = ATOMIC_GET(external_vars->head);
         external_vars->done < head;
         ATOMIC_SET(external_vars->done, external_vars->done + 1)) {
        const struct external_write *external_write =
            &external_vars->writes[external_vars->done % EXTERNAL_WRITES];
        memcpy(shared(engine, external_write->area) + external_write->offset,
               external_write->data,
               external_write->length);
    }
    for (uint32_t area = 0; area < 2; area++) {
        for (uint32_t i = 0; i + 8 <= external_vars->bytes[area]; i += 8) {
            store_u64_relaxed(external_vars->latched[area] + i,
                              load_u64_relaxed(shared(engine, area) + i));
        }
    }
}
