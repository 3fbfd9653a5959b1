/* From pieces to elements where they are not the same: a smoothed piece covers
 * a stretch of the programmed contour.
 *
 * The displayed distance of such a piece runs with dist_rate = programmed mm
 * per mm of its own; the elements it reaches lie one behind the other on the
 * ring, from `element` to before `element_end`. SDA keeps the cursor where the
 * pieces pushed so far end; GEO walks from the active element, forward or
 * backward.
 */
#include <math.h>
#include "engine/store/element_map.h"
#include "engine/state/state.h"
#include "engine/store/element_more.h"

#define ROUNDING 1e-9 /* mm */

static double start_mm(struct piece_store *store, uint64_t i) {
    return element_at(store, i)->facts.start_position / TENTH_UM;
}

static double length_mm(struct piece_store *store, uint64_t i) {
    return element_at(store, i)->facts.length / TENTH_UM;
}

void element_map_behind(struct engine *engine) {
    engine->element_map.element = engine->store.element_head;
    engine->element_map.from = 0.0;
}

void element_map_piece(struct engine *engine,
                       struct piece *piece,
                       double programmed) {
    while (engine->element_map.element + 1 < engine->store.element_head
           && engine->element_map.from
                  >= length_mm(&engine->store, engine->element_map.element)
                         - ROUNDING) {
        engine->element_map.from =
            fmax(engine->element_map.from
                     - length_mm(&engine->store, engine->element_map.element++),
                 0.0);
    }
    piece->mapped = true;
    piece->element = engine->element_map.element;
    piece->element_end = engine->store.element_head;
    piece->dist0 = start_mm(&engine->store, engine->element_map.element)
                   + engine->element_map.from;
    piece->dist_rate = programmed / piece->length;
    note_driven(engine,
                engine->element_map.element,
                engine->element_map.from,
                programmed,
                piece->length * piece->path_rate);
    engine->element_map.from += programmed;
}

void element_map_position(struct engine *engine, const struct piece *piece) {
    struct geo *geo = &engine->geo;
    uint64_t i = geo->active < piece->element       ? piece->element
                 : geo->active < piece->element_end ? geo->active
                                                    : piece->element_end - 1;
    while (i + 1 < piece->element_end
           && start_mm(&engine->store, i + 1) <= geo->dist + ROUNDING) {
        i++;
    }
    while (i > piece->element
           && start_mm(&engine->store, i) > geo->dist + ROUNDING) {
        i--;
    }
    geo->element_distance = fmax(geo->dist - start_mm(&engine->store, i), 0.0);
    geo->n = element_at(&engine->store, i)->facts.block_number;
    geo->count = element_at(&engine->store, i)->facts.block_count_r;
    ATOMIC_SET(geo->active, i);
}
