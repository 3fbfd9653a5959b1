/* Points of the contour between rows and sections. */
#include "stages/smoothing/nodes.h"
#include "stages/smoothing/state.h"
#include "stages/square.h"

struct node *last_node(nc_smooth *smooth) {
    return &smooth->nodes[smooth->n_nodes - 1];
}

void drop_nodes(nc_smooth *smooth, int count) {
    memmove(smooth->nodes,
            smooth->nodes + count,
            sizeof(struct node) * (size_t)(smooth->n_nodes - count));
    smooth->n_nodes -= count;
}

double whole_parameter(double t) {
    return rint(t * PARAMETER_PARTS) / PARAMETER_PARTS;
}

double scaled_distance(const nc_smooth *smooth,
                       const double *from,
                       const double *to) {
    double sum = 0.0;
    for (int i = 0; i < smooth->cfg.axes; i++) {
        sum += square(from[i] - to[i]);
    }
    return sqrt(sum);
}

void on_chord(const nc_smooth *smooth, int i, double t, double *position) {
    const struct node *node = &smooth->nodes[i];
    const struct node *behind = node + 1;
    double share = (t - node->t) / (behind->t - node->t);
    for (int k = 0; k < smooth->cfg.axes; k++) {
        position[k] = node->position[k]
                      + share * (behind->position[k] - node->position[k]);
    }
}
