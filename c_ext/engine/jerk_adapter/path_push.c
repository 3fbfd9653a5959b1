/* Path for the jerk-limited planner: pieces of the run ring become intervals,
 * stands their flags. */
#include <math.h>
#include "engine/jerk_adapter/path_push.h"
#include "engine/jerk_adapter/intervals.h"
#include "engine/path/stands.h"
#include "engine/state/state.h"
#include "jerk/planner.h"

#define CORNER_SHARE 0.5 /* of the jerk limit, as in grid.c */
#define CORNER_ACC_SHARE 0.012
#define STAND_SPEED                                                            \
    1.0 /* mm/s: corners that had to be passed below it are stood at */
#define STOP_MARGIN                                                            \
    0.98 /* of the estimated stopping distance: a stand nearer than that is    \
            not tried */

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
void push_path(struct engine *engine) {
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
void adapter_restart(struct engine *engine) {
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
    if (drive->next < head || drive->restart) {
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
    if (drive->restart || drive->next < i
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

/* Stands that the present conditions ask for, as far as they can still be met.
 */
void update_stands(struct engine *engine) {
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
void forget_missed_stands(jerk_planner *planner) {
    for (int64_t i = 0, count = jerk_ahead(planner);
         i < count && jerk_passes(planner, i);
         i++) {
        jerk_stand(planner, i, 0);
    }
}
