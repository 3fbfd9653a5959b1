/* Stops and functions that the PLC inserts (insert_cmd, hli_reference 5.3): where they lie, and how the path is cut there. */
#include <math.h>
#include "engine/run/run_ring.h"

/* Where in a piece an axis is at `target`: the first place found, or -1. Lines and arcs change direction rarely enough. */
static double axis_crossing(engine *e, const piece *p, int axis, double target, double begin) {
    enum { STEPS = 64 };
    double q[NC_AXES], before, s0 = begin;
    piece_position(e, p, begin, q);
    before = q[axis] - target;
    for (int k = 1; k <= STEPS; k++) {
        double s1 = begin + (p->length - begin) * k / STEPS;
        piece_position(e, p, s1, q);
        if (before != 0.0 && before * (q[axis] - target) <= 0.0) {
            for (int i = 0; i < 60; i++) {
                double middle = 0.5 * (s0 + s1);
                piece_position(e, p, middle, q);
                if (before * (q[axis] - target) > 0.0) s0 = middle;
                else s1 = middle;
            }
            return s1;
        }
        before = q[axis] - target;
        s0 = s1;
    }
    return -1.0;
}

static double dist_shift(engine *e) {
    double shift;
    __atomic_load(&e->geo.dist_shift, &shift, __ATOMIC_ACQUIRE);
    return shift;
}

/* Where in a piece, as it is driven, the inserted stop lies, behind `begin`; -1 if not there. */
double feed_stop_in(engine *e, const piece *p, double begin) {
    if (!e->feed.armed) return -1.0;
    if (e->feed.insert.axis) return axis_crossing(e, p, e->feed.insert.axis - 1, e->feed.target, begin);
    if (p->dist_rate <= 0.0) return -1.0;
    double s = (e->feed.target - (dist_shift(e) + p->dist0)) / p->dist_rate;
    return s > begin + 1e-9 && s <= p->length + 1e-9 ? fmin(s, p->length) : -1.0;
}

static double run_dist(engine *e, const piece *p, double s) { return dist_shift(e) + p->dist0 + p->dist_rate * s; }

/* The stop stands behind the piece `before`. */
void feed_stop(engine *e, const piece *before) {
    const insert_cmd *c = &e->feed.insert;
    piece stop;
    memset(&stop, 0, sizeof stop);
    stop.kind = PIECE_EVENT;
    stop.type = NC_M;
    stop.inserted = true;
    stop.dir = 1;
    stop.code = c->m_function;
    stop.value = c->add;
    stop.flags = c->add ? NC_HAS_VALUE : 0;
    stop.n = before->n;
    stop.count = before->count;
    stop.line = before->line;
    stop.element = before->element;
    stop.origin = before->origin;
    stop.from = before->from + before->length;
    stop.whole = before->whole;
    stop.path0 = e->feed.target;
    memcpy(stop.end, before->end, sizeof stop.end);
    inserted_stop *entry = &e->stops[e->stops_fed % STOPS_MAX];
    store_f64_relaxed(&entry->dist, run_dist(e, before, before->length)); /* GEO may be showing the stop it replaces */
    for (int i = 0; i < NC_AXES; i++) store_f64_relaxed(&entry->position[i], before->end[i]);
    ATOMIC_SET(e->stops_fed, e->stops_fed + 1);
    e->feed.armed = c->mode == INSERT_RELATIVE_REPEATED;
    if (e->feed.armed) e->feed.target = (c->axis ? before->end[c->axis - 1] : entry->dist) + c->value;
    if (c->m_function > 1) {
        feed_function(e, &stop, SYNCH_MVS_SVS);
        e->feed.stop = true;
        return;
    }
    piece *p = feed_copy(e, &stop);
    p->stop_before = c->m_function == 0;
    p->m01 = c->m_function == 1;
    feed_publish(e);
    e->feed.stop = p->stop_before;
    e->feed.m01 = p->m01;
}

/* The program ends ahead of an inserted stop: it stands at the end. */
void feed_stop_at_end(engine *e) {
    if (!e->feed.final || e->feed.dir < 0 || !e->feed.armed || !e->feed.has_motion) return;
    if (e->feed.insert.axis || e->feed.insert.mode == INSERT_RELATIVE_REPEATED || e->piece_head == ATOMIC_GET(e->piece_done)) return;
    feed_stop(e, piece_at(e, e->feed.last_motion));
}

static bool is_inserted_stop(const piece *p) { return p->inserted && p->type == NC_M; }

/* Feed from piece i of the run ring on anew: a motion or an inserted stop. */
static void feed_again_from(engine *e, uint64_t i) {
    const piece *p = piece_at(e, i);
    bool behind = p->inserted && p->from >= p->whole - 1e-9;
    uint64_t next = behind ? p->origin + 1 : p->origin;
    double at = !behind && p->from > 0.0 ? p->from : -1.0;
    feed_cut(e, i);
    e->feed.next = next;
    e->feed.at = at;
}

/* Where the path would come to rest if it braked now. */
static uint64_t rest_piece(engine *e, double *s) {
    planner_store_tail(e);
    uint64_t word = ATOMIC_GET(e->commit);
    const tail *t = &e->plan.tails[(word >> 1) & 1];
    *s = e->plan.v > 0.0 ? t->s : e->plan.s;
    return e->plan.v > 0.0 ? t->piece : e->plan.piece;
}

/* The stop lies in the piece in which the path could come to rest: that one is cut in two. */
static bool cut_rest_piece(engine *e) {
    double rest;
    uint64_t i = rest_piece(e, &rest);
    if (i >= e->piece_head) return false;
    piece *p = piece_at(e, i);
    if (!is_motion(p) || p->shortcut || p->dir < 0) return false;
    if (!e->feed.insert.axis && e->feed.target < run_dist(e, p, rest)) e->feed.target = run_dist(e, p, rest + 1e-6);
    double stop = feed_stop_in(e, p, rest);
    if (stop < 0.0) return false;
    bool armed = e->feed.armed;
    double target = e->feed.target;
    feed_cut(e, i + 1);
    e->feed.armed = armed;
    e->feed.target = target;
    e->feed.last_motion = i;
    e->feed.has_motion = true;
    bool cut = stop < p->length - 1e-9;
    if (cut) feed_shorten(e, p, stop);
    if (cut) drive_shorten(e, i, stop);
    double at = p->from + p->length; /* behind an earlier stop the piece is a part already */
    bool left = at < p->whole - 1e-9;
    e->feed.next = left ? p->origin : p->origin + 1;
    e->feed.at = left ? at : -1.0;
    feed_stop(e, p);
    e->feed.stop = true; /* the path comes to rest here, whatever is inserted: only that is sure to be possible */
    return true;
}

/* A new insert_cmd: what has been fed is fed again from where that is free, so that the stop finds its place. */
void feed_take_insert(engine *e) {
    uint32_t request = ATOMIC_GET(e->insert_requests);
    if (request == e->feed.inserts || e->feed.dir < 0 || !drive_shorten_tail(e)) return;
    uint64_t i = feed_first_free(e);
    while (i < e->piece_head && !is_inserted_stop(piece_at(e, i)) && (!is_motion(piece_at(e, i)) || piece_at(e, i)->shortcut)) i++;
    if (i < e->piece_head) feed_again_from(e, i); /* this drops the stops of the command before */
    insert_cmd *c = &e->feed.insert;
    *c = e->insert_request;
    e->feed.target = c->mode == INSERT_ABSOLUTE ? c->value : c->base + c->value;
    e->feed.armed = c->mode == INSERT_ABSOLUTE ? c->axis || c->value >= c->base : c->value != 0.0;
    if (e->feed.armed) cut_rest_piece(e);
    ATOMIC_SET(e->feed.inserts, request);
}
