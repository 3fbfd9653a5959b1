/* The queue of the look-ahead extension: slots that several PLC tasks use
 * without waiting for each other. Every change of a slot's owner is one atomic
 * change of its word. */
#include <string.h>
#include "hli/hli_layout.h"
#include "hli/sync.h"

#define SLOTS (HLI_AHEAD_SLOT_MAXIDX + 1)

static uint32_t word_of(uint32_t generation, uint32_t phase) {
    return generation << 8 | phase;
}

/* Free, or left behind by another PLC. */
static int is_free(uint32_t word, uint32_t generation) {
    uint32_t phase = word & HS_SLOT_PHASE;
    int ours = word == word_of(generation, phase);
    return phase == HLI_AHEAD_FREE || (!ours && phase != HLI_AHEAD_ASKED);
}

int hs_ahead_claim(void *area, uint32_t generation) {
    HLI_AHEAD *ahead = area;
    for (int i = 0; i < SLOTS; i++) {
        uint32_t seen = load_u32_acquire(&ahead->slot_rw[i]);
        if (is_free(seen, generation)
            && __atomic_compare_exchange_n(
                &ahead->slot_rw[i],
                &seen,
                word_of(generation, HLI_AHEAD_CLAIMED),
                0,
                __ATOMIC_ACQ_REL,
                __ATOMIC_ACQUIRE)) {
            return i;
        }
    }
    return HS_BUSY;
}

void hs_ahead_ask(void *area, void *bell, uint32_t slot, uint32_t generation) {
    HLI_AHEAD *ahead = area;
    store_u32_release(&ahead->slot_rw[slot],
                      word_of(generation, HLI_AHEAD_ASKED));
    hs_ring(bell);
}

int hs_ahead_take(void *area,
                  uint32_t slot,
                  uint32_t generation,
                  void *blocks,
                  void *details,
                  void *facts) {
    HLI_AHEAD *ahead = area;
    const HLI_AHEAD_SLOT *from = &ahead->slot[slot];
    uint32_t seen = load_u32_acquire(&ahead->slot_rw[slot]);
    if (seen == word_of(generation, HLI_AHEAD_ASKED)) {
        return HS_BUSY;
    }
    if (seen != word_of(generation, HLI_AHEAD_ANSWERED)) {
        return HS_GONE;
    }
    memcpy(facts, &from->answer, sizeof from->answer);
    uint32_t count = from->answer.count,
             most = HLI_CONTOUR_LOOKAHEAD_BLOCK_MAXIDX + 1;
    count = count < most ? count : most;
    memcpy(blocks, from->block, count * sizeof from->block[0]);
    if (details) {
        memcpy(details, from->detail, count * sizeof from->detail[0]);
    }
    store_u32_release(&ahead->slot_rw[slot], HLI_AHEAD_FREE);
    return (int)count;
}

int hs_ahead_asked(const void *area, uint32_t from) {
    const HLI_AHEAD *ahead = area;
    for (uint32_t i = from; i < SLOTS; i++) {
        uint32_t word = load_u32_acquire(&ahead->slot_rw[i]);
        if ((word & HS_SLOT_PHASE) == HLI_AHEAD_ASKED) {
            return (int)i;
        }
    }
    return HS_BUSY;
}

void hs_ahead_answer(void *area, void *answer, uint32_t slot) {
    HLI_AHEAD *ahead = area;
    uint32_t *word = &ahead->slot_rw[slot];
    store_u32_release(word,
                      (load_u32_relaxed(word) & ~(uint32_t)HS_SLOT_PHASE)
                          | HLI_AHEAD_ANSWERED);
    hs_ring(answer);
}
