/* Eight bytes of state, then words of blocks as a parser fills them. */
#include "bytes.h"
#include "modal.h"
#include "targets.h"
#include "verdict.h"

#define BLOCKS 200

static double word(struct bytes *bytes) {
    double number = take_number(bytes);
    return isfinite(number) ? number : 0.0;
}

static void fill(struct bytes *bytes, const nc_modal *modal, nc_words *words) {
    nc_words_init(words);
    words->set = take_byte(bytes);
    words->axis_set = take_word(bytes) & ((1u << modal->axes) - 1u);
    for (int i = 0; i < modal->axes; i++) {
        if (words->axis_set >> i & 1u) {
            words->axis[i] = word(bytes);
        }
    }
    for (int i = 0; i < 3; i++) {
        if (words->set >> i & 1u) {
            words->centre[i] = word(bytes);
        }
    }
    if (words->set & NC_WORD_R) {
        words->r = word(bytes);
    }
    if (words->set & NC_WORD_F) {
        words->f = word(bytes);
    }
    uint8_t codes = take_byte(bytes);
    uint8_t more = take_byte(bytes);
    words->motion = (int8_t)(codes % 5 - 1);
    words->plane = (int8_t)(codes & 64 ? 17 + (codes >> 3) % 3 : -1);
    words->absolute = (int8_t)(more % 3 - 1);
    words->inch = (int8_t)(more / 3 % 3 - 1);
    words->centre_absolute = (int8_t)(more / 9 % 3 - 1);
    words->exact_stop = (int8_t)(more / 27 % 3 - 1);
    words->block_stop = (int8_t)(codes & 128 ? 1 : -1);
    words->n = take_byte(bytes);
    words->column = 1;
}

int fuzz_words(const uint8_t *data, size_t size) {
    if (size < FUZZ_MODAL_BYTES) {
        return -1;
    }
    nc_modal modal;
    fuzz_modal(&modal, data);
    struct bytes bytes = {data + FUZZ_MODAL_BYTES, size - FUZZ_MODAL_BYTES};
    for (int block = 0; block < BLOCKS && bytes.left; block++) {
        nc_words words;
        nc_block row;
        int emitted = 0;
        fill(&bytes, &modal, &words);
        int error = nc_block_from_words(&modal, &words, &row, &emitted);
        if (error && emitted) {
            fuzz_broken("error %d and a row", error);
        }
        if (emitted) {
            fuzz_judge_row(&modal, &row);
        }
        for (int i = 0; i < modal.axes; i++) {
            if (!isfinite(modal.pos[i])) {
                fuzz_broken("axis %d stands nowhere, error %d", i, error);
            }
        }
    }
    return 0;
}
