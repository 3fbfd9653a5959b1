/* Intervals of the jerk-limited planner's path from the geometry and the limits
 * of pieces. */
#include <math.h>
#include <string.h>
#include "engine/jerk_adapter/intervals.h"
#include "engine/jerk_adapter/tuning.h"
#include "engine/path/piece.h"
#include "engine/path/piece_curve.h"
#include "engine/state/state.h"
#include "jerk/state/api.h"
#include "rows/nc_block.h"
#include "maths/plain.h"

static void derivatives(const struct engine *engine,
                        const struct piece *piece,
                        double s,
                        double *d1,
                        double *d2,
                        double *d3) {
    if (piece->kind == PIECE_CURVE) {
        curve_piece_derivatives(&engine->store, piece, s, d1, d2, d3);
        return;
    }
    piece_tangent(engine, piece, s, d1);
    if (piece->kind != PIECE_ARC) {
        return;
    }
    double w = piece->sweep / piece->whole,
           angle = piece->angle0 + w * (piece->from + piece->dir * s),
           r = piece->radius * w * w;
    d2[piece->axis1] = -r * plain_cos(angle);
    d2[piece->axis2] = -r * plain_sin(angle);
    d3[piece->axis1] = -w * w * d1[piece->axis1];
    d3[piece->axis2] = -w * w * d1[piece->axis2];
}

/* Derivatives at one place of a piece. */
typedef struct spot {
    double s, d1[JERK_AXES], d2[JERK_AXES], d3[JERK_AXES];
} spot;

/* The last places that were looked at: the ends and the middle of an interval
 * are asked for by several rules, and each costs a curve a search. */
typedef struct spots {
    const struct engine *engine;
    const struct piece *piece;
    int count;
    spot last[SPOTS];
} spots;

/* The length of what the main axes drive, by the piece's own length. */
static void way_of_main(const struct engine *engine, uint16_t axes, spot *at) {
    int way = engine->cfg.axis_count;
    double speed2 = 0.0, along = 0.0, across2 = 0.0, third = 0.0;
    for (int i = 0; i < way; i++) {
        if (axes >> i & 1) {
            speed2 += at->d1[i] * at->d1[i];
            along += at->d1[i] * at->d2[i];
            across2 += at->d2[i] * at->d2[i];
            third += at->d1[i] * at->d3[i];
        }
    }
    double speed = sqrt(speed2);
    at->d1[way] = speed;
    if (speed < LEAST_RATE) {
        at->d2[way] = sqrt(across2);
        return;
    }
    at->d2[way] = along / speed;
    at->d3[way] = (across2 + third - at->d2[way] * at->d2[way]) / speed;
}

/* How the way to which the limits of the path apply grows with the piece's own
 * length: geo_path_speed. */
static void set_way(const struct engine *engine,
                    const struct piece *piece,
                    spot *at) {
    at->d1[engine->cfg.axis_count] = 1.0;
    if (!(piece->flags & NC_BY_PARAMETER)) {
        return;
    }
    if (piece->flags & NC_OF_TIP) {
        at->d1[engine->cfg.axis_count] = fabs(piece->path_rate);
        return;
    }
    way_of_main(engine, path_axes(engine, piece), at);
}

static const spot *spot_at(spots *spots, double s) {
    for (int i = 0; i < SPOTS && i < spots->count; i++) {
        if (spots->last[i].s == s) {
            return &spots->last[i];
        }
    }
    spot *out = &spots->last[spots->count++ % SPOTS];
    *out = (spot){.s = s};
    derivatives(spots->engine, spots->piece, s, out->d1, out->d2, out->d3);
    set_way(spots->engine, spots->piece, out);
    return out;
}

static double bend_at(const struct engine *engine,
                      const struct piece *piece,
                      double s) {
    double d1[NC_AXES] = {0};
    double d2[NC_AXES] = {0};
    double d3[NC_AXES] = {0};
    double sum = 0.0;
    derivatives(engine, piece, s, d1, d2, d3);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        sum += d2[i] * d2[i];
    }
    return sqrt(sum);
}

/* Largest turn per mm of a curve over from..to. Axes that outrun the path
 * (rotary ones over a short way) count by the relative change of their rate,
 * all axes by their own way where the path is that of the tool tip. */
static double turn_rate(spots *spots, double from, double to) {
    const struct engine *engine = spots->engine;
    double bend = 0.0, fast = 0.0, relative = 0.0, most[NC_AXES] = {0},
           change[NC_AXES] = {0};
    for (int k = 0; k < 3; k++) {
        double s = k < 2 ? from + 0.5 * k * (to - from) : to;
        const spot *at = spot_at(spots, s);
        double sum = 0.0;
        double rate = 0.0;
        for (int i = 0; i < engine->cfg.axis_count; i++) {
            sum += at->d2[i] * at->d2[i];
            rate += at->d1[i] * at->d1[i];
            most[i] = greater(most[i], fabs(at->d1[i]));
            change[i] = greater(change[i], fabs(at->d2[i]));
        }
        bend = greater(bend, sqrt(sum));
        fast = greater(fast, sqrt(rate));
    }
    if (curve_of(&engine->store, spots->piece)->natural > 0.0 && fast > 0.0) {
        return bend / fast;
    }
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        relative = hypot(relative, change[i] / greater(1.0, most[i]));
    }
    return lesser(bend, relative);
}

/* The program asks for a slow corner at the start: a short interval of its own
 * holds that speed. */
static double entry_stretch(const engine_config *cfg,
                            const struct piece *piece) {
    return lesser(0.25 * piece->length,
                  greater(1e-3, piece->entry_speed * cfg->cycle_s));
}

/* Where the interval that begins at s ends. */
static double interval_end(spots *spots, double s) {
    const struct engine *engine = spots->engine;
    const struct piece *piece = spots->piece;
    double end = piece->length, bend = 0.0;
    if (s <= 0.0 && piece->entry_speed < NEVER) {
        end = entry_stretch(&engine->cfg, piece);
    }
    if (piece->kind == PIECE_LINE) {
        return end;
    }
    if (piece->kind == PIECE_ARC) {
        bend = fabs(piece->sweep) / piece->whole;
    } else {
        end = lesser(end, curve_piece_cell_end(&engine->store, piece, s));
        bend = turn_rate(spots, s, end);
    }
    double parts = lesser(ceil((end - s) * bend / INTERVAL_TURN - 1e-9),
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
                v = lesser(
                    v,
                    greater(piece_v_max(&engine->cfg, piece, i) / fabs(d1[i]),
                            1e-6));
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
            bend =
                greater(bend,
                        bend_at(engine, piece, from + 0.5 * k * (to - from)));
        }
        if (bend > 1e-12) {
            v = lesser(v,
                       sqrt((double)motion_limits->radial_acceleration / bend));
        }
    }
    v = lesser(v, shared_speed(engine, piece, from, to));
    return v < NEVER ? v : 0.0;
}

/* Weights of the program as shares of the axes' limits, and its limits along
 * the path. */
static void set_shares(const engine_config *cfg,
                       const struct piece *piece,
                       jerk_interval *interval) {
    const struct motion_limits *limits = &piece->limits;
    double acc = INFINITY, jerk = INFINITY, ramp = INFINITY;
    for (int i = 0; i < cfg->axis_count; i++) {
        interval->acc_share[i] = fmaxf(limits->acceleration[i], LEAST_SHARE);
        interval->jerk_share[i] = fmaxf(limits->jerk[i], LEAST_SHARE);
        acc = lesser(acc, cfg->a_max[i]);
        if (cfg->j_max[i] > 0) {
            jerk = lesser(jerk, cfg->j_max[i]);
            ramp = lesser(ramp, cfg->a_max[i] / cfg->j_max[i]);
        }
    }
    if (limits->path_acceleration > 0) {
        interval->path_acc =
            fmaxf(limits->path_acceleration, (float)(LEAST_SHARE * acc));
        interval->path_jerk = interval->path_acc / (float)(LEAST_RAMP * ramp);
    }
    if (limits->path_jerk > 0) {
        float most = fmaxf(limits->path_jerk, (float)(LEAST_SHARE * jerk));
        interval->path_jerk =
            interval->path_jerk > 0 ? fminf(interval->path_jerk, most) : most;
    }
}

/* Derivatives at one end of the interval. */
static void set_end(spots *spots, double s, int end, jerk_interval *interval) {
    const spot *at = spot_at(spots, s);
    memcpy(interval->d1[end], at->d1, sizeof interval->d1[end]);
    memcpy(interval->d2[end], at->d2, sizeof interval->d2[end]);
    memcpy(interval->d3[end], at->d3, sizeof interval->d3[end]);
}

/* The interval that begins as q does ends at `to`. */
static void end_interval(spots *spots, double to, jerk_interval *interval) {
    const struct engine *engine = spots->engine;
    const struct piece *piece = spots->piece;
    double from = interval->offset;
    interval->length = to - from;
    set_end(spots, to, 1, interval);
    interval->v_hard = programmed_speed(engine, piece, from, to);
    set_shares(&engine->cfg, piece, interval);
    interval->blocks = to >= piece->length;
    if (from <= 0.0 && piece->entry_speed < NEVER) {
        interval->v_hard = interval->v_hard > 0.0
                               ? lesser(interval->v_hard, piece->entry_speed)
                               : piece->entry_speed;
    }
}

/* 1 over the speed along the path that the axes allow at a place, s/mm. */
static double least_slowness(const engine_config *cfg, const double *d1) {
    double slow = 0.0;
    for (int i = 0; i < cfg->axis_count; i++) {
        slow = greater(slow, fabs(d1[i]) / cfg->v_max[i]);
    }
    return slow;
}

/* How far the third derivative of the planner's polynomial over q (path.c)
 * misses the curve at the share t, over the largest of the interval: each axis
 * by its jerk limit. q->miss keeps the largest. */
static double curve_miss(spots *spots, jerk_interval *interval, double t) {
    const struct engine *engine = spots->engine;
    const spot *at = spot_at(spots, interval->offset + t * interval->length);
    const double *d3 = at->d3;
    double slow = least_slowness(&engine->cfg, at->d1);
    double most = 0.0;
    double miss = 0.0;
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        double j = engine->cfg.j_max[i] > 0
                       ? engine->cfg.j_max[i]
                       : engine->cfg.a_max[i] / engine->cfg.cycle_s;
        double off = fabs(jerk_third(interval, t, i) - d3[i]);
        /* too little to matter at any speed */
        double noise = CURVE_NOISE * j * (slow * slow * slow);
        if (off > noise) {
            interval->miss[i] = fmaxf(interval->miss[i], (float)off);
        }
        miss = greater(miss, (off - noise) / j);
        most = greater(
            most,
            greater(fabs(d3[i]),
                    greater(fabs(interval->d3[0][i]), fabs(interval->d3[1][i])))
                / j);
    }
    return miss > 0.0 ? miss / most : 0.0;
}

/* What misses evenly shows in the middle, what misses to either side at a
 * quarter. */
static bool fits_curve(spots *spots, jerk_interval *interval) {
    memset(interval->miss, 0, sizeof interval->miss);
    double middle = curve_miss(spots, interval, 0.5),
           quarter = curve_miss(spots, interval, 0.25);
    return middle <= CURVE_MISS && quarter <= CURVE_MISS;
}

/* Shortest interval of a curve that is worth halving: a blend of a micrometre
 * is seen by many cycles if it must be crept through. */
static double shortest_seen(const engine_config *cfg,
                            const jerk_interval *interval) {
    double most = 0.0;
    for (int i = 0; i < cfg->axis_count; i++) {
        double j =
            cfg->j_max[i] > 0 ? cfg->j_max[i] : cfg->a_max[i] / cfg->cycle_s;
        most = greater(
            most,
            greater(fabs(interval->d3[0][i]), fabs(interval->d3[1][i])) / j);
    }
    return most > 0.0 ? lesser(CURVE_SHORTEST,
                               CURVE_UNSEEN * cfg->cycle_s / cbrt(most))
                      : CURVE_SHORTEST;
}

jerk_interval next_interval(const struct engine *engine,
                            const struct piece *piece,
                            uint64_t i,
                            double from) {
    spots spots = {.engine = engine, .piece = piece};
    double to = interval_end(&spots, from);
    jerk_interval interval = {.offset = from,
                              .tag = i,
                              .feed = piece->feed > 0 ? piece->feed
                                                      : piece->v_hard};
    interval.flags = piece->feed > 0
                         ? (piece->flags & NC_NO_OVERRIDE ? JERK_FIXED : 0u)
                         : JERK_RAPID;
    set_end(&spots, from, 0, &interval);
    end_interval(&spots, to, &interval);
    for (int k = 0; piece->kind == PIECE_CURVE && !fits_curve(&spots, &interval)
                    && k < CURVE_HALVINGS
                    && interval.length > shortest_seen(&engine->cfg, &interval);
         k++) {
        to = 0.5 * (from + to);
        end_interval(&spots, to, &interval);
    }
    return interval;
}
