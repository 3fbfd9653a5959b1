/* Raw reference of the handshake benchmark: two C threads, spinning, on the
 * memory layout of the control unit. */
#ifndef HLI_BENCH_H
#define HLI_BENCH_H
#include <stdint.h>

/* cdef begin */
/* Fill `rows` look-ahead elements so that element i of the table is known by
 * its index alone. */
void hb_fill(void *blocks, uint32_t rows);
/* Number of the n elements that are not elements first .. first+n-1 of such a
 * table. */
uint32_t hb_wrong(const void *blocks, uint32_t count, uint32_t first);
/* Up to `exchanges` exchanges of n_blocks elements out of `table` (table_rows
 * long), for at most `max_ns`: durations in ns go to samples, the number of
 * wrong answers to *torn, 1 to *pinned if both threads got a core of their own.
 * Returns the number of exchanges, or -1 if the second thread could not be
 * started. */
int64_t hb_raw(const void *table,
               uint32_t table_rows,
               uint32_t n_blocks,
               int64_t exchanges,
               int64_t max_ns,
               int cpu_client,
               int cpu_server,
               int64_t *samples,
               int64_t *torn,
               int *pinned);
/* cdef end */
#endif
