/* Limits that a program sets for its motions (NC_DYNAMICS): G127-G134, G230-G233, #VECTOR LIMIT, #SLOPE. */
#include "engine/state/state.h"

#define PROFILES 3 /* highest number of #SLOPE */
#define PATH_LIMITS 6
#define JERK_SHARE_MAX 1e4 /* S ramps of a profile lift the jerk limit; nothing lifts velocity or acceleration */

void limits_reset(engine *e) {
    for (int k = 0; k < 2; k++) {
        motion_limits *l = &e->limits[k];
        memset(l, 0, sizeof *l);
        for (int i = 0; i < NC_AXES; i++) l->velocity[i] = l->acceleration[i] = l->jerk[i] = 1.0f;
        l->profile = PROFILES;
    }
}

bool limits_row_check(const engine *e, const nc_block *row) {
    if (row->code == NC_DYNAMICS_PROFILE) return row->value >= 0 && row->value <= PROFILES;
    if (row->code < NC_DYNAMICS_VELOCITY || row->code > NC_DYNAMICS_PROFILE) return false;
    bool path = row->code == NC_DYNAMICS_PATH;
    double most = row->code == NC_DYNAMICS_JERK ? JERK_SHARE_MAX : 1.0;
    for (int i = 0; i < (path ? PATH_LIMITS : e->cfg.axis_count); i++)
        if (path ? !(row->end[i] >= 0) : !(row->end[i] >= 1e-6 && row->end[i] <= most)) return false;
    return true;
}

static void set_path(motion_limits *l, const double *v) {
    l->path_velocity = (float)v[0];
    l->path_acceleration = (float)v[1];
    l->radial_acceleration = (float)v[2];
    l->transition_acceleration = (float)v[3];
    l->path_jerk = (float)v[4];
    l->radial_jerk = (float)v[5];
}

void limits_set(engine *e, const nc_block *row) {
    if (row->code == NC_DYNAMICS_PROFILE) {
        e->limits[0].profile = e->limits[1].profile = (uint8_t)row->value;
        return;
    }
    motion_limits *l = &e->limits[row->value > 0 ? 1 : 0];
    if (row->code == NC_DYNAMICS_PATH) {
        set_path(l, row->end);
        return;
    }
    float *shares = row->code == NC_DYNAMICS_VELOCITY ? l->velocity : row->code == NC_DYNAMICS_ACCELERATION ? l->acceleration : l->jerk;
    for (int i = 0; i < e->cfg.axis_count; i++) shares[i] = (float)row->end[i];
}
