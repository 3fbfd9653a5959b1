/* The store's slots: pieces in program order. */
#include <stddef.h>
#include <string.h>
#include "engine/store/store.h"
#include "engine/store/marked_log.h"
#include "engine/state/state.h"
#include "rows/nc_block.h"

struct piece *store_slot(struct engine *engine, const nc_block *row) {
    struct piece *piece = store_at(&engine->store, engine->store.head);
    memset(piece, 0, offsetof(struct piece, capped));
    piece->type = row->type;
    piece->n = row->n;
    piece->count = row->count;
    piece->line = row->line;
    piece->file = row->file;
    piece->flags = row->flags;
    piece->origin = engine->store.head;
    piece->row = engine->push.rows_taken;
    piece->dir = 1;
    piece->logged = log_now(engine);
    return piece;
}

void store_publish(struct piece_store *store) {
    ATOMIC_SET(store->head, store->head + 1);
}
