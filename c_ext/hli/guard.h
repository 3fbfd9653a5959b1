/* Memory of a file that somebody may cut while it is mapped. */
#ifndef HLI_GUARD_H
#define HLI_GUARD_H
#include <stdint.h>
/* cdef begin */
/* From here on a missing page of this memory is not the process's end (SIGBUS):
 * zeros take the memory's place, and hs_guard_lost tells. -1: no room. */
int hs_guard(void *base, uint64_t size);
void hs_unguard(void *base);
int hs_guard_lost(void *base);
/* cdef end */
#endif
