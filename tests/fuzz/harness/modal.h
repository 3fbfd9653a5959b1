/* Eight bytes to the modal state of a channel. */
#ifndef FUZZ_MODAL_H
#define FUZZ_MODAL_H
#include "calls.h"

#define FUZZ_MODAL_BYTES 8

void fuzz_modal(nc_modal *modal, const uint8_t *bytes);
/* A row of a motion holds numbers that a stage may take. */
void fuzz_judge_row(const nc_modal *modal, const nc_block *row);

#endif
