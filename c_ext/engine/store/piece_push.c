/* A motion row becomes a piece, with the displacement of short motions ahead of
 * it. */
#include <math.h>
#include <string.h>
#include "engine/store/piece_push.h"
#include "engine/path/piece.h"
#include "engine/state/state.h"
#include "rows/nc_block.h"

static void carry_build(struct engine *engine,
                        struct piece *piece,
                        const nc_block *row);

/* What a motion row says of its piece, but for where that lies on the path. */
void push_piece(struct engine *engine,
                struct piece *piece,
                const nc_block *row) {
    memcpy(piece->start, engine->last_end, sizeof piece->start);
    piece->limits = engine->limits[row->flags & NC_RAPID ? 1 : 0];
    if (engine->carried.rows) {
        carry_build(engine, piece, row);
    } else {
        piece_build(engine, piece, row);
    }
    piece->stop_before = engine->stop_pending || !engine->has_motion_piece;
    piece->new_block =
        engine->has_motion_piece && engine->last_count != piece->count;
    piece->m01 = engine->m01_pending;
    engine->m01_pending = false;
    piece->gated = engine->has_pending_gate;
    piece->need = engine->pending_gate;
    engine->has_pending_gate = false;
    piece->stop_after = row->flags & NC_EXACT_STOP;
    engine->stop_pending = piece->stop_after;
    piece->entry_speed = engine->end_speed > 0 ? engine->end_speed : NEVER;
    engine->end_speed = row->end_speed;
    piece->path0 = engine->pushed_path;
    piece->whole = piece->length;
    memcpy(engine->last_end, row->end, sizeof engine->last_end);
    engine->last_count = piece->count;
    engine->has_motion_piece = true;
}

double axis_distance(const struct engine *engine,
                     const double *from,
                     const double *to) {
    double sum = 0.0;
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        sum += (to[i] - from[i]) * (to[i] - from[i]);
    }
    return sqrt(sum);
}

/* Where the row begins as it is programmed. */
static const double *begins(const struct engine *engine) {
    return engine->carried.rows ? engine->carried.row.end : engine->last_end;
}

/* Length of a line with what is carried to its start. */
static double line_length(const struct engine *engine, const nc_block *row) {
    double whole = axis_distance(engine, begins(engine), row->end),
           length =
               whole > 0.0
                   ? row->length
                         * axis_distance(engine, engine->last_end, row->end)
                         / whole
                   : 0.0;
    return length > STEPPED_OVER_MM ? length : row->length;
}

/* The geometry of p, which begins where the last piece has ended instead of
 * where its row does. */
static void carry_build(struct engine *engine,
                        struct piece *piece,
                        const nc_block *row) {
    double off[NC_AXES];
    for (int i = 0; i < NC_AXES; i++) {
        off[i] = engine->last_end[i] - engine->carried.row.end[i];
    }
    if (row->type == NC_LINEAR) {
        nc_block line = *row;
        line.length = line_length(engine, row);
        piece_build(engine, piece, &line);
        return;
    }
    if (row->type == NC_POLYNOMIAL) {
        for (int i = 0; i < engine->cfg.axis_count; i++) {
            engine->next_curve.c[i][0] += off[i];
            engine->next_curve.c[i][1] -= off[i];
        }
        piece_build(engine, piece, row);
        return;
    }
    memcpy(piece->start, engine->carried.row.end, sizeof piece->start);
    piece_build(engine, piece, row);
    memcpy(piece->start, engine->last_end, sizeof piece->start);
    for (int i = 0; i < engine->cfg.axis_count; i++) {
        piece->slope[i] -= off[i] / piece->length;
    }
    piece_tangent(engine, piece, 0.0, piece->tangent_in);
    piece_tangent(engine, piece, piece->length, piece->tangent_out);
}
