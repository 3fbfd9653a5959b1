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

/* Between programmed coordinates and those of the machine's axes, where a frame
 * behind this stage turns the path: curves are shaped for the axes that drive
 * them. */
static void turn(const nc_smooth *smooth,
                 const double rotation[3][3],
                 double *point) {
    double from[3];
    for (int i = 0; i < 3; i++) {
        int axis = smooth->cfg.main_axis[i];
        from[i] = axis >= 0 ? point[axis] : 0.0;
    }
    for (int i = 0; i < 3; i++) {
        int axis = smooth->cfg.main_axis[i];
        if (axis >= 0) {
            point[axis] = rotation[i][0] * from[0] + rotation[i][1] * from[1]
                          + rotation[i][2] * from[2];
        }
    }
}

const double *position_here(nc_smooth *smooth) {
    if (!smooth->is_turned) {
        return smooth->last;
    }
    memcpy(smooth->here, smooth->last, sizeof smooth->here);
    turn(smooth, smooth->forth, smooth->here);
    return smooth->here;
}

double way_here(nc_smooth *smooth) {
    return scaled_distance(smooth,
                           last_node(smooth)->position,
                           position_here(smooth));
}

void turn_back(const nc_smooth *smooth, double *point) {
    if (smooth->is_turned) {
        turn(smooth, smooth->back, point);
    }
}

void nc_smooth_turn(nc_smooth *smooth, const double *rotation) {
    smooth->is_turned = false;
    for (int i = 0; i < 3; i++) {
        for (int k = 0; k < 3; k++) {
            smooth->forth[i][k] = smooth->back[k][i] = rotation[3 * i + k];
            smooth->is_turned = smooth->is_turned
                                || rotation[3 * i + k] != (i == k ? 1.0 : 0.0);
        }
    }
}
