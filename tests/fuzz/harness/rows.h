/* Bytes to rows: motions that fit to each other, functions, settings, and rows
 * of any bytes. */
#ifndef FUZZ_ROWS_H
#define FUZZ_ROWS_H
#include <stdbool.h>

#include "bytes.h"
#include "calls.h"

#define FUZZ_POOL 1024

struct rows_in {
    struct bytes bytes;
    double position[NC_AXES]; /* where the last motion ends */
    double pool[FUZZ_POOL];
    int64_t pool_n;
    uint32_t line;
    int axes;
    bool raw_too;    /* rows of any bytes may come */
    bool consistent; /* none has come yet */
};

void fuzz_rows_start(struct rows_in *in, const uint8_t *data, size_t size);
/* Coefficients of polynomials: one byte says how many. */
void fuzz_rows_pool(struct rows_in *in);
/* Flags of a function: M00, M01, M02 and M30 come at standstill alone. */
uint16_t fuzz_function_flags(const nc_block *row, bool standstill);
/* The next row; false: the bytes made none. */
bool fuzz_row(struct rows_in *in, nc_block *row);

#endif
