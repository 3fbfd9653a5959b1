/* A motion row becomes a piece, with the displacement of short motions ahead of
 * it. */
#include <math.h>
#include <string.h>
#include "engine/store/piece_push.h"
#include "engine/path/piece.h"
#include "engine/state/state.h"
#include "rows/nc_block.h"

static void short_motions_build(struct engine *engine,
                                struct piece *piece,
                                const nc_block *row);

void push_piece(struct engine *engine,
                struct piece *piece,
                const nc_block *row) {
    memcpy(piece->start, engine->push.last_end, sizeof piece->start);
    piece->limits = engine->push.limits[row->flags & NC_RAPID ? 1 : 0];
    if (engine->push.short_motions.rows) {
        short_motions_build(engine, piece, row);
    } else {
        piece_build(engine, piece, row);
    }
    piece->stop_before =
        engine->push.stop_pending || !engine->push.has_motion_piece;
    piece->new_block = engine->push.begun
                       && (!engine->push.has_motion_piece
                           || engine->push.last_count != piece->count);
    piece->m01 = engine->push.m01_pending;
    engine->push.m01_pending = false;
    piece->gated = engine->technology_rows.has_pending_gate;
    piece->need = engine->technology_rows.pending_gate;
    engine->technology_rows.has_pending_gate = false;
    piece->stop_after = row->flags & NC_EXACT_STOP;
    engine->push.stop_pending = piece->stop_after;
    piece->entry_speed =
        engine->push.end_speed > 0 ? engine->push.end_speed : NEVER;
    engine->push.end_speed = row->end_speed;
    piece->path0 = engine->push.path;
    piece->whole = piece->length;
    memcpy(engine->push.last_end, row->end, sizeof engine->push.last_end);
    engine->push.last_count = piece->count;
    engine->push.has_motion_piece = engine->push.begun = true;
}

double axis_distance(const engine_config *cfg,
                     const double *from,
                     const double *to) {
    double sum = 0.0;
    for (int i = 0; i < cfg->axis_count; i++) {
        sum += (to[i] - from[i]) * (to[i] - from[i]);
    }
    return sqrt(sum);
}

const double *push_begins(const struct push_state *push) {
    return push->short_motions.rows ? push->short_motions.row.end
                                    : push->last_end;
}

/* Length of a line with what is carried to its start. */
static double line_length(const struct engine *engine, const nc_block *row) {
    double whole = axis_distance(&engine->cfg,
                                 push_begins(&engine->push),
                                 row->end),
           length = whole > 0.0 ? row->length
                                      * axis_distance(&engine->cfg,
                                                      engine->push.last_end,
                                                      row->end)
                                      / whole
                                : 0.0;
    return length > STEPPED_OVER_MM ? length : row->length;
}

/* The geometry of p, which begins where the last piece has ended instead of
 * where its row does. */
static void short_motions_build(struct engine *engine,
                                struct piece *piece,
                                const nc_block *row) {
    double off[NC_AXES];
    for (int i = 0; i < NC_AXES; i++) {
        off[i] =
            engine->push.last_end[i] - engine->push.short_motions.row.end[i];
    }
    if (row->type == NC_LINEAR) {
        nc_block line = *row;
        line.length = line_length(engine, row);
        piece_build(engine, piece, &line);
        return;
    }
    if (row->type == NC_POLYNOMIAL) {
        for (int i = 0; i < engine->cfg.axis_count; i++) {
            engine->push.next_curve.c[i][0] += off[i];
            engine->push.next_curve.c[i][1] -= off[i];
        }
        piece_build(engine, piece, row);
        return;
    }
    memcpy(piece->start,
           engine->push.short_motions.row.end,
           sizeof piece->start);
    piece_build(engine, piece, row);
    memcpy(piece->start, engine->push.last_end, sizeof piece->start);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        piece->slope[i] -= off[i] / piece->length;
    }
    piece_tangent(engine, piece, 0.0, piece->tangent_in);
    piece_tangent(engine, piece, piece->length, piece->tangent_out);
}
