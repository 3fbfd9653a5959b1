/* Nodes to sections: which points belong to one smooth section, which chords
 * are driven exactly, where corners are. */
#include "stages/smoothing/emit.h"
#include "stages/smoothing/nodes.h"
#include "stages/smoothing/sections.h"
#include "stages/smoothing/state.h"
#include "stages/smoothing/window.h"
#include "stages/square.h"
#include "maths/plain.h"

/* Directions of the chords that end and begin at a node. */
static void directions_at(const nc_smooth *smooth,
                          const struct node *node,
                          double *into,
                          double *out) {
    const struct node *before = node - 1;
    const struct node *behind = node + 1;
    for (int i = 0; i < smooth->cfg.axes; i++) {
        into[i] =
            (node->position[i] - before->position[i]) / (node->t - before->t);
        out[i] =
            (behind->position[i] - node->position[i]) / (behind->t - node->t);
    }
}

static double turn_between(const nc_smooth *smooth,
                           const double *into,
                           const double *out) {
    double minus = 0.0;
    double plus = 0.0;
    for (int i = 0; i < smooth->cfg.axes; i++) {
        minus += square(into[i] - out[i]);
        plus += square(into[i] + out[i]);
    }
    return 2.0 * plain_atan2(sqrt(minus), sqrt(plus));
}

static void turn_in_plane(const struct bow *bow,
                          double angle,
                          double *direction) {
    double first = direction[bow->first];
    double second = direction[bow->second];
    double c = plain_cos(angle);
    double s = plain_sin(angle);
    direction[bow->first] = c * first - s * second;
    direction[bow->second] = s * first + c * second;
}

/* Whether the program turns by more than is smoothed, between chords of these
 * directions. Chords of an arc turn as well, and it does not: they become its
 * tangents. */
static bool turns_too_far(const nc_smooth *smooth,
                          const struct node *node,
                          double *into,
                          double *out) {
    const struct bow *before = &node->bow;
    const struct bow *behind = &node[1].bow;
    if (before->half == 0.0f && behind->half == 0.0f) {
        return node->turn > smooth->cfg.turn_max;
    }
    turn_back(smooth, into); /* planes of arcs are programmed */
    turn_back(smooth, out);
    if (before->half != 0.0f) {
        turn_in_plane(before, before->half, into);
    }
    if (behind->half != 0.0f) {
        turn_in_plane(behind, -behind->half, out);
    }
    return turn_between(smooth, into, out) > smooth->cfg.turn_max;
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
 * blend is faster than a long curve, which is slow over all of its way. Not if
 * the curve may swing out to one side first. */
static double sharpness(const nc_smooth *smooth, double turn) {
    if (!smooth->cuts) {
        return 0.0;
    }
    return fmin(1.0, fmax(0.0, (turn - SHARP_FROM) / (SHARP_TO - SHARP_FROM)));
}

/* Way over which a turn may be spread so that it does not slow the machine down
 * up to this speed.  The acceleration counts as far as the jerk builds it up in
 * RISE_S. */
static double fast_length(const nc_smooth *smooth, double turn, double speed) {
    double accel = smooth->cfg.accel;
    if (smooth->cfg.jerk > 0.0) {
        accel = fmin(accel, RISE_S * smooth->cfg.jerk);
    }
    double v2 = speed * speed / accel;
    return fmax(FAST_LEAST,
                fmax(2.0 * turn * v2, sqrt(4.0 * RISE_S * turn * v2 * speed)));
}

/* How far along a long line the curve may begin before a node with this turn,
 * next to a chord of this length; the line may be driven with `speed`. */
static double run_out(const nc_smooth *this_smooth,
                      const struct node *node,
                      double beside,
                      double speed) {
    if (node->kind == NODE_BREAK) {
        return 0.0;
    }
    double turn = fmax(node->turn, 1e-9);
    double corner = corner_distance(this_smooth, turn);
    double smooth = fmin(3.0 * sqrt(8.0 * this_smooth->tol * beside / turn),
                         fast_length(this_smooth, turn, speed));
    double kink = this_smooth->jerk > 0.0 ? KINK_JERK : KINK;
    double bend = fmax(fmin(smooth, kink * this_smooth->tol / turn),
                       10.0 * this_smooth->tol);
    return fmax(corner, bend + sharpness(this_smooth, turn) * (corner - bend));
}

static struct node between(const nc_smooth *smooth,
                           const struct node *node,
                           const struct node *behind,
                           double share,
                           uint8_t kind,
                           double size) {
    struct node node_n = *behind;
    node_n.kind = kind;
    node_n.t = whole_parameter(node->t + share * (behind->t - node->t));
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
void section_split(nc_smooth *smooth, int i, double beside_next) {
    struct node node = smooth->nodes[i - 1];
    struct node behind = smooth->nodes[i];
    double own = behind.t - node.t;
    if (node.kind == NODE_HEAD || node.kind == NODE_TAIL) {
        return;
    }
    double left = run_out(smooth, &node, node.len, behind.most);
    double right = run_out(smooth, &behind, beside_next, behind.most);
    double corner_a = sharpness(smooth, node.turn);
    double corner_b = sharpness(smooth, behind.turn);
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

/* The vertex of a section that has one only, NULL. */
static const struct node *only_vertex(const nc_smooth *smooth, int end) {
    const struct node *found = NULL;
    for (int i = 1; i < end; i++) {
        const struct node *node = &smooth->nodes[i];
        if (node->kind == NODE_VERTEX && found) {
            return NULL;
        }
        found = node->kind == NODE_VERTEX ? node : found;
    }
    return found;
}

/* A blend passes the vertex at the feed: then the shortest way is the fastest.
 */
static bool passes_at_feed(const nc_smooth *smooth, const struct node *node) {
    double feed = fmin(node->most, node[1].most);
    feed = node->feed > 0.0 ? fmin(node->feed, feed) : feed;
    double way = corner_distance(smooth, node->turn);
    return smooth->jerk * way * way > BLEND_JERK * feed * feed * feed;
}

/* One vertex between lines that is cut by a blend. */
static bool is_corner(const nc_smooth *smooth, int end) {
    const struct node *node = only_vertex(smooth, end);
    return !smooth->keep.valid && node
           && (smooth->cuts || passes_at_feed(smooth, node));
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
    } else if (is_corner(smooth, end)) {
        corner_path(smooth, end);
        drop_nodes(smooth, end);
    } else {
        window_advance(smooth, end, true);
    }
}

static double spans_wanted(const nc_smooth *smooth, int known) {
    bool coarse =
        smooth->jerk > 0.0 && smooth->measure >= COARSE * (double)known;
    return coarse || law_goes_on(smooth) ? SPANS_FASTER : SPANS_FULL;
}

/* Work off what is known: the first `known` nodes are settled. */
void section_work(nc_smooth *smooth, int known) {
    for (;;) {
        int before = smooth->n_nodes;
        int end = section_end(smooth, known);
        bool enough = smooth->measure >= spans_wanted(smooth, known)
                      || smooth->n_nodes > NODES_FULL;
        if (end > 0) {
            finish_section(smooth, end);
            smooth->measure = 0.0;
        } else if (known > 4 && enough) {
            window_advance(smooth, known - 1, false);
        } else {
            return;
        }
        known -= before - smooth->n_nodes;
    }
}

/* Node i - its next node is known - becomes final. */
static void settle(nc_smooth *smooth, int i) {
    struct node *node = &smooth->nodes[i];
    double next = smooth->nodes[i + 1].t - node->t;
    if (node->kind == NODE_VERTEX) {
        double into[NC_AXES], out[NC_AXES];
        directions_at(smooth, node, into, out);
        node->turn = turn_between(smooth, into, out);
        if (turns_too_far(smooth, node, into, out)
            || main_turns_back(smooth, node - 1, node, node + 1)) {
            node->kind = NODE_BREAK;
        }
        size_of(smooth, node, next);
    }
    section_split(smooth, i, next);
}

/* The chord that ends at node `last` grows no more: the node ahead of it is
 * final. */
static void settle_ahead(nc_smooth *smooth, int last) {
    int from_end = smooth->n_nodes - last; /* settling adds nodes ahead of it */
    if (last > 1) {
        settle(smooth, last - 1);
    }
    section_work(smooth, smooth->n_nodes - from_end);
}

/* Collinear chords may follow, and the last one grows with them: how the path
 * goes round a node is decided when the chord behind it is whole. */
static void add_node(nc_smooth *smooth, const struct node *node) {
    smooth->nodes[smooth->n_nodes++] = *node;
    if (smooth->n_nodes > 2) {
        settle_ahead(smooth, smooth->n_nodes - 2);
    }
}

void section_complete(nc_smooth *smooth) {
    settle_ahead(smooth, smooth->n_nodes - 1);
}

/* The directions in which a chord passes all points left out on it: a ball
 * around `toward`. Each point leaves a ball of its own, and what is kept of the
 * common part is a ball again. */
static void narrow(nc_smooth *smooth, const double *unit, double radius) {
    double apart =
        smooth->merged_n ? scaled_distance(smooth, unit, smooth->toward) : 0.0;
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
    double length = scaled_distance(smooth, from, to);
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
    if (scaled_distance(smooth, v, smooth->toward) > smooth->spread) {
        memcpy(smooth->toward, toward, sizeof toward);
        smooth->spread = spread;
        return false;
    }
    smooth->merged_n++;
    double t = whole_parameter(from->t + length);
    *at = *node;
    at->t = smooth->t = t;
    at->slack = allowed;
    at->len = length;
    return true;
}

/* mm/s that the axes allow along a chord, at most that of the quickest one. */
static double chord_speed(const nc_smooth *smooth,
                          const double *from,
                          const double *to,
                          double length) {
    double most = 0.0;
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        most = fmax(most, smooth->cfg.axis_feed[axis]);
    }
    double quickest = most;
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        double feed = smooth->cfg.axis_feed[axis] * length;
        double way = fabs(to[axis] - from[axis]);
        if (feed > 0.0 && way * quickest > feed) {
            most = fmin(most, feed / way);
        }
    }
    return most;
}

/* The programmed position becomes a node; `row` says where it comes from. */
void section_point(nc_smooth *smooth, const nc_block *row, double slack) {
    struct node *at = last_node(smooth);
    const double *here = position_here(smooth);
    double length = scaled_distance(smooth, at->position, here);
    struct node node = {.t = whole_parameter(at->t + length),
                        .programmed = smooth->programmed,
                        .kind = NODE_VERTEX,
                        .slack = fmax(slack, smooth->skipped),
                        .len = length,
                        .size = 1e9};
    memcpy(node.position, here, sizeof node.position);
    node.most = chord_speed(smooth, at->position, here, length);
    node.feed = row->flags & NC_RAPID ? 0.0 : row->feed;
    node.flags = row->flags & NC_NO_OVERRIDE;
    node.bow = smooth->bow;
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
