/* Rows to nodes: which points of the contour belong to one smooth section, which chords are driven exactly. */
#include "stages/smoothing/smoothing.h"
#include <stdlib.h>
#include "stages/smoothing/state.h"

#define ZERO 1e-9         /* mm, scaled: no motion */
#define LEAVE_OUT 0.25    /* share of the tolerance: points closer to the last one are left out */
#define FIGURE 0.1        /* the same of a figure that would be left out altogether, as share of its size */
#define MERGE 0.01        /* share of the tolerance (1e-4 mm at most): collinear points are left out */
#define MERGE_MAX 1e-4
#define MERGED 128        /* points left out on one chord at the most */
#define SAGITTA 0.05      /* share of the tolerance that the chords of an arc use up */
#define TURN_PER_SPAN 0.18
#define LONG_LINE 1.5     /* times both run-outs: longer chords are driven exactly in their middle; at corners 1 */
#define TURN_BACK -0.866   /* cosine: main axes that turn by more are at a corner, even if the path with all axes is not */
#define KINK 24.0         /* tolerances over the turn: run-out of a curve */
#define CROWDED 0.7       /* of the way that two corner blends want: with less, a curve takes both corners */
#define FAST_LEAST 0.5    /* mm: run-out of a curve that hardly bends */
#define SHARP_FROM 1.2    /* rad: turns are blended by curves below, */
#define SHARP_TO 1.6      /* ... and as corners above */
#define MAIN_LEAST 0.02   /* share of the main axes in a chord: below it, the path is too short for the turns of the others */
#define HELD_MAX 8192     /* rows held back; then the section is ended */

void nc_smooth_free(nc_smooth *s) {
    if (!s) return;
    free(s->held);
    free(s->rows);
    free(s->pool);
    free(s);
}

void nc_smooth_get_stats(const nc_smooth *s, nc_smooth_stats *out) { *out = s->stats; }

/* ---- nodes ------------------------------------------------------------------------------------------------------ */

static node *last_node(nc_smooth *s) { return &s->nodes[s->n_nodes - 1]; }

void drop_nodes(nc_smooth *s, int n) {
    memmove(s->nodes, s->nodes + n, sizeof(node) * (size_t)(s->n_nodes - n));
    s->n_nodes -= n;
}

static double distance(const nc_smooth *s, const double *a, const double *b) {
    double sum = 0.0;
    for (int i = 0; i < s->cfg.axes; i++) sum += (a[i] - b[i]) * (a[i] - b[i]);
    return sqrt(sum);
}

/* The section begins anew at the programmed position. */
static void begin_at(nc_smooth *s) {
    node n = {.t = s->t, .d = s->d, .kind = NODE_BREAK, .size = 1e9, .feed = -1.0};
    memcpy(n.q, s->last, sizeof n.q);
    s->nodes[0] = n;
    s->n_nodes = 1;
    s->keep.valid = s->has_line = false;
    s->skipped = 0.0;
    s->left_n = 0;
    s->feed = -1.0;
    s->merged_n = 0;
    s->measure = 0.0;
    s->out_t = s->t;
    for (int a = 0; a < s->cfg.axes; a++) s->out_at[a] = s->last[a] / s->scale[a];
}

void nc_smooth_resync(nc_smooth *s, const double *position) {
    for (int a = 0; a < s->cfg.axes; a++) s->last[a] = position[a] * s->scale[a];
    s->held_n = s->held_first = 0;
    begin_at(s);
}

static double turn_at(const nc_smooth *s, const node *a, const node *b, const node *c) {
    double minus = 0.0, plus = 0.0, la = b->t - a->t, lb = c->t - b->t;
    for (int i = 0; i < s->cfg.axes; i++) {
        double u = (b->q[i] - a->q[i]) / la, v = (c->q[i] - b->q[i]) / lb;
        minus += (u - v) * (u - v);
        plus += (u + v) * (u + v);
    }
    return 2.0 * atan2(sqrt(minus), sqrt(plus));
}

/* The main axes turn back although others go on: their speed, by which the path is measured, would vanish in the turn. */
static bool main_turns_back(const nc_smooth *s, const node *a, const node *b, const node *c) {
    double before = 0.0, behind = 0.0, both = 0.0;
    for (int i = 0; i < s->cfg.axes; i++) {
        if (!in_main(s, i)) continue;
        double u = b->q[i] - a->q[i], v = c->q[i] - b->q[i];
        before += u * u;
        behind += v * v;
        both += u * v;
    }
    return both < TURN_BACK * sqrt(before * behind);
}

/* How much a turn is a corner, 0..1: where lines meet at a large angle a short blend is faster than a long curve, which is slow
 * over all of its way. */
static double sharpness(double turn) { return fmin(1.0, fmax(0.0, (turn - SHARP_FROM) / (SHARP_TO - SHARP_FROM))); }

/* Way over which a turn may be spread so that it does not slow the machine down at any speed. */
static double fast_length(const nc_smooth *s, double turn) {
    double v2 = s->cfg.feed * s->cfg.feed / s->cfg.accel; /* jerk: what builds up the acceleration in 0.1 s */
    return fmax(FAST_LEAST, fmax(2.0 * turn * v2, sqrt(0.4 * turn * v2 * s->cfg.feed)));
}

/* How far along a long line the curve may begin before a node with this turn, next to a chord of this length. */
static double run_out(const nc_smooth *s, const node *n, double beside) {
    if (n->kind == NODE_BREAK) return 0.0;
    double turn = fmax(n->turn, 1e-9), corner = corner_distance(s, turn);
    double smooth = fmin(3.0 * sqrt(8.0 * s->tol * beside / turn), fast_length(s, turn));
    double bend = fmax(fmin(smooth, KINK * s->tol / turn), 10.0 * s->tol);
    return fmax(corner, bend + sharpness(turn) * (corner - bend));
}

static node between(const nc_smooth *s, const node *a, const node *b, double r, uint8_t kind, double size) {
    node n = *b;
    n.kind = kind;
    n.t = a->t + r * (b->t - a->t);
    n.d = a->d + r * (b->d - a->d);
    n.turn = 0.0;
    n.size = size;
    n.mark = false;
    n.end_speed = 0.0f;
    for (int i = 0; i < s->cfg.axes; i++) n.q[i] = a->q[i] + r * (b->q[i] - a->q[i]);
    return n;
}

/* The chord that ends at node i, both of whose turns are known: a long one is driven exactly in its middle. */
static void split_long(nc_smooth *s, int i, double beside_next) {
    node a = s->nodes[i - 1], b = s->nodes[i];
    double own = b.t - a.t;
    if (a.kind == NODE_HEAD || a.kind == NODE_TAIL) return;
    double left = run_out(s, &a, a.len), right = run_out(s, &b, beside_next), corner_a = sharpness(a.turn), corner_b = sharpness(b.turn);
    if (fmin(corner_a, corner_b) > 0.9 && own < left + right && own > CROWDED * (left + right)) left = right = 0.45 * own; /* smaller blends */
    double least = left * (LONG_LINE - (LONG_LINE - 1.0) * corner_a) + right * (LONG_LINE - (LONG_LINE - 1.0) * corner_b);
    if (own < least || s->n_nodes + 2 > NODES) return;
    if (left + right <= 0.0) return;
    node add[2];
    int n = 0;
    if (a.kind != NODE_BREAK) add[n++] = between(s, &a, &b, left / own, NODE_TAIL, left / 4.0);
    if (b.kind != NODE_BREAK) add[n++] = between(s, &a, &b, 1.0 - right / own, NODE_HEAD, right / 4.0);
    if (n == 2 && !(add[0].t < add[1].t)) return;
    memmove(s->nodes + i + n, s->nodes + i, sizeof(node) * (size_t)(s->n_nodes - i));
    memcpy(s->nodes + i, add, sizeof(node) * (size_t)n);
    s->n_nodes += n;
}

static void size_of(nc_smooth *s, node *n, double next) {
    double turn = fmax(n->turn, 1e-9), chord = fmax(n->len, next);
    n->size = fmax(s->tol, fmin(3.0 * s->tol / turn, TURN_PER_SPAN * chord / turn));
    double half = 0.5 * SIZE_GROWTH * n->len, spans = (log1p(half / n->size) + log1p(half / n[-1].size)) / SIZE_GROWTH;
    s->measure += fmax(spans, 1.0 / 8.0);
}

/* ---- sections --------------------------------------------------------------------------------------------------- */

static int section_end(const nc_smooth *s, int known) {
    for (int i = 1; i < known; i++)
        if (s->nodes[i].kind == NODE_BREAK || s->nodes[i].kind == NODE_TAIL || s->nodes[i].kind == NODE_HEAD) return i;
    return 0;
}

static int vertices(const nc_smooth *s, int end) {
    int n = 0;
    for (int i = 1; i < end; i++) n += s->nodes[i].kind == NODE_VERTEX;
    return n;
}

/* Everything up to nodes[end] where a section ends. */
static void finish_section(nc_smooth *s, int end) {
    if (end == 1 && !s->keep.valid) {
        emit_line(s, &s->nodes[0], &s->nodes[1], s->out_t, s->nodes[1].t);
        drop_nodes(s, 1);
    } else if (vertices(s, end) == 1 && !s->keep.valid) {
        corner_path(s, end);
        drop_nodes(s, end);
    } else {
        window_advance(s, end, true);
    }
}

/* Work off what is known: the first `known` nodes are settled. */
static void work(nc_smooth *s, int known) {
    int end;
    while ((end = section_end(s, known))) {
        int before = s->n_nodes;
        finish_section(s, end);
        known -= before - s->n_nodes;
        s->measure = 0.0;
    }
    while (known > 4 && (s->measure >= SPANS_FULL || s->n_nodes > NODES_FULL)) {
        int before = s->n_nodes;
        window_advance(s, known - 1, false);
        known -= before - s->n_nodes;
    }
}

/* Node i - its next node is known - becomes final. */
static void settle(nc_smooth *s, int i) {
    node *n = &s->nodes[i];
    double next = s->nodes[i + 1].t - n->t;
    if (n->kind == NODE_VERTEX) {
        n->turn = turn_at(s, n - 1, n, n + 1);
        double most = s->cfg.turn_max;
        if (n->turn > most || main_turns_back(s, n - 1, n, n + 1)) n->kind = NODE_BREAK;
        size_of(s, n, next);
    }
    split_long(s, i, next);
}

static void add_node(nc_smooth *s, const node *n) {
    s->nodes[s->n_nodes++] = *n;
    if (s->n_nodes > 2) settle(s, s->n_nodes - 2);
    work(s, s->n_nodes - 1);
}

/* The directions in which a chord passes all points left out on it: a ball around `toward`. Each point leaves a ball of its own,
 * and what is kept of the common part is a ball again. */
static void narrow(nc_smooth *s, const double *u, double radius) {
    double apart = s->merged_n ? distance(s, u, s->toward) : 0.0;
    if (s->merged_n == 0 || apart + radius <= s->spread) {
        memcpy(s->toward, u, sizeof s->toward);
        s->spread = radius;
    } else if (apart + s->spread > radius) {
        double common = 0.5 * (s->spread + radius - apart), shift = apart > 0.0 ? (s->spread - common) / apart : 0.0;
        for (int a = 0; a < s->cfg.axes; a++) s->toward[a] += shift * (u[a] - s->toward[a]);
        s->spread = common;
    }
}

static double direction_to(const nc_smooth *s, const double *from, const double *to, double *u) {
    double length = distance(s, from, to);
    for (int a = 0; a < NC_AXES; a++) u[a] = a < s->cfg.axes ? (to[a] - from[a]) / length : 0.0;
    return length;
}

/* Collinear with the chord that ends at the last node: that node moves. */
static bool merge(nc_smooth *s, const node *n) {
    node *at = last_node(s);
    double allowed = fmin(MERGE * s->tol, MERGE_MAX);
    if (s->n_nodes < 2 || at->mark || at->kind != NODE_VERTEX || at->slack > allowed || n->slack > allowed || s->merged_n >= MERGED) return false;
    if (at[-1].kind == NODE_TAIL || at->feed != n->feed || at->flags != n->flags || at->t <= s->out_t) return false;
    if (s->keep.valid && at[-1].t < s->keep.tau[s->keep.spans + 5]) return false;
    const node *from = at - 1;
    double u[NC_AXES], v[NC_AXES], before = direction_to(s, from->q, at->q, u), length = direction_to(s, from->q, n->q, v);
    if (length <= before + ZERO) return false;
    double toward[NC_AXES], spread = s->spread;
    memcpy(toward, s->toward, sizeof toward);
    narrow(s, u, allowed / before);
    if (distance(s, v, s->toward) > s->spread) {
        memcpy(s->toward, toward, sizeof toward);
        s->spread = spread;
        return false;
    }
    s->merged_n++;
    double t = from->t + length;
    *at = *n;
    at->t = s->t = t;
    at->slack = allowed;
    at->len = length;
    return true;
}

/* The programmed position becomes a node; `row` says where it comes from. */
static void add_point(nc_smooth *s, const nc_block *row, double slack) {
    node *at = last_node(s);
    double length = distance(s, at->q, s->last);
    node n = {.t = at->t + length, .d = s->d, .kind = NODE_VERTEX, .slack = fmax(slack, s->skipped), .len = length, .size = 1e9};
    memcpy(n.q, s->last, sizeof n.q);
    n.feed = row->flags & NC_RAPID ? 0.0 : row->feed;
    n.flags = row->flags & NC_NO_OVERRIDE;
    n.n = row->n;
    n.line = row->line;
    n.count = row->count;
    n.file = row->file;
    s->stats.left_out = fmax(s->stats.left_out, s->skipped);
    s->skipped = 0.0;
    s->left_n = 0;
    s->t = n.t;
    if (merge(s, &n)) return;
    s->merged_n = 0;
    add_node(s, &n);
}

/* ---- rows ------------------------------------------------------------------------------------------------------- */

static const nc_block *newest_motion(const nc_smooth *s) {
    for (size_t i = s->held_n; i-- > s->held_first;)
        if (s->held[i].motion) return &s->held[i].row;
    return NULL;
}

/* A point left out: where there is no more room every other one of those so far goes. */
static void leave_out(nc_smooth *s, double length) {
    s->skipped = fmax(s->skipped, length);
    if (s->left_n == LEFT_OUT) {
        s->left_n /= 2;
        for (int i = 0; i < s->left_n; i++) s->left[i] = s->left[2 * i + 1];
    }
    left_out *to = &s->left[s->left_n++];
    memcpy(to->q, s->last, sizeof to->q);
    to->d = s->d;
}

/* The path comes back to the last node from a figure whose points have all been left out, and ends: they are not left out then, but
 * for those that are next to each other. */
static void drive_figure(nc_smooth *s) {
    const nc_block *row = newest_motion(s);
    double last[NC_AXES], d = s->d, leave = FIGURE * s->skipped;
    if (!row || s->skipped <= ZERO || distance(s, last_node(s)->q, s->last) > ZERO) return;
    nc_block copy = *row;
    memcpy(last, s->last, sizeof last);
    last_node(s)->mark = true;
    s->skipped = 0.0;
    for (int i = 0, n = s->left_n; i < n; i++) {
        memcpy(s->last, s->left[i].q, sizeof last);
        s->d = s->left[i].d;
        if (distance(s, last_node(s)->q, s->last) > fmax(leave, ZERO)) add_point(s, &copy, leave);
    }
    memcpy(s->last, last, sizeof last);
    s->d = d;
}

/* A node where the programmed position is, so that something can take effect there. */
static node *node_here(nc_smooth *s) {
    const nc_block *row = newest_motion(s);
    if (row && distance(s, last_node(s)->q, s->last) > ZERO) {
        nc_block copy = *row;
        last_node(s)->mark = true; /* not merged into what is before */
        add_point(s, &copy, 0.0);
    }
    return last_node(s);
}

/* The section ends here; everything is written. */
static void close_section(nc_smooth *s) {
    drive_figure(s);
    node *n = node_here(s);
    if (s->n_nodes > 1) {
        n->kind = NODE_BREAK;
        split_long(s, s->n_nodes - 1, 0.0);
        work(s, s->n_nodes);
    }
    emit_flush(s);
    begin_at(s);
}

static void pass(nc_smooth *s, const nc_block *row, const double *pool) {
    nc_block copy = *row;
    if (row->type == NC_POLYNOMIAL) copy.pool = emit_pool(s, pool + row->pool, (size_t)s->cfg.axes * (row->degree + 1u));
    emit_row(s, &copy);
}

/* A motion driven as programmed. */
static void exact_motion(nc_smooth *s, const nc_block *row, const double *pool) {
    close_section(s);
    pass(s, row, pool);
    for (int a = 0; a < s->cfg.axes; a++) s->last[a] = row->end[a] * s->scale[a];
    s->t += row->length;
    s->d += row->length;
    begin_at(s);
}

/* The last piece written ends at standstill. */
static void stop_here(nc_smooth *s) {
    for (size_t i = s->rows_n; i-- > 0;)
        if (s->rows[i].type <= NC_POLYNOMIAL && !(s->rows[i].flags & NC_ELEMENT)) {
            s->rows[i].flags |= NC_EXACT_STOP;
            return;
        }
}

/* The node here, or the last one if this is next to it, is passed no faster. */
static void slow_point(nc_smooth *s, float speed) {
    node *n = last_node(s);
    if (s->n_nodes < 2) return;
    n->mark = true;
    n->end_speed = n->end_speed > 0.0f ? fminf(n->end_speed, speed) : speed;
}

static void line_point(nc_smooth *s, const nc_block *row) {
    for (int a = 0; a < s->cfg.axes; a++) s->last[a] = row->end[a] * s->scale[a];
    s->d += row->length;
    double length = distance(s, last_node(s)->q, s->last);
    if (length < LEAVE_OUT * s->tol && !last_node(s)->mark) leave_out(s, length);
    else if (length > ZERO) add_point(s, row, 0.0);
    if (row->end_speed > 0.0f) slow_point(s, row->end_speed);
}

static void arc_points(nc_smooth *s, const nc_block *row) {
    static const int planes[3][2] = {{0, 1}, {2, 0}, {1, 2}};
    int a1 = s->cfg.main_axis[planes[row->plane - 17][0]], a2 = s->cfg.main_axis[planes[row->plane - 17][1]];
    double from[NC_AXES], sagitta = SAGITTA * s->tol, d0 = s->d;
    memcpy(from, s->last, sizeof from);
    double e1 = from[a1] - row->center[0], e2 = from[a2] - row->center[1], radius = hypot(e1, e2), angle0 = atan2(e2, e1);
    double step = 2.0 * acos(fmax(1.0 - sagitta / radius, 0.5)), count = ceil(fabs(row->angle) / step);
    for (double k = 1.0; k <= count; k++) {
        double r = k / count, angle = angle0 + row->angle * r;
        for (int a = 0; a < s->cfg.axes; a++) s->last[a] = from[a] + r * (row->end[a] * s->scale[a] - from[a]);
        if (k < count) {
            s->last[a1] = row->center[0] + radius * cos(angle);
            s->last[a2] = row->center[1] + radius * sin(angle);
        }
        s->d = d0 + r * row->length;
        if (distance(s, last_node(s)->q, s->last) > ZERO) add_point(s, row, sagitta);
    }
    if (row->end_speed > 0.0f) slow_point(s, row->end_speed);
}

static bool smoothable(const nc_smooth *s, const nc_block *row) {
    if (!(s->tol > 0.0) || (row->flags & NC_RAPID) || row->type == NC_POLYNOMIAL || !(row->feed > 0.0)) return false;
    if (s->longest > 0.0 && row->length > s->longest) return false;
    if (row->type == NC_CIRCULAR) return true;
    double main = 0.0, all = 0.0;
    for (int a = 0; a < s->cfg.axes; a++) {
        double d = row->end[a] * s->scale[a] - s->last[a];
        all += d * d;
        if (in_main(s, a)) main += d * d;
    }
    return main > 1e-12 && main >= MAIN_LEAST * MAIN_LEAST * all;
}

static void take_motion(nc_smooth *s, const nc_block *row, const double *pool) {
    if (!smoothable(s, row)) {
        exact_motion(s, row, pool);
        return;
    }
    uint16_t flags = row->flags & NC_NO_OVERRIDE;
    if (s->feed >= 0.0 && (s->feed != row->feed || s->feed_flags != flags)) node_here(s)->mark = true;
    s->feed = row->feed;
    s->feed_flags = flags;
    if (row->type == NC_CIRCULAR) node_here(s);
    bool function = s->has_function && row->count == s->function_count;
    emit_hold(s, row, last_node(s)->t, true);
    if (row->type == NC_CIRCULAR) arc_points(s, row);
    else line_point(s, row);
    if (function) node_here(s)->mark = true; /* it may take effect at the end of its block */
    if (!(row->flags & NC_EXACT_STOP)) return;
    close_section(s);
    stop_here(s);
}

static void set_mode(nc_smooth *s, const nc_block *row) {
    close_section(s);
    double old[NC_AXES];
    for (int a = 0; a < s->cfg.axes; a++) old[a] = s->last[a] / s->scale[a];
    double tol = row->value > 0.0 ? row->value : s->cfg.tolerance;
    double rotary = row->radius > 0.0 ? row->radius : s->cfg.rotary_tolerance;
    s->tol = row->code ? tol : 0.0;
    s->degrees = s->cfg.rotary ? rotary / tol : 0.0;
    s->cfg.turn_max = row->angle > 0.0 ? row->angle : s->turn_configured;
    s->longest = row->length;
    for (int a = 0; a < s->cfg.axes; a++) s->scale[a] = s->tol > 0.0 && s->cfg.rotary >> a & 1 ? tol / rotary : 1.0;
    nc_smooth_resync(s, old);
}

static bool ends_section(const nc_block *row) {
    if (row->flags & NC_STANDSTILL) return true;
    if (row->type == NC_EVENT) return row->code != NC_EVENT_COMMAND;
    return row->type == NC_DWELL || row->type == NC_FLUSH || row->type == NC_DISTANCE_RESET ||
           row->type == NC_RT_LOOP_BEGIN || row->type == NC_RT_LOOP_END || row->type == NC_COMPENSATION;
}

static void take_row(nc_smooth *s, const nc_block *row, const double *pool) {
    s->stats.rows++;
    if (row->type == NC_SMOOTHING) {
        set_mode(s, row);
    } else if (row->type <= NC_POLYNOMIAL) {
        take_motion(s, row, pool);
    } else if (ends_section(row) || !(s->tol > 0.0)) {
        close_section(s);
        pass(s, row, pool);
    } else if (row->type == NC_MARKER) {
        emit_hold(s, row, node_here(s)->t, false);
    } else {
        node *n = node_here(s);
        n->mark = s->has_function = true;
        s->function_count = row->count;
        emit_hold(s, row, n->t, false);
    }
    if (s->held_n - s->held_first > HELD_MAX) close_section(s);
}

int64_t nc_smooth_push(nc_smooth *s, const nc_block *rows, int64_t n, const double *pool, int64_t pool_n) {
    (void)pool_n;
    for (int64_t i = 0; i < n; i++) {
        take_row(s, &rows[i], pool);
        if (s->no_memory) return -1;
    }
    return n;
}

int nc_smooth_drain(nc_smooth *s) {
    close_section(s);
    return s->no_memory ? -1 : 0;
}

nc_smooth *nc_smooth_new(const nc_smooth_config *config, const double *start) {
    nc_smooth *s = calloc(1, sizeof *s);
    if (!s) return NULL;
    s->cfg = *config;
    s->turn_configured = config->turn_max;
    for (int i = 0; i < 3; i++)
        if (config->main_axis[i] >= 0) s->main_mask |= (uint16_t)(1u << config->main_axis[i]);
    for (int a = 0; a < NC_AXES; a++) s->scale[a] = 1.0;
    nc_block mode = {.type = NC_SMOOTHING, .code = config->tolerance > 0.0};
    nc_smooth_resync(s, start);
    set_mode(s, &mode);
    return s;
}
