/* Elements: the facts of the programmed motions that the PLC sees. */
#include <math.h>
#include <string.h>
#include "engine/store/elements.h"
#include "engine/path/piece.h"
#include "engine/state/state.h"
#include "engine/store/element_more.h"
#include "engine/store/marked_log.h"
#include "rows/nc_block.h"

/* Unit tangent of the three main axes; false where none of them moves. */
static bool main_tangent(const engine_config *cfg, const double *u, double *t) {
    double norm = 0.0;
    for (int i = 0; i < 3; i++) {
        t[i] = cfg->main[i] < 0 ? 0.0 : u[cfg->main[i]];
        norm += t[i] * t[i];
    }
    norm = sqrt(norm);
    if (norm < 1e-12) {
        return false;
    }
    for (int i = 0; i < 3; i++) {
        t[i] /= norm;
    }
    return true;
}

static double tangent_variation(struct engine *engine,
                                const struct piece *piece) {
    double in[3], out[3];
    double angle = 0.0;
    if (main_tangent(&engine->cfg, piece->tangent_in, in)) {
        if (engine->push.has_tangent) {
            angle = angle_between(engine->push.last_tangent, in);
        }
        if (main_tangent(&engine->cfg, piece->tangent_out, out)) {
            memcpy(engine->push.last_tangent, out, sizeof out);
            engine->push.has_tangent = true;
        }
    }
    return angle;
}

void push_element(struct engine *engine,
                  const struct piece *piece,
                  const nc_block *row) {
    struct element *el = element_at(&engine->store, engine->store.element_head);
    __atomic_thread_fence(
        __ATOMIC_RELEASE); /* who sees the slot change sees at least the present
                              head (docs/explanation/model/ring.pml) */
    HLI_CONTOUR_LOOKAHEAD_BLOCK *facts = &el->facts;
    memset(el, 0, sizeof *el);
    facts->block_type = row->type == NC_CIRCULAR     ? HLI_CLAH_CIRCULAR
                        : row->type == NC_POLYNOMIAL ? HLI_CLAH_POLYNOMIAL
                                                     : HLI_CLAH_LINEAR;
    facts->block_number = row->n;
    facts->block_count_r = row->count;
    facts->start_position = engine->push.distance;
    facts->length = row->length * TENTH_UM;
    facts->length_min = row->length_min * TENTH_UM;
    if (row->type == NC_CIRCULAR) {
        facts->programmed_radius = row->programmed_radius * TENTH_UM;
        facts->compensated_radius = row->radius * TENTH_UM;
        facts->circle_angle = row->angle;
    }
    facts->tangent_variation = tangent_variation(engine, piece);
    el->epoch = engine->push.epoch;
    el->resets = engine->push.resets;
    note_element(engine, piece, row);
    if (engine->push.in_loop
        && engine->store.element_head
               == store_at(&engine->store, engine->push.loop_begin)->element) {
        main_tangent(&engine->cfg,
                     piece->tangent_in,
                     engine->push.loop_tangent);
    }
    engine->push.distance = facts->start_position + facts->length;
    log_element(engine, el);
    ATOMIC_SET(engine->store.element_head, engine->store.element_head + 1);
}

void push_programmed(struct engine *engine, const nc_block *row) {
    struct piece piece;
    memset(&piece, 0, sizeof piece);
    memcpy(piece.start, engine->push.element_end, sizeof piece.start);
    if (row->degree == NC_TANGENTS) {
        for (int i = 0; i < 3; i++) {
            if (engine->cfg.main[i] < 0) {
                continue;
            }
            piece.tangent_in[engine->cfg.main[i]] =
                engine->push.next_tangents[i];
            piece.tangent_out[engine->cfg.main[i]] =
                engine->push.next_tangents[3 + i];
        }
    } else {
        piece_build(engine, &piece, row);
    }
    push_element(engine, &piece, row);
    memcpy(engine->push.element_end, row->end, sizeof engine->push.element_end);
}
