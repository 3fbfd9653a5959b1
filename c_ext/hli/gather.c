/* See gather.h. */
#include "hli/gather.h"
#include "hli/hli_layout.h"
#include "hli/sync.h"

/* Each number is loaded whole: it is never torn. */
#define LOADED(type)                                                           \
    (double)__atomic_load_n((const type *)from, __ATOMIC_RELAXED)

static double number(const void *from, uint32_t kind) {
    uint32_t bits;
    float single;
    switch (kind) {
    case HS_I8:
        return LOADED(int8_t);
    case HS_U8:
        return LOADED(uint8_t);
    case HS_I16:
        return LOADED(int16_t);
    case HS_U16:
        return LOADED(uint16_t);
    case HS_I32:
        return LOADED(int32_t);
    case HS_U32:
        return LOADED(uint32_t);
    case HS_I64:
        return LOADED(int64_t);
    case HS_U64:
        return LOADED(uint64_t);
    case HS_F32:
        bits = load_u32_relaxed(from);
        memcpy(&single, &bits, sizeof single);
        return single;
    case HS_F64:
        return load_f64_relaxed(from);
    default:
        return 0.0;
    }
}

void hs_gather(const hs_item *items, uint32_t count, double *to) {
    for (uint32_t i = 0; i < count; i++) {
        to[items[i].place] =
            number(items[i].from, items[i].kind) * items[i].scale;
    }
}

uint64_t hs_techno_offered(const void *units, uint32_t count) {
    const TECHNO_UNIT_CH *unit = units;
    uint64_t found = 0;
    for (uint32_t i = 0; i < count && i < 64; i++) {
        found |= (uint64_t)(load_u8_acquire(&unit[i].please_rw) != 0) << i;
    }
    return found;
}
