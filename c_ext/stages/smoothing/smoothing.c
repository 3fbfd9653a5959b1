/* Rows to nodes: which points of the contour belong to one smooth section,
 * which chords are driven exactly. */
#include "stages/smoothing/smoothing.h"
#include <stdlib.h>
#include "stages/smoothing/state.h"

#define ZERO 1e-9 /* mm, scaled: no motion */
#define LEAVE_OUT                                                              \
    0.25 /* share of the tolerance: points closer to the last one are left out \
          */
#define FIGURE                                                                 \
    0.1 /* the same of a figure that would be left out altogether, as share of \
           its size */
#define MERGE                                                                  \
    0.01 /* share of the tolerance (1e-4 mm at most): collinear points are     \
            left out */
#define MERGE_MAX 1e-4
#define MERGED 128 /* points left out on one chord at the most */
#define SAGITTA                                                                \
    0.05 /* share of the tolerance that the chords of an arc use up */
#define TURN_PER_SPAN 0.18
#define LONG_LINE                                                              \
    1.5 /* times both run-outs: longer chords are driven exactly in their      \
           middle; at corners 1 */
#define TURN_BACK                                                              \
    -0.866 /* cosine: main axes that turn by more are at a corner, even if the \
              path with all axes is not */
#define KINK 24.0 /* tolerances over the turn: run-out of a curve */
#define CROWDED                                                                \
    0.7 /* of the way that two corner blends want: with less, a curve takes    \
           both corners */
#define FAST_LEAST 0.5 /* mm: run-out of a curve that hardly bends */
#define SHARP_FROM 1.2 /* rad: turns are blended by curves below, */
#define SHARP_TO 1.6   /* ... and as corners above */
#define MAIN_LEAST                                                             \
    0.02 /* share of the main axes in a chord: below it, the path is too short \
            for the turns of the others */
#define HELD_MAX 8192 /* rows held back; then the section is ended */

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
}

/* ---- nodes
 * ------------------------------------------------------------------------------------------------------
 */

static struct node *last_node(nc_smooth *smooth) {
    return &smooth->nodes[smooth->n_nodes - 1];
}

void drop_nodes(nc_smooth *smooth, int count) {
    memmove(smooth->nodes,
            smooth->nodes + count,
            sizeof(struct node) * (size_t)(smooth->n_nodes - count));
    smooth->n_nodes -= count;
}

static double distance(const nc_smooth *smooth,
                       const double *from,
                       const double *to) {
    double sum = 0.0;
    for (int i = 0; i < smooth->cfg.axes; i++) {
        sum += (from[i] - to[i]) * (from[i] - to[i]);
    }
    return sqrt(sum);
}

/* The section begins anew at the programmed position. */
static void begin_at(nc_smooth *smooth) {
    struct node node = {.t = smooth->t,
                        .programmed = smooth->programmed,
                        .kind = NODE_BREAK,
                        .size = 1e9,
                        .feed = -1.0};
    memcpy(node.position, smooth->last, sizeof node.position);
    smooth->nodes[0] = node;
    smooth->n_nodes = 1;
    smooth->keep.valid = smooth->has_line = false;
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
    smooth->held_n = smooth->held_first = 0;
    begin_at(smooth);
}

static double turn_at(const nc_smooth *smooth,
                      const struct node *before,
                      const struct node *node,
                      const struct node *behind) {
    double minus = 0.0;
    double plus = 0.0;
    double la = node->t - before->t;
    double lb = behind->t - node->t;
    for (int i = 0; i < smooth->cfg.axes; i++) {
        double into = (node->position[i] - before->position[i]) / la;
        double out = (behind->position[i] - node->position[i]) / lb;
        minus += (into - out) * (into - out);
        plus += (into + out) * (into + out);
    }
    return 2.0 * atan2(sqrt(minus), sqrt(plus));
}

/* The main axes turn back although others go on: their speed, by which the path
 * is measured, would vanish in the turn. */
static bool main_turns_back(const nc_smooth *smooth,
                            const struct node *before,
                            const struct node *node,
                            const struct node *behind) {
    double before2 = 0.0;
    double behind2 = 0.0;
    double both = 0.0;
    for (int i = 0; i < smooth->cfg.axes; i++) {
        if (!in_main(smooth, i)) {
            continue;
        }
        double into = node->position[i] - before->position[i];
        double out = behind->position[i] - node->position[i];
        before2 += into * into;
        behind2 += out * out;
        both += into * out;
    }
    return both < TURN_BACK * sqrt(before2 * behind2);
}

/* How much a turn is a corner, 0..1: where lines meet at a large angle a short
 * blend is faster than a long curve, which is slow over all of its way. */
static double sharpness(double turn) {
    return fmin(1.0, fmax(0.0, (turn - SHARP_FROM) / (SHARP_TO - SHARP_FROM)));
}

/* Way over which a turn may be spread so that it does not slow the machine down
 * at any speed. */
static double fast_length(const nc_smooth *smooth, double turn) {
    double v2 =
        smooth->cfg.feed * smooth->cfg.feed
        / smooth->cfg
              .accel; /* jerk: what builds up the acceleration in 0.1 s */
    return fmax(
        FAST_LEAST,
        fmax(2.0 * turn * v2, sqrt(0.4 * turn * v2 * smooth->cfg.feed)));
}

/* How far along a long line the curve may begin before a node with this turn,
 * next to a chord of this length. */
static double run_out(const nc_smooth *this_smooth,
                      const struct node *node,
                      double beside) {
    if (node->kind == NODE_BREAK) {
        return 0.0;
    }
    double turn = fmax(node->turn, 1e-9);
    double corner = corner_distance(this_smooth, turn);
    double smooth = fmin(3.0 * sqrt(8.0 * this_smooth->tol * beside / turn),
                         fast_length(this_smooth, turn));
    double bend = fmax(fmin(smooth, KINK * this_smooth->tol / turn),
                       10.0 * this_smooth->tol);
    return fmax(corner, bend + sharpness(turn) * (corner - bend));
}

static struct node between(const nc_smooth *smooth,
                           const struct node *node,
                           const struct node *behind,
                           double share,
                           uint8_t kind,
                           double size) {
    struct node node_n = *behind;
    node_n.kind = kind;
    node_n.t = node->t + share * (behind->t - node->t);
    node_n.programmed =
        node->programmed + share * (behind->programmed - node->programmed);
    node_n.turn = 0.0;
    node_n.size = size;
    node_n.mark = false;
    node_n.end_speed = 0.0f;
    for (int i = 0; i < smooth->cfg.axes; i++) {
        node_n.position[i] =
            node->position[i]
            + share * (behind->position[i] - node->position[i]);
    }
    return node_n;
}

/* The chord that ends at node i, both of whose turns are known: a long one is
 * driven exactly in its middle. */
static void split_long(nc_smooth *smooth, int i, double beside_next) {
    struct node node = smooth->nodes[i - 1];
    struct node behind = smooth->nodes[i];
    double own = behind.t - node.t;
    if (node.kind == NODE_HEAD || node.kind == NODE_TAIL) {
        return;
    }
    double left = run_out(smooth, &node, node.len);
    double right = run_out(smooth, &behind, beside_next);
    double corner_a = sharpness(node.turn);
    double corner_b = sharpness(behind.turn);
    if (fmin(corner_a, corner_b) > 0.9 && own < left + right
        && own > CROWDED * (left + right)) {
        left = right = 0.45 * own; /* smaller blends */
    }
    double least = left * (LONG_LINE - (LONG_LINE - 1.0) * corner_a)
                   + right * (LONG_LINE - (LONG_LINE - 1.0) * corner_b);
    if (own < least || smooth->n_nodes + 2 > NODES) {
        return;
    }
    if (left + right <= 0.0) {
        return;
    }
    struct node add[2];
    int count = 0;
    if (node.kind != NODE_BREAK) {
        add[count++] =
            between(smooth, &node, &behind, left / own, NODE_TAIL, left / 4.0);
    }
    if (behind.kind != NODE_BREAK) {
        add[count++] = between(smooth,
                               &node,
                               &behind,
                               1.0 - right / own,
                               NODE_HEAD,
                               right / 4.0);
    }
    if (count == 2 && !(add[0].t < add[1].t)) {
        return;
    }
    memmove(smooth->nodes + i + count,
            smooth->nodes + i,
            sizeof(struct node) * (size_t)(smooth->n_nodes - i));
    memcpy(smooth->nodes + i, add, sizeof(struct node) * (size_t)count);
    smooth->n_nodes += count;
}

static void size_of(nc_smooth *smooth, struct node *node, double next) {
    double turn = fmax(node->turn, 1e-9);
    double chord = fmax(node->len, next);
    node->size =
        fmax(smooth->tol,
             fmin(3.0 * smooth->tol / turn, TURN_PER_SPAN * chord / turn));
    double half = 0.5 * SIZE_GROWTH * node->len;
    double spans =
        (log1p(half / node->size) + log1p(half / node[-1].size)) / SIZE_GROWTH;
    smooth->measure += fmax(spans, 1.0 / 8.0);
}

/* ---- sections
 * ---------------------------------------------------------------------------------------------------
 */

static int section_end(const nc_smooth *smooth, int known) {
    for (int i = 1; i < known; i++) {
        if (smooth->nodes[i].kind == NODE_BREAK
            || smooth->nodes[i].kind == NODE_TAIL
            || smooth->nodes[i].kind == NODE_HEAD) {
            return i;
        }
    }
    return 0;
}

static int vertices(const nc_smooth *smooth, int end) {
    int count = 0;
    for (int i = 1; i < end; i++) {
        count += smooth->nodes[i].kind == NODE_VERTEX;
    }
    return count;
}

/* Everything up to nodes[end] where a section ends. */
static void finish_section(nc_smooth *smooth, int end) {
    if (end == 1 && !smooth->keep.valid) {
        emit_line(smooth,
                  &smooth->nodes[0],
                  &smooth->nodes[1],
                  smooth->out_t,
                  smooth->nodes[1].t);
        drop_nodes(smooth, 1);
    } else if (vertices(smooth, end) == 1 && !smooth->keep.valid) {
        corner_path(smooth, end);
        drop_nodes(smooth, end);
    } else {
        window_advance(smooth, end, true);
    }
}

/* Work off what is known: the first `known` nodes are settled. */
static void work(nc_smooth *smooth, int known) {
    int end;
    while ((end = section_end(smooth, known))) {
        int before = smooth->n_nodes;
        finish_section(smooth, end);
        known -= before - smooth->n_nodes;
        smooth->measure = 0.0;
    }
    while (known > 4
           && (smooth->measure >= SPANS_FULL || smooth->n_nodes > NODES_FULL)) {
        int before = smooth->n_nodes;
        window_advance(smooth, known - 1, false);
        known -= before - smooth->n_nodes;
    }
}

/* Node i - its next node is known - becomes final. */
static void settle(nc_smooth *smooth, int i) {
    struct node *node = &smooth->nodes[i];
    double next = smooth->nodes[i + 1].t - node->t;
    if (node->kind == NODE_VERTEX) {
        node->turn = turn_at(smooth, node - 1, node, node + 1);
        double most = smooth->cfg.turn_max;
        if (node->turn > most
            || main_turns_back(smooth, node - 1, node, node + 1)) {
            node->kind = NODE_BREAK;
        }
        size_of(smooth, node, next);
    }
    split_long(smooth, i, next);
}

static void add_node(nc_smooth *smooth, const struct node *node) {
    smooth->nodes[smooth->n_nodes++] = *node;
    if (smooth->n_nodes > 2) {
        settle(smooth, smooth->n_nodes - 2);
    }
    work(smooth, smooth->n_nodes - 1);
}

/* The directions in which a chord passes all points left out on it: a ball
 * around `toward`. Each point leaves a ball of its own, and what is kept of the
 * common part is a ball again. */
static void narrow(nc_smooth *smooth, const double *unit, double radius) {
    double apart =
        smooth->merged_n ? distance(smooth, unit, smooth->toward) : 0.0;
    if (smooth->merged_n == 0 || apart + radius <= smooth->spread) {
        memcpy(smooth->toward, unit, sizeof smooth->toward);
        smooth->spread = radius;
    } else if (apart + smooth->spread > radius) {
        double common = 0.5 * (smooth->spread + radius - apart);
        double shift = apart > 0.0 ? (smooth->spread - common) / apart : 0.0;
        for (int axis = 0; axis < smooth->cfg.axes; axis++) {
            smooth->toward[axis] += shift * (unit[axis] - smooth->toward[axis]);
        }
        smooth->spread = common;
    }
}

static double direction_to(const nc_smooth *smooth,
                           const double *from,
                           const double *to,
                           double *unit) {
    double length = distance(smooth, from, to);
    for (int axis = 0; axis < NC_AXES; axis++) {
        unit[axis] =
            axis < smooth->cfg.axes ? (to[axis] - from[axis]) / length : 0.0;
    }
    return length;
}

/* Collinear with the chord that ends at the last node: that node moves. */
static bool merge(nc_smooth *smooth, const struct node *node) {
    struct node *at = last_node(smooth);
    double allowed = fmin(MERGE * smooth->tol, MERGE_MAX);
    if (smooth->n_nodes < 2 || at->mark || at->kind != NODE_VERTEX
        || at->slack > allowed || node->slack > allowed
        || smooth->merged_n >= MERGED) {
        return false;
    }
    if (at[-1].kind == NODE_TAIL || at->feed != node->feed
        || at->flags != node->flags || at->t <= smooth->out_t) {
        return false;
    }
    if (smooth->keep.valid
        && at[-1].t < smooth->keep.tau[smooth->keep.spans + 5]) {
        return false;
    }
    const struct node *from = at - 1;
    double unit[NC_AXES], v[NC_AXES];
    double before = direction_to(smooth, from->position, at->position, unit);
    double length = direction_to(smooth, from->position, node->position, v);
    if (length <= before + ZERO) {
        return false;
    }
    double toward[NC_AXES];
    double spread = smooth->spread;
    memcpy(toward, smooth->toward, sizeof toward);
    narrow(smooth, unit, allowed / before);
    if (distance(smooth, v, smooth->toward) > smooth->spread) {
        memcpy(smooth->toward, toward, sizeof toward);
        smooth->spread = spread;
        return false;
    }
    smooth->merged_n++;
    double t = from->t + length;
    *at = *node;
    at->t = smooth->t = t;
    at->slack = allowed;
    at->len = length;
    return true;
}

/* The programmed position becomes a node; `row` says where it comes from. */
static void add_point(nc_smooth *smooth, const nc_block *row, double slack) {
    struct node *at = last_node(smooth);
    double length = distance(smooth, at->position, smooth->last);
    struct node node = {.t = at->t + length,
                        .programmed = smooth->programmed,
                        .kind = NODE_VERTEX,
                        .slack = fmax(slack, smooth->skipped),
                        .len = length,
                        .size = 1e9};
    memcpy(node.position, smooth->last, sizeof node.position);
    node.feed = row->flags & NC_RAPID ? 0.0 : row->feed;
    node.flags = row->flags & NC_NO_OVERRIDE;
    node.number = row->n;
    node.line = row->line;
    node.count = row->count;
    node.file = row->file;
    smooth->stats.left_out = fmax(smooth->stats.left_out, smooth->skipped);
    smooth->skipped = 0.0;
    smooth->left_n = 0;
    smooth->t = node.t;
    if (merge(smooth, &node)) {
        return;
    }
    smooth->merged_n = 0;
    add_node(smooth, &node);
}

/* ---- rows
 * -------------------------------------------------------------------------------------------------------
 */

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

/* The path comes back to the last node from a figure whose points have all been
 * left out, and ends: they are not left out then, but for those that are next
 * to each other. */
static void drive_figure(nc_smooth *smooth) {
    const nc_block *row = newest_motion(smooth);
    double last[NC_AXES];
    double programmed = smooth->programmed;
    double leave = FIGURE * smooth->skipped;
    if (!row || smooth->skipped <= ZERO
        || distance(smooth, last_node(smooth)->position, smooth->last) > ZERO) {
        return;
    }
    nc_block copy = *row;
    memcpy(last, smooth->last, sizeof last);
    last_node(smooth)->mark = true;
    smooth->skipped = 0.0;
    for (int i = 0, count = smooth->left_n; i < count; i++) {
        memcpy(smooth->last, smooth->left[i].position, sizeof last);
        smooth->programmed = smooth->left[i].programmed;
        if (distance(smooth, last_node(smooth)->position, smooth->last)
            > fmax(leave, ZERO)) {
            add_point(smooth, &copy, leave);
        }
    }
    memcpy(smooth->last, last, sizeof last);
    smooth->programmed = programmed;
}

/* A node where the programmed position is, so that something can take effect
 * there. */
static struct node *node_here(nc_smooth *smooth) {
    const nc_block *row = newest_motion(smooth);
    if (row
        && distance(smooth, last_node(smooth)->position, smooth->last) > ZERO) {
        nc_block copy = *row;
        last_node(smooth)->mark = true; /* not merged into what is before */
        add_point(smooth, &copy, 0.0);
    }
    return last_node(smooth);
}

/* The section ends here; everything is written. */
static void close_section(nc_smooth *smooth) {
    drive_figure(smooth);
    struct node *node = node_here(smooth);
    if (smooth->n_nodes > 1) {
        node->kind = NODE_BREAK;
        split_long(smooth, smooth->n_nodes - 1, 0.0);
        work(smooth, smooth->n_nodes);
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
    smooth->t += row->length;
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
    double length = distance(smooth, last_node(smooth)->position, smooth->last);
    if (length < LEAVE_OUT * smooth->tol && !last_node(smooth)->mark) {
        leave_out(smooth, length);
    } else if (length > ZERO) {
        add_point(smooth, row, 0.0);
    }
    if (row->end_speed > 0.0f) {
        slow_point(smooth, row->end_speed);
    }
}

static void arc_points(nc_smooth *smooth, const nc_block *row) {
    static const int planes[3][2] = {{0, 1}, {2, 0}, {1, 2}};
    int a1 = smooth->cfg.main_axis[planes[row->plane - 17][0]];
    int a2 = smooth->cfg.main_axis[planes[row->plane - 17][1]];
    double from[NC_AXES];
    double sagitta = SAGITTA * smooth->tol;
    double d0 = smooth->programmed;
    memcpy(from, smooth->last, sizeof from);
    double e1 = from[a1] - row->center[0];
    double e2 = from[a2] - row->center[1];
    double radius = hypot(e1, e2);
    double angle0 = atan2(e2, e1);
    double step = 2.0 * acos(fmax(1.0 - sagitta / radius, 0.5));
    double count = ceil(fabs(row->angle) / step);
    for (double k = 1.0; k <= count; k++) {
        double share = k / count;
        double angle = angle0 + row->angle * share;
        for (int axis = 0; axis < smooth->cfg.axes; axis++) {
            smooth->last[axis] =
                from[axis]
                + share * (row->end[axis] * smooth->scale[axis] - from[axis]);
        }
        if (k < count) {
            smooth->last[a1] = row->center[0] + radius * cos(angle);
            smooth->last[a2] = row->center[1] + radius * sin(angle);
        }
        smooth->programmed = d0 + share * row->length;
        if (distance(smooth, last_node(smooth)->position, smooth->last)
            > ZERO) {
            add_point(smooth, row, sagitta);
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
    if (smooth->longest > 0.0 && row->length > smooth->longest) {
        return false;
    }
    if (row->type == NC_CIRCULAR) {
        return true;
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
    if (row->type == NC_CIRCULAR) {
        node_here(smooth);
    }
    bool function =
        smooth->has_function && row->count == smooth->function_count;
    emit_hold(smooth, row, last_node(smooth)->t, true);
    if (row->type == NC_CIRCULAR) {
        arc_points(smooth, row);
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

static void set_mode(nc_smooth *smooth, const nc_block *row) {
    close_section(smooth);
    double old[NC_AXES];
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        old[axis] = smooth->last[axis] / smooth->scale[axis];
    }
    double tol = row->value > 0.0 ? row->value : smooth->cfg.tolerance;
    double rotary =
        row->radius > 0.0 ? row->radius : smooth->cfg.rotary_tolerance;
    smooth->tol = row->code ? tol : 0.0;
    smooth->degrees = smooth->cfg.rotary ? rotary / tol : 0.0;
    smooth->cfg.turn_max =
        row->angle > 0.0 ? row->angle : smooth->turn_configured;
    smooth->longest = row->length;
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        smooth->scale[axis] =
            smooth->tol > 0.0 && smooth->cfg.rotary >> axis & 1 ? tol / rotary
                                                                : 1.0;
    }
    nc_smooth_resync(smooth, old);
}

static bool ends_section(const nc_block *row) {
    if (row->flags & NC_STANDSTILL) {
        return true;
    }
    if (row->type == NC_EVENT) {
        return row->code != NC_EVENT_COMMAND;
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
    } else if (ends_section(row) || !(smooth->tol > 0.0)) {
        close_section(smooth);
        pass(smooth, row, pool);
    } else if (row->type == NC_MARKER) {
        emit_hold(smooth, row, node_here(smooth)->t, false);
    } else {
        struct node *node = node_here(smooth);
        node->mark = smooth->has_function = true;
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
    (void)pool_n;
    for (int64_t i = 0; i < count; i++) {
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
