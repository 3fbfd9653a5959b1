/* External variables (V.E): the program reads what the last cycle has latched and writes for the next one.
 *
 * So a lockstep run is the same every time although preparation and a PLC's scan run side by side.
 */
#include <stdlib.h>
#include <string.h>
#include "engine/state/state.h"

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
    external_write writes[EXTERNAL_WRITES];
    uint64_t head, done;
    uint32_t commands_at, command_slots, commands; /* of the global area: bytes, blocks; how many so far */
};

static uint8_t *shared(engine *e, uint32_t area) {
    return area == 0 ? (uint8_t *)&e->segment->ext_var_channel[e->cfg.channel] : (uint8_t *)&e->segment->ext_var_global;
}

uint8_t *engine_external(engine *e, uint32_t area, uint32_t bytes) {
    if (area > 1 || bytes > sizeof(HLI_EXT_VAR)) return NULL;
    if (!e->external) e->external = calloc(1, sizeof *e->external);
    if (!e->external) return NULL;
    e->external->bytes[area] = bytes;
    if (e->segment) memcpy(e->external->latched[area], shared(e, area), bytes);
    return e->external->latched[area];
}

int engine_write_external(engine *e, uint32_t area, uint32_t offset, const uint8_t *data, uint32_t length) {
    struct external_vars *v = e->external;
    if (!v || area > 1 || length > WRITE_BYTES || offset > sizeof(HLI_EXT_VAR) || length > sizeof(HLI_EXT_VAR) - offset) return -1;
    uint64_t head = ATOMIC_GET(v->head);
    if (head - ATOMIC_GET(v->done) >= EXTERNAL_WRITES) return 0;
    external_write *w = &v->writes[head % EXTERNAL_WRITES];
    w->area = area;
    w->offset = offset;
    w->length = length;
    memcpy(w->data, data, length);
    ATOMIC_SET(v->head, head + 1);
    return 1;
}

int engine_show_commands(engine *e, uint32_t offset, uint32_t slots) {
    struct external_vars *v = e->external;
    if (!v || !slots || offset % EXTERNAL_BLOCK || offset + (uint64_t)(slots + 1) * EXTERNAL_BLOCK > sizeof(HLI_EXT_VAR)) return -1;
    v->commands_at = offset;
    v->command_slots = slots;
    return 0;
}

/* The path has passed a command: its number, then the count. */
void external_command(engine *e, double value) {
    struct external_vars *v = e->external;
    if (!v || !e->segment || !v->command_slots) return;
    uint8_t *counter = shared(e, 1) + v->commands_at, *slot = counter + EXTERNAL_BLOCK * (1 + v->commands % v->command_slots);
    uint64_t number = (uint32_t)(int32_t)value, count = ++v->commands & INT32_MAX;
    store_u64_relaxed(slot, number);
    store_u64_release(counter, count);
}

void external_free(engine *e) { free(e->external); }

/* Once a cycle: the program's writes go out, then everything is latched. */
void external_cycle(engine *e) {
    struct external_vars *v = e->external;
    if (!v || !e->segment) return;
    for (uint64_t head = ATOMIC_GET(v->head); v->done < head; ATOMIC_SET(v->done, v->done + 1)) {
        const external_write *w = &v->writes[v->done % EXTERNAL_WRITES];
        memcpy(shared(e, w->area) + w->offset, w->data, w->length);
    }
    for (uint32_t area = 0; area < 2; area++)
        for (uint32_t i = 0; i + 8 <= v->bytes[area]; i += 8)
            store_u64_relaxed(v->latched[area] + i, load_u64_relaxed(shared(e, area) + i));
}
