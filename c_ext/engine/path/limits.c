/* Limits that a program sets for its motions (NC_DYNAMICS): G127-G134,
 * G230-G233, #VECTOR LIMIT, #SLOPE. */
#include <string.h>
#include "engine/path/limits.h"
#include "engine/state/state.h"
#include "rows/nc_block.h"

#define PROFILES 3 /* highest number of #SLOPE */
#define PATH_LIMITS 6
/* S ramps of a profile lift the jerk limit; nothing lifts velocity or
 * acceleration */
#define JERK_SHARE_MAX 1e4

void limits_reset(struct push_state *push) {
    for (int k = 0; k < 2; k++) {
        struct motion_limits *motion_limits = &push->limits[k];
        memset(motion_limits, 0, sizeof *motion_limits);
        for (int i = 0; i < NC_AXES; i++) {
            motion_limits->velocity[i] = motion_limits->acceleration[i] =
                motion_limits->jerk[i] = 1.0f;
        }
        motion_limits->profile = PROFILES;
    }
}

bool limits_row_check(const engine_config *cfg, const nc_block *row) {
    if (row->code == NC_DYNAMICS_PROFILE) {
        return row->value >= 0 && row->value <= PROFILES;
    }
    if (row->code < NC_DYNAMICS_VELOCITY || row->code > NC_DYNAMICS_PROFILE) {
        return false;
    }
    bool path = row->code == NC_DYNAMICS_PATH;
    double most = row->code == NC_DYNAMICS_JERK ? JERK_SHARE_MAX : 1.0;
    for (int i = 0; i < (path ? PATH_LIMITS : cfg->axis_count); i++) {
        if (path ? !(row->end[i] >= 0)
                 : !(row->end[i] >= 1e-6 && row->end[i] <= most)) {
            return false;
        }
    }
    return true;
}

static void set_path(struct motion_limits *motion_limits, const double *v) {
    motion_limits->path_velocity = (float)v[0];
    motion_limits->path_acceleration = (float)v[1];
    motion_limits->radial_acceleration = (float)v[2];
    motion_limits->transition_acceleration = (float)v[3];
    motion_limits->path_jerk = (float)v[4];
    motion_limits->radial_jerk = (float)v[5];
}

void limits_set(struct engine *engine, const nc_block *row) {
    if (row->code == NC_DYNAMICS_PROFILE) {
        engine->push.limits[0].profile = engine->push.limits[1].profile =
            (uint8_t)row->value;
        return;
    }
    struct motion_limits *motion_limits =
        &engine->push.limits[row->value > 0 ? 1 : 0];
    if (row->code == NC_DYNAMICS_PATH) {
        set_path(motion_limits, row->end);
        return;
    }
    float *shares = row->code == NC_DYNAMICS_VELOCITY ? motion_limits->velocity
                    : row->code == NC_DYNAMICS_ACCELERATION
                        ? motion_limits->acceleration
                        : motion_limits->jerk;
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        shares[i] = (float)row->end[i];
    }
}
