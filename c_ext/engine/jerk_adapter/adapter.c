/* The jerk-limited planner behind the engine: pieces of the run ring become intervals of its path, its time laws become
 * phases, what is left of its plan becomes the stopping tail.
 *
 * Where the axes must stand is a flag of the interval ahead of that place, so it can come and go while the path ahead is
 * known: gates that open, single block, held axes. A stand that comes too late to be met is not set, as in profile.c.
 */
#include <math.h>
#include <stdlib.h>
#include "engine/state/state.h"

#define TURN_STEP 0.1      /* rad of turn over an interval */
#define CURVE_MISS 0.001    /* of the third derivative: beyond it an interval of a curve is halved, ... */
#define CURVE_HALVINGS 3   /* ... so often, but none shorter than ... */
#define CURVE_SHORTEST 2e-3 /* mm, or ... */
#define CURVE_UNSEEN 0.25    /* cycles at the speed that its third derivative allows, if that is less */
#define CURVE_NOISE 1e-3
#define STRAIGHT 1e-9      /* change of the tangent over an interval that does not bend */
#define LEAST_SHARE 1e-4   /* of a limit, however small the program asks for */
#define LEAST_MM 1e-6      /* of an interval of a curve, however much it bends */
#define CORNER_SHARE 0.5   /* of the jerk limit, as in grid.c */
#define CORNER_ACC_SHARE 0.012
#define STAND_SPEED 1.0    /* mm/s: corners that had to be passed below it are stood at */
#define STOP_MARGIN 0.98   /* of the estimated stopping distance: a stand nearer than that is not tried */
#define BRAKES_AHEAD 1.6   /* window in planner intervals, over the stopping distance from full speed */
#define KNOTS_PER_BLOCK 3.0 /* of the window, on the whole */
#define MAX_KNOTS 1000.0
#define SAME_TIME 1e-9     /* s */
#define JERK_SEEN 3.0      /* a jerk that reaches the acceleration in less of a cycle is none that anybody sees */

/* ------------------------------------------------------------------------------------------------ limits */
static jerk_config config_of(const engine_config *cfg) {
    jerk_config c = {.axes = cfg->axis_count, .cycle_s = cfg->cycle_s, .window_blocks = (int)cfg->window};
    for (int i = 0; i < c.axes; i++) {
        c.v_max[i] = cfg->v_max[i];
        c.a_max[i] = cfg->a_max[i];
        c.j_max[i] = cfg->j_max[i] > 0 ? cfg->j_max[i] : cfg->a_max[i] / cfg->cycle_s;
    }
    c.window_knots = (int)fmin(MAX_KNOTS, fmax(KNOTS_PER_BLOCK * cfg->window, 64.0 + BRAKES_AHEAD * jerk_stop_knots(&c)));
    return c;
}

static bool jerk_limited(const engine_config *cfg) {
    for (int i = 0; i < cfg->axis_count; i++)
        if (cfg->j_max[i] > 0) return true;
    return false;
}

/* A second planner like the first one. */
jerk_planner *drive_spare(const engine *e) {
    jerk_config c = config_of(&e->cfg);
    return jerk_new(&c, 2 * c.window_knots);
}

bool drive_new(engine *e) {
    if (!jerk_limited(&e->cfg)) return true;
    for (int i = 0; i < e->cfg.axis_count; i++) e->cfg.j_max[i] = fmin(e->cfg.j_max[i], JERK_SEEN * e->cfg.a_max[i] / e->cfg.cycle_s);
    jerk_config c = config_of(&e->cfg);
    e->drive.laws_max = c.window_knots + 128 + jerk_laws_kept();
    if (e->plan.tail_max < 2 * (uint32_t)e->drive.laws_max + 1024) e->plan.tail_max = 2 * (uint32_t)e->drive.laws_max + 1024;
    e->drive.planner = jerk_new(&c, 2 * c.window_knots);
    e->drive.laws = calloc((size_t)e->drive.laws_max, sizeof(jerk_law));
    for (int i = 0; i < 2; i++) e->plan.tails[i].place = calloc((size_t)e->drive.laws_max, sizeof(uint32_t));
    return e->drive.planner && e->drive.laws && e->plan.tails[0].place && e->plan.tails[1].place;
}

void drive_free(engine *e) {
    jerk_free(e->drive.planner);
    free(e->drive.laws);
    for (int i = 0; i < 2; i++) free(e->plan.tails[i].place);
}

/* ------------------------------------------------------------------------------------------------ path */
static void derivatives(const engine *e, const piece *p, double s, double *d1, double *d2, double *d3) {
    if (p->kind == PIECE_CURVE) {
        curve_piece_derivatives(e, p, s, d1, d2, d3);
        return;
    }
    piece_tangent(e, p, s, d1);
    if (p->kind != PIECE_ARC) return;
    double w = p->sweep / p->whole, angle = p->angle0 + w * (p->from + p->dir * s), r = p->radius * w * w;
    d2[p->axis1] = -r * cos(angle);
    d2[p->axis2] = -r * sin(angle);
    d3[p->axis1] = -w * w * d1[p->axis1];
    d3[p->axis2] = -w * w * d1[p->axis2];
}

static double bend_at(const engine *e, const piece *p, double s) {
    double d1[NC_AXES] = {0}, d2[NC_AXES] = {0}, d3[NC_AXES] = {0}, sum = 0.0;
    derivatives(e, p, s, d1, d2, d3);
    for (int i = 0; i < e->cfg.axis_count; i++) sum += d2[i] * d2[i];
    return sqrt(sum);
}

/* Largest turn per mm of a curve over from..to. Axes that outrun the path (rotary ones over a short way) count by the relative change of
 * their rate, all axes by their own way where the path is that of the tool tip. */
static double turn_rate(const engine *e, const piece *p, double from, double to) {
    double bend = 0.0, fast = 0.0, relative = 0.0, most[NC_AXES] = {0}, change[NC_AXES] = {0};
    for (int k = 0; k < 3; k++) {
        double d1[NC_AXES] = {0}, d2[NC_AXES] = {0}, d3[NC_AXES] = {0}, sum = 0.0, rate = 0.0;
        derivatives(e, p, from + 0.5 * k * (to - from), d1, d2, d3);
        for (int i = 0; i < e->cfg.axis_count; i++) {
            sum += d2[i] * d2[i];
            rate += d1[i] * d1[i];
            most[i] = fmax(most[i], fabs(d1[i]));
            change[i] = fmax(change[i], fabs(d2[i]));
        }
        bend = fmax(bend, sqrt(sum));
        fast = fmax(fast, sqrt(rate));
    }
    if (curve_of(e, p)->natural > 0.0 && fast > 0.0) return bend / fast;
    for (int i = 0; i < e->cfg.axis_count; i++) relative = hypot(relative, change[i] / fmax(1.0, most[i]));
    return fmin(bend, relative);
}

/* The program asks for a slow corner at the start: a short interval of its own holds that speed. */
static double entry_stretch(const engine *e, const piece *p) {
    return fmin(0.25 * p->length, fmax(1e-3, p->entry_speed * e->cfg.cycle_s));
}

/* Where the interval that begins at s ends. */
static double interval_end(const engine *e, const piece *p, double s) {
    double end = p->length, bend = 0.0;
    if (s <= 0.0 && p->entry_speed < NEVER) end = entry_stretch(e, p);
    if (p->kind == PIECE_LINE) return end;
    if (p->kind == PIECE_ARC) {
        bend = fabs(p->sweep) / p->whole;
    } else {
        end = fmin(end, curve_piece_cell_end(e, p, s));
        bend = turn_rate(e, p, s, end);
    }
    double parts = fmin(ceil((end - s) * bend / TURN_STEP - 1e-9), floor((end - s) / LEAST_MM)), next = parts > 1.0 ? s + (end - s) / parts : end;
    return p->length - next < STEPPED_OVER_MM ? p->length : next;
}

/* Speed at which the axes keep their shares of velocity from `from` to `to`. */
static double shared_speed(const engine *e, const piece *p, double from, double to) {
    uint32_t shared = 0;
    for (int i = 0; i < e->cfg.axis_count; i++)
        if (p->limits.velocity[i] < 1.0f && p->moving >> i & 1) shared |= 1u << i;
    double v = NEVER, d1[NC_AXES], d2[NC_AXES], d3[NC_AXES];
    for (int k = 0; shared && k < 3; k++) {
        derivatives(e, p, from + 0.5 * k * (to - from), d1, d2, d3);
        for (int i = 0; i < e->cfg.axis_count; i++)
            if (shared >> i & 1 && fabs(d1[i]) > 1e-12) v = fmin(v, fmax(piece_v_max(e, p, i) / fabs(d1[i]), 1e-6));
    }
    return v;
}

/* Speed that the program allows beyond the machine's own limits (NC_DYNAMICS); 0: no such limit. */
static double programmed_speed(const engine *e, const piece *p, double from, double to) {
    const motion_limits *l = &p->limits;
    double v = l->path_velocity > 0 ? (double)l->path_velocity : NEVER, bend = 0.0;
    if (l->radial_acceleration > 0) {
        for (int k = 0; k < 3; k++) bend = fmax(bend, bend_at(e, p, from + 0.5 * k * (to - from)));
        if (bend > 1e-12) v = fmin(v, sqrt((double)l->radial_acceleration / bend));
    }
    v = fmin(v, shared_speed(e, p, from, to));
    return v < NEVER ? v : 0.0;
}

/* A part of a curve that does not bend is a line. */
static bool is_line(const engine *e, const piece *p, const jerk_interval *q) {
    if (p->kind == PIECE_LINE) return true;
    for (int i = 0; i < e->cfg.axis_count; i++)
        if (fabs(q->d1[1][i] - q->d1[0][i]) > STRAIGHT || (fabs(q->d2[0][i]) + fabs(q->d2[1][i])) * q->length > STRAIGHT) return false;
    return true;
}

/* Weights of the program as shares of the axes' limits. A limit of the path's acceleration or jerk becomes one of the axis that
 * moves most on a line, of all axes where the path bends. */
static void set_shares(const engine *e, const piece *p, jerk_interval *q) {
    const motion_limits *l = &p->limits;
    bool path = l->path_acceleration > 0 || l->path_jerk > 0, line = path && is_line(e, p, q);
    int most = 0;
    for (int i = 1; i < e->cfg.axis_count; i++)
        if (fabs(q->d1[0][i]) > fabs(q->d1[0][most])) most = i;
    for (int i = 0; i < e->cfg.axis_count; i++) {
        bool takes = !line || i == most;
        double along = line ? fabs(q->d1[0][i]) : 1.0, acc = l->acceleration[i], jerk = l->jerk[i];
        if (takes && l->path_acceleration > 0) acc = fmin(acc, (double)l->path_acceleration * along / e->cfg.a_max[i]);
        if (takes && l->path_jerk > 0 && e->cfg.j_max[i] > 0) jerk = fmin(jerk, (double)l->path_jerk * along / e->cfg.j_max[i]);
        q->acc_share[i] = (float)fmax(acc, LEAST_SHARE);
        q->jerk_share[i] = (float)fmax(jerk, LEAST_SHARE);
    }
}

/* The interval that begins as q does ends at `to`. */
static void end_interval(const engine *e, const piece *p, double to, jerk_interval *q) {
    double from = q->offset;
    q->length = to - from;
    derivatives(e, p, to, q->d1[1], q->d2[1], q->d3[1]);
    q->v_hard = programmed_speed(e, p, from, to);
    set_shares(e, p, q);
    q->blocks = to >= p->length;
    if (from <= 0.0 && p->entry_speed < NEVER) q->v_hard = q->v_hard > 0.0 ? fmin(q->v_hard, p->entry_speed) : p->entry_speed;
}

/* How far the third derivative of the planner's polynomial over q (path.c) misses the curve at the share t, over the largest of
 * the interval: each axis by its jerk limit. q->miss keeps the largest. */
static double curve_miss(const engine *e, const piece *p, jerk_interval *q, double t) {
    double d1[NC_AXES], d2[NC_AXES], d3[NC_AXES], most = 0.0, miss = 0.0;
    derivatives(e, p, q->offset + t * q->length, d1, d2, d3);
    for (int i = 0; i < e->cfg.axis_count; i++) {
        double v = e->cfg.v_max[i], j = e->cfg.j_max[i] > 0 ? e->cfg.j_max[i] : e->cfg.a_max[i] / e->cfg.cycle_s;
        double off = fabs(jerk_third(q, t, i) - d3[i]), noise = CURVE_NOISE * j / (v * v * v); /* too little to matter at any speed */
        if (off > noise) q->miss[i] = fmaxf(q->miss[i], (float)off);
        miss = fmax(miss, (off - noise) / j);
        most = fmax(most, fmax(fabs(d3[i]), fmax(fabs(q->d3[0][i]), fabs(q->d3[1][i]))) / j);
    }
    return miss > 0.0 ? miss / most : 0.0;
}

/* What misses evenly shows in the middle, what misses to either side at a quarter. */
static bool fits_curve(const engine *e, const piece *p, jerk_interval *q) {
    memset(q->miss, 0, sizeof q->miss);
    double middle = curve_miss(e, p, q, 0.5), quarter = curve_miss(e, p, q, 0.25);
    return middle <= CURVE_MISS && quarter <= CURVE_MISS;
}

/* Shortest interval of a curve that is worth halving: a blend of a micrometre is seen by many cycles if it must be crept through. */
static double shortest_seen(const engine *e, const jerk_interval *q) {
    double most = 0.0;
    for (int i = 0; i < e->cfg.axis_count; i++) {
        double j = e->cfg.j_max[i] > 0 ? e->cfg.j_max[i] : e->cfg.a_max[i] / e->cfg.cycle_s;
        most = fmax(most, fmax(fabs(q->d3[0][i]), fabs(q->d3[1][i])) / j);
    }
    return most > 0.0 ? fmin(CURVE_SHORTEST, CURVE_UNSEEN * e->cfg.cycle_s / cbrt(most)) : CURVE_SHORTEST;
}

/* The next interval of the path of a piece. */
static jerk_interval next_interval(const engine *e, const piece *p, uint64_t i, double from) {
    double to = interval_end(e, p, from);
    jerk_interval q = {.offset = from, .tag = i, .feed = p->feed > 0 ? p->feed : p->v_hard};
    q.flags = p->feed > 0 ? (p->flags & NC_NO_OVERRIDE ? JERK_FIXED : 0u) : JERK_RAPID;
    derivatives(e, p, from, q.d1[0], q.d2[0], q.d3[0]);
    end_interval(e, p, to, &q);
    for (int k = 0; p->kind == PIECE_CURVE && !fits_curve(e, p, &q) && k < CURVE_HALVINGS && q.length > shortest_seen(e, &q); k++) {
        to = 0.5 * (from + to);
        end_interval(e, p, to, &q);
    }
    return q;
}

/* A corner that could only be crept through is stood at. */
static bool sharp(const engine *e, const piece *p) {
    for (int a = 0; a < e->cfg.axis_count; a++) {
        double j = e->cfg.j_max[a] > 0 ? e->cfg.j_max[a] : e->cfg.a_max[a] / e->cfg.cycle_s;
        j *= fmax(1.0, (double)p->limits.jerk[a]);
        double room = fmin(CORNER_SHARE * j * e->cfg.cycle_s, CORNER_ACC_SHARE * e->cfg.a_max[a]) * e->cfg.cycle_s;
        if (p->jump[a] * STAND_SPEED > room) return true;
    }
    return false;
}

/* Whether the axes must stand behind motion i; *known: what follows has been fed. */
static bool stands_behind(engine *e, uint64_t i, bool *known) {
    *known = true;
    if (piece_at(e, i)->stop_after) return true;
    for (uint64_t k = i + 1; k < e->piece_head; k++) {
        const piece *p = piece_at(e, k);
        if (stands_before(e, p)) return true;
        if (is_motion(p)) return sharp(e, p);
    }
    *known = false;
    return false;
}

bool drive_stands_behind(engine *e, uint64_t i) {
    bool known;
    return stands_behind(e, i, &known);
}

static void close_boundary(engine *e) {
    drive *d = &e->drive;
    int64_t n = jerk_ahead(d->planner);
    if (!d->open || n == 0) return;
    bool known, stand = stands_behind(e, d->last, &known);
    d->open = !known;
    if (known) jerk_stand(d->planner, n - 1, stand);
}

/* One interval of piece `next`; a piece too short to be one is stepped over. */
static bool push_interval(engine *e) {
    drive *d = &e->drive;
    const piece *p = piece_at(e, d->next);
    bool whole = true;
    if (p->length - d->at > STEPPED_OVER_MM) {
        jerk_interval q = next_interval(e, p, d->next, d->at);
        int64_t taken = jerk_push(d->planner, &q, 1);
        if (taken < 0) ATOMIC_SET(e->fault, ENGINE_BAD_PATH); /* it stands ahead of it */
        if (taken != 1) return false;
        d->last = d->next;
        d->has_last = true;
        d->open = whole = q.blocks; /* inside a piece there is nothing to stand for */
        d->at += q.length;
    }
    if (whole) {
        d->next++;
        d->at = 0.0;
    }
    return true;
}

/* Push path until the planner's look-ahead is full, or there is no more. */
static void push_path(engine *e) {
    drive *d = &e->drive;
    close_boundary(e);
    while (d->next < e->piece_head && !jerk_ready(d->planner)) {
        if (!is_motion(piece_at(e, d->next))) {
            d->next++;
            continue;
        }
        if (d->at <= 0.0) close_boundary(e);
        if (!push_interval(e)) break;
    }
    close_boundary(e);
    jerk_finish(d->planner, e->feed.final && d->next >= e->piece_head);
}

/* The path stands where the planner of the engine says: everything is pushed anew. */
static void restart(engine *e) {
    drive *d = &e->drive;
    jerk_reset(d->planner);
    d->next = e->plan.piece;
    d->at = e->plan.s;
    d->has_last = d->open = d->restart = false;
}

/* Pieces change: what the tails were written from does not hold any more. */
static void forget_tails(engine *e) {
    for (int i = 0; i < 2; i++) e->plan.tails[i].edition = 0;
}

/* The run ring is fed anew from `head` on. */
void drive_cut_run(engine *e, uint64_t head) {
    drive *d = &e->drive;
    if (!d->planner || d->next < head || d->restart) return;
    forget_tails(e);
    int64_t n = jerk_ahead(d->planner);
    while (n > 0 && jerk_path(d->planner, n - 1)->tag >= head) n--;
    jerk_cut(d->planner, n, 0.0);
    if (n > 0) jerk_stand(d->planner, n - 1, 0);
    d->next = head;
    d->at = 0.0;
    d->open = d->has_last = n > 0;
    if (n > 0) d->last = jerk_path(d->planner, n - 1)->tag;
}

/* Piece i ends at s now. */
void drive_shorten(engine *e, uint64_t i, double s) {
    drive *d = &e->drive;
    if (!d->planner || d->restart || d->next < i || (d->next == i && d->at <= s)) return;
    forget_tails(e);
    int64_t n = jerk_ahead(d->planner);
    while (n > 0 && jerk_path(d->planner, n - 1)->tag == i && jerk_path(d->planner, n - 1)->offset >= s - STEPPED_OVER_MM) n--;
    if (n > 0 && jerk_path(d->planner, n - 1)->tag == i) jerk_cut(d->planner, n - 1, s - jerk_path(d->planner, n - 1)->offset);
    d->next = i + 1;
    d->at = 0.0;
    d->open = true;
}

/* ------------------------------------------------------------------------------------------------ conditions */
typedef struct conditions {
    techno_counts done, done_again;
    uint32_t held_axes;
    bool single, m01;
} conditions;

static void read_conditions(engine *e, conditions *c) {
    memset(c, 0, sizeof *c);
    c->done = techno_done(&e->done);
    c->done_again = techno_done(&e->done_again);
    c->single = ATOMIC_GET(e->single_now);
    c->m01 = ATOMIC_GET(e->m01_now);
    c->held_axes = ATOMIC_GET(e->held_axes);
}

static bool conditions_change(engine *e) {
    planner *p = &e->plan;
    conditions want;
    read_conditions(e, &want);
    bool same = p->single == want.single && p->m01 == want.m01 && p->held_axes == want.held_axes &&
                memcmp(&p->done, &want.done, sizeof want.done) == 0 && memcmp(&p->done_again, &want.done_again, sizeof want.done) == 0;
    p->done = want.done;
    p->done_again = want.done_again;
    p->single = want.single;
    p->m01 = want.m01;
    p->held_axes = want.held_axes;
    return !same;
}

/* Stands that the present conditions ask for, as far as they can still be met. */
static void update_stands(engine *e) {
    jerk_planner *j = e->drive.planner;
    double way = 0.0, stop = STOP_MARGIN * jerk_stop_distance(j);
    for (int64_t i = 0, n = jerk_ahead(j); i < n; i++) {
        const jerk_interval *q = jerk_path(j, i);
        way += q->length;
        if (!q->blocks) continue;
        bool known, stand = stands_behind(e, q->tag, &known);
        if (known && (!stand || way >= stop)) jerk_stand(j, i, stand);
    }
}

/* A plan that runs over a stand: there was none that meets it. */
static void forget_missed_stands(jerk_planner *j) {
    for (int64_t i = 0, n = jerk_ahead(j); i < n && jerk_passes(j, i); i++) jerk_stand(j, i, 0);
}

static void set_speeds(engine *e) {
    jerk_planner *j = e->drive.planner;
    jerk_hold(j, e->plan.hold);
    jerk_command_speed(j, e->plan.ext_speed < NEVER ? e->plan.ext_speed : -1.0);
    if (!e->plan.hold) jerk_override(j, e->plan.override, fmin(1.0, e->plan.rapid));
}

/* ------------------------------------------------------------------------------------------------ phases */
static bool steps_over(engine *e, uint64_t i) {
    const piece *p = piece_at(e, i);
    return !is_motion(p) || p->length <= STEPPED_OVER_MM;
}

/* Events, and pieces without a length, up to piece `until`. */
static void pass_events(writer *w, uint64_t until) {
    while (w->piece < until && !writer_full(w) && steps_over(w->e, w->piece)) {
        const piece *p = piece_at(w->e, w->piece);
        if (is_motion(p)) {
            const phase ph = {.piece = w->piece, .s0 = p->length, .v0 = w->v, .last = true};
            write_phase(w, &ph);
            w->piece++;
        } else {
            pass_event(w);
        }
    }
}

static void write_law(writer *w, const jerk_law *law) {
    bool last = law->last & 2;
    const phase ph = {law->tag, law->s0, law->v0, law->a0, law->jerk, law->snap, law->crackle, law->pop, law->time, last};
    write_phase(w, &ph);
    w->piece = law->tag + last;
    w->s = last ? 0.0 : law->s0 + law->length;
    w->v = law->flags & JERK_STAND ? 0.0 : law->length / law->time; /* not at rest: that is all a tail needs */
    w->motion += law->time;
}

static void write_commit(engine *e, writer *w, bool changed) {
    jerk_planner *j = e->drive.planner;
    jerk_law law;
    pass_events(w, e->piece_head);
    while (!writer_full(w)) {
        if (!jerk_next_within(j, &law, w->budget - w->seconds)) {
            int64_t known = jerk_ahead(j);
            push_path(e); /* it stands; is there more? */
            if (jerk_ahead(j) == known) break;
            continue;
        }
        if (changed) forget_missed_stands(j);
        changed = false;
        write_law(w, &law);
        pass_events(w, e->piece_head);
    }
    w->v = jerk_speed(j);
}

/* The buffer holds this very plan already: it only begins later. */
static bool tail_continues(engine *e, tail *t, const writer *from) {
    const jerk_planner *j = e->drive.planner;
    jerk_law law;
    if (t->edition == 0 || t->edition != jerk_edition(j) || !(from->v > 0.0) || jerk_tail(j, &law, 1) != 1) return false;
    t->first = t->place[jerk_used(j) - t->from];
    while (steps_over(e, t->phases[t->first].piece) && t->phases[t->first].piece < from->piece) t->first++; /* events that are committed */
    uint32_t i = t->first;
    while (steps_over(e, t->phases[i].piece)) i++;
    writer w = {.e = e, .out = t->phases, .count = i, .budget = NEVER};
    write_law(&w, &law); /* a part of it may have been handed out */
    return true;
}

/* What is left of the plan; false if it finds no room. */
static bool write_tail(engine *e, tail *t, const writer *from) {
    drive *d = &e->drive;
    if (tail_continues(e, t, from)) return true;
    writer w = {.e = e, .out = t->phases, .max = e->plan.tail_max, .piece = from->piece, .s = from->s, .v = from->v, .budget = NEVER};
    int64_t n = from->v > 0.0 ? jerk_tail(d->planner, d->laws, d->laws_max) : 0;
    t->edition = 0;
    for (int64_t i = 0; i < n; i++) {
        t->place[i] = w.count;
        pass_events(&w, d->laws[i].tag);
        if (writer_full(&w)) return false;
        write_law(&w, &d->laws[i]);
    }
    t->first = 0;
    t->count = w.count;
    t->edition = n > 0 ? jerk_edition(d->planner) : 0;
    t->from = jerk_used(d->planner);
    t->piece = w.piece;
    t->s = w.s;
    return n < d->laws_max;
}

/* The stopping tail becomes the shortest one there is, so that what lies behind it may be changed. False: not now. */
bool drive_shorten_tail(engine *e) {
    if (!e->drive.planner || e->plan.v <= 0.0) return true;
    uint64_t word = ATOMIC_GET(e->commit);
    if (e->drive.restart || (word & 1)) return false;
    uint32_t next = ((word >> 1) & 1) ^ 1;
    writer w = {.e = e, .piece = e->plan.piece, .s = e->plan.s, .v = e->plan.v};
    jerk_brake(e->drive.planner);
    if (write_tail(e, &e->plan.tails[next], &w) &&
        __atomic_compare_exchange_n(&e->commit, &word, e->plan.written << 2 | next << 1, false, __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE)) return true;
    e->drive.restart = true;
    return false;
}

/* The last `seconds` that were committed, or a little less, are the beginning of the plan again. */
double drive_take_back(engine *e, double seconds) {
    double back = jerk_take_back(e->drive.planner, seconds);
    if (back > 0.0) update_stands(e);
    return back;
}

/* Motion from where w is, as much as its budget, and the tail behind it; false if that finds no room. */
bool drive_write(engine *e, writer *w, tail *t) {
    bool changed = conditions_change(e);
    if (changed) update_stands(e);
    push_path(e);
    set_speeds(e);
    write_commit(e, w, changed);
    return write_tail(e, t, w);
}

/* GEO has taken the tail behind the last commit: the planner goes back to where it begins. False if its plan is another one by now. */
static bool back_to_tail(engine *e, const writer *w, uint64_t edition) {
    if (jerk_edition(e->drive.planner) != edition) return false;
    return !(w->motion > 0.0) || fabs(jerk_take_back(e->drive.planner, w->motion) - w->motion) < SAME_TIME;
}

/* Commit motion until commit_high of it is ahead of GEO. */
void drive_commit(engine *e) {
    if (e->drive.restart && e->plan.v > 0.0) return; /* the stored tail is driven first */
    if (e->drive.restart) restart(e);
    uint64_t word = ATOMIC_GET(e->commit), before = e->plan.written, edition = jerk_edition(e->drive.planner);
    writer w = {.e = e, .piece = e->plan.piece, .s = e->plan.s, .v = e->plan.v, .budget = commit_high(e) - ahead_s(e)};
    uint32_t next = ((word >> 1) & 1) ^ 1;
    if (word & 1) return; /* GEO has taken the tail */
    jerk_watch(e->drive.planner, &e->commit);
    bool fits = drive_write(e, &w, &e->plan.tails[next]);
    jerk_watch(e->drive.planner, NULL);
    if (!fits || !__atomic_compare_exchange_n(&e->commit, &word, e->plan.written << 2 | next << 1, false, __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE)) {
        e->plan.written = before;
        e->drive.restart = !fits || !back_to_tail(e, &w, edition); /* from rest: where the tail that GEO drives now ends, or where the path stands already */
        return;
    }
    e->plan.phases += e->plan.written - before;
    e->plan.piece = w.piece;
    e->plan.s = w.s;
    e->plan.v = w.v;
    e->plan.committed_s += w.seconds;
}
