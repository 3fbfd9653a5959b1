/* Motions too short to be driven: nothing jumps for them, and nothing stands at their corners.
 *
 * Such a row becomes an element, but no piece: the next piece begins where the last one ended, and takes the displacement with it. On a
 * line that is another chord; on an arc or a polynomial it fades out towards the end. What ends the path, or orders anything on it, has the
 * displacement driven as a line of its own first.
 */
#include <math.h>
#include "engine/state/state.h"

#define CARRIED_MM 1e-7    /* together they are not longer, */
#define CARRIED_ROWS 2048u /* ... nor more than so many: the PLC goes from element to element */
#define FADE_MM 1e-4       /* shorter arcs and polynomials do not take a displacement */

static double distance(const engine *e, const double *from, const double *to) {
    double sum = 0.0;
    for (int i = 0; i < e->cfg.axis_count; i++) sum += (to[i] - from[i]) * (to[i] - from[i]);
    return sqrt(sum);
}

/* Where the row begins as it is programmed. */
static const double *begins(const engine *e) { return e->carried.rows ? e->carried.row.end : e->last_end; }

/* Length of a line with what is carried to its start. */
static double line_length(const engine *e, const nc_block *row) {
    double whole = distance(e, begins(e), row->end), length = whole > 0.0 ? row->length * distance(e, e->last_end, row->end) / whole : 0.0;
    return length > STEPPED_OVER_MM ? length : row->length;
}

static bool too_short(const engine *e, const nc_block *row) {
    if (row->type == NC_POLYNOMIAL || row->flags & (NC_EXACT_STOP | NC_BY_PARAMETER | NC_OF_TIP) || e->carried.rows >= CARRIED_ROWS) return false;
    double way = distance(e, e->last_end, row->end), path = row->length + (e->carried.rows ? e->carried.path : 0.0);
    return way <= CARRIED_MM && (path <= CARRIED_MM || (row->type == NC_LINEAR && way <= STEPPED_OVER_MM && row->length <= CARRIED_MM));
}

/* A motion row: true if it is carried. What cannot take the displacement with it has it driven first. */
bool carry_row(engine *e, const nc_block *row) {
    carried *c = &e->carried;
    if (!too_short(e, row)) {
        bool bent = row->type != NC_LINEAR;
        if (c->rows >= CARRIED_ROWS || (bent && row->length < FADE_MM) || row->flags & (NC_BY_PARAMETER | NC_OF_TIP)) carry_flush(e);
        return false;
    }
    if (!c->rows) c->path = c->programmed = 0.0;
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
    if (row->end_speed > 0.0f) e->end_speed = e->end_speed > 0.0f ? fminf(e->end_speed, row->end_speed) : row->end_speed;
    return true;
}

/* The geometry of p, which begins where the last piece has ended instead of where its row does. */
void carry_build(engine *e, piece *p, const nc_block *row) {
    double off[NC_AXES];
    for (int i = 0; i < NC_AXES; i++) off[i] = e->last_end[i] - e->carried.row.end[i];
    if (row->type == NC_LINEAR) {
        nc_block line = *row;
        line.length = line_length(e, row);
        piece_build(e, p, &line);
        return;
    }
    if (row->type == NC_POLYNOMIAL) {
        for (int i = 0; i < e->cfg.axis_count; i++) {
            e->next_curve.c[i][0] += off[i];
            e->next_curve.c[i][1] -= off[i];
        }
        piece_build(e, p, row);
        return;
    }
    memcpy(p->start, e->carried.row.end, sizeof p->start);
    piece_build(e, p, row);
    memcpy(p->start, e->last_end, sizeof p->start);
    for (int i = 0; i < e->cfg.axis_count; i++) p->slope[i] -= off[i] / p->length;
    piece_tangent(e, p, 0.0, p->tangent_in);
    piece_tangent(e, p, p->length, p->tangent_out);
}

/* Something comes that is no motion: the displacement is driven ahead of it. */
void carry_flush(engine *e) {
    carried *c = &e->carried;
    if (!c->rows) return;
    nc_block row = c->row;
    c->rows = 0;
    row.type = NC_LINEAR;
    row.length = distance(e, e->last_end, row.end);
    row.end_speed = 0.0f;
    if (!(row.length > 0.0)) return;
    piece *p = store_slot(e, &row);
    push_piece(e, p, &row);
    p->row = c->number;
    if (row.flags & NC_PIECE) {
        map_piece(e, p, c->programmed);
    } else {
        p->element = c->element;
        p->dist0 = e->distance / TENTH_UM;
    }
    store_publish(e);
}
