/* Rows of any kind through the stages: memory stays whole, each ends. */
#include "chain.h"
#include "targets.h"

#define BATCH 64
#define BATCHES 20

int fuzz_stages(const uint8_t *data, size_t size) {
    if (size < 4) {
        return -1;
    }
    struct rows_in in;
    fuzz_rows_start(&in, data, size);
    uint8_t mode = take_byte(&in.bytes);
    in.axes = 2 + mode % 5;
    in.raw_too = (mode & 128) != 0;
    fuzz_rows_pool(&in);
    struct chain *chain = chain_new(in.axes, in.position);
    for (int i = 0; i < BATCHES && in.bytes.left; i++) {
        nc_block rows[BATCH];
        int64_t count = 0;
        while (count < BATCH && in.bytes.left) {
            count += fuzz_row(&in, &rows[count]);
        }
        bool last = !in.bytes.left || i == BATCHES - 1;
        struct batch batch = batch_copy(rows, count, in.pool, in.pool_n);
        struct batch out = chain_push(chain, &batch, last);
        batch_free(&batch);
        batch_free(&out);
    }
    chain_free(chain);
    return 0;
}
