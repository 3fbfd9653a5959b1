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
#include "engine/store/element_map.h"
#include "engine/store/elements.h"
#include "engine/store/piece_push.h"
#include "engine/store/store.h"
#include "rows/nc_block.h"

#define CARRIED_MM 1e-7 /* together they are not longer, */
#define CARRIED_ROWS                                                           \
    2048u /* ... nor more than so many: the PLC goes from element to element   \
           */
#define FADE_MM                                                                \
    1e-4 /* shorter arcs and polynomials do not take a displacement */

static bool too_short(const struct engine *engine, const nc_block *row) {
    if (row->type == NC_POLYNOMIAL
        || row->flags & (NC_EXACT_STOP | NC_BY_PARAMETER | NC_OF_TIP)
        || engine->carried.rows >= CARRIED_ROWS) {
        return false;
    }
    double way = axis_distance(engine, engine->last_end, row->end),
           path = row->length
                  + (engine->carried.rows ? engine->carried.path : 0.0);
    return way <= CARRIED_MM
           && (path <= CARRIED_MM
               || (row->type == NC_LINEAR && way <= STEPPED_OVER_MM
                   && row->length <= CARRIED_MM));
}

/* A motion row: true if it is carried. What cannot take the displacement with
 * it has it driven first. */
bool carry_row(struct engine *e, const nc_block *row) {
    struct carried *c = &e->carried;
    if (!too_short(e, row)) {
        bool bent = row->type != NC_LINEAR;
        if (c->rows >= CARRIED_ROWS || (bent && row->length < FADE_MM)
            || row->flags & (NC_BY_PARAMETER | NC_OF_TIP)) {
            carry_flush(e);
        }
        return false;
    }
    if (!c->rows) {
        c->path = c->programmed = 0.0;
    }
    c->rows++;
    c->row = *row;
    c->path += row->length;
    c->number = e->rows_taken;
    c->element = e->element_head;
    if (row->flags & NC_PIECE) {
        c->programmed += row->value;
    } else {
        push_programmed(e, row);
        map_behind_element(e);
    }
    e->pushed_path += row->length;
    if (row->end_speed > 0.0f) {
        e->end_speed = e->end_speed > 0.0f ? fminf(e->end_speed, row->end_speed)
                                           : row->end_speed;
    }
    return true;
}

/* Something comes that is no motion: the displacement is driven ahead of it. */
void carry_flush(struct engine *engine) {
    struct carried *carried = &engine->carried;
    if (!carried->rows) {
        return;
    }
    nc_block row = carried->row;
    carried->rows = 0;
    row.type = NC_LINEAR;
    row.length = axis_distance(engine, engine->last_end, row.end);
    row.end_speed = 0.0f;
    if (!(row.length > 0.0)) {
        return;
    }
    struct piece *piece = store_slot(engine, &row);
    push_piece(engine, piece, &row);
    piece->row = carried->number;
    if (row.flags & NC_PIECE) {
        map_piece(engine, piece, carried->programmed);
    } else {
        piece->element = carried->element;
        piece->dist0 = engine->distance / TENTH_UM;
    }
    store_publish(engine);
}
