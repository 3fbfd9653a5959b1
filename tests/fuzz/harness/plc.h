/* A byte to an order of the PLC in the shared memory. */
#ifndef FUZZ_PLC_H
#define FUZZ_PLC_H
#include "bytes.h"
#include "calls.h"
#include "hli/hli_layout.h"

/* `axes`: those of the channel, the spindle stands behind them; `wide`: the
 * input knows all orders. True: the engine is to be halted. */
bool fuzz_order(struct bytes *bytes, HLI_SEGMENT *segment, int axes, bool wide);

#endif
