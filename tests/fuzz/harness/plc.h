/* A byte to an order of the PLC in the shared memory. */
#ifndef FUZZ_PLC_H
#define FUZZ_PLC_H
#include "bytes.h"
#include "calls.h"
#include "hli/hli_layout.h"

/* True: the engine is to be halted. */
bool fuzz_order(struct bytes *bytes, HLI_SEGMENT *segment);

#endif
