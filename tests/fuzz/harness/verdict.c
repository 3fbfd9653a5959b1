#include "verdict.h"

#include <stdarg.h>
#include <stdio.h>
#include <string.h>

static char words[200], told[200];

void fuzz_broken(const char *format, ...) {
    if (words[0]) {
        return;
    }
    va_list values;
    va_start(values, format);
    vsnprintf(words, sizeof words, format, values);
    va_end(values);
}

const char *fuzz_verdict(void) {
    memcpy(told, words, sizeof told);
    words[0] = 0;
    return told;
}
