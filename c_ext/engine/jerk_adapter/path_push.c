/* Path for the jerk-limited planner: pieces of the run ring become intervals,
 * stands their flags. */
#include <math.h>
#include "engine/jerk_adapter/path_push.h"
#include "engine/jerk_adapter/intervals.h"
#include "engine/jerk_adapter/tuning.h"
#include "engine/path/piece.h"
#include "engine/path/stands.h"
#include "engine/state/state.h"
#include "jerk/state/api.h"

static double jerk_of(const engine_config *cfg, int axis) {
    return cfg->j_max[axis] > 0 ? cfg->j_max[axis]
                                : cfg->a_max[axis] / cfg->cycle_s;
}

/* How a corner can be passed at the start of a piece: the path speed at which
 * an axis jumps by what it may, and the share of its jerk that this takes. */
typedef struct passing {
    double speed, share;
} passing;

static struct passing passing_at(const engine_config *cfg,
                                 const struct piece *piece) {
    struct passing out = {INFINITY, 0.0};
    for (int axis = 0; axis < cfg->axis_count; axis++) {
        double j =
            jerk_of(cfg, axis) * fmax(1.0, (double)piece->limits.jerk[axis]);
        double step = fmin(CORNER_SHARE * j * cfg->cycle_s,
                           CORNER_ACC_SHARE * cfg->a_max[axis]);
        double v = step * cfg->cycle_s / fmax(piece->jump[axis], 1e-300);
        if (v < out.speed) {
            out = (struct passing){v, step / (j * cfg->cycle_s)};
        }
    }
    return out;
}

/* A speed that is next to none: at most STAND_SPEED, and what every axis
 * reaches from rest in twice STAND_S. */
static double creeping(const engine_config *cfg, const struct piece *piece) {
    double v = STAND_SPEED;
    for (int axis = 0; axis < cfg->axis_count; axis++) {
        if ((piece->moving >> axis & 1) && cfg->j_max[axis] > 0.0) {
            v = fmin(v, cfg->j_max[axis] * STAND_S * STAND_S);
        }
    }
    return v;
}

/* Acceleration that is come to behind a stand at the start of a piece: of its
 * length half is for the rise, and half of that for the jerk upwards. */
static double used_acceleration(const engine_config *cfg,
                                const struct piece *piece,
                                const double *tangent) {
    double acc = INFINITY;
    double jerk = INFINITY;
    for (int axis = 0; axis < cfg->axis_count; axis++) {
        double rate = fmax(fabs(tangent[axis]), 1e-9);
        acc = fmin(acc, cfg->a_max[axis] / rate);
        jerk = fmin(jerk, jerk_of(cfg, axis) / rate);
    }
    double v = piece->feed > 0.0 ? piece->feed : piece->v_hard;
    return fmin(acc,
                fmin(sqrt(jerk * v), cbrt(0.5 * jerk * jerk * piece->length)));
}

/* A corner is stood at if it could only be crept through, or if that costs more
 * time than it saves: around a jump there is less jerk for the path. The speed
 * of the quickest axis tells what creeping is: where a rotary axis outruns the
 * path, the path is slow everywhere. */
static bool sharp(const struct engine *engine, const struct piece *piece) {
    const engine_config *cfg = &engine->cfg;
    struct passing passing = passing_at(cfg, piece);
    if (passing.speed >= PASSED_SPEED) {
        return false;
    }
    double tangent[NC_AXES] = {0};
    double most = 1.0;
    piece_tangent(engine, piece, 0.0, tangent);
    for (int axis = 0; axis < cfg->axis_count; axis++) {
        most = fmax(most, fabs(tangent[axis]));
    }
    double pays = PASSING_COSTS * passing.share * cfg->cycle_s
                  * used_acceleration(cfg, piece, tangent);
    return passing.speed < fmax(creeping(cfg, piece) / most, pays);
}

/* Whether the axes must stand behind motion i; *known: what follows has been
 * fed. */
static bool stands_behind(struct engine *engine, uint64_t i, bool *known) {
    *known = true;
    if (piece_at(&engine->run, i)->stop_after) {
        return true;
    }
    for (uint64_t k = i + 1; k < engine->run.head; k++) {
        const struct piece *piece = piece_at(&engine->run, k);
        if (stands_before(&engine->plan, piece)) {
            return true;
        }
        if (is_motion(piece)) {
            return sharp(engine, piece);
        }
    }
    *known = false;
    return false;
}

bool adapter_stands_behind(struct engine *engine, uint64_t i) {
    bool known;
    return stands_behind(engine, i, &known);
}

static void close_boundary(struct engine *engine) {
    struct jerk_adapter *adapter = &engine->jerk_adapter;
    int64_t count = jerk_ahead(adapter->planner);
    if (!adapter->open || count == 0) {
        return;
    }
    bool known, stand = stands_behind(engine, adapter->last, &known);
    adapter->open = !known;
    if (known) {
        jerk_stand(adapter->planner, count - 1, stand);
    }
}

/* One interval of piece `next`; a piece too short to be one is stepped over. */
static bool push_interval(struct engine *engine) {
    struct jerk_adapter *adapter = &engine->jerk_adapter;
    const struct piece *piece = piece_at(&engine->run, adapter->next);
    bool whole = true;
    if (piece->length - adapter->at > STEPPED_OVER_MM) {
        jerk_interval interval =
            next_interval(engine, piece, adapter->next, adapter->at);
        int64_t taken = jerk_push(adapter->planner, &interval, 1);
        if (taken < 0) {
            ATOMIC_SET(engine->fault,
                       ENGINE_BAD_PATH); /* it stands ahead of it */
        }
        if (taken != 1) {
            return false;
        }
        adapter->last = adapter->next;
        adapter->has_last = true;
        adapter->open = whole =
            interval.blocks; /* inside a piece there is nothing to stand for */
        adapter->at += interval.length;
    }
    if (whole) {
        adapter->next++;
        adapter->at = 0.0;
    }
    return true;
}

void push_path(struct engine *engine) {
    struct jerk_adapter *adapter = &engine->jerk_adapter;
    close_boundary(engine);
    while (adapter->next < engine->run.head && !jerk_ready(adapter->planner)) {
        if (!is_motion(piece_at(&engine->run, adapter->next))) {
            adapter->next++;
            continue;
        }
        if (adapter->at <= 0.0) {
            close_boundary(engine);
            if (jerk_ready(adapter->planner)) {
                break; /* a stand: one interval behind it is no window */
            }
        }
        if (!push_interval(engine)) {
            break;
        }
    }
    close_boundary(engine);
    jerk_finish(adapter->planner,
                engine->dispatch.final && adapter->next >= engine->run.head);
}

void adapter_restart(struct engine *engine) {
    struct jerk_adapter *adapter = &engine->jerk_adapter;
    jerk_reset(adapter->planner);
    adapter->next = engine->commit.piece;
    adapter->at = engine->commit.s;
    adapter->has_last = adapter->open = adapter->restart = false;
}

/* Pieces change: what the tails were written from does not hold any more. */
static void forget_tails(struct commit_state *commit) {
    for (int i = 0; i < 2; i++) {
        commit->tails[i].edition = 0;
    }
}

void adapter_cut(struct engine *engine, uint64_t head) {
    struct jerk_adapter *adapter = &engine->jerk_adapter;
    if (adapter->next < head || adapter->restart) {
        return;
    }
    forget_tails(&engine->commit);
    int64_t count = jerk_ahead(adapter->planner);
    while (count > 0 && jerk_path(adapter->planner, count - 1)->tag >= head) {
        count--;
    }
    jerk_cut(adapter->planner, count, 0.0);
    if (count > 0) {
        jerk_stand(adapter->planner, count - 1, 0);
    }
    adapter->next = head;
    adapter->at = 0.0;
    adapter->open = adapter->has_last = count > 0;
    if (count > 0) {
        adapter->last = jerk_path(adapter->planner, count - 1)->tag;
    }
}

void adapter_shorten(struct engine *engine, uint64_t i, double s) {
    struct jerk_adapter *adapter = &engine->jerk_adapter;
    bool not_pushed =
        adapter->next < i || (adapter->next == i && adapter->at <= s);
    if (adapter->restart || not_pushed) {
        return;
    }
    forget_tails(&engine->commit);
    int64_t count = jerk_ahead(adapter->planner);
    while (count > 0 && jerk_path(adapter->planner, count - 1)->tag == i
           && jerk_path(adapter->planner, count - 1)->offset
                  >= s - STEPPED_OVER_MM) {
        count--;
    }
    if (count > 0 && jerk_path(adapter->planner, count - 1)->tag == i) {
        jerk_cut(adapter->planner,
                 count - 1,
                 s - jerk_path(adapter->planner, count - 1)->offset);
    }
    adapter->next = i + 1;
    adapter->at = 0.0;
    adapter->open = true;
}

void update_stands(struct engine *engine) {
    jerk_planner *planner = engine->jerk_adapter.planner;
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

void forget_missed_stands(jerk_planner *planner) {
    for (int64_t i = 0, count = jerk_ahead(planner);
         i < count && jerk_passes(planner, i);
         i++) {
        jerk_stand(planner, i, 0);
    }
}
