/* From pieces to elements where they are not the same: a smoothed piece covers a stretch of the programmed contour.
 *
 * A piece that is mapped begins `map_from` mm behind the start of its element and covers `map_rate` mm of programmed
 * distance per mm of its own; the elements it reaches lie one behind the other on the ring. SDA keeps the cursor where the
 * pieces pushed so far end, GEO one where it is; both only walk.
 */
#include "engine_internal.h"

#define ROUNDING 1e-9 /* mm */

static double element_mm(engine *e, uint64_t i) { return element_at(e, i)->facts.length / TENTH_UM; }

/* Walk to the element that holds programmed distance *d, measured from the start of *i; elements below `end` exist. */
static void walk(engine *e, uint64_t *i, double *d, uint64_t end) {
    while (*i + 1 < end && *d >= element_mm(e, *i) - ROUNDING) *d -= element_mm(e, (*i)++);
    if (*d < 0.0) *d = 0.0;
}

/* The motion behind the element pushed last: pieces that follow begin there. */
void map_behind_element(engine *e) {
    e->map_element = e->element_head;
    e->map_from = 0.0;
}

/* SDA: a piece that covers `programmed` mm of the elements from where the piece before ended. */
void map_piece(engine *e, piece *p, double programmed) {
    walk(e, &e->map_element, &e->map_from, e->element_head);
    p->mapped = true;
    p->element = e->map_element;
    p->map_from = e->map_from;
    p->map_rate = programmed / p->length;
    e->map_from += programmed;
    p->element_end = e->element_head;
}

/* GEO: the element under the tool and the programmed distance from its start, mm, at path length s of piece p. */
void map_position(engine *e, const piece *p, double s) {
    geo *g = &e->geo;
    uint64_t i = p->element, before = g->active;
    double d = p->map_from + s * p->map_rate;
    if (before > i && before < p->element_end && g->mapped_piece == g->piece && s >= g->mapped_s) {
        i = before; /* go on from where the last cycle found it */
        d += g->mapped_back;
    }
    double start = p->map_from + s * p->map_rate;
    walk(e, &i, &d, p->element_end);
    g->mapped_back = d - start;
    g->mapped_piece = g->piece;
    g->mapped_s = s;
    g->element_distance = d;
    if (i == before) return;
    g->n = element_at(e, i)->facts.block_number;
    g->count = element_at(e, i)->facts.block_count_r;
    ATOMIC_SET(g->active, i);
}
