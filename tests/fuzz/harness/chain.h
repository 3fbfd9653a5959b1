/* The stages behind each other: compensation, contouring, smoothing. */
#ifndef FUZZ_CHAIN_H
#define FUZZ_CHAIN_H
#include "rows.h"

/* Rows with their coefficients, in memory of exactly their size. */
struct batch {
    nc_block *rows;
    double *pool;
    int64_t count, pool_n;
};

struct chain {
    nc_offset offset;
    nc_contour *contour;
    nc_smooth *smooth;
};

struct batch batch_copy(const nc_block *rows,
                        int64_t count,
                        const double *pool,
                        int64_t pool_n);
void batch_free(struct batch *batch);

struct chain *chain_new(int axes, const double *start);
void chain_free(struct chain *chain);
/* What the stages make of the rows; `last`: and of all that they hold. The
 * caller frees the answer. */
struct batch chain_push(struct chain *chain,
                        const struct batch *batch,
                        bool last);

#endif
