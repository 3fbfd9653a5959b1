/* Look-ahead: how fast each corner may be passed and how fast everything ahead
 * can still be met.
 *
 * A corner between two pieces that are not tangential is driven exactly, with a
 * jump of velocity. What a drive sees of it is what the cycle samples show: a
 * jump dv at a time t adds dv/dt * w(t) to the acceleration measured around a
 * sample, where w is the triangle of half-width one cycle (second difference).
 * The sum over all jumps is largest exactly at the corners, so it is enough to
 * bound, per axis and at every corner, F(v) = (1/dt) * sum_j max(0, v - d_j/dt)
 * * jump_j + CORNER * v^2 * curvature  <=  CORNER * a_max with d_j the path
 * distance to corner j. Speeds differ a little inside the window of two cycles,
 * so v is taken SLACK times one cycle of acceleration larger than the speed
 * that is allowed. F is increasing in v; the neighbours are taken in by
 * increasing distance until the speed found does not reach the next one within
 * one cycle. What the jumps in F use up at the speed that can occur is the
 * `reserve`; in a zone of one cycle around the corner only the rest is left for
 * everything else (corner_zones.c, spans.c). Where that costs more time than
 * the jump saves, the corner is passed at standstill: without a jump nothing is
 * used up.
 *
 * The speed that can occur is bounded by the corners beside it, too: what a
 * line is left with depends on how it is entered.  Between two corners what
 * they add to the acceleration is linear in the time.  So at joints whose own
 * jumps are negligible, together with all such jumps in reach, nothing is
 * bounded but at the large ones beside them.
 */
#include <math.h>
#include <string.h>
#include "engine/accel/corner_limits.h"
#include "engine/accel/corner_zones.h"
#include "engine/accel/curve_spans.h"
#include "engine/accel/tuning.h"
#include "engine/path/speed_caps.h"
#include "engine/path/stands.h"
#include "engine/state/state.h"
#include "rows/nc_block.h"

typedef struct walk {
    uint64_t i;   /* piece whose start is the next corner on this side */
    double d;     /* path distance to it; NEVER: none that matters */
    double known; /* distance up to which corners are known */
    int budget;
} walk;

typedef struct axis_load {
    double sum, moment; /* sum of jumps; sum of distance * jump / dt */
    double curvature;
    double most; /* acceleration allowed on all pieces seen */
} axis_load;

/* What has been seen of a corner's neighbourhood. */
typedef struct load {
    struct walk left, right;
    double farthest; /* corner that is counted */
    axis_load axis[NC_AXES];
} load;

/* Pieces this far behind committed motion are still in the ring (push.c keeps
 * KEPT_BEHIND slots). */
static uint64_t left_floor(const struct commit_state *commit) {
    return commit->piece > CORNERS_BEHIND ? commit->piece - CORNERS_BEHIND : 0;
}

static bool previous_motion(struct engine *engine, uint64_t *i) {
    uint64_t floor = left_floor(&engine->commit);
    do {
        if (*i <= floor) {
            return false;
        }
        (*i)--;
    } while (!is_motion(piece_at(&engine->run, *i)));
    return true;
}

static void add_curvature(const struct engine *engine,
                          const struct piece *piece,
                          struct load *load) {
    const double *bend = piece->kind == PIECE_CURVE
                             ? curve_of(&engine->store, piece)->bend
                             : NULL;
    for (int axis = 0; axis < engine->cfg.axis_count; axis++) {
        load->axis[axis].most = lesser(load->axis[axis].most,
                                       piece_a_max(&engine->cfg, piece, axis));
        if (bend) {
            load->axis[axis].curvature =
                greater(load->axis[axis].curvature, bend[axis]);
        }
    }
    if (piece->limits.transition_acceleration > 0) {
        for (int axis = 0; axis < engine->cfg.axis_count; axis++) {
            load->axis[axis].most =
                lesser(load->axis[axis].most,
                       (double)piece->limits.transition_acceleration / CORNER);
        }
    }
    if (piece->kind != PIECE_ARC) {
        return;
    }
    for (int axis = 0; axis < 2; axis++) {
        axis_load *in_plane = &load->axis[axis ? piece->axis2 : piece->axis1];
        in_plane->curvature = greater(in_plane->curvature, piece->curvature);
    }
}

/* Step to the next corner on the left; pieces passed add their curvature. */
static void step_left(struct engine *engine,
                      struct walk *walk,
                      struct load *load) {
    bool stop = stands_before(&engine->plan, piece_at(&engine->run, walk->i));
    if (stop || walk->budget-- == 0 || !previous_motion(engine, &walk->i)) {
        walk->known = stop || walk->i == 0 ? NEVER : walk->d;
        walk->d = NEVER;
        return;
    }
    walk->d += piece_at(&engine->run, walk->i)->length;
    add_curvature(engine, piece_at(&engine->run, walk->i), load);
}

static void step_right(struct engine *engine,
                       struct walk *walk,
                       struct load *load,
                       uint64_t head,
                       bool finished) {
    double d = walk->d + piece_at(&engine->run, walk->i)->length;
    add_curvature(engine, piece_at(&engine->run, walk->i), load);
    if (piece_at(&engine->run, walk->i)->stop_after) {
        walk->known = walk->d = NEVER;
        return;
    }
    bool found =
        walk->budget-- > 0 && next_motion(&engine->run, &walk->i, head);
    if (found
        && !stands_before(&engine->plan, piece_at(&engine->run, walk->i))) {
        walk->d = d;
        return;
    }
    walk->known = found || (finished && walk->budget >= 0) ? NEVER : d;
    walk->d = NEVER;
}

static void add_corner(const engine_config *cfg,
                       const struct piece *piece,
                       double d,
                       struct load *load) {
    load->farthest = d; /* they are taken in by distance */
    for (int axis = 0; axis < cfg->axis_count; axis++) {
        load->axis[axis].sum += piece->jump[axis];
        load->axis[axis].moment += d * piece->jump[axis] / cfg->cycle_s;
    }
}

/* Largest v with (sum v - moment)/dt <= CORNER (a - curvature v^2) on every
 * axis, `v` at the most. */
static double load_speed(const engine_config *cfg,
                         const struct load *load,
                         double v) {
    double inv_dt = 1.0 / cfg->cycle_s;
    for (int axis = 0; axis < cfg->axis_count; axis++) {
        const axis_load *at = &load->axis[axis];
        if (at->sum < 1e-13) {
            continue;
        }
        double c = CORNER * at->most + at->moment * inv_dt,
               b = at->sum * inv_dt, bend = CORNER * at->curvature;
        if ((b + bend * v) * v > c) {
            v = lesser(v, 2.0 * c / (b + sqrt(b * b + 4.0 * bend * c)));
        }
    }
    return v;
}

static double jumps_at(const engine_config *cfg,
                       const struct load *load,
                       int axis,
                       double v) {
    return load->axis[axis].sum < 1e-13
               ? 0.0
               : (load->axis[axis].sum * v - load->axis[axis].moment)
                     / cfg->cycle_s;
}

/* The curvature is in the rows of curved stretches. False: there is none. */
static bool set_reserve(engine_config *cfg,
                        struct piece *piece,
                        const struct load *load,
                        double v) {
    bool some = false;
    for (int axis = 0; axis < cfg->axis_count; axis++) {
        double jumps = jumps_at(cfg, load, axis, v);
        piece->reserve[axis] =
            jumps < NEGLIGIBLE * load->axis[axis].most ? 0.0 : jumps;
        some |= piece->reserve[axis] > 0.0;
    }
    return some;
}

/* The corner itself and the pieces on both sides of it. */
static void load_corner(struct engine *engine, uint64_t i, struct load *load) {
    for (int axis = 0; axis < engine->cfg.axis_count; axis++) {
        load->axis[axis] =
            (axis_load){.sum = piece_at(&engine->run, i)->jump[axis],
                        .most = NEVER};
    }
    /* one each: a copy of what was just written would wait for it */
    load->left = (struct walk){i, 0.0, NEVER, (int)CORNERS_BEHIND};
    load->right = (struct walk){i, 0.0, NEVER, (int)CORNERS_BEHIND};
    step_left(engine, &load->left, load);
    step_right(engine,
               &load->right,
               load,
               engine->run.head,
               engine->dispatch.ends);
}

/* Which neighbours are taken in, and whether v is given. */
typedef enum gathering {
    ALL_FOR_SPEED,
    ALL_AT_SPEED,
    SMALL_AT_SPEED
} gathering;

static bool is_negligible(const engine_config *cfg,
                          const struct piece *piece,
                          const struct load *load,
                          double v) {
    for (int axis = 0; axis < cfg->axis_count; axis++) {
        if (piece->jump[axis] * v
            >= NEGLIGIBLE * load->axis[axis].most * cfg->cycle_s) {
            return false;
        }
    }
    return true;
}

/* From the corner alone, take in neighbours until `v` does not reach the next
 * one. Returns false if corners that matter are not known yet. */
static bool gather(struct engine *engine,
                   const struct load *corner,
                   enum gathering gathering,
                   double *v,
                   struct load *load) {
    double dt = engine->cfg.cycle_s, limit = *v;
    struct walk *left = &load->left, *right = &load->right;
    *left = corner->left;
    *right = corner->right;
    load->farthest = 0.0;
    for (int axis = 0; axis < engine->cfg.axis_count; axis++) {
        load->axis[axis] = corner->axis[axis];
    }
    for (;;) {
        if (gathering == ALL_FOR_SPEED) {
            *v = load_speed(&engine->cfg, load, limit);
        }
        struct walk *next = left->d <= right->d ? left : right;
        if (*v * dt <= next->d) {
            break;
        }
        const struct piece *piece = piece_at(&engine->run, next->i);
        if (gathering != SMALL_AT_SPEED
            || is_negligible(&engine->cfg, piece, load, *v)) {
            add_corner(&engine->cfg, piece, next->d, load);
        }
        if (next == left) {
            step_left(engine, next, load);
        } else {
            step_right(engine,
                       next,
                       load,
                       engine->run.head,
                       engine->dispatch.ends);
        }
    }
    if (left->known < *v * dt) {
        *v = left->known / dt; /* too many short pieces: slower, so that all
                                  that matter are seen */
    }
    if (right->known >= *v * dt) {
        return true;
    }
    if (right->budget >= 0) {
        return false;
    }
    *v = right->known / dt;
    return true;
}

static bool jumps_are_negligible(const engine_config *cfg,
                                 const struct load *load,
                                 double v) {
    for (int axis = 0; axis < cfg->axis_count; axis++) {
        if (jumps_at(cfg, load, axis, v)
            >= NEGLIGIBLE * load->axis[axis].most) {
            return false;
        }
    }
    return true;
}

static double speed_slack(const engine_config *cfg) {
    double a = 0.0;
    for (int i = 0; i < cfg->axis_count; i++) {
        a = greater(a, cfg->a_max[i]);
    }
    return SLACK * a * cfg->cycle_s;
}

/* Acceleration along p that the axes are left with beside `reserve`; bends
 * aside. */
static double left_along(const engine_config *cfg,
                         const struct piece *piece,
                         const double *reserve) {
    double left = NEVER;
    for (int i = 0; i < cfg->axis_count; i++) {
        double share = piece->kind == PIECE_LINE ? fabs(piece->slope[i]) : 1.0,
               a = piece_a_max(cfg, piece, i) - reserve[i];
        if ((piece->moving >> i & 1) && share > 0.0 && left * share > a) {
            left = a / share;
        }
    }
    return greater(0.0, left);
}

static const double no_reserve[NC_AXES];

/* Speed that a line is left with at the most, from the corner at its start; the
 * same backwards. */
static double reached_along(const engine_config *cfg,
                            const struct piece *line,
                            double from) {
    double full = left_along(cfg, line, no_reserve);
    return sqrt(from * from + 2.0 * full * line->length);
}

/* Speed at the end of a line, at the most, by the corner there alone.  False:
 * it is not known yet. */
static bool passed_behind(struct engine *engine, uint64_t i, double *v) {
    const struct piece *line = piece_at(&engine->run, i);
    if (line->stop_after) {
        *v = 0.0;
        return true;
    }
    if (!next_motion(&engine->run, &i, engine->run.head)) {
        *v = 0.0;
        return engine->dispatch.ends;
    }
    const struct piece *next = piece_at(&engine->run, i);
    if (stands_before(&engine->plan, next)) {
        *v = 0.0;
        return true;
    }
    struct load load = {0};
    for (int axis = 0; axis < engine->cfg.axis_count; axis++) {
        load.axis[axis].sum = next->jump[axis];
        load.axis[axis].most = lesser(piece_a_max(&engine->cfg, line, axis),
                                      piece_a_max(&engine->cfg, next, axis));
    }
    *v = load_speed(&engine->cfg, &load, *v);
    return true;
}

/* Bounds the speed at the start of piece i by the corners at the other ends of
 * the lines beside it; by that ahead only if it is in reach of the speed that
 * `occurs`.  False: that is not known yet. */
static bool bound_by_lines(struct engine *engine,
                           uint64_t i,
                           const struct piece *before,
                           double slack,
                           double occurs,
                           double *bound) {
    const engine_config *cfg = &engine->cfg;
    const struct piece *piece = piece_at(&engine->run, i);
    if (before->kind == PIECE_LINE) {
        *bound = lesser(*bound,
                        slack + reached_along(cfg, before, before->corner_v));
    }
    double v = lesser(*bound + slack, occurs);
    if (piece->kind == PIECE_LINE && v * cfg->cycle_s > piece->length) {
        if (!passed_behind(engine, i, &v)) {
            return false;
        }
        *bound = lesser(*bound, slack + reached_along(cfg, piece, v));
    }
    return true;
}

/* Time that is lost on p by its corner being passed at v with that reserve in
 * the zone, less what standing there loses; both against driving on at the
 * highest speed that p would reach between two standstills. */
static double loses_more(const engine_config *cfg,
                         const struct piece *piece,
                         double v,
                         const double *reserve) {
    double full = left_along(cfg, piece, no_reserve);
    double left = left_along(cfg, piece, reserve);
    double zone = lesser(corner_zone(cfg, v, piece), 0.5 * piece->whole),
           out2 = v * v + 2.0 * left * zone, out = sqrt(out2);
    double top =
        greater(lesser(reachable(piece, 1.0), sqrt(full * piece->whole)), out);
    if (!(out > 0.0)) {
        return 0.0;
    }
    return 2.0 * zone / (v + out) - zone / top
           - (out / full - 0.5 * out2 / (full * top));
}

/* A jump at the speed that the corner allows costs more than it saves. Judged
 * at override 1 and by whole pieces, so that it stays so wherever stops are
 * inserted. */
static bool stand_is_faster(const engine_config *cfg,
                            const struct piece *before,
                            const struct piece *piece,
                            const struct load *load,
                            double v,
                            double slack) {
    double reserve[NC_AXES];
    for (int axis = 0; axis < cfg->axis_count; axis++) {
        reserve[axis] = greater(0.0, jumps_at(cfg, load, axis, v));
    }
    return loses_more(cfg, before, v - slack, reserve)
               + loses_more(cfg, piece, v - slack, reserve)
           > 0.0;
}

/* No jump but rounding: what neighbours add up to is bounded at them. */
static bool is_no_corner(const engine_config *cfg,
                         const struct piece *before,
                         const struct piece *piece,
                         double v) {
    double most = NO_CORNER * cfg->cycle_s;
    for (int axis = 0; axis < cfg->axis_count; axis++) {
        if (piece->jump[axis] * v
            > most
                  * lesser(piece_a_max(cfg, before, axis),
                           piece_a_max(cfg, piece, axis))) {
            return false;
        }
    }
    return true;
}

/* Final speed limit and reserve at the start of piece i; `fastest`: below 0, or
 * the speed at it if there is a reserve. False if the path ahead is not known
 * far enough. */
static bool cap_corner(struct engine *engine,
                       uint64_t i,
                       const struct piece **behind,
                       double *fastest) {
    struct piece *piece = piece_at(&engine->run, i);
    *fastest = -1.0;
    memset(piece->reserve, 0, sizeof piece->reserve);
    piece->corner_v = 0.0;
    if (stands_before(&engine->plan, piece)) {
        return true;
    }
    uint64_t b = i;
    if (!previous_motion(engine, &b)) {
        return true;
    }
    const struct piece *before = *behind = piece_at(&engine->run, b);
    struct load corner, load;
    double slack = speed_slack(&engine->cfg),
           hard = lesser(piece->entry_speed,
                         lesser(before->v_hard, piece->v_hard));
    double occurs = slack
                    + greater(reachable(before, engine->plan.reserve_override),
                              reachable(piece, engine->plan.reserve_override));
    if (!bound_by_lines(engine, i, before, slack, occurs, &hard)) {
        return false;
    }
    occurs = lesser(occurs, hard + slack);
    if (is_no_corner(&engine->cfg, before, piece, occurs)) {
        piece->corner_v = hard;
        return true;
    }
    load_corner(engine, i, &corner);
    double v = occurs;
    if (jumps_are_negligible(&engine->cfg, &corner, v)) {
        /* Next to no corner: neither curvature nor a large jump beside it is a
         * reason to be slower.  What that leaves here is bounded at itself. */
        if (!gather(engine, &corner, SMALL_AT_SPEED, &v, &load)) {
            return false;
        }
        if (v >= occurs && jumps_are_negligible(&engine->cfg, &load, v)) {
            piece->corner_v = occurs - slack;
            return true;
        }
    }
    v = hard + slack;
    if (!gather(engine, &corner, ALL_FOR_SPEED, &v, &load)) {
        return false;
    }
    piece->corner_v = lesser(hard, greater(0.0, v - slack));
    if (load.farthest > v * engine->cfg.cycle_s
        && !gather(engine, &corner, ALL_AT_SPEED, &v, &load)) {
        return false; /* bends beyond it have made it slower */
    }
    double usual =
        slack + greater(reachable(before, 1.0), reachable(piece, 1.0));
    if (usual >= v
        && stand_is_faster(&engine->cfg, before, piece, &load, v, slack)) {
        piece->corner_v = 0.0;
        return true;
    }
    if (occurs < v) {
        v = occurs;
        if (!gather(engine, &corner, ALL_AT_SPEED, &v, &load)) {
            return false;
        }
    }
    if (set_reserve(&engine->cfg, piece, &load, v)) {
        *fastest = lesser(piece->corner_v, greater(0.0, v - slack));
    }
    return true;
}

void corner_caps(struct engine *engine) {
    uint64_t head = engine->run.head;
    if (engine->accel.capped < engine->commit.piece) {
        engine->accel.capped = engine->commit.piece;
    }
    if (engine->accel.capped < engine->accel.need_end) {
        engine->accel.need_end = 0; /* pieces are capped anew */
    }
    if (engine->accel.capped < engine->accel.window_to) {
        engine->accel.window_to = engine->accel.window_from = 0;
    }
    corner_zones_follow(engine, engine->accel.capped);
    while (engine->accel.capped < head) {
        struct piece *piece = piece_at(&engine->run, engine->accel.capped);
        const struct piece *before = piece;
        curve_prefetch(engine, engine->accel.capped + FETCHED_AHEAD);
        double fastest = -1.0;
        if (is_motion(piece)
            && !cap_corner(engine, engine->accel.capped, &before, &fastest)) {
            return;
        }
        corner_zones_note(engine, engine->accel.capped, before, fastest);
        piece->capped = true;
        piece->spanned = piece->settled = false;
        piece->cruise2 = -1.0;
        engine->accel.capped++;
    }
}
