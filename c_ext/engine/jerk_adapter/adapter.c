/* The jerk-limited planner behind the engine: pieces of the run ring become
 * intervals of its path, its time laws become phases, what is left of its plan
 * becomes the stopping tail.
 *
 * Where the axes must stand is a flag of the interval ahead of that place, so
 * it can come and go while the path ahead is known: gates that open, single
 * block, held axes. A stand that comes too late to be met is not set, as in
 * profile.c.
 */
#include <math.h>
#include <stdlib.h>
#include "engine/state/state.h"

#define TURN_STEP 0.1 /* rad of turn over an interval */
#define CURVE_MISS                                                             \
    0.001 /* of the third derivative: beyond it an interval of a curve is      \
             halved, ... */
#define CURVE_HALVINGS 3    /* ... so often, but none shorter than ... */
#define CURVE_SHORTEST 2e-3 /* mm, or ... */
#define CURVE_UNSEEN                                                           \
    0.25 /* cycles at the speed that its third derivative allows, if that is   \
            less */
#define CURVE_NOISE 1e-3
#define STRAIGHT                                                               \
    1e-9 /* change of the tangent over an interval that does not bend */
#define LEAST_SHARE 1e-4 /* of a limit, however small the program asks for */
#define LEAST_MM 1e-6    /* of an interval of a curve, however much it bends */
#define CORNER_SHARE 0.5 /* of the jerk limit, as in grid.c */
#define CORNER_ACC_SHARE 0.012
#define STAND_SPEED                                                            \
    1.0 /* mm/s: corners that had to be passed below it are stood at */
#define STOP_MARGIN                                                            \
    0.98 /* of the estimated stopping distance: a stand nearer than that is    \
            not tried */
#define BRAKES_AHEAD                                                           \
    1.6 /* window in planner intervals, over the stopping distance from full   \
           speed */
#define KNOTS_PER_BLOCK 3.0 /* of the window, on the whole */
#define MAX_KNOTS 1000.0
#define SAME_TIME 1e-9 /* s */
#define JERK_SEEN                                                              \
    3.0 /* a jerk that reaches the acceleration in less of a cycle is none     \
           that anybody sees */

/* ------------------------------------------------------------------------------------------------
 * limits */
static jerk_config config_of(const engine_config *cfg) {
    jerk_config config = {.axes = cfg->axis_count,
                          .cycle_s = cfg->cycle_s,
                          .window_blocks = (int)cfg->window};
    for (int i = 0; i < config.axes; i++) {
        config.v_max[i] = cfg->v_max[i];
        config.a_max[i] = cfg->a_max[i];
        config.j_max[i] =
            cfg->j_max[i] > 0 ? cfg->j_max[i] : cfg->a_max[i] / cfg->cycle_s;
    }
    config.window_knots =
        (int)fmin(MAX_KNOTS,
                  fmax(KNOTS_PER_BLOCK * cfg->window,
                       64.0 + BRAKES_AHEAD * jerk_stop_knots(&config)));
    return config;
}

static bool jerk_limited(const engine_config *cfg) {
    for (int i = 0; i < cfg->axis_count; i++) {
        if (cfg->j_max[i] > 0) {
            return true;
        }
    }
    return false;
}

/* A second planner like the first one. */
jerk_planner *drive_spare(const struct engine *engine) {
    jerk_config config = config_of(&engine->cfg);
    return jerk_new(&config, 2 * config.window_knots);
}

bool drive_new(struct engine *e) {
    if (!jerk_limited(&e->cfg)) {
        return true;
    }
    for (int i = 0; i < e->cfg.axis_count; i++) {
        e->cfg.j_max[i] =
            fmin(e->cfg.j_max[i], JERK_SEEN * e->cfg.a_max[i] / e->cfg.cycle_s);
    }
    jerk_config c = config_of(&e->cfg);
    e->drive.laws_max = c.window_knots + 128 + jerk_laws_kept();
    if (e->plan.tail_max < 2 * (uint32_t)e->drive.laws_max + 1024) {
        e->plan.tail_max = 2 * (uint32_t)e->drive.laws_max + 1024;
    }
    e->drive.planner = jerk_new(&c, 2 * c.window_knots);
    e->drive.laws = calloc((size_t)e->drive.laws_max, sizeof(jerk_law));
    for (int i = 0; i < 2; i++) {
        e->plan.tails[i].place =
            calloc((size_t)e->drive.laws_max, sizeof(uint32_t));
    }
    return e->drive.planner && e->drive.laws && e->plan.tails[0].place
           && e->plan.tails[1].place;
}

void drive_free(struct engine *engine) {
    jerk_free(engine->drive.planner);
    free(engine->drive.laws);
    for (int i = 0; i < 2; i++) {
        free(engine->plan.tails[i].place);
    }
}

/* ------------------------------------------------------------------------------------------------
 * path */
static void derivatives(const struct engine *engine,
                        const struct piece *piece,
                        double s,
                        double *d1,
                        double *d2,
                        double *d3) {
    if (piece->kind == PIECE_CURVE) {
        curve_piece_derivatives(engine, piece, s, d1, d2, d3);
        return;
    }
    piece_tangent(engine, piece, s, d1);
    if (piece->kind != PIECE_ARC) {
        return;
    }
    double w = piece->sweep / piece->whole,
           angle = piece->angle0 + w * (piece->from + piece->dir * s),
           r = piece->radius * w * w;
    d2[piece->axis1] = -r * cos(angle);
    d2[piece->axis2] = -r * sin(angle);
    d3[piece->axis1] = -w * w * d1[piece->axis1];
    d3[piece->axis2] = -w * w * d1[piece->axis2];
}

static double bend_at(const struct engine *engine,
                      const struct piece *piece,
                      double s) {
    double d1[NC_AXES] = {0}, d2[NC_AXES] = {0}, d3[NC_AXES] = {0}, sum = 0.0;
    derivatives(engine, piece, s, d1, d2, d3);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        sum += d2[i] * d2[i];
    }
    return sqrt(sum);
}

/* Largest turn per mm of a curve over from..to. Axes that outrun the path
 * (rotary ones over a short way) count by the relative change of their rate,
 * all axes by their own way where the path is that of the tool tip. */
static double turn_rate(const struct engine *engine,
                        const struct piece *piece,
                        double from,
                        double to) {
    double bend = 0.0, fast = 0.0, relative = 0.0, most[NC_AXES] = {0},
           change[NC_AXES] = {0};
    for (int k = 0; k < 3; k++) {
        double d1[NC_AXES] = {0}, d2[NC_AXES] = {0}, d3[NC_AXES] = {0},
               sum = 0.0, rate = 0.0;
        derivatives(engine, piece, from + 0.5 * k * (to - from), d1, d2, d3);
        for (int i = 0; i < engine->cfg.axis_count; i++) {
            sum += d2[i] * d2[i];
            rate += d1[i] * d1[i];
            most[i] = fmax(most[i], fabs(d1[i]));
            change[i] = fmax(change[i], fabs(d2[i]));
        }
        bend = fmax(bend, sqrt(sum));
        fast = fmax(fast, sqrt(rate));
    }
    if (curve_of(engine, piece)->natural > 0.0 && fast > 0.0) {
        return bend / fast;
    }
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        relative = hypot(relative, change[i] / fmax(1.0, most[i]));
    }
    return fmin(bend, relative);
}

/* The program asks for a slow corner at the start: a short interval of its own
 * holds that speed. */
static double entry_stretch(const struct engine *engine,
                            const struct piece *piece) {
    return fmin(0.25 * piece->length,
                fmax(1e-3, piece->entry_speed * engine->cfg.cycle_s));
}

/* Where the interval that begins at s ends. */
static double interval_end(const struct engine *engine,
                           const struct piece *piece,
                           double s) {
    double end = piece->length, bend = 0.0;
    if (s <= 0.0 && piece->entry_speed < NEVER) {
        end = entry_stretch(engine, piece);
    }
    if (piece->kind == PIECE_LINE) {
        return end;
    }
    if (piece->kind == PIECE_ARC) {
        bend = fabs(piece->sweep) / piece->whole;
    } else {
        end = fmin(end, curve_piece_cell_end(engine, piece, s));
        bend = turn_rate(engine, piece, s, end);
    }
    double parts = fmin(ceil((end - s) * bend / TURN_STEP - 1e-9),
                        floor((end - s) / LEAST_MM)),
           next = parts > 1.0 ? s + (end - s) / parts : end;
    return piece->length - next < STEPPED_OVER_MM ? piece->length : next;
}

/* Speed at which the axes keep their shares of velocity from `from` to `to`. */
static double shared_speed(const struct engine *engine,
                           const struct piece *piece,
                           double from,
                           double to) {
    uint32_t shared = 0;
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        if (piece->limits.velocity[i] < 1.0f && piece->moving >> i & 1) {
            shared |= 1u << i;
        }
    }
    double v = NEVER, d1[NC_AXES], d2[NC_AXES], d3[NC_AXES];
    for (int k = 0; shared && k < 3; k++) {
        derivatives(engine, piece, from + 0.5 * k * (to - from), d1, d2, d3);
        for (int i = 0; i < engine->cfg.axis_count; i++) {
            if (shared >> i & 1 && fabs(d1[i]) > 1e-12) {
                v = fmin(
                    v,
                    fmax(piece_v_max(engine, piece, i) / fabs(d1[i]), 1e-6));
            }
        }
    }
    return v;
}

/* Speed that the program allows beyond the machine's own limits (NC_DYNAMICS);
 * 0: no such limit. */
static double programmed_speed(const struct engine *engine,
                               const struct piece *piece,
                               double from,
                               double to) {
    const struct motion_limits *motion_limits = &piece->limits;
    double v = motion_limits->path_velocity > 0
                   ? (double)motion_limits->path_velocity
                   : NEVER,
           bend = 0.0;
    if (motion_limits->radial_acceleration > 0) {
        for (int k = 0; k < 3; k++) {
            bend = fmax(bend,
                        bend_at(engine, piece, from + 0.5 * k * (to - from)));
        }
        if (bend > 1e-12) {
            v = fmin(v,
                     sqrt((double)motion_limits->radial_acceleration / bend));
        }
    }
    v = fmin(v, shared_speed(engine, piece, from, to));
    return v < NEVER ? v : 0.0;
}

/* A part of a curve that does not bend is a line. */
static bool is_line(const struct engine *engine,
                    const struct piece *piece,
                    const jerk_interval *interval) {
    if (piece->kind == PIECE_LINE) {
        return true;
    }
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        if (fabs(interval->d1[1][i] - interval->d1[0][i]) > STRAIGHT
            || (fabs(interval->d2[0][i]) + fabs(interval->d2[1][i]))
                       * interval->length
                   > STRAIGHT) {
            return false;
        }
    }
    return true;
}

/* Weights of the program as shares of the axes' limits. A limit of the path's
 * acceleration or jerk becomes one of the axis that moves most on a line, of
 * all axes where the path bends. */
static void set_shares(const struct engine *engine,
                       const struct piece *piece,
                       jerk_interval *interval) {
    const struct motion_limits *motion_limits = &piece->limits;
    bool path = motion_limits->path_acceleration > 0
                || motion_limits->path_jerk > 0,
         line = path && is_line(engine, piece, interval);
    int most = 0;
    for (int i = 1; i < engine->cfg.axis_count; i++) {
        if (fabs(interval->d1[0][i]) > fabs(interval->d1[0][most])) {
            most = i;
        }
    }
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        bool takes = !line || i == most;
        double along = line ? fabs(interval->d1[0][i]) : 1.0,
               acc = motion_limits->acceleration[i],
               jerk = motion_limits->jerk[i];
        if (takes && motion_limits->path_acceleration > 0) {
            acc = fmin(acc,
                       (double)motion_limits->path_acceleration * along
                           / engine->cfg.a_max[i]);
        }
        if (takes && motion_limits->path_jerk > 0 && engine->cfg.j_max[i] > 0) {
            jerk = fmin(jerk,
                        (double)motion_limits->path_jerk * along
                            / engine->cfg.j_max[i]);
        }
        interval->acc_share[i] = (float)fmax(acc, LEAST_SHARE);
        interval->jerk_share[i] = (float)fmax(jerk, LEAST_SHARE);
    }
}

/* The interval that begins as q does ends at `to`. */
static void end_interval(const struct engine *engine,
                         const struct piece *piece,
                         double to,
                         jerk_interval *interval) {
    double from = interval->offset;
    interval->length = to - from;
    derivatives(engine,
                piece,
                to,
                interval->d1[1],
                interval->d2[1],
                interval->d3[1]);
    interval->v_hard = programmed_speed(engine, piece, from, to);
    set_shares(engine, piece, interval);
    interval->blocks = to >= piece->length;
    if (from <= 0.0 && piece->entry_speed < NEVER) {
        interval->v_hard = interval->v_hard > 0.0
                               ? fmin(interval->v_hard, piece->entry_speed)
                               : piece->entry_speed;
    }
}

/* How far the third derivative of the planner's polynomial over q (path.c)
 * misses the curve at the share t, over the largest of the interval: each axis
 * by its jerk limit. q->miss keeps the largest. */
static double curve_miss(const struct engine *engine,
                         const struct piece *piece,
                         jerk_interval *interval,
                         double t) {
    double d1[NC_AXES], d2[NC_AXES], d3[NC_AXES], most = 0.0, miss = 0.0;
    derivatives(engine,
                piece,
                interval->offset + t * interval->length,
                d1,
                d2,
                d3);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        double v = engine->cfg.v_max[i],
               j = engine->cfg.j_max[i] > 0
                       ? engine->cfg.j_max[i]
                       : engine->cfg.a_max[i] / engine->cfg.cycle_s;
        double off = fabs(jerk_third(interval, t, i) - d3[i]),
               noise = CURVE_NOISE * j
                       / (v * v * v); /* too little to matter at any speed */
        if (off > noise) {
            interval->miss[i] = fmaxf(interval->miss[i], (float)off);
        }
        miss = fmax(miss, (off - noise) / j);
        most =
            fmax(most,
                 fmax(fabs(d3[i]),
                      fmax(fabs(interval->d3[0][i]), fabs(interval->d3[1][i])))
                     / j);
    }
    return miss > 0.0 ? miss / most : 0.0;
}

/* What misses evenly shows in the middle, what misses to either side at a
 * quarter. */
static bool fits_curve(const struct engine *engine,
                       const struct piece *piece,
                       jerk_interval *interval) {
    memset(interval->miss, 0, sizeof interval->miss);
    double middle = curve_miss(engine, piece, interval, 0.5),
           quarter = curve_miss(engine, piece, interval, 0.25);
    return middle <= CURVE_MISS && quarter <= CURVE_MISS;
}

/* Shortest interval of a curve that is worth halving: a blend of a micrometre
 * is seen by many cycles if it must be crept through. */
static double shortest_seen(const struct engine *engine,
                            const jerk_interval *interval) {
    double most = 0.0;
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        double j = engine->cfg.j_max[i] > 0
                       ? engine->cfg.j_max[i]
                       : engine->cfg.a_max[i] / engine->cfg.cycle_s;
        most =
            fmax(most,
                 fmax(fabs(interval->d3[0][i]), fabs(interval->d3[1][i])) / j);
    }
    return most > 0.0 ? fmin(CURVE_SHORTEST,
                             CURVE_UNSEEN * engine->cfg.cycle_s / cbrt(most))
                      : CURVE_SHORTEST;
}

/* The next interval of the path of a piece. */
static jerk_interval next_interval(const struct engine *engine,
                                   const struct piece *piece,
                                   uint64_t i,
                                   double from) {
    double to = interval_end(engine, piece, from);
    jerk_interval interval = {.offset = from,
                              .tag = i,
                              .feed = piece->feed > 0 ? piece->feed
                                                      : piece->v_hard};
    interval.flags = piece->feed > 0
                         ? (piece->flags & NC_NO_OVERRIDE ? JERK_FIXED : 0u)
                         : JERK_RAPID;
    derivatives(engine,
                piece,
                from,
                interval.d1[0],
                interval.d2[0],
                interval.d3[0]);
    end_interval(engine, piece, to, &interval);
    for (int k = 0;
         piece->kind == PIECE_CURVE && !fits_curve(engine, piece, &interval)
         && k < CURVE_HALVINGS
         && interval.length > shortest_seen(engine, &interval);
         k++) {
        to = 0.5 * (from + to);
        end_interval(engine, piece, to, &interval);
    }
    return interval;
}

/* A corner that could only be crept through is stood at. */
static bool sharp(const struct engine *engine, const struct piece *piece) {
    for (int axis = 0; axis < engine->cfg.axis_count; axis++) {
        double j = engine->cfg.j_max[axis] > 0
                       ? engine->cfg.j_max[axis]
                       : engine->cfg.a_max[axis] / engine->cfg.cycle_s;
        j *= fmax(1.0, (double)piece->limits.jerk[axis]);
        double room = fmin(CORNER_SHARE * j * engine->cfg.cycle_s,
                           CORNER_ACC_SHARE * engine->cfg.a_max[axis])
                      * engine->cfg.cycle_s;
        if (piece->jump[axis] * STAND_SPEED > room) {
            return true;
        }
    }
    return false;
}

/* Whether the axes must stand behind motion i; *known: what follows has been
 * fed. */
static bool stands_behind(struct engine *engine, uint64_t i, bool *known) {
    *known = true;
    if (piece_at(engine, i)->stop_after) {
        return true;
    }
    for (uint64_t k = i + 1; k < engine->piece_head; k++) {
        const struct piece *piece = piece_at(engine, k);
        if (stands_before(engine, piece)) {
            return true;
        }
        if (is_motion(piece)) {
            return sharp(engine, piece);
        }
    }
    *known = false;
    return false;
}

bool drive_stands_behind(struct engine *e, uint64_t i) {
    bool known;
    return stands_behind(e, i, &known);
}

static void close_boundary(struct engine *engine) {
    struct drive *drive = &engine->drive;
    int64_t count = jerk_ahead(drive->planner);
    if (!drive->open || count == 0) {
        return;
    }
    bool known, stand = stands_behind(engine, drive->last, &known);
    drive->open = !known;
    if (known) {
        jerk_stand(drive->planner, count - 1, stand);
    }
}

/* One interval of piece `next`; a piece too short to be one is stepped over. */
static bool push_interval(struct engine *engine) {
    struct drive *drive = &engine->drive;
    const struct piece *piece = piece_at(engine, drive->next);
    bool whole = true;
    if (piece->length - drive->at > STEPPED_OVER_MM) {
        jerk_interval interval =
            next_interval(engine, piece, drive->next, drive->at);
        int64_t taken = jerk_push(drive->planner, &interval, 1);
        if (taken < 0) {
            ATOMIC_SET(engine->fault,
                       ENGINE_BAD_PATH); /* it stands ahead of it */
        }
        if (taken != 1) {
            return false;
        }
        drive->last = drive->next;
        drive->has_last = true;
        drive->open = whole =
            interval.blocks; /* inside a piece there is nothing to stand for */
        drive->at += interval.length;
    }
    if (whole) {
        drive->next++;
        drive->at = 0.0;
    }
    return true;
}

/* Push path until the planner's look-ahead is full, or there is no more. */
static void push_path(struct engine *engine) {
    struct drive *drive = &engine->drive;
    close_boundary(engine);
    while (drive->next < engine->piece_head && !jerk_ready(drive->planner)) {
        if (!is_motion(piece_at(engine, drive->next))) {
            drive->next++;
            continue;
        }
        if (drive->at <= 0.0) {
            close_boundary(engine);
        }
        if (!push_interval(engine)) {
            break;
        }
    }
    close_boundary(engine);
    jerk_finish(drive->planner,
                engine->feed.final && drive->next >= engine->piece_head);
}

/* The path stands where the planner of the engine says: everything is pushed
 * anew. */
static void restart(struct engine *engine) {
    struct drive *drive = &engine->drive;
    jerk_reset(drive->planner);
    drive->next = engine->plan.piece;
    drive->at = engine->plan.s;
    drive->has_last = drive->open = drive->restart = false;
}

/* Pieces change: what the tails were written from does not hold any more. */
static void forget_tails(struct engine *engine) {
    for (int i = 0; i < 2; i++) {
        engine->plan.tails[i].edition = 0;
    }
}

/* The run ring is fed anew from `head` on. */
void drive_cut_run(struct engine *engine, uint64_t head) {
    struct drive *drive = &engine->drive;
    if (!drive->planner || drive->next < head || drive->restart) {
        return;
    }
    forget_tails(engine);
    int64_t count = jerk_ahead(drive->planner);
    while (count > 0 && jerk_path(drive->planner, count - 1)->tag >= head) {
        count--;
    }
    jerk_cut(drive->planner, count, 0.0);
    if (count > 0) {
        jerk_stand(drive->planner, count - 1, 0);
    }
    drive->next = head;
    drive->at = 0.0;
    drive->open = drive->has_last = count > 0;
    if (count > 0) {
        drive->last = jerk_path(drive->planner, count - 1)->tag;
    }
}

/* Piece i ends at s now. */
void drive_shorten(struct engine *engine, uint64_t i, double s) {
    struct drive *drive = &engine->drive;
    if (!drive->planner || drive->restart || drive->next < i
        || (drive->next == i && drive->at <= s)) {
        return;
    }
    forget_tails(engine);
    int64_t count = jerk_ahead(drive->planner);
    while (count > 0 && jerk_path(drive->planner, count - 1)->tag == i
           && jerk_path(drive->planner, count - 1)->offset
                  >= s - STEPPED_OVER_MM) {
        count--;
    }
    if (count > 0 && jerk_path(drive->planner, count - 1)->tag == i) {
        jerk_cut(drive->planner,
                 count - 1,
                 s - jerk_path(drive->planner, count - 1)->offset);
    }
    drive->next = i + 1;
    drive->at = 0.0;
    drive->open = true;
}

/* ------------------------------------------------------------------------------------------------
 * conditions */
typedef struct conditions {
    struct techno_counts done, done_again;
    uint32_t held_axes;
    bool single, m01;
} conditions;

static void read_conditions(struct engine *engine,
                            struct conditions *conditions) {
    memset(conditions, 0, sizeof *conditions);
    conditions->done = techno_done(&engine->done);
    conditions->done_again = techno_done(&engine->done_again);
    conditions->single = ATOMIC_GET(engine->single_now);
    conditions->m01 = ATOMIC_GET(engine->m01_now);
    conditions->held_axes = ATOMIC_GET(engine->held_axes);
}

static bool conditions_change(struct engine *engine) {
    planner *plan = &engine->plan;
    struct conditions want;
    read_conditions(engine, &want);
    bool same =
        plan->single == want.single && plan->m01 == want.m01
        && plan->held_axes == want.held_axes
        && memcmp(&plan->done, &want.done, sizeof want.done) == 0
        && memcmp(&plan->done_again, &want.done_again, sizeof want.done) == 0;
    plan->done = want.done;
    plan->done_again = want.done_again;
    plan->single = want.single;
    plan->m01 = want.m01;
    plan->held_axes = want.held_axes;
    return !same;
}

/* Stands that the present conditions ask for, as far as they can still be met.
 */
static void update_stands(struct engine *engine) {
    jerk_planner *planner = engine->drive.planner;
    double way = 0.0, stop = STOP_MARGIN * jerk_stop_distance(planner);
    for (int64_t i = 0, count = jerk_ahead(planner); i < count; i++) {
        const jerk_interval *interval = jerk_path(planner, i);
        way += interval->length;
        if (!interval->blocks) {
            continue;
        }
        bool known, stand = stands_behind(engine, interval->tag, &known);
        if (known && (!stand || way >= stop)) {
            jerk_stand(planner, i, stand);
        }
    }
}

/* A plan that runs over a stand: there was none that meets it. */
static void forget_missed_stands(jerk_planner *planner) {
    for (int64_t i = 0, count = jerk_ahead(planner);
         i < count && jerk_passes(planner, i);
         i++) {
        jerk_stand(planner, i, 0);
    }
}

static void set_speeds(struct engine *engine) {
    jerk_planner *planner = engine->drive.planner;
    jerk_hold(planner, engine->plan.hold);
    jerk_command_speed(planner,
                       engine->plan.ext_speed < NEVER ? engine->plan.ext_speed
                                                      : -1.0);
    if (!engine->plan.hold) {
        jerk_override(planner,
                      engine->plan.override,
                      fmin(1.0, engine->plan.rapid));
    }
}

/* ------------------------------------------------------------------------------------------------
 * phases */
static bool steps_over(struct engine *engine, uint64_t i) {
    const struct piece *piece = piece_at(engine, i);
    return !is_motion(piece) || piece->length <= STEPPED_OVER_MM;
}

/* Events, and pieces without a length, up to piece `until`. */
static void pass_events(struct writer *writer, uint64_t until) {
    while (writer->piece < until && !writer_full(writer)
           && steps_over(writer->e, writer->piece)) {
        const struct piece *piece = piece_at(writer->e, writer->piece);
        if (is_motion(piece)) {
            const phase ph = {.piece = writer->piece,
                              .s0 = piece->length,
                              .v0 = writer->v,
                              .last = true};
            write_phase(writer, &ph);
            writer->piece++;
        } else {
            pass_event(writer);
        }
    }
}

static void write_law(struct writer *writer, const jerk_law *law) {
    bool last = law->last & 2;
    const phase ph = {law->tag,
                      law->s0,
                      law->v0,
                      law->a0,
                      law->jerk,
                      law->snap,
                      law->crackle,
                      law->pop,
                      law->time,
                      last};
    write_phase(writer, &ph);
    writer->piece = law->tag + last;
    writer->s = last ? 0.0 : law->s0 + law->length;
    writer->v =
        law->flags & JERK_STAND
            ? 0.0
            : law->length
                  / law->time; /* not at rest: that is all a tail needs */
    writer->motion += law->time;
}

static void write_commit(struct engine *engine,
                         struct writer *writer,
                         bool changed) {
    jerk_planner *planner = engine->drive.planner;
    jerk_law law;
    pass_events(writer, engine->piece_head);
    while (!writer_full(writer)) {
        if (!jerk_next_within(planner,
                              &law,
                              writer->budget - writer->seconds)) {
            int64_t known = jerk_ahead(planner);
            push_path(engine); /* it stands; is there more? */
            if (jerk_ahead(planner) == known) {
                break;
            }
            continue;
        }
        if (changed) {
            forget_missed_stands(planner);
        }
        changed = false;
        write_law(writer, &law);
        pass_events(writer, engine->piece_head);
    }
    writer->v = jerk_speed(planner);
}

/* The buffer holds this very plan already: it only begins later. */
static bool tail_continues(struct engine *engine,
                           struct tail *tail,
                           const struct writer *from) {
    const jerk_planner *planner = engine->drive.planner;
    jerk_law law;
    if (tail->edition == 0 || tail->edition != jerk_edition(planner)
        || !(from->v > 0.0) || jerk_tail(planner, &law, 1) != 1) {
        return false;
    }
    tail->first = tail->place[jerk_used(planner) - tail->from];
    while (steps_over(engine, tail->phases[tail->first].piece)
           && tail->phases[tail->first].piece < from->piece) {
        tail->first++; /* events that are committed */
    }
    uint32_t i = tail->first;
    while (steps_over(engine, tail->phases[i].piece)) {
        i++;
    }
    struct writer writer = {.e = engine,
                            .out = tail->phases,
                            .count = i,
                            .budget = NEVER};
    write_law(&writer, &law); /* a part of it may have been handed out */
    return true;
}

/* What is left of the plan; false if it finds no room. */
static bool write_tail(struct engine *engine,
                       struct tail *tail,
                       const struct writer *from) {
    struct drive *drive = &engine->drive;
    if (tail_continues(engine, tail, from)) {
        return true;
    }
    struct writer writer = {.e = engine,
                            .out = tail->phases,
                            .max = engine->plan.tail_max,
                            .piece = from->piece,
                            .s = from->s,
                            .v = from->v,
                            .budget = NEVER};
    int64_t count =
        from->v > 0.0 ? jerk_tail(drive->planner, drive->laws, drive->laws_max)
                      : 0;
    tail->edition = 0;
    for (int64_t i = 0; i < count; i++) {
        tail->place[i] = writer.count;
        pass_events(&writer, drive->laws[i].tag);
        if (writer_full(&writer)) {
            return false;
        }
        write_law(&writer, &drive->laws[i]);
    }
    tail->first = 0;
    tail->count = writer.count;
    tail->edition = count > 0 ? jerk_edition(drive->planner) : 0;
    tail->from = jerk_used(drive->planner);
    tail->piece = writer.piece;
    tail->s = writer.s;
    return count < drive->laws_max;
}

/* The stopping tail becomes the shortest one there is, so that what lies behind
 * it may be changed. False: not now. */
bool drive_shorten_tail(struct engine *e) {
    if (!e->drive.planner || e->plan.v <= 0.0) {
        return true;
    }
    uint64_t word = ATOMIC_GET(e->commit);
    if (e->drive.restart || (word & 1)) {
        return false;
    }
    uint32_t next = ((word >> 1) & 1) ^ 1;
    struct writer w = {.e = e,
                       .piece = e->plan.piece,
                       .s = e->plan.s,
                       .v = e->plan.v};
    jerk_brake(e->drive.planner);
    if (write_tail(e, &e->plan.tails[next], &w)
        && __atomic_compare_exchange_n(&e->commit,
                                       &word,
                                       e->plan.written << 2 | next << 1,
                                       false,
                                       __ATOMIC_ACQ_REL,
                                       __ATOMIC_ACQUIRE)) {
        return true;
    }
    e->drive.restart = true;
    return false;
}

/* The last `seconds` that were committed, or a little less, are the beginning
 * of the plan again. */
double drive_take_back(struct engine *engine, double seconds) {
    double back = jerk_take_back(engine->drive.planner, seconds);
    if (back > 0.0) {
        update_stands(engine);
    }
    return back;
}

/* Motion from where w is, as much as its budget, and the tail behind it; false
 * if that finds no room. */
bool drive_write(struct engine *e, struct writer *w, struct tail *t) {
    bool changed = conditions_change(e);
    if (changed) {
        update_stands(e);
    }
    push_path(e);
    set_speeds(e);
    write_commit(e, w, changed);
    return write_tail(e, t, w);
}

/* GEO has taken the tail behind the last commit: the planner goes back to where
 * it begins. False if its plan is another one by now. */
static bool back_to_tail(struct engine *engine,
                         const struct writer *writer,
                         uint64_t edition) {
    if (jerk_edition(engine->drive.planner) != edition) {
        return false;
    }
    return !(writer->motion > 0.0)
           || fabs(jerk_take_back(engine->drive.planner, writer->motion)
                   - writer->motion)
                  < SAME_TIME;
}

/* Commit motion until commit_high of it is ahead of GEO. */
void drive_commit(struct engine *engine) {
    if (engine->drive.restart && engine->plan.v > 0.0) {
        return; /* the stored tail is driven first */
    }
    if (engine->drive.restart) {
        restart(engine);
    }
    uint64_t word = ATOMIC_GET(engine->commit), before = engine->plan.written,
             edition = jerk_edition(engine->drive.planner);
    struct writer writer = {.e = engine,
                            .piece = engine->plan.piece,
                            .s = engine->plan.s,
                            .v = engine->plan.v,
                            .budget = commit_high(engine) - ahead_s(engine)};
    uint32_t next = ((word >> 1) & 1) ^ 1;
    if (word & 1) {
        return; /* GEO has taken the tail */
    }
    jerk_watch(engine->drive.planner, &engine->commit);
    bool fits = drive_write(engine, &writer, &engine->plan.tails[next]);
    jerk_watch(engine->drive.planner, NULL);
    if (!fits
        || !__atomic_compare_exchange_n(&engine->commit,
                                        &word,
                                        engine->plan.written << 2 | next << 1,
                                        false,
                                        __ATOMIC_ACQ_REL,
                                        __ATOMIC_ACQUIRE)) {
        engine->plan.written = before;
        engine->drive.restart =
            !fits
            || !back_to_tail(
                engine,
                &writer,
                edition); /* from rest: where the tail that GEO drives now ends,
                             or where the path stands already */
        return;
    }
    engine->plan.phases += engine->plan.written - before;
    engine->plan.piece = writer.piece;
    engine->plan.s = writer.s;
    engine->plan.v = writer.v;
    engine->plan.committed_s += writer.seconds;
}
