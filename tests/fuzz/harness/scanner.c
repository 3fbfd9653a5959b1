/* Eight bytes of state, then text: the scanner reads it to its end, and read in
 * pieces it says the same as at once. */
#include <stdlib.h>
#include <string.h>

#include "modal.h"
#include "targets.h"
#include "verdict.h"

/* The text behind a line that the scanner leaves to a parser; NULL: none. */
static const char *next_line(const char *text, const char *end) {
    const char *mark = memchr(text, '\n', (size_t)(end - text));
    return mark ? mark + 1 : NULL;
}

static size_t read_all(nc_modal *modal,
                       const char *text,
                       size_t size,
                       int final,
                       size_t room) {
    nc_block *out = malloc(room * sizeof *out);
    const char *end = text + size;
    size_t rows = 0;
    while (text && text < end) {
        nc_scan_result result;
        size_t left = (size_t)(end - text);
        int stop = nc_scan(modal, text, left, final, out, room, &result);
        if (result.consumed > left || result.rows > room) {
            fuzz_broken("%zu of %zu bytes, %zu of %zu rows",
                        result.consumed,
                        left,
                        result.rows,
                        room);
            break;
        }
        for (size_t i = 0; i < result.rows; i++) {
            fuzz_judge_row(modal, &out[i]);
        }
        rows += result.rows;
        text += result.consumed;
        if (stop == NC_SCAN_MORE) {
            break;
        }
        if (stop == NC_SCAN_FULL && !result.rows) {
            fuzz_broken("full without a row");
            break;
        }
        if (stop != NC_SCAN_FULL) {
            text = next_line(text, end);
        }
    }
    free(out);
    return rows;
}

int fuzz_scanner(const uint8_t *data, size_t size) {
    if (size < FUZZ_MODAL_BYTES) {
        return -1;
    }
    nc_modal one, many;
    fuzz_modal(&one, data);
    fuzz_modal(&many, data);
    size_t room = 1 + data[5] % 64;
    int final = data[6] & 1;
    size -= FUZZ_MODAL_BYTES;
    char *text = malloc(size ? size : 1); /* its end is the memory's end */
    memcpy(text, data + FUZZ_MODAL_BYTES, size);
    size_t rows = read_all(&one, text, size, final, room);
    size_t again = read_all(&many, text, size, final, size + 1);
    if (rows != again || memcmp(one.pos, many.pos, sizeof one.pos) != 0) {
        fuzz_broken("%zu rows in pieces, %zu at once", rows, again);
    }
    free(text);
    return 0;
}
