/* Points of the contour between rows and sections. */
#ifndef SMOOTH_NODES_H
#define SMOOTH_NODES_H
#include "stages/smoothing/state.h"

/* The node read last. */
struct node *last_node(nc_smooth *smooth);

/* So many nodes from the front are written. */
void drop_nodes(nc_smooth *smooth, int count);

/* The contour parameter nearest to t whose sums and differences are exact, so
 * that a section is the same wherever it begins. */
double whole_parameter(double t);

/* Distance of two points, scaled. */
double scaled_distance(const nc_smooth *smooth,
                       const double *from,
                       const double *to);

/* The programmed position in the coordinates of the nodes, until it changes. */
const double *position_here(nc_smooth *smooth);
/* How far it is from the last node. */
double way_here(nc_smooth *smooth);
/* A scaled point or direction, into programmed coordinates. */
void turn_back(const nc_smooth *smooth, double *point);

/* Position on the chord behind node i at the contour parameter t. */
void on_chord(const nc_smooth *smooth, int i, double t, double *position);

/* bends.c */
/* The curve over a chord: a cubic with its direction at both ends. */
typedef struct bend {
    /* main axes, scaled; directions as long as the derivatives */
    double from[3], chord[3], into[3], out[3];
    int count;      /* points that it is made of */
    double sagitta; /* by which the lines between them leave it */
} bend;

bool is_bent_row(const nc_block *row);
/* The curve of a row from the programmed position on; false: it is driven as
 * the chord. */
bool bend_of(nc_smooth *smooth, const nc_block *row, bend *out);
/* The main axes of a point, share 0 to 1. */
void bend_at(const nc_smooth *smooth,
             const bend *bend,
             double share,
             double *position);
#endif
