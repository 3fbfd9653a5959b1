/* One input each: bytes to calls. A broken promise is told by fuzz_verdict().
 * -1: the input is too short to mean anything. */
#ifndef FUZZ_TARGETS_H
#define FUZZ_TARGETS_H
#include <stddef.h>
#include <stdint.h>

int fuzz_scanner(const uint8_t *data, size_t size);
int fuzz_words(const uint8_t *data, size_t size);
int fuzz_stages(const uint8_t *data, size_t size);
int fuzz_engine(const uint8_t *data, size_t size);

#endif
