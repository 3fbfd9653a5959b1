/* Memory that the planner writes is there before it plans, as it is in real time (engine_threads.c locks it): the first touch
 * of a page takes the kernel longer than the planner takes for a block. In large pages, where the system has them. */
#include <stdint.h>
#include <sys/mman.h>
#include <unistd.h>
#include "engine_internal.h"

void memory_touch(void *memory, size_t bytes) {
    size_t page = (size_t)sysconf(_SC_PAGESIZE);
    char *first = (char *)(((uintptr_t)memory + page - 1) / page * page), *end = (char *)memory + bytes;
    if (first >= end) return;
#ifdef MADV_HUGEPAGE
    (void)madvise(first, (size_t)(end - first) / page * page, MADV_HUGEPAGE);
#endif
#ifdef MADV_POPULATE_WRITE
    (void)madvise(first, (size_t)(end - first) / page * page, MADV_POPULATE_WRITE);
#endif
    for (volatile char *at = first; at < end; at += page) *at = *at;
}
