/* Stops and functions that the PLC inserts (insert_cmd, hli_reference 5.3):
 * where they lie, and how the path is cut there. */
#include <math.h>
#include <string.h>
#include "engine/run/inserted_stop.h"
#include "engine/commit/planner.h"
#include "engine/path/piece.h"
#include "engine/run/run_ring.h"
#include "engine/state/state.h"
#include "hli/sync.h"
#include "rows/nc_block.h"

#define ROUNDING 1e-6 /* mm */
#define SPARE 0.05    /* of the braking way on a curve */

/* Where in a piece an axis is at `target`: the first place found, or -1. Lines
 * and arcs change direction rarely enough. */
static double axis_crossing(struct engine *engine,
                            const struct piece *piece,
                            int axis,
                            double target,
                            double begin) {
    enum {
        STEPS = 64
    };
    double q[NC_AXES], before, s0 = begin;
    piece_position(engine, piece, begin, q);
    before = q[axis] - target;
    for (int k = 1; k <= STEPS; k++) {
        double s1 = begin + (piece->length - begin) * k / STEPS;
        piece_position(engine, piece, s1, q);
        if (before != 0.0 && before * (q[axis] - target) <= 0.0) {
            for (int i = 0; i < 60; i++) {
                double middle = 0.5 * (s0 + s1);
                piece_position(engine, piece, middle, q);
                if (before * (q[axis] - target) > 0.0) {
                    s0 = middle;
                } else {
                    s1 = middle;
                }
            }
            return s1;
        }
        before = q[axis] - target;
        s0 = s1;
    }
    return -1.0;
}

static double dist_shift(struct geo *geo) {
    double shift;
    __atomic_load(&geo->dist_shift, &shift, __ATOMIC_ACQUIRE);
    return shift;
}

double inserted_stop_in(struct engine *engine,
                        const struct piece *piece,
                        double begin) {
    if (!engine->dispatch.armed) {
        return -1.0;
    }
    if (engine->dispatch.insert.axis) {
        return axis_crossing(engine,
                             piece,
                             engine->dispatch.insert.axis - 1,
                             engine->dispatch.target,
                             begin);
    }
    if (piece->dist_rate <= 0.0) {
        return -1.0;
    }
    double s =
        (engine->dispatch.target - (dist_shift(&engine->geo) + piece->dist0))
        / piece->dist_rate;
    return s > begin + 1e-9 && s <= piece->length + 1e-9
               ? fmin(s, piece->length)
               : -1.0;
}

static double run_dist(struct geo *geo, const struct piece *piece, double s) {
    return dist_shift(geo) + piece->dist0 + piece->dist_rate * s;
}

void insert_stop(struct engine *engine, const struct piece *before) {
    const struct insert_cmd *insert_cmd = &engine->dispatch.insert;
    struct piece stop;
    memset(&stop, 0, sizeof stop);
    stop.kind = PIECE_EVENT;
    stop.type = NC_M;
    stop.inserted = true;
    stop.dir = 1;
    stop.code = insert_cmd->m_function;
    stop.value = insert_cmd->add;
    stop.flags = insert_cmd->add ? NC_HAS_VALUE : 0;
    stop.n = before->n;
    stop.count = before->count;
    stop.line = before->line;
    stop.file = before->file;
    stop.element = before->element;
    stop.origin = before->origin;
    stop.from = before->from + before->length;
    stop.whole = before->whole;
    stop.path0 = engine->dispatch.target;
    memcpy(stop.end, before->end, sizeof stop.end);
    inserted_stop *entry =
        &engine->stops.entries[engine->stops.fed % STOPS_MAX];
    store_f64_relaxed(
        &entry->dist,
        run_dist(&engine->geo,
                 before,
                 before->length)); /* GEO may be showing the stop it replaces */
    for (int i = 0; i < NC_AXES; i++) {
        store_f64_relaxed(&entry->position[i], before->end[i]);
    }
    ATOMIC_SET(engine->stops.fed, engine->stops.fed + 1);
    engine->dispatch.armed = insert_cmd->mode == INSERT_RELATIVE_REPEATED;
    if (engine->dispatch.armed) {
        engine->dispatch.target =
            (insert_cmd->axis ? before->end[insert_cmd->axis - 1] : entry->dist)
            + insert_cmd->value;
    }
    if (insert_cmd->m_function > 1) {
        run_function(engine, &stop, SYNCH_MVS_SVS);
        engine->dispatch.stop = true;
        return;
    }
    struct piece *piece = run_copy(&engine->run, &stop);
    piece->stop_before = insert_cmd->m_function == 0;
    piece->m01 = insert_cmd->m_function == 1;
    run_publish(&engine->run);
    engine->dispatch.stop = piece->stop_before;
    engine->dispatch.m01 = piece->m01;
}

void insert_stop_at_end(struct engine *engine) {
    bool at_end = engine->dispatch.final && engine->dispatch.dir >= 0;
    if (!at_end || !engine->dispatch.armed || !engine->dispatch.has_motion) {
        return;
    }
    if (engine->dispatch.insert.axis
        || engine->dispatch.insert.mode == INSERT_RELATIVE_REPEATED
        || engine->run.head == ATOMIC_GET(engine->run.done)) {
        return;
    }
    insert_stop(engine, piece_at(&engine->run, engine->dispatch.last_motion));
}

static bool is_inserted_stop(const struct piece *piece) {
    return piece->inserted && piece->type == NC_M;
}

/* Feed from piece i of the run ring on anew: a motion or an inserted stop. */
static void dispatch_again_from(struct engine *engine, uint64_t i) {
    const struct piece *piece = piece_at(&engine->run, i);
    bool behind = piece->inserted && piece->from >= piece->whole - 1e-9;
    uint64_t next = behind ? piece->origin + 1 : piece->origin;
    double at = !behind && piece->from > 0.0 ? piece->from : -1.0;
    run_cut(engine, i);
    engine->dispatch.next = next;
    engine->dispatch.at = at;
}

/* Where the path would come to rest if it braked now. */
static uint64_t standstill_piece(struct engine *engine, double *s) {
    planner_store_tail(engine);
    uint64_t word = ATOMIC_GET(engine->commit.word);
    const struct tail *tail = &engine->commit.tails[(word >> 1) & 1];
    *s = engine->commit.v > 0.0 ? tail->s : engine->commit.s;
    return engine->commit.v > 0.0 ? tail->piece : engine->commit.piece;
}

/* How much farther a stop has to lie. A curve that is cut is divided anew, and
 * its parts may allow a little less than the brake that was planned takes. */
static double spare_way(const struct engine *engine, uint64_t i, double s) {
    const struct piece *piece = piece_at(&engine->run, i);
    if (piece->type == NC_LINEAR || engine->commit.v <= 0.0) {
        return ROUNDING;
    }
    double from = engine->commit.piece == i ? engine->commit.s : 0.0;
    return fmax(ROUNDING, SPARE * (s - from));
}

/* The stop lies in the piece in which the path could come to rest: that one is
 * cut in two. */
static bool cut_standstill_piece(struct engine *engine) {
    double remainder;
    uint64_t i = standstill_piece(engine, &remainder);
    if (i >= engine->run.head) {
        return false;
    }
    struct piece *piece = piece_at(&engine->run, i);
    if (!is_motion(piece) || piece->shortcut || piece->dir < 0) {
        return false;
    }
    remainder += spare_way(engine, i, remainder);
    if (!engine->dispatch.insert.axis
        && engine->dispatch.target
               <= run_dist(&engine->geo, piece, remainder)) {
        engine->dispatch.target =
            run_dist(&engine->geo, piece, remainder + ROUNDING);
    }
    double stop = inserted_stop_in(engine, piece, remainder);
    if (stop < 0.0) {
        return false;
    }
    bool armed = engine->dispatch.armed;
    double target = engine->dispatch.target;
    run_cut(engine, i + 1);
    engine->dispatch.armed = armed;
    engine->dispatch.target = target;
    engine->dispatch.last_motion = i;
    engine->dispatch.has_motion = true;
    bool cut = stop < piece->length - 1e-9;
    if (cut) {
        run_shorten(engine, piece, stop);
    }
    if (cut) {
        engine->planner->shorten(engine, i, stop);
    }
    double at =
        piece->from
        + piece
              ->length; /* behind an earlier stop the piece is a part already */
    bool left = at < piece->whole - 1e-9;
    engine->dispatch.next = left ? piece->origin : piece->origin + 1;
    engine->dispatch.at = left ? at : -1.0;
    insert_stop(engine, piece);
    engine->dispatch.stop = true; /* the path comes to rest here, whatever is
                                 inserted: only that is sure to be possible */
    return true;
}

/* An inserted stop, or a motion of the program. */
static bool may_be_fed_again(const struct piece *piece) {
    return is_inserted_stop(piece) || (is_motion(piece) && !piece->shortcut);
}

void take_insert(struct engine *engine) {
    uint32_t request = ATOMIC_GET(engine->orders.insert_requests);
    if (request == engine->dispatch.inserts || engine->dispatch.dir < 0
        || !engine->planner->shorten_tail(engine)) {
        return;
    }
    uint64_t i = run_first_free(engine);
    while (i < engine->run.head
           && !may_be_fed_again(piece_at(&engine->run, i))) {
        i++;
    }
    if (i < engine->run.head) {
        dispatch_again_from(engine,
                            i); /* this drops the stops of the command before */
    }
    struct insert_cmd *insert_cmd = &engine->dispatch.insert;
    *insert_cmd = engine->orders.insert_request;
    engine->dispatch.target = insert_cmd->mode == INSERT_ABSOLUTE
                                  ? insert_cmd->value
                                  : insert_cmd->base + insert_cmd->value;
    engine->dispatch.armed =
        insert_cmd->mode == INSERT_ABSOLUTE
            ? insert_cmd->axis || insert_cmd->value >= insert_cmd->base
            : insert_cmd->value != 0.0;
    if (engine->dispatch.armed) {
        cut_standstill_piece(engine);
    }
    ATOMIC_SET(engine->dispatch.inserts, request);
}
