/* The replay loop of compiled tasks (see replay.h). */
#include <stddef.h>
#include "hli/replay.h"

#include "hli/sync.h"
#include "hli/trace.h"

/* The recorded words up to `end`; `memory` NULL: those of the recorded PLC. */
static void apply(hs_replay *replay, uint64_t *memory, uint32_t end) {
    uint32_t first = replay->row;
    hs_trace_apply(memory,
                   replay->recorded,
                   replay->at + first,
                   replay->values + first,
                   end - first);
    replay->row = end;
}

static int is_due(const hs_scans *scans, uint64_t cycle) {
    for (uint32_t i = 0; i < scans->count; i++) {
        if (scans->tasks[i].due <= cycle) {
            return 1;
        }
    }
    return 0;
}

/* HS_OK, HS_TIMEOUT: no image is to be had, HS_TRAPPED. */
static int scan(hs_replay *replay, uint64_t cycle, int64_t cell_ns) {
    hs_scans *scans = replay->scans;
    if (!is_due(scans, cycle)) {
        return HS_OK;
    }
    if (hs_image_latch(scans->image, HS_LATCH_TRIES) != HS_OK) {
        return HS_TIMEOUT;
    }
    if (hs_tasks_scan(scans, cycle, cell_ns, hs_monotonic_ns()) < 0) {
        return HS_TRAPPED;
    }
    hs_scans_count(scans);
    return HS_OK;
}

/* The last scan left just what is known to differ. */
static int is_known(const hs_replay *replay) {
    if (replay->differing != replay->known_count) {
        return 0;
    }
    for (uint32_t i = 0; i < replay->known_count; i++) {
        uint32_t at = replay->found[i];
        uint64_t mask = replay->masks[at];
        uint64_t old = replay->recorded[at] ^ replay->old[i];
        uint64_t new_ = replay->memory[at] ^ replay->new_[i];
        if (at != replay->known[i] || ((old | new_) & mask) != 0) {
            return 0;
        }
    }
    return 1;
}

/* What the CNC changed ahead of the next scan; the clock stands at it. */
static uint32_t begin(hs_replay *replay) {
    uint32_t i = replay->next++;
    apply(replay, replay->memory, replay->ends[2 * i]);
    store_u64_relaxed(replay->cycle_at, replay->cycles[i]);
    store_u64_relaxed(replay->cell_time_at, (uint64_t)replay->cell_ns[i]);
    return i;
}

int hs_replay_begin(hs_replay *replay, hs_image *image) {
    begin(replay);
    return hs_image_latch(image, HS_LATCH_TRIES);
}

int hs_replay_end(hs_replay *replay) {
    apply(replay, NULL, replay->ends[2 * replay->next - 1]);
    replay->differing = hs_trace_differing(replay->memory,
                                           replay->recorded,
                                           replay->masks,
                                           replay->runs,
                                           replay->run_count,
                                           replay->found);
    if (replay->differing == 0) {
        return HS_OK;
    }
    if (!is_known(replay)) {
        return HS_ASIDE;
    }
    replay->same++;
    return HS_OK;
}

int hs_replay_scans(hs_replay *replay) {
    while (replay->next < replay->count) {
        uint32_t i = begin(replay);
        int result = scan(replay, replay->cycles[i], replay->cell_ns[i]);
        if (result == HS_OK) {
            result = hs_replay_end(replay);
        }
        if (result != HS_OK) {
            return result;
        }
    }
    return HS_OK;
}
