/* Look-ahead: how fast each corner may be passed and how fast everything ahead can still be met.
 *
 * A corner between two pieces that are not tangential is driven exactly, with a jump of velocity. What a drive sees of
 * it is what the cycle samples show: a jump dv at a time t adds dv/dt * w(t) to the acceleration measured around a
 * sample, where w is the triangle of half-width one cycle (second difference). The sum over all jumps is largest
 * exactly at the corners, so it is enough to bound, per axis and at every corner,
 *     F(v) = (1/dt) * sum_j max(0, v - d_j/dt) * jump_j + v^2 * curvature  <=  CORNER * a_max
 * with d_j the path distance to corner j. Speeds differ a little inside the window of two cycles, so v is taken SLACK
 * times one cycle of acceleration larger than the speed that is allowed. F is increasing in v; the neighbours are taken in by increasing distance
 * until the speed found does not reach the next one within one cycle. What F uses up at the speed that can occur is the
 * `reserve`; in a zone of one cycle around the corner only the rest is left for tangential acceleration.
 */
#include <float.h>
#include <math.h>
#include "engine_internal.h"

#define CORNER 0.7         /* share of the acceleration limit that jumps may use */
#define USABLE 0.98        /* share of the acceleration limit that is planned with */
#define ARC_TANGENT 0.6    /* sqrt(1 - ARC_NORMAL^2) */
#define ARC_NORMAL 0.8
#define SLACK 0.3
#define NEIGHBOURS 1000    /* pieces looked at on each side of a corner */
#define NEGLIGIBLE 0.02    /* reserves below this share need no zone */

typedef struct walk {
    uint64_t i;     /* piece whose start is the next corner on this side */
    double d;       /* path distance to it; NEVER: none that matters */
    double known;   /* distance up to which corners are known */
    int budget;
} walk;

typedef struct load {
    double sum[NC_AXES], moment[NC_AXES]; /* sum of jumps; sum of distance * jump / dt */
    double curvature[NC_AXES];
    double most[NC_AXES]; /* acceleration allowed on all pieces seen */
} load;

/* Pieces this far behind committed motion are still in the ring (ring.c keeps KEPT_BEHIND slots). */
static uint64_t left_floor(const engine *e) {
    return e->plan.piece > NEIGHBOURS ? e->plan.piece - NEIGHBOURS : 0;
}

static bool previous_motion(engine *e, uint64_t *i) {
    uint64_t floor = left_floor(e);
    do {
        if (*i <= floor) return false;
        (*i)--;
    } while (!is_motion(piece_at(e, *i)));
    return true;
}

static bool next_motion(engine *e, uint64_t *i, uint64_t head) {
    do {
        (*i)++;
        if (*i >= head) return false;
    } while (!is_motion(piece_at(e, *i)));
    return true;
}

static void add_curvature(const engine *e, const piece *p, load *l) {
    for (int a = 0; a < e->cfg.axis_count; a++) l->most[a] = fmin(l->most[a], piece_a_max(e, p, a));
    if (p->limits.transition_acceleration > 0)
        for (int a = 0; a < e->cfg.axis_count; a++) l->most[a] = fmin(l->most[a], (double)p->limits.transition_acceleration / CORNER);
    if (p->kind == PIECE_CURVE) curve_add_curvature(e, p, l->curvature);
    if (p->kind != PIECE_ARC) return;
    l->curvature[p->axis1] = fmax(l->curvature[p->axis1], p->curvature);
    l->curvature[p->axis2] = fmax(l->curvature[p->axis2], p->curvature);
}

/* Step to the next corner on the left; pieces passed add their curvature. */
static void step_left(engine *e, walk *w, load *l) {
    bool stop = stands_before(e, piece_at(e, w->i));
    if (stop || w->budget-- == 0 || !previous_motion(e, &w->i)) {
        w->known = stop || w->i == 0 ? NEVER : w->d;
        w->d = NEVER;
        return;
    }
    w->d += piece_at(e, w->i)->length;
    add_curvature(e, piece_at(e, w->i), l);
}

static void step_right(engine *e, walk *w, load *l, uint64_t head, bool finished) {
    double d = w->d + piece_at(e, w->i)->length;
    add_curvature(e, piece_at(e, w->i), l);
    if (piece_at(e, w->i)->stop_after) {
        w->known = w->d = NEVER;
        return;
    }
    bool found = w->budget-- > 0 && next_motion(e, &w->i, head);
    if (found && !stands_before(e, piece_at(e, w->i))) {
        w->d = d;
        return;
    }
    w->known = found || (finished && w->budget >= 0) ? NEVER : d;
    w->d = NEVER;
}

static void add_corner(const engine *e, const piece *p, double d, load *l) {
    for (int a = 0; a < e->cfg.axis_count; a++) {
        l->sum[a] += p->jump[a];
        l->moment[a] += d * p->jump[a] / e->cfg.cycle_s;
    }
}

/* Largest v with (sum v - moment)/dt + curvature v^2 <= CORNER a on every axis. */
static double load_speed(const engine *e, const load *l) {
    double v = NEVER, dt = e->cfg.cycle_s;
    for (int a = 0; a < e->cfg.axis_count; a++) {
        if (l->sum[a] < 1e-13) continue;
        double c = CORNER * l->most[a] + l->moment[a] / dt, b = l->sum[a] / dt;
        v = fmin(v, 2.0 * c / (b + sqrt(b * b + 4.0 * l->curvature[a] * c)));
    }
    return v;
}

/* Fastest that p is driven at an override. */
double reachable(const piece *p, double override) {
    return p->feed > 0 ? fmin(p->v_hard, p->feed * override) : p->v_hard;
}

static void set_reserve(engine *e, piece *p, const load *l, double v) {
    for (int a = 0; a < e->cfg.axis_count; a++) {
        double jumps = (l->sum[a] * v - l->moment[a]) / e->cfg.cycle_s;
        bool negligible = l->sum[a] < 1e-13 || jumps < NEGLIGIBLE * l->most[a];
        p->reserve[a] = negligible ? 0.0 : jumps + l->curvature[a] * v * v;
    }
}

/* Take in neighbours until `v` does not reach the next one. `solve`: find v, else only load at the given v.
 * Returns false if corners that matter are not known yet. */
static bool gather(engine *e, uint64_t i, bool solve, double *v, load *l) {
    uint64_t head = e->piece_head;
    bool finished = e->feed.final;
    double dt = e->cfg.cycle_s, limit = *v;
    memset(l, 0, sizeof *l);
    for (int a = 0; a < NC_AXES; a++) l->most[a] = NEVER;
    add_corner(e, piece_at(e, i), 0.0, l);
    walk left = {i, 0.0, NEVER, NEIGHBOURS}, right = {i, 0.0, NEVER, NEIGHBOURS};
    step_left(e, &left, l);
    step_right(e, &right, l, head, finished);
    for (;;) {
        if (solve) *v = fmin(limit, load_speed(e, l));
        walk *next = left.d <= right.d ? &left : &right;
        if (*v * dt <= next->d) break;
        add_corner(e, piece_at(e, next->i), next->d, l);
        if (next == &left) step_left(e, next, l);
        else step_right(e, next, l, head, finished);
    }
    if (left.known < *v * dt) *v = left.known / dt; /* too many short pieces: slower, so that all that matter are seen */
    if (right.known >= *v * dt) return true;
    if (right.budget >= 0) return false;
    *v = right.known / dt;
    return true;
}

static double speed_slack(const engine *e) {
    double a = 0.0;
    for (int i = 0; i < e->cfg.axis_count; i++) a = fmax(a, e->cfg.a_max[i]);
    return SLACK * a * e->cfg.cycle_s;
}

/* Final speed limit and reserve at the start of piece i; false if the path ahead is not known far enough. */
static bool cap_corner(engine *e, uint64_t i) {
    piece *p = piece_at(e, i);
    memset(p->reserve, 0, sizeof p->reserve);
    p->corner_v = 0.0;
    if (stands_before(e, p)) return true;
    uint64_t b = i;
    if (!previous_motion(e, &b)) return true;
    const piece *before = piece_at(e, b);
    load l;
    double slack = speed_slack(e), hard = fmin(p->entry_speed, fmin(before->v_hard, p->v_hard)), v = hard + slack;
    if (!gather(e, i, true, &v, &l)) return false;
    p->corner_v = fmin(hard, fmax(0.0, v - slack));
    double occurs = slack + fmax(reachable(before, e->plan.reserve_override), reachable(p, e->plan.reserve_override));
    if (occurs < v) {
        v = occurs;
        if (!gather(e, i, false, &v, &l)) return false;
    }
    set_reserve(e, p, &l, v);
    return true;
}

/* Finish the corner limits of all pieces up to the end of what is known. */
void corner_caps(engine *e) {
    uint64_t head = e->piece_head;
    if (e->plan.capped < e->plan.piece) e->plan.capped = e->plan.piece;
    if (e->plan.capped < e->plan.need_end) e->plan.need_end = 0; /* pieces are capped anew */
    while (e->plan.capped < head) {
        piece *p = piece_at(e, e->plan.capped);
        if (is_motion(p) && !cap_corner(e, e->plan.capped)) return;
        p->capped = true;
        p->spanned = false;
        e->plan.capped++;
    }
}

static bool has_reserve(const engine *e, const double *r) {
    for (int a = 0; a < e->cfg.axis_count; a++)
        if (r[a] > 0) return true;
    return false;
}

static void limit_span(const engine *e, const piece *p, const double *reserve, span *s) {
    s->accel = NEVER;
    s->v_hard = p->v_hard;
    bool arc = p->kind == PIECE_ARC;
    for (int a = 0; a < e->cfg.axis_count; a++) {
        if (arc && (a == p->axis1 || a == p->axis2)) continue;
        double share = fabs(p->slope[a]);
        if (share > 1e-12) s->accel = fmin(s->accel, (USABLE * piece_a_max(e, p, a) - reserve[a]) / share);
    }
    if (p->limits.path_acceleration > 0) s->accel = fmin(s->accel, (double)p->limits.path_acceleration);
    if (!arc) return;
    double room = fmin(USABLE * piece_a_max(e, p, p->axis1) - reserve[p->axis1], USABLE * piece_a_max(e, p, p->axis2) - reserve[p->axis2]);
    s->accel = fmin(s->accel, ARC_TANGENT * room / p->plane_speed);
    s->v_hard = fmin(s->v_hard, sqrt(ARC_NORMAL * room / p->curvature));
}

static bool moves(const engine *e, const piece *p, int i) {
    if (p->kind == PIECE_CURVE) return curve_of(e, p)->moving >> i & 1;
    return p->kind == PIECE_ARC || fabs(p->slope[i]) > 1e-12;
}

static double zone(const engine *e, const piece *corner, const piece *p) {
    if (!has_reserve(e, corner->reserve)) return 0.0;
    double dt = e->cfg.cycle_s, a = NEVER;
    for (int i = 0; i < e->cfg.axis_count; i++)
        if (moves(e, p, i)) a = fmin(a, e->cfg.a_max[i]);
    return (corner->corner_v + 2.0 * a * dt) * dt;
}

/* Stretches of piece i with constant limits: a zone at either end where jumps use up acceleration, and the rest. */
void piece_spans(engine *e, uint64_t i) {
    piece *p = piece_at(e, i);
    static const double none[NC_AXES] = {0};
    uint64_t n = i;
    const piece *next = p->stop_after || !next_motion(e, &n, e->plan.capped) ? NULL : piece_at(e, n);
    double first = zone(e, p, p), last = next ? zone(e, next, p) : 0.0;
    double both[NC_AXES];
    for (int a = 0; a < NC_AXES; a++) both[a] = fmax(p->reserve[a], next ? next->reserve[a] : 0.0);
    const strip parts[3] = {{first, p->reserve}, {p->length - first - last, none}, {last, next ? next->reserve : none}};
    const strip whole = {p->length, both};
    bool apart = first + last <= 0.9 * p->length;
    const strip *strips = apart ? parts : &whole;
    int n_strips = apart ? 3 : 1;
    p->span_count = 0;
    if (p->kind == PIECE_CURVE) curve_piece_spans(e, p, strips, n_strips);
    for (int k = 0; k < n_strips && p->kind != PIECE_CURVE; k++) {
        if (strips[k].length <= 0) continue;
        p->spans[p->span_count].length = strips[k].length;
        limit_span(e, p, strips[k].reserve, &p->spans[p->span_count++]);
    }
    p->spanned = next != NULL || p->stop_after;
}

/* First piece behind the window: N motion pieces after the one where committed motion ends, or what is known. */
uint64_t window_end(engine *e) {
    uint64_t i = e->plan.piece, end = e->plan.capped;
    uint32_t motions = 0;
    while (i < end && motions <= e->cfg.window) motions += is_motion(piece_at(e, i++));
    return i;
}

static double back_over(const engine *e, const piece *p, double need2) {
    double cap = soft_cap(e, p);
    for (uint32_t k = p->span_count; k-- > 0;) {
        double c = fmin(cap, p->spans[k].v_hard);
        need2 = fmin(c * c, fmin(need2, c * c) + 2.0 * p->spans[k].accel * p->spans[k].length);
    }
    return need2;
}

/* What need2 depends on besides the pieces themselves. */
static need_key key_of(const planner *p) { return (need_key){p->override, p->rapid, p->ext_speed, p->hold}; }

/* Pieces below this index still have the values of the last pass. */
static uint64_t kept_needs(const planner *p) {
    need_key now = key_of(p), then = p->need_key;
    bool same = now.override == then.override && now.rapid == then.rapid && now.ext_speed == then.ext_speed && now.hold == then.hold;
    return same ? p->need_end : 0;
}

/* need2 of every piece from `end` back to where committed motion ends; the window ends at standstill. Where a piece comes
 * to the value it has had, all those ahead of it keep theirs: so the cost for a block does not grow with the window. */
void backward_pass(engine *e, uint64_t end) {
    double need2 = 0.0;
    uint64_t kept = kept_needs(&e->plan);
    for (uint64_t i = end; i-- > e->plan.piece;) {
        piece *p = piece_at(e, i);
        bool same = i < kept && is_motion(p) && p->spanned;
        if (is_motion(p)) {
            if (!p->spanned) piece_spans(e, i);
            if (p->stop_after) need2 = 0.0;
            need2 = fmin(back_over(e, p, need2), p->corner_v * p->corner_v);
        }
        if (stands_before(e, p)) need2 = 0.0;
        if (same && need2 == p->need2) break;
        p->need2 = need2;
    }
    e->plan.need_end = end;
    e->plan.need_key = key_of(&e->plan);
}
