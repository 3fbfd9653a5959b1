#include "hli/trace.h"

#include "hli/sync.h"

#define PART 32u /* words that are looked at together: most stay the same */

static const uint64_t *word_of(const hs_stretch *stretch, uint32_t i) {
    return (const uint64_t *)stretch->source + i;
}

/* Whether any of the words differs from the copy. A hint: while the other side
 * writes, the next look finds what this one has missed. */
static int part_differs(const hs_stretch *stretch,
                        uint32_t begin,
                        uint32_t end,
                        const uint64_t *copy) {
    return memcmp(word_of(stretch, begin),
                  copy + begin,
                  (end - begin) * sizeof *copy)
           != 0;
}

static int guard_stands(hs_stretch *stretch) {
    if (stretch->guard == NULL) {
        return 0;
    }
    uint32_t now = load_u32_acquire(stretch->guard);
    int stands = now == stretch->seen;
    stretch->seen = now;
    return stands;
}

uint32_t hs_trace_changes(hs_stretch *stretches,
                          uint32_t count,
                          uint64_t *copy,
                          uint32_t *at,
                          uint64_t *values) {
    uint32_t found = 0;
    for (hs_stretch *stretch = stretches; stretch < stretches + count;
         stretch++) {
        if (guard_stands(stretch)) {
            continue;
        }
        uint64_t *mine = copy + stretch->first;
        for (uint32_t begin = 0; begin < stretch->words; begin += PART) {
            uint32_t rest = stretch->words - begin;
            uint32_t end = begin + (rest < PART ? rest : PART);
            if (!part_differs(stretch, begin, end, mine)) {
                continue;
            }
            for (uint32_t i = begin; i < end; i++) {
                uint64_t now = load_u64_relaxed(word_of(stretch, i));
                if (now != mine[i]) {
                    mine[i] = now;
                    at[found] = stretch->first + i;
                    values[found++] = now;
                }
            }
        }
    }
    return found;
}

/* 0xff in every byte that is not zero. */
static uint64_t changed_bytes(uint64_t difference) {
    uint64_t mask = 0;
    for (uint32_t byte = 0; byte < 64u; byte += 8u) {
        uint64_t all = (uint64_t)0xff << byte;
        mask |= (difference & all) != 0 ? all : 0;
    }
    return mask;
}

void hs_trace_apply(uint64_t *memory,
                    uint64_t *recorded,
                    const uint32_t *at,
                    const uint64_t *values,
                    uint32_t count) {
    for (uint32_t i = 0; i < count; i++) {
        uint64_t *word = recorded + at[i];
        if (memory != NULL) {
            uint64_t mask = changed_bytes(*word ^ values[i]);
            uint64_t *mine = memory + at[i];
            *mine = (*mine & ~mask) | (values[i] & mask);
        }
        *word = values[i];
    }
}

uint32_t hs_trace_differing(const uint64_t *memory,
                            const uint64_t *recorded,
                            const uint64_t *masks,
                            const uint32_t *runs,
                            uint32_t run_count,
                            uint32_t *at) {
    uint32_t found = 0;
    for (uint32_t run = 0; run < run_count; run++) {
        uint32_t first = runs[2 * run], words = runs[2 * run + 1];
        if (memcmp(memory + first, recorded + first, words * sizeof *memory)
            == 0) {
            continue;
        }
        for (uint32_t i = first; i < first + words; i++) {
            if (((memory[i] ^ recorded[i]) & masks[i]) != 0) {
                at[found++] = i;
            }
        }
    }
    return found;
}
