/* Look-ahead: how fast each corner may be passed and how fast everything ahead can still be met.
 *
 * A corner between two pieces that are not tangential is driven exactly, with a jump of velocity. What a drive sees of
 * it is what the cycle samples show: a jump dv at a time t adds dv/dt * w(t) to the acceleration measured around a
 * sample, where w is the triangle of half-width one cycle (second difference). The sum over all jumps is largest
 * exactly at the corners, so it is enough to bound, per axis and at every corner,
 *     F(v) = (1/dt) * sum_j max(0, v - d_j/dt) * jump_j + CORNER * v^2 * curvature  <=  CORNER * a_max
 * with d_j the path distance to corner j. Speeds differ a little inside the window of two cycles, so v is taken SLACK
 * times one cycle of acceleration larger than the speed that is allowed. F is increasing in v; the neighbours are taken in by increasing distance
 * until the speed found does not reach the next one within one cycle. What the
 * jumps in F use up at the speed that can occur is the
 * `reserve`; in a zone of one cycle around the corner only the rest is left for everything else (corner_zones.c, spans.c).
 * Where that costs more time than the jump saves, the corner is passed at standstill: without a jump nothing is used up.
 */
#include <float.h>
#include <math.h>
#include "engine/state/state.h"

#define CORNER 0.7         /* share of the acceleration limit that jumps may use */
#define SLACK 0.3
#define NEGLIGIBLE 0.01    /* reserves below this share need no zone */
#define NO_CORNER 1e-6     /* a jump below this share is rounding */

typedef struct walk {
    uint64_t i;     /* piece whose start is the next corner on this side */
    double d;       /* path distance to it; NEVER: none that matters */
    double known;   /* distance up to which corners are known */
    int budget;
} walk;

typedef struct axis_load {
    double sum, moment; /* sum of jumps; sum of distance * jump / dt */
    double curvature;
    double most;        /* acceleration allowed on all pieces seen */
} axis_load;

/* What has been seen of a corner's neighbourhood. */
typedef struct load {
    walk left, right;
    double farthest; /* corner that is counted */
    axis_load axis[NC_AXES];
} load;

/* Pieces this far behind committed motion are still in the ring (push.c keeps KEPT_BEHIND slots). */
static uint64_t left_floor(const engine *e) {
    return e->plan.piece > CORNERS_BEHIND ? e->plan.piece - CORNERS_BEHIND : 0;
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
    const double *bend = p->kind == PIECE_CURVE ? curve_of(e, p)->bend : NULL;
    for (int a = 0; a < e->cfg.axis_count; a++) {
        l->axis[a].most = lesser(l->axis[a].most, piece_a_max(e, p, a));
        if (bend) l->axis[a].curvature = greater(l->axis[a].curvature, bend[a]);
    }
    if (p->limits.transition_acceleration > 0)
        for (int a = 0; a < e->cfg.axis_count; a++) l->axis[a].most = lesser(l->axis[a].most, (double)p->limits.transition_acceleration / CORNER);
    if (p->kind != PIECE_ARC) return;
    for (int a = 0; a < 2; a++) {
        axis_load *in_plane = &l->axis[a ? p->axis2 : p->axis1];
        in_plane->curvature = greater(in_plane->curvature, p->curvature);
    }
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
    l->farthest = d; /* they are taken in by distance */
    for (int a = 0; a < e->cfg.axis_count; a++) {
        l->axis[a].sum += p->jump[a];
        l->axis[a].moment += d * p->jump[a] / e->cfg.cycle_s;
    }
}

/* Largest v with (sum v - moment)/dt <= CORNER (a - curvature v^2) on every axis, `v` at the most. */
static double load_speed(const engine *e, const load *l, double v) {
    double inv_dt = 1.0 / e->cfg.cycle_s;
    for (int a = 0; a < e->cfg.axis_count; a++) {
        const axis_load *at = &l->axis[a];
        if (at->sum < 1e-13) continue;
        double c = CORNER * at->most + at->moment * inv_dt, b = at->sum * inv_dt, bend = CORNER * at->curvature;
        if ((b + bend * v) * v > c) v = lesser(v, 2.0 * c / (b + sqrt(b * b + 4.0 * bend * c)));
    }
    return v;
}

/* Fastest that p is driven at an override. */
double reachable(const piece *p, double override) {
    return p->feed > 0 ? lesser(p->v_hard, p->feed * override) : p->v_hard;
}

static double jumps_at(const engine *e, const load *l, int axis, double v) {
    return l->axis[axis].sum < 1e-13 ? 0.0 : (l->axis[axis].sum * v - l->axis[axis].moment) / e->cfg.cycle_s;
}

/* The curvature is in the rows of curved stretches. False: there is none. */
static bool set_reserve(engine *e, piece *p, const load *l, double v) {
    bool some = false;
    for (int a = 0; a < e->cfg.axis_count; a++) {
        double jumps = jumps_at(e, l, a, v);
        p->reserve[a] = jumps < NEGLIGIBLE * l->axis[a].most ? 0.0 : jumps;
        some |= p->reserve[a] > 0.0;
    }
    return some;
}

/* The corner itself and the pieces on both sides of it. */
static void load_corner(engine *e, uint64_t i, load *l) {
    for (int a = 0; a < e->cfg.axis_count; a++) l->axis[a] = (axis_load){.sum = piece_at(e, i)->jump[a], .most = NEVER};
    l->left = l->right = (walk){i, 0.0, NEVER, (int)CORNERS_BEHIND};
    step_left(e, &l->left, l);
    step_right(e, &l->right, l, e->piece_head, e->feed.final);
}

/* From the corner alone, take in neighbours until `v` does not reach the next one. `solve`: find v, else only load at the given v.
 * Returns false if corners that matter are not known yet. */
static bool gather(engine *e, const load *corner, bool solve, double *v, load *l) {
    double dt = e->cfg.cycle_s, limit = *v;
    walk *left = &l->left, *right = &l->right;
    *left = corner->left;
    *right = corner->right;
    l->farthest = 0.0;
    for (int a = 0; a < e->cfg.axis_count; a++) l->axis[a] = corner->axis[a];
    for (;;) {
        if (solve) *v = load_speed(e, l, limit);
        walk *next = left->d <= right->d ? left : right;
        if (*v * dt <= next->d) break;
        add_corner(e, piece_at(e, next->i), next->d, l);
        if (next == left) step_left(e, next, l);
        else step_right(e, next, l, e->piece_head, e->feed.final);
    }
    if (left->known < *v * dt) *v = left->known / dt; /* too many short pieces: slower, so that all that matter are seen */
    if (right->known >= *v * dt) return true;
    if (right->budget >= 0) return false;
    *v = right->known / dt;
    return true;
}

static bool jumps_are_negligible(const engine *e, const load *l, double v) {
    for (int a = 0; a < e->cfg.axis_count; a++)
        if (jumps_at(e, l, a, v) >= NEGLIGIBLE * l->axis[a].most) return false;
    return true;
}

static double speed_slack(const engine *e) {
    double a = 0.0;
    for (int i = 0; i < e->cfg.axis_count; i++) a = greater(a, e->cfg.a_max[i]);
    return SLACK * a * e->cfg.cycle_s;
}

/* Acceleration along p that the axes have, and that they are left with beside `reserve`; bends aside. */
static void left_along(const engine *e, const piece *p, const double *reserve, double *full, double *left) {
    *full = *left = NEVER;
    for (int i = 0; i < e->cfg.axis_count; i++) {
        double share = p->kind == PIECE_LINE ? fabs(p->slope[i]) : 1.0, a = piece_a_max(e, p, i);
        if (!(p->moving >> i & 1) || !(share > 0.0)) continue;
        if (*full * share > a) *full = a / share;
        if (*left * share > a - reserve[i]) *left = (a - reserve[i]) / share;
    }
    *left = greater(0.0, *left);
}

/* Time that is lost on p by its corner being passed at v with that reserve in the zone, less what standing there loses; both
 * against driving on at the highest speed that p would reach between two standstills. */
static double loses_more(const engine *e, const piece *p, double v, const double *reserve) {
    double full, left;
    left_along(e, p, reserve, &full, &left);
    double zone = lesser(corner_zone(e, v, p), 0.5 * p->whole), out2 = v * v + 2.0 * left * zone, out = sqrt(out2);
    double top = greater(lesser(reachable(p, 1.0), sqrt(full * p->whole)), out);
    if (!(out > 0.0)) return 0.0;
    return 2.0 * zone / (v + out) - zone / top - (out / full - 0.5 * out2 / (full * top));
}

/* A jump at the speed that the corner allows costs more than it saves. Judged at override 1 and by whole pieces, so that it
 * stays so wherever stops are inserted. */
static bool stand_is_faster(const engine *e, const piece *before, const piece *p, const load *l, double v, double slack) {
    double reserve[NC_AXES];
    for (int a = 0; a < e->cfg.axis_count; a++) reserve[a] = greater(0.0, jumps_at(e, l, a, v));
    return loses_more(e, before, v - slack, reserve) + loses_more(e, p, v - slack, reserve) > 0.0;
}

/* No jump but rounding: what neighbours add up to is bounded at them. */
static bool is_no_corner(const engine *e, const piece *before, const piece *p, double v) {
    double most = NO_CORNER * e->cfg.cycle_s;
    for (int a = 0; a < e->cfg.axis_count; a++)
        if (p->jump[a] * v > most * lesser(piece_a_max(e, before, a), piece_a_max(e, p, a))) return false;
    return true;
}

/* Final speed limit and reserve at the start of piece i; `fastest`: below 0, or the speed at it if there is a reserve. False if the
 * path ahead is not known far enough. */
static bool cap_corner(engine *e, uint64_t i, const piece **behind, double *fastest) {
    piece *p = piece_at(e, i);
    *fastest = -1.0;
    memset(p->reserve, 0, sizeof p->reserve);
    p->corner_v = 0.0;
    if (stands_before(e, p)) return true;
    uint64_t b = i;
    if (!previous_motion(e, &b)) return true;
    const piece *before = *behind = piece_at(e, b);
    load corner, l;
    double slack = speed_slack(e), hard = lesser(p->entry_speed, lesser(before->v_hard, p->v_hard)), v = hard + slack;
    double occurs = slack + greater(reachable(before, e->plan.reserve_override), reachable(p, e->plan.reserve_override));
    if (is_no_corner(e, before, p, lesser(v, occurs))) {
        p->corner_v = hard;
        return true;
    }
    load_corner(e, i, &corner);
    if (before->kind != PIECE_LINE || p->kind != PIECE_LINE) { /* next to no corner: curvature alone is no reason to be slower */
        v = lesser(v, occurs);
        p->corner_v = v - slack;
        if (jumps_are_negligible(e, &corner, v)) { /* else those of neighbours need not be looked at */
            if (!gather(e, &corner, false, &v, &l)) return false;
            if (v >= p->corner_v + slack && jumps_are_negligible(e, &l, v)) return true;
        }
        v = hard + slack;
    }
    if (!gather(e, &corner, true, &v, &l)) return false;
    p->corner_v = lesser(hard, greater(0.0, v - slack));
    if (l.farthest > v * e->cfg.cycle_s && !gather(e, &corner, false, &v, &l)) return false; /* bends beyond it have made it slower */
    double usual = slack + greater(reachable(before, 1.0), reachable(p, 1.0));
    if (usual >= v && stand_is_faster(e, before, p, &l, v, slack)) {
        p->corner_v = 0.0;
        return true;
    }
    if (occurs < v) {
        v = occurs;
        if (!gather(e, &corner, false, &v, &l)) return false;
    }
    if (set_reserve(e, p, &l, v)) *fastest = lesser(p->corner_v, greater(0.0, v - slack));
    return true;
}

/* Finish the corner limits of all pieces up to the end of what is known. */
void corner_caps(engine *e) {
    uint64_t head = e->piece_head;
    if (e->plan.capped < e->plan.piece) e->plan.capped = e->plan.piece;
    if (e->plan.capped < e->plan.need_end) e->plan.need_end = 0; /* pieces are capped anew */
    if (e->plan.capped < e->plan.window_to) e->plan.window_to = e->plan.window_from = 0;
    zones_follow(e, e->plan.capped);
    while (e->plan.capped < head) {
        piece *p = piece_at(e, e->plan.capped);
        const piece *before = p;
        double fastest = -1.0;
        if (is_motion(p) && !cap_corner(e, e->plan.capped, &before, &fastest)) return;
        zones_note(e, e->plan.capped, before, fastest);
        p->capped = true;
        p->spanned = p->settled = false;
        p->cruise2 = -1.0;
        e->plan.capped++;
    }
}

/* The motion behind piece i, if it is known and the axes do not stand between. */
static const piece *next_of(engine *e, uint64_t i) {
    uint64_t n = i;
    return piece_at(e, i)->stop_after || !next_motion(e, &n, e->plan.capped) ? NULL : piece_at(e, n);
}

static void make_spans(engine *e, uint64_t i) {
    const piece *next = next_of(e, i);
    piece *p = piece_at(e, i);
    piece_spans(e, i, next);
    p->spanned = true;
}

/* First piece behind the window: N motion pieces after the one where committed motion ends, or what is known. Counted on from
 * where it was counted to. */
uint64_t window_end(engine *e) {
    planner *w = &e->plan;
    if (w->piece < w->window_from || w->piece > w->window_to || w->window_from == w->window_to) {
        w->window_from = w->window_to = w->piece;
        w->window_motions = 0;
    }
    for (; w->window_from < w->piece; w->window_from++) w->window_motions -= is_motion(piece_at(e, w->window_from));
    while (w->window_to < w->capped && w->window_motions <= e->cfg.window && w->window_to - w->piece <= w->span_mask)
        w->window_motions += is_motion(piece_at(e, w->window_to++));
    return w->window_to;
}

/* Largest speed squared at the start of the stretch from which `next` can be met at its end. `free`: it is the largest one
 * that the stretch and the feed allow, so it stays whatever comes behind. */
static double back_over_span(const span *sp, double soft2, double next, bool *free) {
    double cap2 = lesser(soft2, sp->rows ? sp->cap2[0] : sp->v_hard * sp->v_hard);
    double need2 = sp->rows ? bent_need(sp, 0.0, soft2, next) : lesser(cap2, lesser(next, cap2) + 2.0 * sp->accel * sp->length);
    *free |= need2 >= cap2;
    return need2;
}

static double back_over_spans(engine *e, uint64_t i, double soft, double need2, bool *free) {
    piece *p = piece_at(e, i);
    if (!spans_known(e, i)) make_spans(e, i);
    span *spans = spans_of(e, i);
    p->cruises = false;
    for (uint32_t k = p->span_count; k-- > 0;) need2 = spans[k].need2 = back_over_span(&spans[k], soft * soft, need2, free);
    *free &= p->settled; /* corners further on may leave less */
    return need2;
}

/* Where the feed can be kept all over a piece, and what lies behind it can be met from there, nothing else has to be known. */
static double back_over(engine *e, uint64_t i, double need2, bool *free) {
    piece *p = piece_at(e, i);
    double soft = soft_cap(e, p);
    const piece *next = next_of(e, i);
    if (!p->settled) {
        p->spanned = false; /* more is known now */
        p->settled = zones_known(e, p, next);
    }
    p->cruises = soft > 0.0 && can_cruise(e, p, next, p->settled, soft, need2);
    if (!p->cruises) return back_over_spans(e, i, soft, need2, free);
    *free = true;
    return soft * soft;
}

/* The stretches of a piece over which feed is not kept after all; `need2`: to be met at its end. */
void settle_spans(engine *e, uint64_t i, double need2) {
    bool free = false;
    back_over_spans(e, i, soft_cap(e, piece_at(e, i)), need2, &free);
}

static need_key key_of(const planner *p) { return (need_key){p->override, p->rapid, p->ext_speed, p->hold}; }

/* Needs below this piece are those of the last pass: nothing that they depend on has changed but the window's end. */
static uint64_t kept_needs(const planner *p) {
    need_key now = key_of(p), then = p->need_key;
    bool same = now.override == then.override && now.rapid == then.rapid && now.ext_speed == then.ext_speed && now.hold == then.hold;
    return same ? p->need_end : 0;
}

/* Whether what the last pass has found holds on: nothing that it depends on has changed but what lies behind its window. */
bool needs_hold(const engine *e) {
    uint64_t kept = kept_needs(&e->plan);
    return kept > e->plan.piece && kept <= e->plan.capped;
}

/* need2 at the start of piece i, from that behind it. `fixed`: it is the same whatever comes behind the window. */
static double need_before(engine *e, uint64_t i, double need2, bool *fixed) {
    piece *p = piece_at(e, i);
    if (is_motion(p)) {
        double corner2 = p->corner_v * p->corner_v;
        if (p->stop_after) need2 = 0.0;
        *fixed |= p->stop_after;
        need2 = back_over(e, i, need2, fixed);
        *fixed |= need2 >= corner2 && (p->settled || p->cruises);
        need2 = lesser(need2, corner2);
    }
    if (!stands_before(e, p)) return need2;
    *fixed = true;
    return 0.0;
}

/* need2 of every piece from `end` back to where committed motion ends; the window ends at standstill. Where a piece comes
 * to the value it has had, all those ahead of it keep theirs: so the cost for a block does not grow with the window. */
void backward_pass(engine *e, uint64_t end) {
    double need2 = 0.0;
    uint64_t kept = kept_needs(&e->plan), fixed_to = 0, unsettled = UINT64_MAX;
    e->plan.passed_at = e->plan.piece;
    e->plan.passes++;
    if (kept == end && end > e->plan.piece && e->plan.unsettled == UINT64_MAX) return;
    kept = kept < e->plan.unsettled ? kept : e->plan.unsettled;
    for (uint64_t i = end; i-- > e->plan.piece;) {
        piece *p = piece_at(e, i);
        bool same = i < kept && is_motion(p) && p->settled, fixed = fixed_to > 0;
        need2 = need_before(e, i, need2, &fixed);
        if (is_motion(p) && !p->settled) unsettled = i;
        if (is_motion(p) && !p->settled && !p->cruises) fixed_to = 0;
        if (fixed && !fixed_to) fixed_to = i;
        if (same && need2 == p->need2) break;
        p->need2 = need2;
    }
    if (!kept || fixed_to > e->plan.fixed_to) e->plan.fixed_to = fixed_to;
    e->plan.unsettled = unsettled;
    e->plan.need_end = end;
    e->plan.need_key = key_of(&e->plan);
}
