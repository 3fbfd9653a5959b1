/* The run ring: pieces in the order in which they are driven; copied in, cut
 * off, shortened. */
#include <stddef.h>
#include <string.h>
#include "engine/run/run_ring.h"
#include "engine/commit/planner.h"
#include "engine/path/piece.h"
#include "engine/state/state.h"
#include "hli/sync.h"
#include "rows/nc_block.h"

bool run_has_room(struct run_ring *run) {
    return run->head - ATOMIC_GET(run->done) < run->mask + 1 - KEPT_BEHIND - 8;
}

struct piece *run_copy(struct run_ring *run, const struct piece *from) {
    struct piece *piece = piece_at(run, run->head);
    memcpy(piece, from, offsetof(struct piece, told_line_n));
    piece->capped = piece->spanned = piece->settled = piece->cruises = false;
    piece->corner_v = piece->controllable_v2 = 0.0;
    piece->cruise2 = -1.0;
    piece->span_count = 0;
    return piece;
}

void run_publish(struct run_ring *run) {
    struct piece *piece = piece_at(run, run->head);
    uint64_t line_n = (uint64_t)piece->line << 32 | piece->n;
    __atomic_store_n(&piece->told_line_n, line_n, __ATOMIC_RELAXED);
    __atomic_store_n(&piece->told_file, piece->file, __ATOMIC_RELAXED);
    ATOMIC_SET(run->head, run->head + 1);
}

static struct piece *run_gate(struct engine *engine,
                              const struct piece *from,
                              struct techno_counts need) {
    struct piece *piece = run_copy(&engine->run, from);
    piece->type = NC_EVENT;
    piece->code = EVENT_GATE;
    piece->flags = 0;
    piece->need = need;
    piece->dir = (int8_t)engine->dispatch.dir;
    piece->gated = piece->replay = true;
    piece->stop_before = false;
    run_publish(&engine->run);
    return piece;
}

void run_function(struct engine *engine,
                  const struct piece *from,
                  uint32_t synch) {
    struct techno_counts need = {0};
    need.std_freed = engine->dispatch.pushed.std_freed;
    if (need.std_freed) {
        run_gate(engine, from, need);
    }
    struct piece *piece = run_copy(&engine->run, from);
    piece->flags |= NC_OUTPUT;
    piece->replay = true;
    piece->put_out = false;
    piece->synch = synch;
    piece->dir = (int8_t)engine->dispatch.dir;
    piece->stop_before = false;
    run_publish(&engine->run);
    engine->dispatch.pushed.std_freed++;
    if (!(synch & SYNCH_MVS_SVS)) {
        return;
    }
    engine->dispatch.pushed.std_acked++;
    need =
        (struct techno_counts){.std_acked = engine->dispatch.pushed.std_acked};
    run_gate(engine, from, need);
}

uint64_t run_first_free(struct engine *engine) {
    if (engine->commit.v <= 0.0) {
        return engine->commit.piece + (engine->commit.s > 0.0);
    }
    planner_store_tail(engine);
    uint64_t word = ATOMIC_GET(engine->commit.word);
    return engine->commit.tails[(word >> 1) & 1].piece + 1;
}

/* An inserted stop that is dropped has to be found again; of several the first.
 */
static void drop_stop(struct engine *engine, const struct piece *piece) {
    ATOMIC_SET(engine->stops.fed, engine->stops.fed - 1);
    if (engine->dispatch.dropped_stop) {
        return;
    }
    engine->dispatch.dropped_stop = engine->dispatch.armed = true;
    engine->dispatch.target = piece->path0;
}

/* An inserted stop that stays is one for the motion behind it too, when that is
 * fed again. */
static void stop_behind(struct dispatch *dispatch, const struct piece *piece) {
    if (!piece->inserted || piece->type != NC_M) {
        return;
    }
    if (piece->m01) {
        dispatch->m01 = true;
    } else {
        dispatch->stop = true;
    }
}

void run_cut(struct engine *engine, uint64_t head) {
    for (uint64_t i = head; i < engine->run.head; i++) {
        const struct piece *piece = piece_at(&engine->run, i);
        engine->dispatch.displaced |=
            piece->shortcut
            && (i > engine->commit.piece
                || engine->commit.s <= 0.0); /* not begun: the way back to the
                                              path is still to go */
        if (piece->inserted && piece->type == NC_M) {
            drop_stop(engine, piece);
        }
        if (!piece->replay || !(piece->flags & NC_OUTPUT)) {
            continue;
        }
        engine->dispatch.pushed.std_freed--;
        if (piece->synch & SYNCH_MVS_SVS) {
            engine->dispatch.pushed.std_acked--;
        }
    }
    engine->dispatch.dropped_stop = false;
    engine->commit.fed_anew |= engine->commit.v > 0.0;
    engine->planner->cut(engine, head);
    ATOMIC_SET(engine->run.head, head);
    engine->dispatch.has_motion = engine->dispatch.stop = engine->dispatch.m01 =
        false;
    for (uint64_t i = head;
         i-- > 0 && i + KEPT_BEHIND > engine->commit.piece;) {
        if (!is_motion(piece_at(&engine->run, i))) {
            stop_behind(&engine->dispatch, piece_at(&engine->run, i));
            continue;
        }
        engine->dispatch.last_motion = i;
        engine->dispatch.has_motion = true;
        return;
    }
}

void run_shorten(struct engine *engine, struct piece *piece, double s) {
    double end[NC_AXES];
    piece_position(engine, piece, s, end);
    piece_tangent(engine, piece, s, piece->tangent_out);
    for (int i = 0; i < NC_AXES; i++) {
        store_f64_relaxed(&piece->end[i],
                          end[i]); /* GEO may be in it, ahead of s */
    }
    store_f64_release(&piece->length,
                      s); /* who takes it for the end finds the new end */
    piece->stop_after = piece->spanned = piece->settled = false;
    piece->cruise2 = -1.0;
}
