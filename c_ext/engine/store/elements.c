/* Elements: the facts of the programmed motions that the PLC sees. */
#include <math.h>
#include <string.h>
#include "engine/store/elements.h"
#include "curve/curve.h"
#include "engine/path/piece.h"
#include "engine/state/state.h"
#include "engine/store/element_more.h"
#include "engine/store/marked_log.h"
#include "engine/store/piece_push.h"
#include "rows/nc_block.h"
#include "maths/plain.h"

#define TURN (2.0 * M_PI)
#define ROUNDING_TURNS 1e-9

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

/* Directions of a programmed motion at its two ends, over all axes; of any
 * length. */
typedef struct directions {
    double in[NC_AXES], out[NC_AXES];
} directions;

static void line_directions(const double *start,
                            const nc_block *row,
                            struct directions *to) {
    for (int i = 0; i < NC_AXES; i++) {
        to->in[i] = to->out[i] = row->end[i] - start[i];
    }
}

static void arc_directions(const engine_config *cfg,
                           const double *start,
                           const nc_block *row,
                           struct directions *to) {
    static const int planes[3][2] = {
        {0, 1},
        {2, 0},
        {1, 2},
    };
    int axis1 = cfg->main[planes[row->plane - 17][0]],
        axis2 = cfg->main[planes[row->plane - 17][1]];
    line_directions(start, row, to);
    double d1 = start[axis1] - row->center[0],
           d2 = start[axis2] - row->center[1], c = plain_cos(row->angle),
           s = plain_sin(row->angle);
    to->in[axis1] = -row->angle * d2;
    to->in[axis2] = row->angle * d1;
    to->out[axis1] = -row->angle * (d1 * s + d2 * c);
    to->out[axis2] = row->angle * (d1 * c - d2 * s);
}

static bool names_tangents(const nc_block *row) {
    return row->flags & NC_ELEMENT && row->degree == NC_TANGENTS;
}

/* What is programmed alone decides: neither smoothing nor short motions that
 * the machine leaves out turn an element. */
static void row_directions(struct engine *engine,
                           const nc_block *row,
                           struct directions *to) {
    struct push_state *push = &engine->push;
    const double *start =
        push->element_elsewhere ? push_begins(push) : push->element_end;
    if (names_tangents(row)) {
        memset(to, 0, sizeof *to);
        for (int i = 0; i < 3; i++) {
            if (engine->cfg.main[i] >= 0) {
                to->in[engine->cfg.main[i]] = push->next_tangents[i];
                to->out[engine->cfg.main[i]] = push->next_tangents[3 + i];
            }
        }
    } else if (row->type == NC_POLYNOMIAL) {
        memset(to, 0, sizeof *to);
        curve_tangent(&push->next_curve, 0.0, to->in);
        curve_tangent(&push->next_curve, 1.0, to->out);
    } else if (row->type == NC_CIRCULAR) {
        arc_directions(&engine->cfg, start, row, to);
    } else {
        line_directions(start, row, to);
    }
}

/* Angle to the motion before, 0 where there is none; `in` becomes this one's
 * first direction and `out` its last one, if the main axes move. */
static double tangent_variation(struct engine *engine,
                                const nc_block *row,
                                double *in,
                                double *out) {
    struct directions to;
    double angle = 0.0;
    row_directions(engine, row, &to);
    if (!main_tangent(&engine->cfg, to.in, in)) {
        return 0.0;
    }
    if (engine->push.has_tangent) {
        angle = angle_between(engine->push.last_tangent, in);
    }
    if (main_tangent(&engine->cfg, to.out, out)) {
        memcpy(engine->push.last_tangent,
               out,
               sizeof engine->push.last_tangent);
        engine->push.has_tangent = true;
    }
    return angle;
}

/* First in a real-time loop, inside or first behind it: what is ahead of such
 * an element depends on how the loop is driven. */
static void place_by_loop(struct engine *engine,
                          struct element *el,
                          const double *in) {
    struct push_state *push = &engine->push;
    el->loop = push->loop;
    if (push->in_loop && push->loop_first == UINT64_MAX) {
        el->role = LOOP_FIRST;
        push->loop_first = engine->store.element_head;
        memcpy(push->loop_tangent, in, sizeof push->loop_tangent);
    } else if (push->in_loop) {
        el->role = LOOP_INSIDE;
    } else if (push->behind_loop) {
        el->role = LOOP_BEHIND;
        el->other_variation =
            push->has_before_loop ? angle_between(push->before_loop, in) : 0.0;
    }
    push->behind_loop = false;
}

/* circle_angle stays within a whole turn, as the manual has it; the whole turns
 * of a helix beyond it stand beside it. */
static void set_angle(HLI_CONTOUR_LOOKAHEAD_BLOCK *facts, double angle) {
    double turns = fmax(ceil(fabs(angle) / TURN - ROUNDING_TURNS) - 1.0, 0.0);
    facts->circle_turns = (uint16_t)fmin(turns, UINT16_MAX);
    facts->circle_angle = angle - copysign(TURN * turns, angle);
}

void push_element(struct engine *engine, const nc_block *row) {
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
        set_angle(facts, row->angle);
    }
    double in[3] = {0}, out[3] = {0};
    facts->tangent_variation = tangent_variation(engine, row, in, out);
    el->epoch = engine->push.epoch;
    el->resets = engine->push.resets;
    note_element(engine, row, in, out);
    place_by_loop(engine, el, in);
    engine->push.distance = facts->start_position + facts->length;
    memcpy(engine->push.element_end, row->end, sizeof engine->push.element_end);
    engine->push.element_elsewhere = names_tangents(row);
    log_element(engine, el);
    ATOMIC_SET(engine->store.element_head, engine->store.element_head + 1);
}
