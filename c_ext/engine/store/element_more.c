/* What the extension of the look-ahead tells of elements beside their facts:
 * written by preparation, read by the service. */
#include <string.h>
#include "engine/store/element_more.h"
#include "engine/state/state.h"
#include "rows/nc_block.h"

void note_element(struct engine *engine,
                  const nc_block *row,
                  const double *in,
                  const double *out) {
    struct element_more *more =
        more_at(&engine->store, engine->store.element_head);
    memcpy(more->start, engine->push.element_end, sizeof more->start);
    memcpy(more->end, row->end, sizeof more->end);
    memcpy(more->tangent_in, in, sizeof more->tangent_in);
    memcpy(more->tangent_out, out, sizeof more->tangent_out);
    more->rapid = (row->flags & NC_RAPID) != 0;
    more->feed = more->rapid ? 0.0 : row->feed;
    more->covered = more->driven = row->flags & NC_ELEMENT ? 0.0 : row->length;
}

static void add(double *to, double mm) {
    double sum = *to + mm;
    __atomic_store(to, &sum, __ATOMIC_RELEASE);
}

void note_driven(struct engine *engine,
                 uint64_t element,
                 double from,
                 double programmed,
                 double driven) {
    double rate = programmed > 0.0 ? driven / programmed : 0.0;
    for (; element < engine->store.element_head; element++, from = 0.0) {
        double room =
            element_at(&engine->store, element)->facts.length / TENTH_UM - from;
        bool all = element + 1 == engine->store.element_head
                   || programmed <= room || rate == 0.0;
        double part = all ? programmed : greater(room, 0.0);
        struct element_more *more = more_at(&engine->store, element);
        add(&more->driven, all ? driven : part * rate);
        add(&more->covered, part);
        programmed -= part;
        driven -= part * rate;
        if (all) {
            return;
        }
    }
}

static uint32_t event_type(const nc_block *row) {
    switch (row->type) {
    case NC_DWELL:
        return HLI_CLAH_DWELL;
    case NC_M:
        return HLI_CLAH_M;
    case NC_H:
        return HLI_CLAH_H;
    case NC_S:
        return HLI_CLAH_S;
    case NC_T:
        return HLI_CLAH_T;
    default:
        return HLI_CLAH_NONE;
    }
}

void note_event(struct engine *engine, const nc_block *row) {
    uint32_t type = event_type(row);
    if (type == HLI_CLAH_NONE) {
        return;
    }
    struct piece_store *store = &engine->store;
    *ahead_event_at(store, store->event_head) =
        (ahead_event){.element = store->element_head,
                      .distance = engine->push.distance,
                      .value = row->value,
                      .epoch = engine->push.epoch,
                      .resets = engine->push.resets,
                      .block_type = type,
                      .n = row->n,
                      .count = row->count,
                      .code = row->code};
    ATOMIC_SET(store->event_head, store->event_head + 1);
}
