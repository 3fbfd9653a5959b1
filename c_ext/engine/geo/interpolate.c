/* GEO: evaluates committed phases once a cycle. It never plans, never allocates, never locks. */
#include <math.h>
#include "engine/state/state.h"

/* Path and displayed distance at s of a motion. */
static void place_on_path(geo *g, const piece *p, double s) {
    g->path = g->path_shift + p->path0 + p->path_rate * s;
    g->dist = p->dist0 + p->dist_rate * s;
}

/* Speed along the path, mm/s; of a polynomial that runs with its parameter not the speed of that. */
double geo_path_speed(const engine *e) {
    const geo *g = &e->geo;
    if (g->v <= 0.0 || g->piece == UINT64_MAX) return g->v;
    const piece *p = piece_at((engine *)e, g->piece);
    if (!is_motion(p) || !(p->flags & NC_BY_PARAMETER)) return g->v;
    if (p->flags & NC_OF_TIP) return g->v * fabs(p->path_rate);
    return g->v * curve_piece_main_rate(e, p, g->s);
}

static void enter_piece(engine *e, uint64_t i) {
    geo *g = &e->geo;
    const piece *p = piece_at(e, i);
    g->piece = i;
    g->n = p->n;
    g->count = p->count;
    g->s = 0.0;
    g->dwelling = p->type == NC_DWELL;
    if (!is_motion(p)) return;
    g->rapid = p->feed <= 0.0;
    g->feed = p->flags & NC_BY_PARAMETER ? p->feed * fabs(p->path_rate) : p->feed;
    place_on_path(g, p, 0.0);
    if (p->mapped) map_position(e, p);
    else ATOMIC_SET(g->active, p->element);
}

/* Distances change their meaning here; `marks` lets the look-ahead service see either the old or the new one. */
static void set_epoch(geo *g, uint32_t epoch, uint64_t first, double dist_shift) {
    ATOMIC_SET(g->marks, g->marks + 1);
    __atomic_thread_fence(__ATOMIC_SEQ_CST);
    ATOMIC_SET(g->epoch, epoch);
    ATOMIC_SET(g->epoch_first, first);
    __atomic_store(&g->dist_shift, &dist_shift, __ATOMIC_RELEASE);
    ATOMIC_SET(g->marks, g->marks + 1);
}

/* The end of a real-time loop (going back: its beginning). */
static void run_branch(engine *e, const piece *p) {
    geo *g = &e->geo;
    if (!p->again) {
        if (p->dir > 0) set_epoch(g, g->epoch + 1, g->epoch_first, g->dist_shift);
        else set_epoch(g, g->epoch, g->saved_first, g->dist_shift);
        return;
    }
    double turn = p->dir * p->value;
    uint64_t begin = p->dir > 0 ? store_at(e, p->mate)->element : p->element;
    g->loop_count++;
    g->path_shift += turn;
    g->dist -= turn; /* the place is the same, now counted from the other end of the loop */
    set_epoch(g, g->epoch, begin, p->flags & NC_MODULO ? g->dist_shift : g->dist_shift + turn);
}

static void run_loop_end(engine *e, const piece *p) {
    geo *g = &e->geo;
    if (p->type == (p->dir > 0 ? NC_RT_LOOP_END : NC_RT_LOOP_BEGIN)) run_branch(e, p);
    else if (p->dir < 0) set_epoch(g, g->epoch - 1, store_at(e, p->mate)->element, g->dist_shift);
    else g->saved_first = g->epoch_first, g->loop_count = 0;
}

/* A program begins: its first element begins the distance. */
void geo_begin_distance(engine *e) { set_epoch(&e->geo, e->push_epoch, e->element_head, 0.0); }

static void run_reset(geo *g, const piece *p) {
    g->dist = 0.0;
    if (p->dir > 0) set_epoch(g, g->epoch + 1, p->element, 0.0);
    else set_epoch(g, g->epoch - 1, p->mate, 0.0);
}

/* The cell takes commands out of a small ring; what it cannot hold is counted. */
static void tell_command(engine *e, const piece *p) {
    uint64_t head = e->command_head;
    external_command(e, p->value);
    if (head - ATOMIC_GET(e->command_tail) >= COMMANDS_MAX) {
        e->commands_lost++;
        return;
    }
    engine_command *c = &e->commands[head % COMMANDS_MAX];
    c->value = p->value;
    c->cycle = e->geo.cycle;
    c->line = p->line;
    memcpy(c->position, e->geo.position, sizeof c->position);
    ATOMIC_SET(e->command_head, head + 1);
}

static void run_event(engine *e, piece *p) {
    geo *g = &e->geo;
    if (p->inserted && p->type == NC_M) ATOMIC_SET(e->stops_done, e->stops_done + 1);
    if (p->flags & NC_OUTPUT) techno_output(e, p->replay ? p : store_at(e, p->origin));
    switch (p->type) {
    case NC_DISTANCE_RESET:
        run_reset(g, p);
        break;
    case NC_EVENT:
        if (p->code == NC_EVENT_COMMAND && p->dir > 0) tell_command(e, p);
        if (p->code == NC_EVENT_OVERRIDE) ATOMIC_SET(e->override_ignored, p->value == 0.0);
        if (p->code == NC_EVENT_STORAGE_CLEAR && p->dir > 0) ATOMIC_SET(e->store_first, p->origin + 1);
        if (p->dir > 0) foresight_time(e, p->code - NC_EVENT_ESA_TIME, p->value);
        break;
    case NC_RT_LOOP_BEGIN: case NC_RT_LOOP_END:
        run_loop_end(e, p);
        break;
    case NC_T:
        g->tool = p->code;
        break;
    case NC_M:
        if (!e->segment) break; /* nobody there who could continue */
        if (p->code == 0 || (p->code == 1 && e->m01_now && g->v <= 0.0)) g->waiting_continue = true;
        break;
    default:
        break;
    }
}

static void leave_piece(engine *e) {
    geo *g = &e->geo;
    piece *p = piece_at(e, g->piece);
    if (is_motion(p)) {
        place_on_path(g, p, p->length);
        memcpy(g->position, p->end, sizeof g->position);
        g->s = p->length;
        if (p->mapped) map_position(e, p);
    } else {
        run_event(e, p);
    }
    g->dwelling = false;
    ATOMIC_SET(e->piece_done, g->piece + 1);
    if (p->dir > 0 && !p->inserted && p->from + p->length >= p->whole - 1e-9 && p->origin >= e->store_done) ATOMIC_SET(e->store_done, p->origin + 1);
}

static bool fetch_phase(engine *e);

/* The present phase is driven for t seconds only; its piece goes on. */
static void end_phase_at(geo *g, double t) {
    g->now.time = t;
    g->now.last = false;
}

/* The tail was taken: its next phase, or, once it is used up, standstill until the planner has taken note. */
static bool fetch_from_tail(engine *e) {
    geo *g = &e->geo;
    if (!g->in_tail) return false;
    if (g->leaves && g->tail_next > e->rejoin.phase) {
        g->in_tail = g->leaves = false;
        ATOMIC_SET(e->rejoin.state, REJOIN_NONE); /* from here on the buffer is the planner's again */
        return fetch_phase(e);
    }
    const tail *t = &e->plan.tails[g->tail_index];
    if (g->tail_next < t->count) {
        g->now = t->phases[g->tail_next++];
        if (g->leaves && g->tail_next > e->rejoin.phase) end_phase_at(g, e->rejoin.t);
        return true;
    }
    g->in_tail = false; /* from here on the buffer is the planner's again */
    g->v = 0.0;
    ATOMIC_SET(e->tail_done, 1);
    return false;
}

/* The next phase: committed motion, or the stored tail when the planner is late. */
static bool fetch_phase(engine *e) {
    geo *g = &e->geo;
    uint64_t word = ATOMIC_GET(e->commit);
    if (g->in_tail || (word & 1)) return fetch_from_tail(e);
    if (g->consumed < word >> 2) {
        g->now = e->phase_ring[g->consumed & (PHASE_RING - 1)];
        ATOMIC_SET(g->consumed, g->consumed + 1);
        return true;
    }
    uint32_t index = (word >> 1) & 1;
    if (g->v <= 0.0 && g->consumed == word >> 2) return false;
    if (!__atomic_compare_exchange_n(&e->commit, &word, word | 1, false, __ATOMIC_ACQ_REL, __ATOMIC_ACQUIRE)) return fetch_phase(e);
    uint64_t beyond = g->consumed - (word >> 2); /* taken back too late: the tail begins with phases that are driven already */
    g->in_tail = true;
    g->tail_index = index;
    g->tail_next = e->plan.tails[index].first + (uint32_t)beyond;
    ATOMIC_SET(g->consumed, word >> 2);
    return fetch_phase(e);
}

static bool begin_phase(engine *e) {
    geo *g = &e->geo;
    if (!fetch_phase(e)) return false;
    g->has_phase = true;
    g->t = 0.0;
    if (g->now.piece != g->piece || g->piece == UINT64_MAX) {
        bool stood = g->v <= 0.0;
        enter_piece(e, g->now.piece);
        const piece *p = piece_at(e, g->piece);
        if (stood && is_motion(p) && p->new_block && e->single_now) g->waiting_continue = g->stands_single = true;
    }
    return true;
}

/* The planner may cut the piece behind what is committed. */
static double phase_position(const phase *ph, const piece *p, double t, double *v) {
    double s = ph->s0 + (ph->v0 + 0.5 * ph->a * t) * t;
    *v = ph->v0 + ph->a * t;
    if (ph->jerk != 0.0 || ph->snap != 0.0) {
        const jerk_law law = law_of_phase(ph);
        jerk_state at;
        jerk_at(&law, t, &at);
        s = at.s;
        *v = at.v;
    }
    return fmin(load_f64_relaxed(&p->length), s);
}

static void end_phase(engine *e) {
    geo *g = &e->geo;
    g->has_phase = false;
    g->s = phase_position(&g->now, piece_at(e, g->piece), g->now.time, &g->v);
    if (g->v < GEO_STANDS) g->v = 0.0;
    if (g->now.last) leave_piece(e);
}

static void add_consumed(geo *g, double t) {
    double sum = g->consumed_s + t;
    __atomic_store(&g->consumed_s, &sum, __ATOMIC_RELEASE);
}

/* Consume dt of committed motion. */
static void advance(engine *e, double dt) {
    geo *g = &e->geo;
    g->waiting_techno = false;
    while (dt > 0.0 && !g->waiting_continue) {
        if (!g->has_phase && !begin_phase(e)) return;
        if (g->waiting_continue) return;
        const piece *p = piece_at(e, g->piece);
        if (!is_motion(p) && techno_blocked(e, p)) {
            g->waiting_techno = true;
            e->techno_wait_cycles++;
            return;
        }
        if (is_motion(p) && g->v <= 0.0 && g->t <= 0.0 && (p->moving & e->held_axes)) return; /* a held axis would begin to move */
        double rest = g->now.time - g->t;
        if (rest > dt) {
            g->t += dt;
            add_consumed(g, dt);
            return;
        }
        dt -= rest;
        add_consumed(g, rest);
        end_phase(e);
    }
}

static void evaluate(engine *e) {
    geo *g = &e->geo;
    if (g->piece == UINT64_MAX || e->piece_done > g->piece) return; /* stands at the end of what is done */
    if (ATOMIC_GET(e->withdraw) == WITHDRAW_DONE) return; /* stands; the planner looks at the position */
    const piece *p = piece_at(e, g->piece);
    if (g->has_phase) {
        double s = phase_position(&g->now, p, g->t, &g->v);
        if (is_motion(p)) g->s = s;
    }
    if (!is_motion(p)) return;
    place_on_path(g, p, g->s);
    if (p->mapped) map_position(e, p);
    piece_position(e, p, g->s, g->position);
}

static void record(engine *e) {
    if (!e->record) return;
    if (e->record_head - ATOMIC_GET(e->record_tail) >= e->record_rows) {
        e->record_lost++;
        return;
    }
    int n = e->cfg.axis_count;
    double *row = e->record + (e->record_head % e->record_rows) * (n + 4);
    row[0] = (double)e->geo.cycle;
    memcpy(row + 1, e->geo.position, sizeof(double) * (size_t)n);
    row[n + 1] = e->geo.path;
    row[n + 2] = geo_path_speed(e);
    row[n + 3] = (double)e->geo.active;
    ATOMIC_SET(e->record_head, e->record_head + 1);
}

/* Everything pushed up to now has been executed and the axes stand. */
bool geo_drained(engine *e) {
    return ATOMIC_GET(e->store_done) >= ATOMIC_GET(e->store_head) && !e->geo.has_phase && !e->geo.waiting_continue;
}

static void note_end(engine *e) {
    if (e->program_end || !ATOMIC_GET(e->finished) || !geo_drained(e) || e->feed.dir < 0 || ATOMIC_GET(e->withdraw) != WITHDRAW_NONE) return;
    e->geo.v = 0.0;
    ATOMIC_SET(e->program_active, 0);
    ATOMIC_SET(e->program_end, 1);
}

/* It stands at an M00 or M01: that one is not over, whatever turns the path around meanwhile. */
static bool at_program_stop(engine *e) {
    const piece *p = piece_at(e, e->geo.piece);
    return e->geo.waiting_continue && !e->geo.stands_single && !p->inserted && !(p->flags & NC_OUTPUT);
}

/* The planner wants phases back: at standstill it gets all that are not begun. */
static void answer_withdrawal(engine *e) {
    geo *g = &e->geo;
    uint64_t word = ATOMIC_GET(e->commit);
    if (ATOMIC_GET(e->withdraw) != WITHDRAW_ASKED || (word & 1) || g->v > 0.0) return;
    if (g->has_phase && is_motion(piece_at(e, g->piece)) && g->t > 0.0) return;
    bool inside = g->piece != UINT64_MAX && (ATOMIC_GET(e->piece_done) <= g->piece || at_program_stop(e));
    e->stand_piece = inside ? g->piece : ATOMIC_GET(e->piece_done);
    e->stand_s = inside && is_motion(piece_at(e, g->piece)) ? g->s : 0.0;
    g->has_phase = g->waiting_continue = g->stands_single = g->waiting_techno = g->dwelling = false;
    ATOMIC_SET(g->consumed, word >> 2);
    ATOMIC_SET(e->withdraw, WITHDRAW_DONE);
}

/* The planner offers to go on from a place on the tail: taken if that is still ahead. */
static void answer_rejoin(engine *e) {
    geo *g = &e->geo;
    rejoin *r = &e->rejoin;
    if (ATOMIC_GET(r->state) != REJOIN_OFFERED) return;
    bool inside = g->tail_next == r->phase + 1 && g->has_phase;
    if (!g->in_tail || !(g->tail_next <= r->phase || (inside && g->t < r->t))) {
        ATOMIC_SET(r->state, REJOIN_REFUSED);
        return;
    }
    g->leaves = true;
    if (inside) end_phase_at(g, r->t);
    ATOMIC_SET(e->commit, r->word);
    ATOMIC_SET(r->state, REJOIN_TAKEN);
}

void geo_cycle(engine *e) {
    if (e->segment) take_commands(e);
    external_cycle(e);
    techno_cycle(e);
    answer_withdrawal(e);
    answer_rejoin(e);
    if (!ATOMIC_GET(e->hold_start)) advance(e, e->cfg.cycle_s);
    ATOMIC_SET(e->waits_now, e->geo.waiting_continue || e->geo.waiting_techno);
    evaluate(e);
    ATOMIC_SET(e->geo.cycle, e->geo.cycle + 1);
    note_end(e);
    record(e);
    if (!e->segment) return;
    publish(e);
    if (e->cfg.service == HLI_SERVICE_CYCLIC) serve_request(e);
}

/* Just ahead of a real-time cycle, no time passes: the position and what the PLC is shown of it once more. */
void geo_rehearse(engine *e) {
    evaluate(e);
    if (e->segment) publish_again(e);
}

void engine_rehearse(engine *e) { geo_rehearse(e); }
