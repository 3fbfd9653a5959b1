/* Knots where the integral of one over the wanted span length has grown by one.
 */
#include "stages/smoothing/nodes.h"
#include "stages/smoothing/sites.h"
#include "stages/smoothing/state.h"
#include "maths/plain.h"

/* Span lengths wanted at the nodes, grown away from the small ones. */
static void node_sizes(nc_smooth *smooth, int end, double *size) {
    for (int i = 0; i <= end; i++) {
        const struct node *node = &smooth->nodes[i];
        size[i] = node->kind == NODE_BREAK ? REST_SIZE * smooth->tol
                                           : smooth->finer * node->size;
    }
    for (int i = end; i-- > 0;) {
        size[i] = fmin(
            size[i],
            size[i + 1]
                + SIZE_GROWTH * (smooth->nodes[i + 1].t - smooth->nodes[i].t));
    }
    for (int i = 1; i <= end; i++) {
        size[i] = fmin(
            size[i],
            size[i - 1]
                + SIZE_GROWTH * (smooth->nodes[i].t - smooth->nodes[i - 1].t));
    }
}

typedef struct knot_maker {
    double *tau;
    int count, room, passed;
    double remainder; /* of a span still to go */
} knot_maker;

/* Knots where the integral of 1 / size has grown by one, size linear with slope
 * `g` from `size` on, over `length`. */
static void ramp(struct knot_maker *knot_maker,
                 double t,
                 double length,
                 double size,
                 double growth) {
    double at = 0.0;
    while (knot_maker->count < knot_maker->room) {
        double left =
            growth == 0.0
                ? (length - at) / size
                : plain_log((size + growth * length) / (size + growth * at))
                      / growth;
        if (left < knot_maker->remainder) {
            knot_maker->remainder -= left;
            return;
        }
        at = growth == 0.0 ? at + knot_maker->remainder * size
                           : ((size + growth * at)
                                  * plain_exp(growth * knot_maker->remainder)
                              - size)
                                 / growth;
        knot_maker->tau[knot_maker->count++] = whole_parameter(t + at);
        knot_maker->remainder = 1.0;
        knot_maker->passed = 0;
    }
}

static void chord_knots(struct knot_maker *knot_maker,
                        double t,
                        double from,
                        double length,
                        double size_from,
                        double size_to) {
    double top = fmin(
        fmax((size_to - size_from + SIZE_GROWTH * length) / (2.0 * SIZE_GROWTH),
             0.0),
        length); /* the largest size is here */
    if (from < top) {
        ramp(knot_maker,
             t + from,
             top - from,
             size_from + SIZE_GROWTH * from,
             SIZE_GROWTH);
    }
    double begin = fmax(from, top);
    double high = size_to + SIZE_GROWTH * (length - begin);
    if (begin < length) {
        ramp(knot_maker, t + begin, length - begin, high, -SIZE_GROWTH);
    }
}

/* Append knots behind tau[n - 1] up to nodes[end], or as far as there is room;
 * returns the node reached. */
int make_knots(nc_smooth *smooth, double *tau, int *count, int room, int end) {
    double size[NODES];
    node_sizes(smooth, end, size);
    struct knot_maker knot_maker = {tau, *count, room, 0, 1.0};
    double at = tau[*count - 1];
    int i = 0;
    while (i < end && smooth->nodes[i + 1].t <= at) {
        i++;
    }
    for (; i < end && knot_maker.count < room; i++) {
        const struct node *node = &smooth->nodes[i];
        const struct node *behind = node + 1;
        chord_knots(&knot_maker,
                    node->t,
                    fmax(at - node->t, 0.0),
                    behind->t - node->t,
                    size[i],
                    size[i + 1]);
        if (++knot_maker.passed >= NODES_PER_SPAN && knot_maker.count < room
            && behind->t > tau[knot_maker.count - 1]) {
            tau[knot_maker.count++] = behind->t;
            knot_maker.passed = 0;
            knot_maker.remainder = 1.0;
        }
    }
    if (knot_maker.count
        == room) { /* end at the last node that the knots cover */
        while (i > 1 && smooth->nodes[i].t > tau[knot_maker.count - 1]) {
            i--;
        }
    }
    double stop = smooth->nodes[i].t;
    while (knot_maker.count > *count) {
        const double *last = tau + knot_maker.count - 1;
        double left = stop - last[0];
        if (left >= last[0] - last[-1] || left >= size[i]) {
            break;
        }
        knot_maker.count--; /* too short a span */
    }
    tau[knot_maker.count++] = stop;
    *count = knot_maker.count;
    return i;
}
