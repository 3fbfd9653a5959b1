/* Coefficients of the rows NC_POLYNOMIAL. */
#ifndef NC_POOL_H
#define NC_POOL_H

#include <stdbool.h>
#include <stdint.h>
#include "rows/nc_block.h"

/* The coefficients of a row lie inside the pool. */
static inline bool row_in_pool(const nc_block *row, int axes, int64_t pool_n) {
    uint64_t need = (uint64_t)axes * (row->degree + 1u);
    return row->type != NC_POLYNOMIAL
           || (uint64_t)row->pool + need <= (uint64_t)pool_n;
}

#endif
