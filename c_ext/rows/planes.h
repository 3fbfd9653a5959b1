/* The plane of a circle. */
#ifndef NC_PLANES_H
#define NC_PLANES_H

#include <stdbool.h>
#include <stdint.h>
#include "rows/nc_block.h"

/* There is such a plane, and the channel has both of its axes. `main_axis`:
 * channel index of X, Y, Z, -1 where absent. */
static inline bool plane_is_there(int plane, const int32_t main_axis[3]) {
    static const int beside[3] = {2, 1, 0}; /* the axis that it lacks */
    if (plane < 17 || plane > 19) {
        return false;
    }
    for (int i = 0; i < 3; i++) {
        if (main_axis[i] < 0 && i != beside[plane - 17]) {
            return false;
        }
    }
    return true;
}

static inline bool row_in_plane(const nc_block *row,
                                const int32_t main_axis[3]) {
    return row->type != NC_CIRCULAR || plane_is_there(row->plane, main_axis);
}

#endif
