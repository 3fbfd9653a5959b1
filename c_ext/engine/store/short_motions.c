/* Motions too short to be driven: nothing jumps for them, and nothing stands at
 * their corners.
 *
 * Such a row becomes an element, but no piece: the next piece begins where the
 * last one ended, and takes the displacement with it. On a line that is another
 * chord; on an arc or a polynomial it fades out towards the end. What ends the
 * path, or orders anything on it, has the displacement driven as a line of its
 * own first.
 */
#include <math.h>
#include "engine/store/short_motions.h"
#include "engine/state/state.h"
#include "engine/state/tuning.h"
#include "engine/store/element_map.h"
#include "engine/store/elements.h"
#include "engine/store/piece_push.h"
#include "engine/store/store.h"
#include "rows/nc_block.h"

static bool too_short(const struct engine *engine, const nc_block *row) {
    if (row->type == NC_POLYNOMIAL
        || row->flags & (NC_EXACT_STOP | NC_BY_PARAMETER | NC_OF_TIP)
        || engine->push.short_motions.rows >= SHORT_ROWS) {
        return false;
    }
    double way = axis_distance(&engine->cfg, engine->push.last_end, row->end),
           path = row->length
                  + (engine->push.short_motions.rows
                         ? engine->push.short_motions.path
                         : 0.0);
    return way <= SHORT_MM
           && (path <= SHORT_MM
               || (row->type == NC_LINEAR && way <= STEPPED_OVER_MM
                   && row->length <= SHORT_MM));
}

bool short_motions_row(struct engine *engine, const nc_block *row) {
    struct short_motions *short_motions = &engine->push.short_motions;
    if (!too_short(engine, row)) {
        bool curved = row->type != NC_LINEAR;
        bool cannot_fade = curved && row->length < FADE_MM;
        if (short_motions->rows >= SHORT_ROWS || cannot_fade
            || row->flags & (NC_BY_PARAMETER | NC_OF_TIP)) {
            short_motions_flush(engine);
        }
        return false;
    }
    if (!short_motions->rows) {
        short_motions->path = short_motions->programmed = 0.0;
    }
    short_motions->rows++;
    short_motions->row = *row;
    short_motions->path += row->length;
    short_motions->number = engine->push.rows_taken;
    short_motions->element = engine->store.element_head;
    if (row->flags & NC_PIECE) {
        short_motions->programmed += row->value;
    } else {
        push_element(engine, row);
        element_map_behind(engine);
    }
    engine->push.path += row->length;
    if (row->end_speed > 0.0f) {
        engine->push.end_speed =
            engine->push.end_speed > 0.0f
                ? fminf(engine->push.end_speed, row->end_speed)
                : row->end_speed;
    }
    return true;
}

void short_motions_flush(struct engine *engine) {
    struct short_motions *short_motions = &engine->push.short_motions;
    if (!short_motions->rows) {
        return;
    }
    nc_block row = short_motions->row;
    short_motions->rows = 0;
    row.type = NC_LINEAR;
    row.length = axis_distance(&engine->cfg, engine->push.last_end, row.end);
    row.end_speed = 0.0f;
    if (!(row.length > 0.0)) {
        return;
    }
    struct piece *piece = store_slot(engine, &row);
    push_piece(engine, piece, &row);
    piece->row = short_motions->number;
    if (row.flags & NC_PIECE) {
        element_map_piece(engine, piece, short_motions->programmed);
    } else {
        piece->element = short_motions->element;
        piece->dist0 = engine->push.distance / TENTH_UM;
    }
    store_publish(&engine->store);
}
