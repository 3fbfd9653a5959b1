/* What libFuzzer calls: the target that FUZZ_TARGET names. */
#include <stdio.h>
#include <stdlib.h>

#include "targets.h"
#include "verdict.h"

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size);

int LLVMFuzzerTestOneInput(const uint8_t *data, size_t size) {
    int result = FUZZ_TARGET(data, size);
    const char *words = fuzz_verdict();
    if (words[0]) {
        fprintf(stderr, "broken: %s\n", words);
        abort();
    }
    return result;
}
