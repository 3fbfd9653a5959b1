/* The planner: forward through the window, phase by phase, some milliseconds ahead of the interpolator.
 *
 * Every commit leaves a stored stopping tail: GEO follows it when the planner is late. Commit and tail are published
 * together in one atomic word (head << 2 | tail buffer << 1 | taken).
 */
#include <math.h>
#include "engine/state/state.h"

#define PARTS_MAX 64       /* of a phase */
#define SHORT_PART 0.05    /* of a cycle: no part is shorter */
#define TINY_MM 1e-12
#define MOVES 3            /* the window is moved on so often while it is driven through */
#define SAME_SPEED 1e-12   /* relative */
#define SAME_TIME 1e-9     /* s */
#define PUMPED_CYCLES 3.0  /* motion ahead of GEO below which a pumped planner commits more */
#define LEAST_CYCLES 1.0   /* ... and that is at least so many */
#define LAST_CYCLES 1.5    /* motion ahead of GEO below which it may take the tail in this cycle */
#define FEASIBLE 1.0000001 /* speeds squared may miss by rounding, ... */
#define FEASIBLE_BENT 1.002 /* ... inside a curved stretch by what the chord of its limits is off */
#define REFUSED_FROM 1.01  /* times the speed that a corner or stand allows, and ... */
#define REFUSED_MM_S 0.01  /* ... so much more: no commit does that */

/* Feed and override: what the operator and the program ask for. The machine's own limits come on top. */
double soft_cap(const engine *e, const piece *p) {
    if (e->plan.hold) return 0.0;
    if (e->plan.ext_speed < NEVER) return lesser(reachable(p, e->plan.reserve_override), e->plan.ext_speed);
    if (p->feed > 0) return lesser(p->v_hard, p->feed * (p->flags & NC_NO_OVERRIDE ? 1.0 : e->plan.override));
    return p->v_hard * lesser(1.0, e->plan.rapid);
}

typedef struct stretch {
    const span *span;
    double from, to;   /* path length in the piece */
    double soft, cap;  /* feed and override; straight: with the hard limit */
    double accel;      /* straight */
    double end2;       /* speed squared that must be met at `to` */
} stretch;

/* Speed squared to be met at the end of piece i. */
static double need_behind(engine *e, uint64_t i, uint64_t end) {
    const piece *p = piece_at(e, i);
    return p->stop_after || i + 1 >= end ? 0.0 : piece_at(e, i + 1)->need2;
}

/* The stretch of piece i that holds s, s < length; its needs are those of the last backward pass. */
static stretch stretch_at(engine *e, uint64_t i, uint64_t end, double s) {
    const piece *p = piece_at(e, i);
    if (p->cruises || !spans_known(e, i)) settle_spans(e, i, need_behind(e, i, end));
    const span *spans = spans_of(e, i);
    span_cursor *at = &e->plan.cursor;
    uint32_t last = p->span_count - 1;
    if (at->piece != i || s < at->from) *at = (span_cursor){.piece = i};
    while (at->k < last && s >= at->from + spans[at->k].length) at->from += spans[at->k++].length;
    uint32_t k = at->k;
    double from = at->from;
    double soft = soft_cap(e, p), need = k < last ? spans[k + 1].need2 : need_behind(e, i, end);
    return (stretch){&spans[k], from, k < last ? from + spans[k].length : p->length, soft, lesser(soft, spans[k].v_hard), spans[k].accel, need};
}

/* Whether everything ahead can be met from v at s of piece i. */
static bool meets_all(engine *e, uint64_t i, uint64_t end, double s, double v, double bent) {
    stretch st = stretch_at(e, i, end, s);
    if (st.span->rows) return v * v <= bent_need(st.span, s - st.from, st.soft * st.soft, st.end2) * bent + 1e-12;
    return v * v <= lesser(st.cap * st.cap, lesser(st.end2, st.cap * st.cap) + 2.0 * st.accel * (st.to - s)) * FEASIBLE + 1e-12;
}

bool writer_full(const writer *w) {
    if (w->seconds >= w->budget) return true;
    if (w->out) return w->count + 4 >= w->max;
    return w->e->plan.written - ATOMIC_GET(w->e->geo.consumed) >= PHASE_RING - 4 - PARTS_MAX;
}

/* What is left of a phase from t on begins so. */
static void begin_at(phase *ph, double t) {
    jerk_law law = law_of_phase(ph);
    jerk_begin_at(&law, t);
    ph->s0 = law.s0;
    ph->v0 = law.v0;
    ph->a = law.a0;
    ph->jerk = law.jerk;
    ph->snap = law.snap;
    ph->crackle = law.crackle;
}

/* From `at` (committed motion, s) to the end of the cycle of GEO in which it is driven. */
static double rest_of_cycle(engine *e, double at) {
    double now, dt = e->cfg.cycle_s;
    __atomic_load(&e->geo.consumed_s, &now, __ATOMIC_ACQUIRE);
    double cycles = (at - now) / dt, rest = (floor(cycles) + 1.0 - cycles) * dt;
    return rest < SHORT_PART * dt ? rest + dt : rest;
}

static inline bool cuts_phases(engine *e) { return e->drive.planner || ATOMIC_GET(e->run_running); }

/* Committed motion is written cycle by cycle: what has not begun can be taken back (recall.c). Pumped on one thread without
 * jerk it is cut then and there. */
static void commit_phase(writer *w, const phase *ph) {
    engine *e = w->e;
    if (!cuts_phases(e)) {
        e->phase_ring[e->plan.written++ & (PHASE_RING - 1)] = *ph;
        return;
    }
    bool motion = is_motion(piece_at(e, ph->piece));
    double from = 0.0, to = motion ? rest_of_cycle(e, e->plan.committed_s + w->seconds) : ph->time;
    for (int i = 1;; i++) {
        phase *out = &e->phase_ring[e->plan.written++ & (PHASE_RING - 1)];
        bool end = i >= PARTS_MAX || to >= ph->time - SHORT_PART * e->cfg.cycle_s;
        *out = *ph;
        if (from > 0.0) begin_at(out, from);
        out->time = (end ? ph->time : to) - from;
        out->last = ph->last && end;
        if (end) return;
        from = to;
        to += e->cfg.cycle_s;
    }
}

void write_phase(writer *w, const phase *ph) {
    if (w->out) w->out[w->count++] = *ph;
    else commit_phase(w, ph);
    w->seconds += ph->time;
}

/* Pumped on one thread without jerk phases are not cut: they are written where they stay. */
static inline phase *phase_slot(writer *w) {
    if (w->out) return &w->out[w->count++];
    return &w->e->phase_ring[w->e->plan.written++ & (PHASE_RING - 1)];
}

static void emit(writer *w, double a, double time, bool last) {
    const phase ph = {.piece = w->piece, .s0 = w->s, .v0 = w->v, .a = a, .time = time, .last = last};
    if (w->out || !cuts_phases(w->e)) {
        *phase_slot(w) = ph;
        w->seconds += time;
    } else write_phase(w, &ph);
}

/* Constant acceleration until speed v1 or distance d (whichever the caller computed to coincide); cut at the budget. */
static void run(writer *w, double a, double time, double s1, double v1, bool last) {
    double room = w->budget - w->seconds;
    if (time <= room + SAME_TIME) { /* the end of a piece is not cut off by rounding */
        emit(w, a, time, last);
        w->s = s1;
        w->v = v1;
        return;
    }
    emit(w, a, room, false);
    w->s += w->v * room + 0.5 * a * room * room;
    w->v = greater(0.0, w->v + a * room);
    if (!w->out) w->e->plan.rest = (run_left){w->piece, w->e->plan.passes, w->s, w->v, a, time - room, s1, v1, last};
}

static void brake_to(writer *w, const stretch *st, double v1, bool ends) {
    double d = (w->v * w->v - v1 * v1) / (2.0 * st->accel), room = st->to - w->s;
    if (d < room - TINY_MM) {
        run(w, -st->accel, (w->v - v1) / st->accel, w->s + d, v1, false);
        return;
    }
    double end = sqrt(greater(0.0, w->v * w->v - 2.0 * st->accel * room));
    if (end + w->v > 0) run(w, -st->accel, 2.0 * room / (end + w->v), st->to, end, ends);
}

/* Constant acceleration to the end of the stretch, where the speed is v1. */
static void run_out(writer *w, const stretch *st, double v1, bool ends) {
    double room = st->to - w->s, sum = w->v + v1;
    if (sum > 1e-9) {
        double time = 2.0 * room / sum;
        run(w, (v1 - w->v) / time, time, st->to, v1, ends);
        return;
    }
    emit(w, 0.0, 0.0, ends); /* what is left is rounding */
    w->s = st->to;
    w->v = 0.0;
}

/* Brake towards end2. A speed above what still meets it comes from a reduced feed or override: brake with all that is
 * allowed (the machine's own limits are still met, the speed was legal before); rounding is taken up by the last stretch. */
static void brake(writer *w, const stretch *st, double end2, bool ends) {
    double room = st->to - w->s, meets = end2 + 2.0 * st->accel * room;
    if (w->v * w->v <= meets * FEASIBLE + 1e-9) run_out(w, st, sqrt(end2), ends);
    else brake_to(w, st, 0.0, ends);
}

/* One step over a curved stretch with constant acceleration along the path, cut at the budget. */
static void drive_bent(writer *w, const stretch *st, bool ends, bool brake) {
    double at = w->s - st->from, room = st->to - w->s;
    const bent_left *left = &w->left;
    uint64_t made = piece_at(w->e, w->piece)->spans_made;
    bool goes_on = !brake && left->to > w->s && left->piece == w->piece && left->made == made && left->s == w->s && left->v == w->v && left->soft == st->soft && left->end2 == st->end2;
    bent_step step = goes_on ? (bent_step){.h = left->to - w->s, .x1 = left->x1} : bent_forward(st->span, at, w->v * w->v, st->soft * st->soft, st->end2, brake);
    double to = w->s + step.h;
    bool whole = step.h >= room - TINY_MM;
    double v1 = sqrt(step.x1), time = 2.0 * (whole ? room : step.h) / greater(w->v + v1, 1e-30);
    if (whole && w->v + v1 <= 1e-9) { /* what is left is rounding */
        emit(w, 0.0, 0.0, ends);
        w->s = st->to;
        w->v = 0.0;
        return;
    }
    run(w, (v1 - w->v) / time, time, whole ? st->to : to, v1, whole && ends);
    w->left = (bent_left){w->piece, made, w->s, w->v, to, step.x1, st->soft, st->end2}; /* of use if the budget has cut it */
}

/* One step over the stretch: accelerate, cruise or brake, each cut at the budget. */
static void drive_stretch(writer *w, const stretch *st, bool ends) {
    if (st->span->rows) {
        drive_bent(w, st, ends, false);
        return;
    }
    double room = st->to - w->s, v = w->v, a = st->accel, end2 = lesser(st->end2, st->cap * st->cap);
    if (v * v >= end2 + 2.0 * a * room) {
        brake(w, st, end2, ends);
        return;
    }
    if (v > st->cap * (1.0 + 1e-12) + 1e-12) {
        brake_to(w, st, st->cap, ends);
        return;
    }
    double out2 = lesser(end2, v * v + 2.0 * a * room), peak2 = 0.5 * (2.0 * a * room + v * v + out2);
    double peak = lesser(st->cap, sqrt(peak2)), out = sqrt(out2);
    double up = (peak * peak - v * v) / (2.0 * a), down = (peak * peak - out2) / (2.0 * a);
    double flat = room - up - down;
    if (up > TINY_MM) {
        bool whole = flat <= TINY_MM && down <= TINY_MM;
        run(w, a, (peak - v) / a, whole ? st->to : w->s + up, peak, whole && ends);
    } else if (flat > TINY_MM) {
        w->v = peak > 0 ? peak : v;
        run(w, 0.0, flat / w->v, down <= TINY_MM ? st->to : w->s + flat, w->v, down <= TINY_MM && ends);
    } else {
        run_out(w, st, out, ends);
    }
}

void pass_event(writer *w) {
    const piece *p = piece_at(w->e, w->piece);
    double time = p->type == NC_DWELL ? p->value : 0.0;
    emit(w, 0.0, time, true);
    w->piece++;
    w->s = 0.0;
}

/* A standstill or a corner passed too fast: where it is committed it is counted, and a test holds that at 0. What is more than rounding
 * is not committed: a path that is fed anew (an inserted stop, a loop that ends) may have other stretches than the plan has met. */
static void leave_motion(writer *w, uint64_t end) {
    engine *e = w->e;
    const piece *p = piece_at(e, w->piece);
    double limit = p->stop_after || w->piece + 1 >= end ? 0.0 : NEVER;
    if (limit > 0.0) {
        const piece *next = piece_at(e, w->piece + 1);
        limit = stands_before(e, next) ? 0.0 : is_motion(next) ? next->corner_v : NEVER;
    }
    w->too_fast += w->v > limit * (1.0 + 1e-6) + 1e-4;
    if (w->v > limit * REFUSED_FROM + REFUSED_MM_S) w->refused = true;
    if (limit <= 0.0 && w->v <= REFUSED_MM_S) w->v = 0.0; /* rounding; who waits for a standstill would wait for ever */
    w->piece++;
    w->s = 0.0;
}

/* The feed is kept over the rest of the piece. */
static bool cruise(writer *w, const piece *p, uint64_t end) {
    double soft = soft_cap(w->e, p), room = p->length - w->s;
    bool keeps = p->cruises && soft > 0.0 && fabs(w->v - soft) <= SAME_SPEED * soft && need_behind(w->e, w->piece, end) >= soft * soft;
    if (!keeps || room <= 0.0) return false;
    run(w, 0.0, room / w->v, p->length, w->v, true);
    return true;
}

/* The phase that the end of the last commit has cut. */
static void run_on(writer *w, uint64_t end) {
    const run_left rest = w->e->plan.rest;
    bool fits = rest.pass == w->e->plan.passes && rest.piece == w->piece && rest.s == w->s && rest.v == w->v && rest.v > 0.0 && !writer_full(w);
    if (!fits) return;
    run(w, rest.a, rest.time, rest.s1, rest.v1, rest.last);
    if (w->s >= piece_at(w->e, w->piece)->length) leave_motion(w, end);
}

/* From here on more of the path would let it drive faster, and enough is committed until then. */
static bool waits_for_path(const writer *w) { return !w->out && w->seconds >= w->least && w->piece >= w->e->plan.fixed_to; }

/* Forward until the budget is used up, the window ends or the path stands (hold, override 0). */
void drive_window(writer *w, uint64_t end) {
    engine *e = w->e;
    while (w->piece < end && !writer_full(w) && !waits_for_path(w)) {
        const piece *p = piece_at(e, w->piece);
        if (!is_motion(p)) {
            pass_event(w);
            continue;
        }
        if (!cruise(w, p, end)) {
            stretch st = stretch_at(e, w->piece, end, w->s);
            if (w->v < GEO_STANDS && st.soft <= 0.0) {
                w->v = 0.0;
                return;
            }
            drive_stretch(w, &st, st.to >= p->length);
        }
        if (w->s >= p->length) leave_motion(w, end);
    }
}

/* Stopping tail: brake to rest from the end of the commit. False if that is not legal. */
static bool write_tail(engine *e, tail *t, const writer *from, uint64_t end) {
    writer w = {.e = e, .out = t->phases, .max = e->plan.tail_max, .piece = from->piece, .s = from->s, .v = from->v, .budget = NEVER};
    while (w.v > 0.0 && w.piece < end && !writer_full(&w)) {
        if (!is_motion(piece_at(e, w.piece))) {
            pass_event(&w);
            continue;
        }
        stretch st = stretch_at(e, w.piece, end, w.s);
        bool ends = st.to >= piece_at(e, w.piece)->length;
        if (st.span->rows) drive_bent(&w, &st, ends, true);
        else brake_to(&w, &st, 0.0, ends);
        if (w.s >= piece_at(e, w.piece)->length) leave_motion(&w, end);
    }
    t->first = 0;
    t->count = w.count;
    t->piece = w.piece;
    t->s = w.s;
    return !w.refused;
}

/* What GEO follows if nothing more is committed. GEO on the same thread cannot outrun the planner: there it is written when
 * somebody asks for it, or when too little is committed for one more cycle. */
void planner_store_tail(engine *e) {
    if (!e->plan.tail_due) return;
    e->plan.tail_due = false;
    const writer from = {.e = e, .piece = e->plan.piece, .s = e->plan.s, .v = e->plan.v};
    write_tail(e, &e->plan.tails[(ATOMIC_GET(e->commit) >> 1) & 1], &from, e->plan.tail_end);
}

/* The tail was driven: go on from where it ended. */
static bool resume_after_tail(engine *e) {
    uint64_t word = ATOMIC_GET(e->commit);
    if (!(word & 1)) return true;
    if (!ATOMIC_GET(e->tail_done)) return false;
    const tail *t = &e->plan.tails[(word >> 1) & 1];
    double driven = 0.0;
    for (uint32_t i = t->first; i < t->count; i++) driven += t->phases[i].time;
    e->plan.piece = t->piece;
    e->plan.s = t->s;
    e->plan.v = 0.0;
    e->plan.committed_s += driven;
    e->plan.written = word >> 2;
    tail *other = &e->plan.tails[((word >> 1) & 1) ^ 1];
    other->first = other->count = 0;
    other->edition = 0;
    e->drive.restart = true;
    e->rejoin.over = false;
    e->plan.late = false;
    e->tail_done = 0;
    ATOMIC_SET(e->commit, word ^ 3u);
    return true;
}

static bool state_feasible(engine *e, uint64_t end, double bent) {
    if (e->plan.v <= 0.0) return true;
    if (e->plan.piece >= end) return false;
    return !is_motion(piece_at(e, e->plan.piece)) || meets_all(e, e->plan.piece, end, e->plan.s, e->plan.v, bent);
}

/* What the corner limits depend on besides the path: the override that zones are sized for, and which gates are open. */
typedef struct conditions {
    double reserve_override;
    techno_counts done, done_again;
    bool single, m01;
    uint32_t held_axes;
} conditions;

static uint64_t plan_under(engine *e, const conditions *c) {
    e->plan.reserve_override = c->reserve_override;
    e->plan.done = c->done;
    e->plan.done_again = c->done_again;
    e->plan.single = c->single;
    e->plan.m01 = c->m01;
    e->plan.held_axes = c->held_axes;
    e->plan.capped = e->plan.piece;
    corner_caps(e);
    uint64_t end = window_end(e);
    backward_pass(e, end);
    return end;
}

static double reserve_wanted(const engine *e) { return e->plan.ext_speed < NEVER ? NEVER : e->plan.override > 1.0 ? 2.0 : 1.0; }

static bool same_counts(const techno_counts *now, const techno_counts *then) {
    return ATOMIC_GET(now->std_freed) == then->std_freed && ATOMIC_GET(now->std_acked) == then->std_acked &&
           ATOMIC_GET(now->late_freed) == then->late_freed && ATOMIC_GET(now->slm_acked) == then->slm_acked &&
           ATOMIC_GET(now->slp_acked) == then->slp_acked;
}

/* The last plan was made under the present conditions. */
static bool conditions_hold(engine *e) {
    const planner *p = &e->plan;
    return reserve_wanted(e) == p->reserve_override && ATOMIC_GET(e->single_now) == p->single && ATOMIC_GET(e->m01_now) == p->m01 &&
           ATOMIC_GET(e->held_axes) == p->held_axes && same_counts(&e->done, &p->done) && same_counts(&e->done_again, &p->done_again);
}

static conditions conditions_now(const engine *e) {
    const planner *p = &e->plan;
    return (conditions){p->reserve_override, p->done, p->done_again, p->single, p->m01, p->held_axes};
}

static conditions conditions_wanted(engine *e) {
    return (conditions){reserve_wanted(e), techno_done(&e->done), techno_done(&e->done_again), ATOMIC_GET(e->single_now), ATOMIC_GET(e->m01_now),
                        ATOMIC_GET(e->held_axes)};
}

/* New conditions are taken over where the present state can be continued legally under them: a larger override, a speed that
 * the PLC commands (any speed may come) and an opened gate all make zones, where less acceleration is left. Until then the old
 * ones hold. Returns the window's end. */
static uint64_t choose_conditions(engine *e) {
    if (conditions_hold(e)) {
        corner_caps(e);
        uint64_t end = window_end(e);
        backward_pass(e, end);
        return end;
    }
    conditions old = conditions_now(e), want = conditions_wanted(e);
    uint64_t end = plan_under(e, &want);
    if (state_feasible(e, end, want.reserve_override == old.reserve_override ? FEASIBLE_BENT : FEASIBLE)) return end; /* else cut anew */
    if (want.reserve_override > old.reserve_override) e->plan.override = lesser(e->plan.override, old.reserve_override);
    want.reserve_override = old.reserve_override;
    end = plan_under(e, &want);
    return state_feasible(e, end, FEASIBLE_BENT) ? end : plan_under(e, &old);
}

/* The window's end; where corner limits need more of the path than is fed, more is fed. */
static uint64_t choose_window(engine *e) {
    watch_window(e);
    uint64_t end = choose_conditions(e);
    bool wants = (e->plan.window_motions <= e->cfg.window ? e->plan.capped < e->piece_head : e->plan.unsettled < end) && !e->feed.final;
    return wants && feed_further(e) ? choose_conditions(e) : end;
}

double ahead_s(engine *e) {
    double consumed;
    __atomic_load(&e->geo.consumed_s, &consumed, __ATOMIC_ACQUIRE);
    return e->plan.committed_s - consumed;
}

/* So much motion is ahead of GEO behind a commit; never less than the cycle that comes next, or GEO would live on the tails. */
double commit_high(const engine *e) { return greater(COMMIT_HIGH_S, COMMIT_HIGH_CYCLES * e->cfg.cycle_s); }

/* Less motion ahead than this: more is committed. Without jerk a planner that is pumped with every cycle needs no time of its
 * own; fewer and longer commits spare it stopping tails. */
double commit_low(const engine *e) {
    double least = COMMIT_LOW_CYCLES * e->cfg.cycle_s;
    if (e->drive.planner || ATOMIC_GET(e->run_running)) return greater(COMMIT_LOW_S, least);
    return greater(lesser(COMMIT_LOW_S, PUMPED_CYCLES * e->cfg.cycle_s), least);
}

/* Where nothing has changed, the last window does as long as the path does not come to where it would be faster with a
 * later end: the same motion is found without looking at every window between. */
static bool drive_last_window(engine *e, writer *w) {
    uint64_t driven = e->plan.piece - e->plan.passed_at; /* the window is moved on in parts that take little time each */
    if (e->foresight || driven * MOVES > e->cfg.window || e->plan.piece >= e->plan.fixed_to || !needs_hold(e) || !conditions_hold(e)) return false;
    uint64_t written = e->plan.written;
    run_on(w, e->plan.need_end);
    drive_window(w, e->plan.need_end);
    if (!w->refused && (w->piece < e->plan.fixed_to || (w->piece == e->plan.fixed_to && w->s <= 0.0))) return true;
    e->plan.written = written;
    return false;
}

/* A commit from where committed motion ends. What is of tails and of planning with jerk is not looked at. */
static void begin_commit(engine *e, writer *w, double ahead) {
    w->e = e;
    w->out = NULL;
    w->count = w->max = 0;
    w->piece = e->plan.piece;
    w->s = e->plan.s;
    w->v = e->plan.v;
    w->seconds = w->motion = 0.0;
    w->budget = commit_high(e) - ahead;
    w->least = commit_low(e) + LEAST_CYCLES * e->cfg.cycle_s - ahead;
    w->too_fast = 0;
    w->refused = false;
    w->left = e->plan.left;
}

static void commit(engine *e) {
    writer w;
    double ahead = ahead_s(e);
    uint64_t word = ATOMIC_GET(e->commit), before = e->plan.written;
    uint32_t next = ((word >> 1) & 1) ^ 1;
    uint64_t end = e->plan.need_end;
    begin_commit(e, &w, ahead);
    if (!drive_last_window(e, &w)) {
        end = choose_window(e);
        begin_commit(e, &w, ahead); /* its stretch may be cut anew now */
        drive_window(&w, end);
    }
    bool due = !ATOMIC_GET(e->run_running) && !e->plan.fed_anew;
    bool legal = !w.refused && (due || write_tail(e, &e->plan.tails[next], &w, end));
    e->plan.fed_anew = false;
    if (!legal && e->plan.v > GEO_MOVES) { /* the stored tail is: GEO takes it, and the path goes on from there */
        e->plan.written = before;
        e->plan.late = true;
        return;
    }
    if ((word & 1) || !__atomic_compare_exchange_n(&e->commit, &word, e->plan.written << 2 | next << 1, false, __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE)) {
        e->plan.written = before;
        return;
    }
    e->plan.infeasible += w.too_fast;
    e->plan.phases += e->plan.written - before;
    e->plan.piece = w.piece;
    e->plan.s = w.s;
    e->plan.v = w.v;
    e->plan.left = w.left;
    e->plan.tail_due = due;
    e->plan.tail_end = end;
    e->plan.committed_s += w.seconds;
}

/* Motion from a place of the tail on, where the planner is (rejoin.c), and the tail behind it. False: what lies ahead cannot be met from there. */
bool profile_write(engine *e, writer *w, tail *t) {
    uint64_t end = choose_window(e);
    if (!state_feasible(e, end, FEASIBLE_BENT)) return false;
    w->least = lesser(w->budget, commit_low(e) + LEAST_CYCLES * e->cfg.cycle_s);
    drive_window(w, end);
    if (w->refused || !write_tail(e, t, w, end)) return false;
    e->plan.fed_anew = e->plan.tail_due = false;
    e->plan.infeasible += w->too_fast;
    return true;
}

/* The path stands where GEO says; what was committed behind that place is taken back. */
static bool withdraw(engine *e) {
    if (ATOMIC_GET(e->withdraw) == WITHDRAW_NONE) ATOMIC_SET(e->withdraw, WITHDRAW_ASKED);
    if (ATOMIC_GET(e->withdraw) != WITHDRAW_DONE) return false;
    bool before = e->stand_piece < e->feed.run; /* nothing of the present run has been driven yet */
    e->plan.piece = before ? e->feed.run : e->stand_piece;
    e->plan.s = before ? 0.0 : e->stand_s;
    e->plan.v = 0.0;
    e->plan.late = false;
    e->plan.written = ATOMIC_GET(e->commit) >> 2;
    __atomic_load(&e->geo.consumed_s, &e->plan.committed_s, __ATOMIC_ACQUIRE);
    e->drive.restart = true;
    return true;
}

/* Jobs of the feeder need standstill: brake, take back what is committed, do them. False while they are pending and
 * nothing may be committed. */
static bool jobs_allow(engine *e) {
    if (ATOMIC_GET(e->withdraw) == WITHDRAW_NONE && !feed_job_pending(e)) return true;
    /* while GEO waits nothing more is driven, so nothing more would be committed: it stands already */
    bool waits = ATOMIC_GET(e->waits_now);
    if (e->plan.v > 0.0 && !waits && ATOMIC_GET(e->withdraw) == WITHDRAW_NONE) return true; /* the hold brakes */
    if (!withdraw(e)) return false;
    feed_do_jobs(e);
    ATOMIC_SET(e->withdraw, WITHDRAW_NONE); /* not before: until then the program does not end */
    return true;
}

static bool wants_hold(engine *e) {
    double override;
    __atomic_load(&e->override_now, &override, __ATOMIC_ACQUIRE);
    return ATOMIC_GET(e->hold_now) || override <= 0.0 || feed_job_pending(e);
}

/* The planner's work, timed: feed, plan, commit. `hold`: the path is to come to rest. */
static __attribute__((noinline)) bool commit_more(engine *e, bool rejoins, bool hold) {
    if (!rejoins) feed(e);
    if (e->plan.piece >= e->piece_head) return false;
    __atomic_load(&e->override_now, &e->plan.override, __ATOMIC_ACQUIRE);
    __atomic_load(&e->ext_speed, &e->plan.ext_speed, __ATOMIC_ACQUIRE);
    __atomic_load(&e->rapid_now, &e->plan.rapid, __ATOMIC_ACQUIRE);
    e->plan.hold = hold;
    if (rejoins) rejoin_offer(e);
    else if (e->drive.planner) drive_commit(e);
    else commit(e);
    return true;
}

static int pump(engine *e) {
    if (ATOMIC_GET(e->plan.stalled) || ATOMIC_GET(e->hold_start) || !rejoin_settled(e)) return 0;
    bool rejoins = rejoin_possible(e);
    if (!rejoins && (!resume_after_tail(e) || !jobs_allow(e))) return 0;
    bool hold = wants_hold(e);
    if (!rejoins) {
        if (hold && !e->plan.hold) recall_commit(e);
        if (e->plan.late || ahead_s(e) >= commit_low(e)) return 0;
    }
    uint64_t before = e->plan.written;
    watch_start(e);
    if (!commit_more(e, rejoins, hold)) return 0;
    watch_stop(e);
    return e->plan.written != before;
}

/* Commit more motion if too little is ahead; returns 1 if phases were added. */
int planner_pump(engine *e) {
    int added = pump(e);
    if (e->plan.tail_due && ahead_s(e) < LAST_CYCLES * e->cfg.cycle_s) planner_store_tail(e);
    return added;
}
