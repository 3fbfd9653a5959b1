/* What changed in a memory, word by word, between two looks at it: recorded on
 * the PLC's side, and put back into another memory when the PLC is replayed. */
#ifndef HLI_TRACE_H
#define HLI_TRACE_H
#include <stdint.h>
/* cdef begin */
/* A stretch of words (8 bytes) that is looked at. */
typedef struct hs_stretch {
    const void *source; /* where the words are read */
    const void *guard;  /* 32 bits that change with every change; NULL: none */
    uint32_t first;     /* number of the first word in the copy */
    uint32_t words;
    uint32_t seen; /* the guard at the last look */
} hs_stretch;

/* Write the words that differ from `copy`: their numbers to `at`, what they are
 * now to `values`, both with room for all stretches; `copy` follows. Returns
 * how many. */
uint32_t hs_trace_changes(hs_stretch *stretches,
                          uint32_t count,
                          uint64_t *copy,
                          uint32_t *at,
                          uint64_t *values);
/* Put recorded words into `recorded`; the bytes that they change there go into
 * `memory` too, if it is not NULL. */
void hs_trace_apply(uint64_t *memory,
                    uint64_t *recorded,
                    const uint32_t *at,
                    const uint64_t *values,
                    uint32_t count);
/* Numbers of the words of `runs` (first word and length, alternating) that
 * differ under `masks`, written to `at`. Returns how many. */
uint32_t hs_trace_differing(const uint64_t *memory,
                            const uint64_t *recorded,
                            const uint64_t *masks,
                            const uint32_t *runs,
                            uint32_t run_count,
                            uint32_t *at);
/* cdef end */
#endif
