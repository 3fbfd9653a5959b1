/* Rows that the engine refuses: no numbers, unknown types, geometry that does
 * not fit. */
#include <math.h>
#include "engine/store/row_check.h"
#include "curve/curve.h"
#include "engine/path/limits.h"
#include "engine/path/piece_curve.h"
#include "engine/state/state.h"
#include "rows/nc_block.h"
#include "rows/planes.h"

bool row_is_finite(const engine_config *cfg, const nc_block *row) {
    for (int i = 0; i < cfg->axis_count; i++) {
        if (!isfinite(row->end[i])) {
            return false;
        }
    }
    return isfinite(row->length) && isfinite(row->feed)
           && isfinite(row->center[0]) && isfinite(row->center[1])
           && isfinite(row->radius) && isfinite(row->programmed_radius)
           && isfinite(row->angle) && isfinite(row->value)
           && isfinite(row->length_min) && isfinite(row->end_speed);
}

/* A motion in other coordinates than the axes': its tangents, kept for the
 * element that is pushed next. */
static bool tangents_are_given(struct push_state *push,
                               const nc_block *row,
                               const double *pool,
                               int64_t pool_n) {
    if (!pool || (int64_t)row->pool + 6 > pool_n || !(row->length > 0)) {
        return false;
    }
    for (int i = 0; i < 6; i++) {
        push->next_tangents[i] = pool[row->pool + i];
        if (!isfinite(push->next_tangents[i])) {
            return false;
        }
    }
    return true;
}

bool row_is_supported(struct engine *engine,
                      const nc_block *row,
                      const double *pool,
                      int64_t pool_n) {
    if (row->type <= NC_POLYNOMIAL && row->flags & NC_ELEMENT
        && row->degree == NC_TANGENTS) {
        return tangents_are_given(&engine->push, row, pool, pool_n);
    }
    if (row->flags & NC_ELEMENT && row->type == NC_POLYNOMIAL) {
        return false;
    }
    if (row->flags & NC_PIECE
        && !(row->value >= 0 && engine->store.element_head > 0)) {
        return false;
    }
    switch (row->type) {
    case NC_LINEAR:
        return row->length > 0 && (row->feed > 0 || (row->flags & NC_RAPID));
    case NC_CIRCULAR: {
        bool bends = row->length > 0 && row->radius > 0 && row->angle != 0.0;
        return bends && plane_is_there(row->plane, engine->cfg.main)
               && (row->feed > 0 || (row->flags & NC_RAPID));
    }
    case NC_POLYNOMIAL:
        return row->length > 0 && row->degree >= 1 && row->degree < CURVE_ORDER
               && row->angle > 0 && (row->feed > 0 || (row->flags & NC_RAPID))
               && curve_row_check(engine, row, pool, pool_n);
    case NC_DWELL:
        return row->value >= 0;
    case NC_M:
    case NC_H:
    case NC_S:
    case NC_T:
    case NC_MARKER:
    case NC_DISTANCE_RESET:
    case NC_FLUSH:
    case NC_EVENT:
        return true;
    case NC_DYNAMICS:
        return limits_row_check(&engine->cfg, row);
    case NC_RT_LOOP_BEGIN:
        return !engine->push.in_loop;
    case NC_RT_LOOP_END:
        return engine->push.in_loop;
    default:
        return false;
    }
}
