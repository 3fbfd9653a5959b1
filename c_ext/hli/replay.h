/* The replay loop of a PLC whose tasks are compiled: recorded changes of the
 * memory, a scan, and what it left otherwise than the recorded PLC did. */
#ifndef HLI_REPLAY_H
#define HLI_REPLAY_H
#include <stdint.h>

#include "hli/scans.h"

/* cdef begin */
/* Recorded scans: cycle, the cell's clock (and where both are shown), and where
 * the words end that the CNC changed ahead of it and the PLC changed in it
 * (`ends`, two a scan); words and values of all of them. What
 * hs_trace_differing() takes. Words that are known to differ, as recorded and
 * as they are now: `known`, `old` and `new_`. `next` and `row`: the scan and
 * the word that come next; `differing` of `found` are the result of the last
 * scan; `same` scans left what is known. */
typedef struct hs_replay {
    hs_scans *scans;
    void *cycle_at, *cell_time_at;
    uint64_t *memory, *recorded;
    const uint64_t *masks;
    const uint32_t *runs;
    const uint64_t *cycles;
    const int64_t *cell_ns;
    const uint32_t *ends, *at;
    const uint64_t *values;
    uint32_t *found;
    const uint32_t *known;
    const uint64_t *old, *new_;
    uint32_t run_count, count, next, row, differing, known_count, same;
} hs_replay;

/* Scans from `next` on: HS_OK: all are done; HS_ASIDE: behind one that left
 * something otherwise than it is known; HS_TRAPPED: a task was stopped;
 * HS_TIMEOUT: the memory never stood still. */
int hs_replay_scans(hs_replay *replay);
/* The two halves of a scan whose tasks run elsewhere. Begin: the CNC's changes,
 * the clock and the image; HS_TIMEOUT: the memory never stood still. End:
 * HS_ASIDE: the scan left something otherwise than it is known. */
int hs_replay_begin(hs_replay *replay, struct hs_image *image);
int hs_replay_end(hs_replay *replay);
/* cdef end */
#endif
