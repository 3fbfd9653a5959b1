/* Zones of corners: how far their jumps use up acceleration, whatever pieces lie there.
 *
 * A sample takes in a cycle to both sides of it. So a jump counts for all that is driven less than a cycle before or behind it,
 * also beyond short pieces that have no corner of their own. Beyond another corner with a zone it cannot reach further than that one's,
 * since less than a cycle is left there.
 */
#include <math.h>
#include <stdlib.h>
#include "engine/state/state.h"

bool zones_new(engine *e) {
    e->plan.corners = calloc(e->piece_mask + 1, sizeof(used_corner));
    return e->plan.corners != NULL;
}

static used_corner *corner_at(const engine *e, uint64_t n) { return &e->plan.corners[n & e->piece_mask]; }

/* What is driven in a cycle that begins or ends with a speed, at the most. */
static double zone_of(const engine *e, double v, double accel) { return (v + 0.5 * accel * e->cfg.cycle_s) * e->cfg.cycle_s; }

double corner_zone(const engine *e, double v, const piece *p) { return zone_of(e, v, p->accel); }

/* ------------------------------------------------------------------------------------------------ list of corners */
/* Piece i is the next one that is capped: behind the one capped last, or again behind one that has been. */
void zones_follow(engine *e, uint64_t i) {
    planner *w = &e->plan;
    if (i == w->zones_to) return;
    w->corners_head = w->corners_first;
    w->capped_at = 0.0;
    if (i > w->zones_from && i < w->zones_to) {
        const piece *before = piece_at(e, i - 1);
        w->corners_head = before->corners;
        w->capped_at = before->at + (is_motion(before) ? before->length : 0.0);
    }
    else w->zones_from = i;
    w->zones_to = i;
}

/* Piece i has been capped. `v`: fastest at its start if its jumps use up acceleration, else below 0. */
void zones_note(engine *e, uint64_t i, const piece *before, double v) {
    planner *w = &e->plan;
    piece *p = piece_at(e, i);
    p->at = w->capped_at;
    if (v >= 0.0) {
        double accel = greater(before->accel, p->accel);
        *corner_at(e, w->corners_head++) = (used_corner){i, p->at, zone_of(e, v, accel), accel};
    }
    p->corners = w->corners_head;
    if (is_motion(p)) w->capped_at += p->length;
    w->zones_to = i + 1;
}

/* ------------------------------------------------------------------------------------------------ what they use up */
/* How far a corner reaches on p, which begins or ends `distance` mm from it. */
static inline double reach_of(const engine *e, const used_corner *c, const piece *p, double distance) {
    double quicker = p->accel - c->accel, reach = c->zone - distance;
    return quicker > 0.0 ? reach + zone_of(e, 0.0, quicker) : reach;
}

/* The first corner that reaches a piece; `reach`: at the most what is left of a cycle behind a standstill. */
static void take(engine *e, const used_corner *c, bool stands, double reach, const piece *p, zone_use *use) {
    use->reach = stands ? lesser(reach, corner_zone(e, 0.0, p)) : reach;
    use->reserve = piece_at(e, c->piece)->reserve;
}

static void take_too(engine *e, const used_corner *c, zone_use *use) {
    const double *reserve = piece_at(e, c->piece)->reserve;
    for (int a = 0; a < e->cfg.axis_count; a++) use->sum[a] = greater(use->reserve[a], reserve[a]);
    use->reserve = use->sum;
}

/* At the start of p, by corners up to there. What is left of a cycle at one is left beyond it, too. */
static void used_ahead(engine *e, const piece *p, zone_use *use) {
    const planner *w = &e->plan;
    double left = NEVER;
    use->reach = 0.0;
    for (uint64_t n = p->corners; n-- > w->corners_first;) {
        const used_corner *c = corner_at(e, n);
        left = lesser(left, reach_of(e, c, p, p->at - c->at));
        if (left <= 0.0 || c->piece + CORNERS_BEHIND < w->piece) return;
        if (use->reach > 0.0) take_too(e, c, use);
        else take(e, c, stands_before(e, p), left, p, use);
    }
}

/* At the end of p, by corners from there on. */
static void used_behind(engine *e, const piece *p, const piece *next, zone_use *use) {
    double end = p->at + p->length, left = NEVER;
    use->reach = 0.0;
    for (uint64_t n = p->corners; n < e->plan.corners_head; n++) {
        const used_corner *c = corner_at(e, n);
        left = lesser(left, reach_of(e, c, p, c->at - end));
        if (left <= 0.0) return;
        if (use->reach > 0.0) take_too(e, c, use);
        else take(e, c, !next || stands_before(e, next), left, p, use);
    }
}

/* What jumps use up at both ends of p. `next`: the motion behind it, NULL where that ends in a standstill or is not known. */
void zones_use(engine *e, const piece *p, const piece *next, zone_use *first, zone_use *last) {
    used_ahead(e, p, first);
    used_behind(e, p, next, last);
}

/* Whether all corners are known that can use up acceleration on p. Nobody waits for what lies behind a standstill. */
bool zones_known(engine *e, const piece *p, const piece *next) {
    if (!next) return p->stop_after;
    double known = e->plan.capped_at - (p->at + p->length);
    if (known >= corner_zone(e, next->corner_v, p) || stands_before(e, next) || (e->feed.final && e->plan.capped == e->piece_head)) return true;
    double v = lesser(next->corner_v, greater(reachable(p, e->plan.reserve_override), reachable(next, e->plan.reserve_override)));
    return known >= corner_zone(e, v, p);
}
