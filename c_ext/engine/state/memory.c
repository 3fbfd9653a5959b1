/* Memory that the planner writes is there before it plans, as it is in real
 * time (threads.c locks it): the first touch of a page takes the kernel longer
 * than the planner takes for a block. In large pages, where the system has
 * them. */
#include <stdint.h>
#include <sys/mman.h>
#include <unistd.h>
#include "engine/state/memory.h"

typedef struct pages {
    char *first;
    size_t bytes, page;
} pages;

static struct pages whole_pages(void *memory, size_t bytes) {
    size_t page = (size_t)sysconf(_SC_PAGESIZE),
           skipped = (page - (uintptr_t)memory % page) % page;
    return (struct pages){(char *)memory + skipped,
                          bytes > skipped ? (bytes - skipped) / page * page : 0,
                          page};
}

void memory_large(void *memory, size_t bytes) {
    struct pages pages = whole_pages(memory, bytes);
#ifdef MADV_HUGEPAGE
    if (pages.bytes) {
        (void)madvise(pages.first, pages.bytes, MADV_HUGEPAGE);
    }
#else
    (void)pages;
#endif
}

void memory_touch(void *memory, size_t bytes) {
#ifdef ENGINE_SMALL_RINGS /* most of it is never used */
    bytes = 0;
#endif
    struct pages pages = whole_pages(memory, bytes);
    memory_large(memory, bytes);
#ifdef MADV_POPULATE_WRITE
    if (pages.bytes) {
        (void)madvise(pages.first, pages.bytes, MADV_POPULATE_WRITE);
    }
#endif
    for (size_t at = 0; at < pages.bytes; at += pages.page) {
        volatile char *byte = pages.first + at;
        *byte = *byte;
    }
}
