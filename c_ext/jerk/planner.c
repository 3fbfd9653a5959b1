/* What the operator and the program ask of a planner, and what it tells. */
#include <math.h>
#include "jerk/state/api.h"
#include "jerk/path/ring.h"
#include "jerk/state/state.h"
#include "maths/order.h"

static bool positive(double v) {
    return isfinite(v) && v > 0.0;
}

int jerk_check_config(const jerk_config *config) {
    if (config->axes < 1 || config->axes >= JERK_AXES
        || !positive(config->cycle_s) || config->window_knots < 8
        || config->window_blocks < 1) {
        return JERK_BAD_LIMITS;
    }
    for (int axis = 0; axis < config->axes; axis++) {
        if (!positive(config->v_max[axis]) || !positive(config->a_max[axis])
            || !positive(config->j_max[axis])) {
            return JERK_BAD_LIMITS;
        }
    }
    return isfinite(config->spacing_mm) && isfinite(config->refresh)
               ? 0
               : JERK_BAD_LIMITS;
}

/* Another motion is wanted, from here on. */
static void changes(jerk_planner *planner) {
    planner->changed = true;
    planner->again_s = 0.0;
    planner->waited_s = 0.0;
}

/* The plan is far below what was and what is asked for everywhere: nothing of
 * it depends on them. `before`: what was asked for last; a stop for an override
 * of 0 was not made under `was`. */
static bool plan_stays(const jerk_planner *planner,
                       const struct speeds *before) {
    const plan *pl = &planner->plan;
    const struct speeds now = speeds_now(planner);
    uint64_t i = planner->head;
    if (planner->changed || planner->at_standstill || pl->next >= pl->count) {
        return false;
    }
    if (planner->near && planner->credit < 0.0) {
        return false; /* short, and the window behind it has to wait */
    }
    for (int k = pl->next; k < pl->count; k++) {
        const jerk_interval *interval = ring_at(planner, i);
        double asked =
            lesser(asked_under(before, interval), asked_under(&now, interval));
        asked = lesser(asked, asked_under(&planner->was, interval));
        double most = planner->scale * sqrt(greater(pl->x[k], pl->x[k + 1]));
        if (most > FAR_BELOW * asked) {
            return false;
        }
        i += pl->last[k] != 0;
    }
    return true;
}

/* Other speeds are asked for, perhaps not the first time within CALM_S. */
static void other_speeds(jerk_planner *planner, const struct speeds *before) {
    planner->hurried = planner->driven_s - planner->other_s < CALM_S;
    planner->other_s = planner->driven_s;
    if (plan_stays(planner, before)) {
        planner->was = speeds_now(planner);
        return;
    }
    double again_s = planner->hurried ? planner->again_s : 0.0;
    changes(planner);
    planner->again_s = again_s;
}

void jerk_override(jerk_planner *planner, double feed, double rapid) {
    if (!isfinite(feed) || !isfinite(rapid)) {
        return;
    }
    if (feed == planner->feed_factor && rapid == planner->rapid_factor) {
        return;
    }
    const struct speeds before = speeds_now(planner);
    planner->feed_factor = fmax(0.0, feed);
    planner->rapid_factor = fmax(0.0, rapid);
    other_speeds(planner, &before);
}

void jerk_hold(jerk_planner *planner, int hold) {
    if ((hold != 0) == planner->hold) {
        return;
    }
    planner->hold = hold != 0;
    changes(planner);
}

void jerk_watch(jerk_planner *planner, const uint64_t *word) {
    planner->gone = word;
}

uint64_t jerk_edition(const jerk_planner *planner) {
    return planner->plan.edition;
}

int64_t jerk_used(const jerk_planner *planner) {
    return planner->plan.next;
}

int jerk_as_wanted(const jerk_planner *planner) {
    return !planner->changed && !planner->near;
}

void jerk_get_stats(const jerk_planner *planner, jerk_stats *out) {
    *out = planner->stats;
}

double jerk_speed(const jerk_planner *planner) {
    return planner->at_standstill ? 0.0 : speed_at_head(planner);
}

void jerk_read_plan(jerk_planner *planner, int read) {
    planner->is_read = read != 0;
}

void jerk_command_speed(jerk_planner *planner, double speed) {
    if (!isfinite(speed) || speed == planner->command_speed
        || (speed < 0.0 && planner->command_speed < 0.0)) {
        return;
    }
    const struct speeds before = speeds_now(planner);
    planner->command_speed = speed;
    other_speeds(planner, &before);
}
