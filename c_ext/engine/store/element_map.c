/* From pieces to elements where they are not the same: a smoothed piece covers a stretch of the programmed contour.
 *
 * The displayed distance of such a piece runs with dist_rate = programmed mm per mm of its own; the elements it reaches lie one
 * behind the other on the ring, from `element` to before `element_end`. SDA keeps the cursor where the pieces pushed so
 * far end; GEO walks from the active element, forward or backward.
 */
#include <math.h>
#include "engine/state/state.h"

#define ROUNDING 1e-9 /* mm */

static double start_mm(engine *e, uint64_t i) { return element_at(e, i)->facts.start_position / TENTH_UM; }
static double length_mm(engine *e, uint64_t i) { return element_at(e, i)->facts.length / TENTH_UM; }

/* The motion behind the element pushed last: pieces that follow begin there. */
void map_behind_element(engine *e) {
    e->map_element = e->element_head;
    e->map_from = 0.0;
}

/* SDA: a piece that covers `programmed` mm of the elements from where the piece before ended. */
void map_piece(engine *e, piece *p, double programmed) {
    while (e->map_element + 1 < e->element_head && e->map_from >= length_mm(e, e->map_element) - ROUNDING)
        e->map_from = fmax(e->map_from - length_mm(e, e->map_element++), 0.0);
    p->mapped = true;
    p->element = e->map_element;
    p->element_end = e->element_head;
    p->dist0 = start_mm(e, e->map_element) + e->map_from;
    p->dist_rate = programmed / p->length;
    e->map_from += programmed;
}

/* GEO: the element under the tool, by the displayed distance. */
void map_position(engine *e, const piece *p) {
    geo *g = &e->geo;
    uint64_t i = g->active < p->element ? p->element : g->active < p->element_end ? g->active : p->element_end - 1;
    while (i + 1 < p->element_end && start_mm(e, i + 1) <= g->dist + ROUNDING) i++;
    while (i > p->element && start_mm(e, i) > g->dist + ROUNDING) i--;
    g->element_distance = fmax(g->dist - start_mm(e, i), 0.0);
    g->n = element_at(e, i)->facts.block_number;
    g->count = element_at(e, i)->facts.block_count_r;
    ATOMIC_SET(g->active, i);
}
