/* Zones of corners: how far their jumps use up acceleration, whatever pieces
 * lie there.
 *
 * A sample takes in a cycle to both sides of it. So a jump counts for all that
 * is driven less than a cycle before or behind it, also beyond short pieces
 * that have no corner of their own. Beyond another corner with a zone it cannot
 * reach further than that one's, since less than a cycle is left there.
 */
#include <stdlib.h>
#include "engine/accel/corner_zones.h"
#include "engine/path/speed_caps.h"
#include "engine/path/stands.h"
#include "engine/state/state.h"

bool corner_zones_new(struct engine *engine) {
    engine->accel.corners =
        calloc(engine->run.mask + 1, sizeof(struct used_corner));
    return engine->accel.corners != NULL;
}

static struct used_corner *corner_at(const struct engine *engine,
                                     uint64_t count) {
    return &engine->accel.corners[count & engine->run.mask];
}

/* What is driven in a cycle that begins or ends with a speed, at the most. */
static double zone_of(const engine_config *cfg, double v, double accel) {
    return (v + 0.5 * accel * cfg->cycle_s) * cfg->cycle_s;
}

double corner_zone(const engine_config *cfg,
                   double v,
                   const struct piece *piece) {
    return zone_of(cfg, v, piece->accel);
}

void corner_zones_follow(struct engine *engine, uint64_t i) {
    if (i == engine->accel.zones_to) {
        return;
    }
    engine->accel.corners_head = engine->accel.corners_first;
    engine->accel.capped_at = 0.0;
    if (i > engine->accel.zones_from && i < engine->accel.zones_to) {
        const struct piece *before = piece_at(&engine->run, i - 1);
        engine->accel.corners_head = before->corners;
        engine->accel.capped_at =
            before->at + (is_motion(before) ? before->length : 0.0);
    } else {
        engine->accel.zones_from = i;
    }
    engine->accel.zones_to = i;
}

void corner_zones_note(struct engine *engine,
                       uint64_t i,
                       const struct piece *before,
                       double v) {
    struct piece *piece = piece_at(&engine->run, i);
    piece->at = engine->accel.capped_at;
    if (v >= 0.0) {
        double accel = greater(before->accel, piece->accel);
        *corner_at(engine, engine->accel.corners_head++) =
            (struct used_corner){i,
                                 piece->at,
                                 zone_of(&engine->cfg, v, accel),
                                 accel};
    }
    piece->corners = engine->accel.corners_head;
    if (is_motion(piece)) {
        engine->accel.capped_at += piece->length;
    }
    engine->accel.zones_to = i + 1;
}

/* How far a corner reaches on p, which begins or ends `distance` mm from it. */
static inline double reach_of(const engine_config *cfg,
                              const struct used_corner *used_corner,
                              const struct piece *piece,
                              double distance) {
    double quicker = piece->accel - used_corner->accel,
           reach = used_corner->zone - distance;
    return quicker > 0.0 ? reach + zone_of(cfg, 0.0, quicker) : reach;
}

/* The first corner that reaches a piece; `reach`: at the most what is left of a
 * cycle behind a standstill. */
static void take(struct engine *engine,
                 const struct used_corner *used_corner,
                 bool stands,
                 double reach,
                 const struct piece *piece,
                 zone_use *use) {
    use->reach =
        stands ? lesser(reach, corner_zone(&engine->cfg, 0.0, piece)) : reach;
    use->reserve = piece_at(&engine->run, used_corner->piece)->reserve;
}

static void take_too(struct engine *engine,
                     const struct used_corner *used_corner,
                     zone_use *use) {
    const double *reserve = piece_at(&engine->run, used_corner->piece)->reserve;
    for (int axis = 0; axis < engine->cfg.axis_count; axis++) {
        use->sum[axis] = greater(use->reserve[axis], reserve[axis]);
    }
    use->reserve = use->sum;
}

/* At the start of p, by corners up to there. What is left of a cycle at one is
 * left beyond it, too. */
static void used_ahead(struct engine *engine,
                       const struct piece *piece,
                       zone_use *use) {
    double left = NEVER;
    use->reach = 0.0;
    for (uint64_t count = piece->corners;
         count-- > engine->accel.corners_first;) {
        const struct used_corner *used_corner = corner_at(engine, count);
        left = lesser(left,
                      reach_of(&engine->cfg,
                               used_corner,
                               piece,
                               piece->at - used_corner->at));
        if (left <= 0.0
            || used_corner->piece + CORNERS_BEHIND < engine->commit.piece) {
            return;
        }
        if (use->reach > 0.0) {
            take_too(engine, used_corner, use);
        } else {
            take(engine,
                 used_corner,
                 stands_before(&engine->plan, piece),
                 left,
                 piece,
                 use);
        }
    }
}

/* At the end of p, by corners from there on. */
static void used_behind(struct engine *engine,
                        const struct piece *piece,
                        const struct piece *next,
                        zone_use *use) {
    double end = piece->at + piece->length, left = NEVER;
    use->reach = 0.0;
    for (uint64_t count = piece->corners; count < engine->accel.corners_head;
         count++) {
        const struct used_corner *used_corner = corner_at(engine, count);
        left = lesser(
            left,
            reach_of(&engine->cfg, used_corner, piece, used_corner->at - end));
        if (left <= 0.0) {
            return;
        }
        if (use->reach > 0.0) {
            take_too(engine, used_corner, use);
        } else {
            take(engine,
                 used_corner,
                 !next || stands_before(&engine->plan, next),
                 left,
                 piece,
                 use);
        }
    }
}

void corner_zones_use(struct engine *engine,
                      const struct piece *piece,
                      const struct piece *next,
                      zone_use *first,
                      zone_use *last) {
    static const double none[NC_AXES] = {0};
    first->reserve = last->reserve = none;
    used_ahead(engine, piece, first);
    used_behind(engine, piece, next, last);
}

bool corner_zones_known(struct engine *engine,
                        const struct piece *piece,
                        const struct piece *next) {
    if (!next) {
        return piece->stop_after;
    }
    double known = engine->accel.capped_at - (piece->at + piece->length);
    bool all =
        engine->dispatch.ends && engine->accel.capped == engine->run.head;
    if (known >= corner_zone(&engine->cfg, next->corner_v, piece)
        || stands_before(&engine->plan, next) || all) {
        return true;
    }
    double v = lesser(next->corner_v,
                      greater(reachable(piece, engine->plan.reserve_override),
                              reachable(next, engine->plan.reserve_override)));
    return known >= corner_zone(&engine->cfg, v, piece);
}
