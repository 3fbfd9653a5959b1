/* What a harness found broken: the first promise, in words. */
#ifndef FUZZ_VERDICT_H
#define FUZZ_VERDICT_H

void fuzz_broken(const char *format, ...) __attribute__((format(printf, 1, 2)));
/* The words, "" where every promise was kept; asking forgets them. */
const char *fuzz_verdict(void);

#endif
