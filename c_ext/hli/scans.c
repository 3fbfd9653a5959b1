/* The scan loop of a PLC (see scans.h). */
#include "hli/scans.h"

#include "hli/hli_layout.h"
#include "hli/sync.h"

/* How far is the period from the interval? */
static void note_period(hs_task *task, int64_t at_ns) {
    if (task->started_ns >= 0) {
        int64_t off = at_ns - task->started_ns - task->interval_ns;
        off = off < 0 ? -off : off;
        task->jitter_ns = off > task->jitter_ns ? off : task->jitter_ns;
    }
    task->started_ns = at_ns;
}

static void note_time(hs_task *task, int64_t ns) {
    if (task->scans == 0 || ns < task->shortest_ns) {
        task->shortest_ns = ns;
    }
    task->longest_ns = ns > task->longest_ns ? ns : task->longest_ns;
    task->total_ns += ns;
    task->scans++;
}

/* The next due cycle behind `now`; intervals without a scan are missed. */
static void schedule(hs_task *task, uint64_t now) {
    task->due += task->interval;
    if (task->due <= now) {
        uint64_t missed = (now - task->due) / task->interval + 1;
        task->missed += missed;
        task->due += missed * task->interval;
    }
}

int64_t hs_tasks_scan(hs_scans *scans,
                      uint64_t cycle,
                      int64_t cell_ns,
                      int64_t begin_ns) {
    for (uint32_t i = 0; i < scans->count; i++) {
        hs_task *task = &scans->tasks[i];
        if (task->due > cycle) {
            continue;
        }
        note_period(task, cell_ns);
        if (task->guarded(task->entry, cell_ns) != 0) {
            scans->trapped = i;
            return -1;
        }
        int64_t end_ns = hs_monotonic_ns();
        note_time(task, end_ns - begin_ns);
        begin_ns = end_ns;
        schedule(task, cycle);
    }
    return begin_ns;
}

static uint64_t next_due(const hs_scans *scans) {
    uint64_t due = scans->tasks[0].due;
    for (uint32_t i = 1; i < scans->count; i++) {
        due = scans->tasks[i].due < due ? scans->tasks[i].due : due;
    }
    return due;
}

void hs_scans_count(const hs_scans *scans) {
    uint64_t count = load_u64_relaxed(scans->scans_at) + 1;
    store_u64_relaxed(scans->scans_at, count);
    store_u64_relaxed(scans->heartbeat_at, count);
}

int hs_scan_tasks(hs_scans *scans) {
    int64_t now_ns = hs_monotonic_ns();
    int64_t end_ns = now_ns + scans->slice_ns;
    while (now_ns < end_ns) {
        const hs_image *image = scans->image;
        if (hs_image_latch(scans->image, HS_LATCH_TRIES) != HS_OK) {
            return HS_ASIDE;
        }
        uint32_t phase = image->phase;
        if (phase == HLI_PHASE_ENDED || phase == HLI_PHASE_SHUTDOWN) {
            return HS_ASIDE;
        }
        now_ns = hs_monotonic_ns();
        int64_t cell_ns = (int64_t)image->cell_time_ns;
        if (hs_tasks_scan(scans, image->cycle, cell_ns, now_ns) < 0) {
            return HS_TRAPPED;
        }
        hs_scans_count(scans);
        int waited = hs_word_turn(scans->mine,
                                  scans->others,
                                  (uint32_t)next_due(scans),
                                  scans->spin_ns,
                                  scans->timeout_ns);
        if (waited != HS_OK) {
            return HS_TIMEOUT;
        }
    }
    return HS_OK;
}
