#include "modal.h"

#include <math.h>
#include <stdbool.h>

#include "verdict.h"

void fuzz_modal(nc_modal *modal, const uint8_t *bytes) {
    static const char names[] = "XYZABCUVW";
    nc_modal_init(modal);
    modal->rules = (uint32_t)bytes[0] | (uint32_t)bytes[1] << 8;
    modal->axes = 3 + bytes[2] % 7;
    for (int i = 0; i < modal->axes; i++) {
        modal->letter_axis[names[i] - 'A'] = (int8_t)i;
        modal->rotary[i] = i >= 3 && i < 6;
    }
    for (int i = 0; i < 3; i++) {
        modal->main_axis[i] = i;
    }
    if (bytes[3] & 1) {
        modal->main_axis[1] = -1;
        modal->letter_axis['Y' - 'A'] = -1;
    }
    if (bytes[3] & 2) {
        modal->unit = modal->feed_unit = 25.4;
    }
    modal->compensated = (bytes[3] & 4) != 0;
    modal->arc_scale[0] = bytes[3] & 8 ? 2.0 : 1.0;
    modal->mirror[0] = bytes[3] & 16 ? -1.0 : 1.0;
    modal->share[0] = bytes[3] & 32 ? 0.5 : 1.0;
    modal->centre_absolute = (bytes[3] & 64) != 0;
    modal->exact_stop = (bytes[3] & 128) != 0;
    modal->centre_limit = bytes[4] & 1 ? 2.0 : 0.01;
    modal->centre_ratio = 0.05;
    modal->feed = bytes[4] & 2 ? 1000.0 : 0.0;
    modal->feed_limit = bytes[4] & 4 ? 100.0 : 0.0;
}

void fuzz_judge_row(const nc_modal *modal, const nc_block *row) {
    bool good =
        isfinite(row->length) && row->length > 0.0 && isfinite(row->feed);
    for (int i = 0; i < modal->axes; i++) {
        good = good && isfinite(row->end[i]);
    }
    if (row->type == NC_CIRCULAR) {
        good = good && isfinite(row->angle) && row->angle != 0.0
               && isfinite(row->radius) && row->radius > 0.0
               && isfinite(row->center[0]) && isfinite(row->center[1]);
    }
    if (!good) {
        fuzz_broken("row of type %d: length %g, feed %g, radius %g, angle %g",
                    row->type,
                    row->length,
                    row->feed,
                    row->radius,
                    row->angle);
    }
}
