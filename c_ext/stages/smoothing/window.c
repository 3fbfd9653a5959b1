/* One window of a smooth section: knots, weights, iteration, acceptance; what
 * is not accepted falls back to what was. */
#include "stages/smoothing/emit.h"
#include "stages/smoothing/iterate.h"
#include "stages/smoothing/sites.h"
#include "stages/smoothing/nodes.h"
#include "stages/smoothing/spline_fit.h"
#include "stages/smoothing/state.h"
#include "stages/smoothing/window.h"

/* The first or last three control points on the line: position, direction, no
 * curvature. */
static void clamp(nc_smooth *smooth, int chord, int first) {
    struct window *window = &smooth->window;
    for (int j = first; j < first + 3; j++) {
        double t = 0.0;
        for (int k = 1; k <= 5; k++) {
            t += 0.2 * window->tau[j + k];
        }
        t = whole_parameter(t);
        on_chord(smooth, chord, t, window->control[j]);
    }
}

/* Knots, spans and fixed control points from where the section is written to
 * nodes[end]; returns the node reached. */
static int lay_out(nc_smooth *smooth, int end, bool final) {
    struct window *window = &smooth->window;
    window->law_head = law_goes_on(smooth) ? 5 : 0;
    window->timed = false;
    window->kept = 0;
    int count; /* knots up to and with the last one, once */
    if (smooth->keep.valid) {
        count = smooth->keep.spans + 6 < HEAD_KNOTS ? smooth->keep.spans + 6
                                                    : HEAD_KNOTS;
        if (smooth->keep.timed && smooth->keep.spans + 6 - LOOSE > count) {
            count = smooth->keep.spans + 6 - LOOSE;
        }
        memcpy(window->tau, smooth->keep.tau, sizeof(double) * (size_t)count);
        memcpy(window->law, smooth->keep.law, sizeof *window->law * 5);
        window->kept = smooth->keep.timed ? count - 6 : 0;
        window->fixed_head =
            smooth->firm && window->kept > 5 ? window->kept : 5;
        memcpy(window->control,
               smooth->keep.control,
               sizeof window->control[0] * (size_t)window->fixed_head);
    } else {
        for (count = 0; count < 6; count++) {
            window->tau[count] = smooth->out_t;
        }
        window->fixed_head = smooth->nodes[0].kind == NODE_HEAD ? 3 : 1;
    }
    if (window->tau[count - 1] < smooth->nodes[end].t) {
        int reached =
            make_knots(smooth, window->tau, &count, SPANS_ROOM + 5, end);
        if (reached < end) {
            final = false;
        }
        end = reached;
    }
    window->spans = count - 6;
    for (int k = 0; k < 5; k++) {
        window->tau[count + k] = window->tau[count - 1];
    }
    window->fixed_tail = final && smooth->nodes[end].kind == NODE_TAIL ? 3 : 1;
    if (window->fixed_head == 3) {
        clamp(smooth, 0, 0);
    }
    if (window->fixed_head == 1) {
        memcpy(window->control[0],
               smooth->nodes[0].position,
               sizeof smooth->nodes[0].position);
    }
    if (window->fixed_tail == 3) {
        clamp(smooth, end - 1, window->spans + 2);
    }
    memcpy(window->control[window->spans + 4],
           smooth->nodes[end].position,
           sizeof smooth->nodes[0].position);
    for (int k = 0; k < window->spans; k++) {
        spline_span(window, k);
    }
    return end;
}

static int node_behind(const nc_smooth *smooth, double t, int end) {
    int i = 1;
    while (i < end && smooth->nodes[i].t <= t) {
        i++;
    }
    return i;
}

/* Write spans first..last - 1. */
static void write_spans(nc_smooth *smooth,
                        double pieces[][NC_AXES][ORDER],
                        const double *tau,
                        int last,
                        int end) {
    for (int k = 0; k < last; k++) {
        emit_curve(smooth,
                   pieces[k],
                   tau[k + 5],
                   tau[k + 6],
                   &smooth->nodes[node_behind(smooth, tau[k + 5], end)]);
    }
}

static void keep_tail(nc_smooth *smooth, int from) {
    struct window *window = &smooth->window;
    int count = window->spans - from;
    smooth->keep.valid = true;
    smooth->keep.spans = count;
    smooth->keep.timed = window->timed;
    memcpy(smooth->keep.law,
           window->law + from,
           sizeof *window->law * (size_t)(count + 5));
    memcpy(smooth->keep.tau,
           window->tau + from,
           sizeof(double) * (size_t)(count + 11));
    memcpy(smooth->keep.control,
           window->control + from,
           sizeof window->control[0] * (size_t)(count + 5));
}

/* Forget the nodes that end at or before what is written. */
static void forget_nodes(nc_smooth *smooth) {
    int count = 0;
    while (count + 1 < smooth->n_nodes
           && smooth->nodes[count + 1].t <= smooth->out_t) {
        count++;
    }
    drop_nodes(smooth, count);
}

/* The tail that an earlier window left is certified and ends on a node:
 * written, and the section begins anew behind it. */
static void use_tail(nc_smooth *smooth) {
    struct window *window = &smooth->window;
    double pieces[SPANS_ROOM][NC_AXES][ORDER];
    window->spans = smooth->keep.spans;
    memcpy(window->tau,
           smooth->keep.tau,
           sizeof(double) * (size_t)(window->spans + 11));
    memcpy(window->control,
           smooth->keep.control,
           sizeof window->control[0] * (size_t)(window->spans + 5));
    for (int k = 0; k < window->spans; k++) {
        spline_span(window, k);
        spline_piece(window, k, smooth->cfg.axes, pieces[k]);
    }
    write_spans(smooth,
                pieces,
                window->tau,
                window->spans,
                smooth->n_nodes - 1);
    smooth->keep.valid = false;
    forget_nodes(smooth);
    smooth->nodes[0].kind = NODE_BREAK;
}

/* Where what is certified of the section ends; nodes up to there stay. */
static double kept_to(const nc_smooth *smooth) {
    return smooth->keep.valid ? smooth->keep.tau[smooth->keep.spans + 5] : -1.0;
}

/* The sharpest turn behind what is certified; 0: none is sharp. */
static int sharpest(const nc_smooth *smooth, int end) {
    double from = kept_to(smooth);
    double most = SHARP_TURN;
    int found = 0;
    for (int i = 1; i < end; i++) {
        const struct node *node = &smooth->nodes[i];
        if (node->t > from && node->turn > most) {
            most = node->turn;
            found = i;
        }
    }
    return found;
}

/* How far a position is from the chord behind node i. */
static double off_chord(const nc_smooth *smooth,
                        int i,
                        const double *position) {
    const struct node *from = &smooth->nodes[i];
    const struct node *to = from + 1;
    double along = 0.0;
    double length2 = 0.0;
    double nearest[NC_AXES] = {0.0};
    for (int axis = 0; axis < smooth->cfg.axes; axis++) {
        double step = to->position[axis] - from->position[axis];
        along += step * (position[axis] - from->position[axis]);
        length2 += step * step;
    }
    double share = fmin(1.0, fmax(0.0, along / length2));
    on_chord(smooth, i, from->t + share * (to->t - from->t), nearest);
    return scaled_distance(smooth, nearest, position);
}

/* First node of a figure within the tolerance that ends at nodes[end], where
 * the path does, and has begun there; 0: there is none. A curve could shrink it
 * to a point. */
static int figure_from(const nc_smooth *smooth, int end) {
    const struct node *last = &smooth->nodes[end];
    for (int i = end - 2; i >= 0 && last->kind == NODE_BREAK; i--) {
        const struct node *node = &smooth->nodes[i + 1];
        if (scaled_distance(smooth, node->position, last->position)
            > smooth->tol) {
            return 0;
        }
        if (off_chord(smooth, i, last->position) <= ZERO) {
            return i + 1;
        }
    }
    return 0;
}

/* All points of such a figure become corners; false: there is none. */
static bool corners_of_figure(nc_smooth *smooth, int end) {
    int figure = figure_from(smooth, end);
    bool any = false;
    for (int i = figure; figure > 0 && i < end; i++) {
        struct node *node = &smooth->nodes[i];
        if (node->t > kept_to(smooth)) {
            node->kind = NODE_BREAK;
            any = true;
        }
    }
    return any;
}

/* A turn in the way of the curve becomes an exact corner; without one, what is
 * certified is written and blends take the place of the curve. */
static void fall_back(nc_smooth *smooth, int end) {
    smooth->stats.fallbacks++;
    if (corners_of_figure(smooth, end)) {
        return;
    }
    int sharp = sharpest(smooth, end);
    if (sharp > 0) {
        smooth->nodes[sharp].kind = NODE_BREAK;
        return;
    }
    if (smooth->keep.valid) {
        use_tail(smooth);
        return;
    }
    int to = end > 4 ? end / 2 : end;
    corner_path(smooth, to);
    drop_nodes(smooth, to);
    if (smooth->nodes[0].kind == NODE_VERTEX) {
        smooth->nodes[0].kind = NODE_BREAK;
    }
}

/* Spans that are written of a window behind which the section goes on. */
static int commit_of(const struct window *window) {
    int spans = window->spans;
    if (spans <= 6) {
        return spans;
    }
    return spans - 5 < COMMIT_SPANS   ? spans - 5
           : spans > 2 * COMMIT_SPANS ? spans - COMMIT_SPANS
                                      : COMMIT_SPANS;
}

/* Whether the points are far apart beside the knots. */
static bool is_coarse(const nc_smooth *smooth, int end) {
    return smooth->jerk > 0.0 && smooth->window.spans >= COARSE * (double)end;
}

/* A curve for the window that is laid out; then a faster one. */
static bool solve_window(nc_smooth *smooth,
                         int end,
                         bool final,
                         bool coarse,
                         double *deviation) {
    lay_sites(smooth, end);
    bool found = iterate(smooth, end, deviation);
    if (law_goes_on(smooth)) {
        found = take_up(smooth, end, deviation) || found;
    }
    if (found && smooth->jerk > 0.0) {
        int join = final ? 0 : commit_of(&smooth->window);
        refine_window(smooth, end, join, coarse, deviation);
    }
    return found;
}

/* Write what is certified and keep what is not written. */
static void accept(nc_smooth *smooth,
                   int reached,
                   bool final,
                   const double *deviation) {
    double pieces[SPANS_ROOM][NC_AXES][ORDER];
    int spans = smooth->window.spans;
    int commit = final ? spans : commit_of(&smooth->window);
    for (int k = 0; k < commit; k++) {
        note_deviation(smooth, deviation[k]);
        spline_piece(&smooth->window, k, smooth->cfg.axes, pieces[k]);
    }
    write_spans(smooth, pieces, smooth->window.tau, commit, reached);
    smooth->keep.valid = false;
    smooth->measure = spans - commit;
    if (commit < spans) {
        keep_tail(smooth, commit);
    }
    if (final) {
        drop_nodes(smooth, reached);
        return;
    }
    forget_nodes(smooth);
    if (!smooth->keep.valid) {
        smooth->nodes[0].kind = NODE_BREAK;
    }
}

/* Smooth from what is written towards nodes[end]: everything if that is the
 * section's end, else the spans that later nodes hardly change; nothing if more
 * nodes are needed to know them. */
void window_advance(nc_smooth *smooth, int end, bool final) {
    double deviation[SPANS_ROOM];
    /* `firm`: what the window before found stays as it is. A curve that is kept
     * closer goes forward along short chords too. */
    static const struct {
        double finer;
        bool firm;
    } tries[] = {{1.0, false},
                 {1.0, true},
                 {0.5, false},
                 {0.5, true},
                 {0.25, false}};
    int reached = end;
    bool good = false;
    for (size_t k = 0; !good && k < sizeof tries / sizeof *tries; k++) {
        smooth->finer = smooth->closer = tries[k].finer;
        smooth->firm = tries[k].firm;
        if ((smooth->firm && !law_goes_on(smooth))
            || (smooth->closer < 1.0 && figure_from(smooth, end) > 0)) {
            continue;
        }
        reached = lay_out(smooth, end, final);
        if (!final && reached == end && smooth->window.spans < SPANS_LEAST
            && smooth->n_nodes <= NODES_FULL) {
            smooth->measure =
                smooth->window.spans; /* too much of it would be fixed before
                                    what follows is known */
            return;
        }
        bool coarse = is_coarse(smooth, reached);
        if (coarse) {
            smooth->finer = COARSE_SIZE * tries[k].finer;
            reached = lay_out(smooth, end, final);
        }
        good = solve_window(smooth,
                            reached,
                            final && reached == end,
                            coarse,
                            deviation);
    }
    if (!good) {
        fall_back(smooth, reached);
        smooth->measure =
            fmin(smooth->measure - COMMIT_SPANS, (double)SPANS_FULL - 20.0);
        return;
    }
    accept(smooth, reached, final && reached == end, deviation);
}
