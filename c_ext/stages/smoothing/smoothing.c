/* Rows to points of the contour, and the life of the stage. */
#include <stdlib.h>
#include "rows/planes.h"
#include "rows/pool.h"
#include "stages/smoothing/emit.h"
#include "stages/smoothing/nodes.h"
#include "stages/smoothing/sections.h"
#include "stages/smoothing/smoothing.h"
#include "stages/smoothing/state.h"
#include "maths/plain.h"

void nc_smooth_free(nc_smooth *smooth) {
    if (!smooth) {
        return;
    }
    free(smooth->held);
    free(smooth->rows);
    free(smooth->pool);
    free(smooth);
}

void nc_smooth_get_stats(const nc_smooth *smooth, nc_smooth_stats *out) {
    *out = smooth->stats;
    out->deviation += smooth->bulge;
}

/* The section begins anew at the programmed position. */
static void begin_at(nc_smooth *smooth) {
    struct node node = {.t = smooth->t,
                        .programmed = smooth->programmed,
                        .kind = NODE_BREAK,
                        .size = 1e9,
                        .feed = -1.0};
    memcpy(node.position, position_here(smooth), sizeof node.position);
    smooth->nodes[0] = node;
    smooth->n_nodes = 1;
    smooth->keep.valid = false;
    smooth->has_line = false;
    smooth->skipped = 0.0;
    smooth->left_n = 0;
    smooth->feed = -1.0;
    smooth->merged_n = 0;
    smooth->measure = 0.0;
    smooth->out_t = smooth->t;
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        smooth->out_at[axis] = smooth->last[axis] / smooth->scale[axis];
    }
}

void nc_smooth_resync(nc_smooth *smooth, const double *position) {
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        smooth->last[axis] = position[axis] * smooth->scale[axis];
    }
    smooth->held_n = 0;
    smooth->held_first = 0;
    smooth->is_bent = false;
    begin_at(smooth);
}

static const nc_block *newest_motion(const nc_smooth *smooth) {
    for (size_t i = smooth->held_n; i-- > smooth->held_first;) {
        if (smooth->held[i].motion) {
            return &smooth->held[i].row;
        }
    }
    return NULL;
}

/* A point left out: where there is no more room every other one of those so far
 * goes. */
static void leave_out(nc_smooth *smooth, double length) {
    smooth->skipped = fmax(smooth->skipped, length);
    if (smooth->left_n == LEFT_OUT) {
        smooth->left_n /= 2;
        for (int i = 0; i < smooth->left_n; i++) {
            smooth->left[i] = smooth->left[2 * i + 1];
        }
    }
    left_out *to = &smooth->left[smooth->left_n++];
    memcpy(to->position, smooth->last, sizeof to->position);
    to->programmed = smooth->programmed;
}

/* The programmed position becomes a node, unless it is one. */
static void end_here(nc_smooth *smooth, const nc_block *row, double slack) {
    if (way_here(smooth) > ZERO) {
        last_node(smooth)->mark = true; /* not merged into what is before */
        section_point(smooth, row, slack);
    }
}

/* The path comes back to the last node from a figure whose points have all been
 * left out, and ends: they are not left out then, but for those that are next
 * to each other. */
static void drive_figure(nc_smooth *smooth) {
    const nc_block *row = newest_motion(smooth);
    double last[NC_AXES];
    double programmed = smooth->programmed;
    double leave = FIGURE * smooth->skipped;
    if (!row || smooth->skipped <= ZERO || way_here(smooth) > ZERO) {
        return;
    }
    nc_block copy = *row;
    memcpy(last, smooth->last, sizeof last);
    last_node(smooth)->mark = true;
    smooth->skipped = 0.0;
    for (int i = 0, count = smooth->left_n; i < count; i++) {
        memcpy(smooth->last, smooth->left[i].position, sizeof last);
        smooth->programmed = smooth->left[i].programmed;
        if (way_here(smooth) > fmax(leave, ZERO)) {
            section_point(smooth, &copy, leave);
        }
    }
    memcpy(smooth->last, last, sizeof last);
    smooth->programmed = programmed;
    end_here(smooth, &copy, leave);
}

/* A node where the programmed position is, so that something can take effect
 * there. */
static struct node *node_here(nc_smooth *smooth) {
    const nc_block *row = newest_motion(smooth);
    if (row) {
        const nc_block copy = *row;
        end_here(smooth, &copy, 0.0);
    }
    return last_node(smooth);
}

/* The section ends here; everything is written. */
static void close_section(nc_smooth *smooth) {
    drive_figure(smooth);
    node_here(smooth);
    if (smooth->n_nodes > 1) {
        section_complete(smooth);
        last_node(smooth)->kind = NODE_BREAK;
        section_split(smooth, smooth->n_nodes - 1, 0.0);
        section_work(smooth, smooth->n_nodes);
    }
    emit_flush(smooth);
    begin_at(smooth);
}

static void pass(nc_smooth *smooth, const nc_block *row, const double *pool) {
    nc_block copy = *row;
    if (row->type == NC_POLYNOMIAL) {
        copy.pool = emit_pool(smooth,
                              pool + row->pool,
                              (size_t)smooth->cfg.axes * (row->degree + 1u));
    }
    emit_row(smooth, &copy);
}

/* A motion driven as programmed. */
static void exact_motion(nc_smooth *smooth,
                         const nc_block *row,
                         const double *pool) {
    close_section(smooth);
    pass(smooth, row, pool);
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        smooth->last[axis] = row->end[axis] * smooth->scale[axis];
    }
    smooth->t = whole_parameter(smooth->t + row->length);
    smooth->programmed += row->length;
    begin_at(smooth);
}

/* The last piece written ends at standstill. */
static void stop_here(nc_smooth *smooth) {
    for (size_t i = smooth->rows_n; i-- > 0;) {
        if (smooth->rows[i].type <= NC_POLYNOMIAL
            && !(smooth->rows[i].flags & NC_ELEMENT)) {
            smooth->rows[i].flags |= NC_EXACT_STOP;
            return;
        }
    }
}

/* The node here, or the last one if this is next to it, is passed no faster. */
static void slow_point(nc_smooth *smooth, float speed) {
    struct node *node = last_node(smooth);
    if (smooth->n_nodes < 2) {
        return;
    }
    node->mark = true;
    node->end_speed =
        node->end_speed > 0.0f ? fminf(node->end_speed, speed) : speed;
}

static void line_point(nc_smooth *smooth, const nc_block *row) {
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        smooth->last[axis] = row->end[axis] * smooth->scale[axis];
    }
    smooth->programmed += row->length;
    double length = way_here(smooth);
    if (length < LEAVE_OUT * smooth->tol && !last_node(smooth)->mark) {
        leave_out(smooth, length);
    } else if (length > ZERO) {
        section_point(smooth, row, 0.0);
    }
    if (row->end_speed > 0.0f) {
        slow_point(smooth, row->end_speed);
    }
}

/* Index 0, 1: channel axes of an arc's plane. */
static void plane_axes(const nc_smooth *smooth,
                       const nc_block *row,
                       int axes[2]) {
    static const int planes[3][2] = {
        {0, 1},
        {2, 0},
        {1, 2},
    };
    for (int i = 0; i < 2; i++) {
        axes[i] = smooth->cfg.main_axis[planes[row->plane - 17][i]];
    }
}

/* How many chords stay within the tolerance; infinite: no step is small
 * enough. */
static double arc_chords(const nc_smooth *smooth, const nc_block *row) {
    int axes[2];
    plane_axes(smooth, row, axes);
    double radius = hypot(smooth->last[axes[0]] - row->center[0],
                          smooth->last[axes[1]] - row->center[1]);
    double sagitta = SAGITTA * smooth->tol;
    double step = 2.0 * plain_acos(fmax(1.0 - sagitta / radius, 0.5));
    return ceil(fabs(row->angle) / step);
}

static void arc_points(nc_smooth *smooth, const nc_block *row) {
    int axes[2];
    plane_axes(smooth, row, axes);
    int a1 = axes[0];
    int a2 = axes[1];
    double from[NC_AXES];
    double sagitta = SAGITTA * smooth->tol;
    double d0 = smooth->programmed;
    memcpy(from, smooth->last, sizeof from);
    double e1 = from[a1] - row->center[0];
    double e2 = from[a2] - row->center[1];
    double radius = hypot(e1, e2);
    double angle0 = plain_atan2(e2, e1);
    double count = arc_chords(smooth, row);
    smooth->bow =
        (struct bow){a1, a2, (float)(0.5 * row->angle / fmax(count, 1.0))};
    for (double k = 1.0; k <= count; k++) {
        double share = k / count;
        double angle = angle0 + row->angle * share;
        for (int axis = 0; axis < smooth->cfg.axes; axis++) {
            smooth->last[axis] =
                from[axis]
                + share * (row->end[axis] * smooth->scale[axis] - from[axis]);
        }
        if (k < count) {
            smooth->last[a1] = row->center[0] + radius * plain_cos(angle);
            smooth->last[a2] = row->center[1] + radius * plain_sin(angle);
        }
        smooth->programmed = d0 + share * row->length;
        if (way_here(smooth) > ZERO) {
            section_point(smooth, row, sagitta);
        }
    }
    smooth->bow.half = 0.0f;
    if (row->end_speed > 0.0f) {
        slow_point(smooth, row->end_speed);
    }
}

/* The programmed position gets to the points of a chord's curve. */
static void curve_points(nc_smooth *smooth,
                         const nc_block *row,
                         const struct bend *bend) {
    double from[NC_AXES];
    double programmed = smooth->programmed;
    memcpy(from, smooth->last, sizeof from);
    for (int k = 1; k <= bend->count; k++) {
        double share = (double)k / bend->count;
        for (int axis = 0; axis < smooth->cfg.axes; axis++) {
            smooth->last[axis] =
                from[axis]
                + share * (row->end[axis] * smooth->scale[axis] - from[axis]);
        }
        bend_at(smooth, bend, share, smooth->last);
        smooth->programmed = programmed + share * row->length;
        if (way_here(smooth) > ZERO) {
            section_point(smooth, row, bend->sagitta);
        }
    }
    if (row->end_speed > 0.0f) {
        slow_point(smooth, row->end_speed);
    }
}

static bool smoothable(const nc_smooth *smooth, const nc_block *row) {
    if (!(smooth->tol > 0.0) || (row->flags & NC_RAPID)
        || row->type == NC_POLYNOMIAL || !(row->feed > 0.0)) {
        return false;
    }
    if (smooth->longest > 0.0 && row->length > smooth->longest
        && !is_bent_row(row)) {
        return false;
    }
    if (row->type == NC_CIRCULAR) {
        return arc_chords(smooth, row) <= ARC_CHORDS;
    }
    double main = 0.0;
    double all = 0.0;
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        double difference =
            row->end[axis] * smooth->scale[axis] - smooth->last[axis];
        all += difference * difference;
        if (in_main(smooth, axis)) {
            main += difference * difference;
        }
    }
    return main > 1e-12 && main >= MAIN_LEAST * MAIN_LEAST * all;
}

static void take_motion(nc_smooth *smooth,
                        const nc_block *row,
                        const double *pool) {
    if (!smoothable(smooth, row)) {
        smooth->is_bent = false;
        exact_motion(smooth, row, pool);
        return;
    }
    uint16_t flags = row->flags & NC_NO_OVERRIDE;
    if (smooth->feed >= 0.0
        && (smooth->feed != row->feed || smooth->feed_flags != flags)) {
        node_here(smooth)->mark = true;
    }
    smooth->feed = row->feed;
    smooth->feed_flags = flags;
    struct bend bend;
    bool curved = bend_of(smooth, row, &bend);
    if (row->type == NC_CIRCULAR || curved) {
        node_here(smooth);
    }
    bool function =
        smooth->has_function && row->count == smooth->function_count;
    nc_block seen = *row;
    if (is_bent_row(row)) {
        seen.degree = 0;
        seen.center[0] = seen.center[1] = seen.radius = 0.0;
    }
    emit_hold(smooth, &seen, last_node(smooth)->t, true);
    if (row->type == NC_CIRCULAR) {
        arc_points(smooth, row);
    } else if (curved) {
        curve_points(smooth, row, &bend);
    } else {
        line_point(smooth, row);
    }
    if (function) {
        node_here(smooth)->mark =
            true; /* it may take effect at the end of its block */
    }
    if (!(row->flags & NC_EXACT_STOP)) {
        return;
    }
    close_section(smooth);
    stop_here(smooth);
}

/* A turn within the tolerance d takes sqrt(8 d / A) at the acceleration A. More
 * jerk than builds A up in half of that time does not make it faster: a curve
 * for so much jerk needs more acceleration than there is. */
static double shaping_jerk(const nc_smooth *smooth) {
    double accel = smooth->cfg.accel;
    double most = accel * sqrt(accel / (2.0 * smooth->tol));
    return smooth->tol > 0.0 ? fmin(smooth->cfg.jerk, most) : smooth->cfg.jerk;
}

/* How slow the axis is, where that with the least jerk has 1. A linear axis
 * above 1 has little acceleration; it is as slow as that one, but what is said
 * to be its jerk need not come to the limit. */
static void set_slowness(nc_smooth *smooth, int axis) {
    double jerk = smooth->cfg.axis_jerk[axis] * smooth->scale[axis];
    double slow = jerk > 0.0 ? smooth->jerk / jerk : 0.0;
    bool rotary = smooth->cfg.rotary >> axis & 1;
    bool weak = !rotary && slow > 1.0;
    smooth->slowness[axis] = fmax(QUICKEST, weak ? 1.0 : slow);
    smooth->penalty_least[axis] = weak ? 1.0 : PENALTY_LEAST;
}

static void set_mode(nc_smooth *smooth, const nc_block *row) {
    close_section(smooth);
    double old[NC_AXES];
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        old[axis] = smooth->last[axis] / smooth->scale[axis];
    }
    double tol = row->value > 0.0 ? row->value : smooth->cfg.tolerance;
    double rotary =
        row->radius > 0.0 ? row->radius : smooth->cfg.rotary_tolerance;
    smooth->tol = row->code != NC_SMOOTH_OFF ? tol : 0.0;
    smooth->jerk = shaping_jerk(smooth);
    smooth->cuts = row->code == NC_SMOOTH_CUT || !(smooth->jerk > 0.0);
    smooth->degrees = smooth->cfg.rotary ? rotary / tol : 0.0;
    smooth->cfg.turn_max =
        row->angle > 0.0 ? row->angle : smooth->turn_configured;
    smooth->longest = row->length;
    smooth->exact_commands =
        (row->flags & NC_HAS_VALUE) && !(row->length > 0.0);
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        smooth->scale[axis] =
            smooth->tol > 0.0 && smooth->cfg.rotary >> axis & 1 ? tol / rotary
                                                                : 1.0;
        set_slowness(smooth, axis);
    }
    nc_smooth_resync(smooth, old);
}

static bool ends_section(const nc_smooth *smooth, const nc_block *row) {
    if (row->flags & NC_STANDSTILL) {
        return true;
    }
    if (row->type == NC_EVENT) {
        return smooth->exact_commands || row->code != NC_EVENT_COMMAND;
    }
    return row->type == NC_DWELL || row->type == NC_FLUSH
           || row->type == NC_DISTANCE_RESET || row->type == NC_RT_LOOP_BEGIN
           || row->type == NC_RT_LOOP_END || row->type == NC_COMPENSATION;
}

static void take_row(nc_smooth *smooth,
                     const nc_block *row,
                     const double *pool) {
    smooth->stats.rows++;
    if (row->type == NC_SMOOTHING) {
        set_mode(smooth, row);
    } else if (row->type <= NC_POLYNOMIAL) {
        take_motion(smooth, row, pool);
    } else if (ends_section(smooth, row) || !(smooth->tol > 0.0)) {
        close_section(smooth);
        pass(smooth, row, pool);
    } else if (row->type == NC_MARKER) {
        emit_hold(smooth, row, node_here(smooth)->t, false);
    } else {
        struct node *node = node_here(smooth);
        node->mark = true;
        smooth->has_function = true;
        smooth->function_count = row->count;
        emit_hold(smooth, row, node->t, false);
    }
    if (smooth->held_n - smooth->held_first > HELD_MAX) {
        close_section(smooth);
    }
}

int64_t nc_smooth_push(nc_smooth *smooth,
                       const nc_block *rows,
                       int64_t count,
                       const double *pool,
                       int64_t pool_n) {
    for (int64_t i = 0; i < count; i++) {
        if (!row_in_pool(&rows[i], smooth->cfg.axes, pool_n)
            || !row_in_plane(&rows[i], smooth->cfg.main_axis)) {
            return -2;
        }
        take_row(smooth, &rows[i], pool);
        if (smooth->no_memory) {
            return -1;
        }
    }
    return count;
}

int nc_smooth_drain(nc_smooth *smooth) {
    close_section(smooth);
    return smooth->no_memory ? -1 : 0;
}

nc_smooth *nc_smooth_new(const nc_smooth_config *config, const double *start) {
    nc_smooth *smooth = calloc(1, sizeof *smooth);
    if (!smooth) {
        return NULL;
    }
    smooth->cfg = *config;
    smooth->turn_configured = config->turn_max;
    for (int i = 0; i < 3; i++) {
        if (config->main_axis[i] >= 0) {
            smooth->main_mask |= (uint16_t)(1u << config->main_axis[i]);
        }
    }
    for (int axis = 0; axis < NC_AXES; axis++) {
        smooth->scale[axis] = 1.0;
    }
    nc_block mode = {.type = NC_SMOOTHING, .code = config->tolerance > 0.0};
    nc_smooth_resync(smooth, start);
    set_mode(smooth, &mode);
    return smooth;
}
