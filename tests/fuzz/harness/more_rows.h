/* Rows that fuzz_row does not make: curves whose length is measured, elements
 * with pieces, functions with values, events, flags of motions. */
#ifndef FUZZ_MORE_ROWS_H
#define FUZZ_MORE_ROWS_H
#include "rows.h"

struct more_rows {
    struct rows_in *in;
    int64_t pool_n; /* of the input itself; behind it stand curves */
    double piece;   /* mm of the element that a piece has to cover, 0: none */
    bool curves;    /* and elements: the engine alone takes them */
    double begin[NC_AXES]; /* of the real-time loop */
    bool in_loop, closing; /* its last motion has been made */
};

void more_rows_start(struct more_rows *more, struct rows_in *in, bool curves);
/* The batch before has been taken: its coefficients go. */
void more_rows_batch(struct more_rows *more);
/* The next row, as fuzz_row; true: there is one. A real-time loop ends where it
 * begins, as the front end sees to it. */
bool more_row(struct more_rows *more, nc_block *row);
/* A row of fuzz_row has come: a loop that does not end where it begins makes
 * the rows no program's. */
void more_rows_see(struct more_rows *more, const nc_block *row);
/* The rows that come have nothing to do with those before. */
void more_rows_anew(struct more_rows *more);

#endif
