/* The scan loop of a PLC: what the scan runtime does in Python, for the scans
 * in which nothing but the tasks needs Python. */
#ifndef HLI_SCANS_H
#define HLI_SCANS_H
#include <stdint.h>

/* Tries to latch an image that the CNC is changing. */
#define HS_LATCH_TRIES 1000

/* cdef begin */
/* Results beside HS_OK (the slice of time is used up and a scan is due) and
 * HS_TIMEOUT (no scan is due yet): the scan that is due is the caller's; a
 * task failed, or its trap stopped it. */
#define HS_ASIDE 1
#define HS_TRAPPED 2

/* A task: how its entry is called (0: it returned), when it is due, and what
 * its scans of this call took. Times of `interval_ns`, `started_ns` and
 * `jitter_ns` are those of the cell's clock; `started_ns` -1: no scan yet. */
typedef struct hs_task {
    int32_t (*guarded)(void (*entry)(void), int64_t now_ns);
    void (*entry)(void);
    uint64_t due, interval;
    int64_t interval_ns, started_ns, jitter_ns;
    int64_t total_ns, shortest_ns, longest_ns;
    uint64_t scans, missed;
} hs_task;

/* The tasks in the order of their priority, the image that is latched ahead of
 * each scan, and the words of the segment the loop reads and writes. `trapped`
 * is a result: the task that was stopped. */
typedef struct hs_scans {
    struct hs_image *image;
    void *mine, *others, *scans_at, *heartbeat_at;
    hs_task *tasks;
    uint32_t count, trapped;
    int64_t slice_ns, spin_ns, timeout_ns;
} hs_scans;

/* Scans, one after the other, at most `slice_ns` of the wall's clock; a cell
 * whose program has ended, or that ends, is the caller's. */
int hs_scan_tasks(hs_scans *scans);
/* cdef end */

/* All tasks that are due in this cycle; gives the time behind the last one, or
 * -1: a task was stopped. */
int64_t hs_tasks_scan(hs_scans *scans,
                      uint64_t cycle,
                      int64_t cell_ns,
                      int64_t begin_ns);
/* The PLC has done one more scan. */
void hs_scans_count(const hs_scans *scans);
#endif
