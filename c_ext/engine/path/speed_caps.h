/* Speeds that feed and override ask for on a piece; hot, so inline. */
#ifndef ENGINE_PATH_SPEED_CAPS_H
#define ENGINE_PATH_SPEED_CAPS_H
#include "engine/state/state.h"
#include "rows/nc_block.h"

/* Fastest that p is driven at an override. */
static inline double reachable(const struct piece *piece, double override) {
    return piece->feed > 0 ? lesser(piece->v_hard, piece->feed * override)
                           : piece->v_hard;
}

/* Feed and override: what the operator and the program ask for. The machine's
 * own limits come on top. */
static inline double soft_cap(const struct plan_conditions *plan,
                              const struct piece *piece) {
    if (plan->hold) {
        return 0.0;
    }
    if (plan->ext_speed < NEVER) {
        return lesser(reachable(piece, plan->reserve_override),
                      plan->ext_speed);
    }
    if (piece->feed > 0) {
        return lesser(
            piece->v_hard,
            piece->feed
                * (piece->flags & NC_NO_OVERRIDE ? 1.0 : plan->override));
    }
    return piece->v_hard * lesser(1.0, plan->rapid);
}

#endif
