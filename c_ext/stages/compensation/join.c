/* Two neighbouring elements and what lies between them. Rows of a corner carry
 * the numbers of the block before it. */
#include <math.h>
#include <string.h>

#include "stages/compensation/state.h"
#include "stages/square.h"
#include "maths/plain.h"

const int OFFSET_PLANE_AXES[3][3] = {
    {0, 1, 2},
    {2, 0, 1},
    {1, 2, 0},
};

/* Channel axis of the plane's i-th axis. */
int offset_axis(const nc_offset *offset, int i) {
    return offset->main_axis[OFFSET_PLANE_AXES[offset->plane - 17][i]];
}

int offset_fail(nc_offset *offset, int error, const nc_block *place) {
    offset->place = *place;
    return error;
}

void offset_emit(nc_offset *offset, const nc_block *row) {
    if (offset->made < offset->room) {
        offset->out[offset->made] = *row;
    }
    offset->made++;
    if (row->type <= NC_POLYNOMIAL) {
        memcpy(offset->pos, row->end, sizeof offset->pos);
    }
}

/* Distance from the last row's end over the main axes, or over the others. */
static double distance(const nc_offset *offset,
                       const double *end,
                       int over_main) {
    double sum = 0.0;
    for (int i = 0; i < offset->axes; i++) {
        int is_main = i == offset->main_axis[0] || i == offset->main_axis[1]
                      || i == offset->main_axis[2];
        if (is_main == over_main) {
            sum += square(end[i] - offset->pos[i]);
        }
    }
    return sqrt(sum);
}

void offset_set_length(const nc_offset *offset, nc_block *row) {
    if (row->type == NC_CIRCULAR) {
        int third = offset_axis(offset, 2);
        double dz = third < 0 ? 0.0 : row->end[third] - offset->pos[third];
        row->length =
            sqrt(row->radius * row->angle * row->radius * row->angle + dz * dz);
    } else {
        row->length = distance(offset, row->end, 1);
        if (row->length < OFFSET_ZERO_MM) {
            row->length = distance(offset, row->end, 0);
        }
        if (row->length < OFFSET_ZERO_MM) {
            row->length = 0.0;
        }
    }
    row->length_min = row->length;
}

static void set_end(const nc_offset *offset,
                    nc_block *row,
                    const double end[2]) {
    row->end[offset_axis(offset, 0)] = end[0];
    row->end[offset_axis(offset, 1)] = end[1];
}

/* A row in the plane from where the tool stands, with numbers and feed of
 * another one. */
static nc_block row_like(const nc_offset *offset,
                         const nc_block *like,
                         const double end[2]) {
    nc_block row = *like;
    memcpy(row.end, offset->pos, sizeof row.end);
    set_end(offset, &row, end);
    row.type = NC_LINEAR;
    row.flags &= (uint16_t)~NC_EXACT_STOP;
    row.radius = 0.0;
    row.programmed_radius = 0.0;
    row.angle = 0.0;
    row.center[0] = 0.0;
    row.center[1] = 0.0;
    row.plane = offset->plane;
    return row;
}

void offset_corner_line(nc_offset *offset,
                        const nc_block *like,
                        const double end[2]) {
    nc_block row = row_like(offset, like, end);
    row.plane = 0;
    offset_set_length(offset, &row);
    if (row.length > 0.0) {
        offset_emit(offset, &row);
    }
}

static void corner_arc(nc_offset *offset,
                       const nc_block *like,
                       const struct corner *corner,
                       const double end[2]) {
    nc_block row = row_like(offset, like, end);
    row.type = NC_CIRCULAR;
    row.center[0] = corner->point[0];
    row.center[1] = corner->point[1];
    row.radius = fabs(corner->distance);
    row.angle = -copysign(fabs(corner->turn), corner->distance);
    offset_set_length(offset, &row);
    offset_emit(offset, &row);
}

/* Rows that stood behind the element held back; those that move (other axes)
 * stay at its end in the plane. */
void offset_release(nc_offset *offset) {
    for (size_t i = 0; i < offset->held; i++) {
        nc_block *row = &offset->rows[i];
        if (row->type <= NC_POLYNOMIAL) {
            set_end(offset,
                    row,
                    (double[2]){offset->pos[offset_axis(offset, 0)],
                                offset->pos[offset_axis(offset, 1)]});
        }
        offset_emit(offset, row);
    }
    offset->held = 0;
}

/* How long the element's offset is, along its own direction; negative: it has
 * vanished. */
static double signed_length(const nc_element *element, const double end[2]) {
    return (end[0] - element->start[0]) * element->t[0][0]
           + (end[1] - element->start[1]) * element->t[0][1];
}

static int finish_arc(nc_offset *offset,
                      nc_element *element,
                      nc_block *row,
                      const double end[2]) {
    double sense = row->angle > 0.0 ? 1.0 : -1.0;
    double radius = row->radius - sense * element->d[1];
    double sweep = offset_sweep(element, element->start, end);
    if (sweep * radius < -OFFSET_DAMAGE_MM) {
        return offset_fail(offset, NC_ERROR_DAMAGE, row);
    }
    if (offset->contour_feed) {
        row->feed *= radius / row->radius;
    }
    row->radius = radius;
    row->angle = sense * sweep;
    if (sweep * radius < OFFSET_DAMAGE_MM) { /* nothing is left in the plane */
        row->type = NC_LINEAR;
        row->plane = 0;
        row->radius = 0.0;
        row->programmed_radius = 0.0;
        row->angle = 0.0;
        row->center[0] = 0.0;
        row->center[1] = 0.0;
    }
    return 0;
}

/* A selection or deselection block with G05: one tangential arc. */
static int is_tangential(const nc_element *element, int role) {
    return element->mode == NC_OFFSET_TANGENTIAL && element->role == role;
}

/* Write the element from its compensated start to `end`. Nothing is written
 * when nothing of it is left. */
int offset_finish(nc_offset *offset, nc_element *element, const double end[2]) {
    nc_block row = element->row;
    int error = 0;
    if (row.type == NC_CIRCULAR) {
        error = finish_arc(offset, element, &row, end);
    } else if (is_tangential(element, OFFSET_LEAVE) && offset->has_prev) {
        error =
            offset_tangent_arc(element->start, end, offset->prev.t[1], 0, &row)
                ? 0
                : NC_ERROR_TANGENTIAL;
    } else if (element->role == OFFSET_CONTOUR
               && signed_length(element, end) < -OFFSET_DAMAGE_MM) {
        error = NC_ERROR_DAMAGE;
    }
    if (error) {
        return offset_fail(offset, error, &element->row);
    }
    if (row.type == NC_CIRCULAR) {
        row.plane = offset->plane;
    }
    int gone = element->role == OFFSET_CONTOUR && row.type == NC_LINEAR
               && signed_length(element, end) < OFFSET_DAMAGE_MM;
    set_end(offset,
            &row,
            gone && element->row.type == NC_LINEAR ? element->start : end);
    offset_set_length(offset, &row);
    if (row.length > 0.0) {
        offset_emit(offset, &row);
    }
    return 0;
}

/* The selection block with G05 ends tangentially to the element behind it. */
static int finish_tangential(nc_offset *offset,
                             nc_element *element,
                             const double end[2],
                             const double t[2]) {
    nc_block row = element->row;
    if (!offset_tangent_arc(element->start, end, t, 1, &row)) {
        return offset_fail(offset, NC_ERROR_TANGENTIAL, &element->row);
    }
    if (row.type == NC_CIRCULAR) {
        row.plane = offset->plane;
    }
    set_end(offset, &row, end);
    offset_set_length(offset, &row);
    if (row.length > 0.0) {
        offset_emit(offset, &row);
    }
    return 0;
}

static int is_straight(const nc_element *element) {
    return element->row.type == NC_LINEAR;
}

/* Outer corner with lines (G25). Lines run on along their tangent, arcs get a
 * line there; beyond a right angle both run on by the tool radius and one line
 * joins them. */
static int corner_with_lines(nc_offset *offset,
                             nc_element *element,
                             nc_element *element_b,
                             const struct corner *corner) {
    double end[2], start[2], x[2][2];
    offset_point(corner->point, corner->t[0], corner->distance, end);
    offset_point(corner->point, corner->t[1], corner->distance, start);
    double reach = fabs(corner->distance)
                   * plain_tan(0.5 * fmin(fabs(corner->turn), 0.5 * OFFSET_PI));
    for (int i = 0; i < 2; i++) {
        x[0][i] = end[i] + reach * corner->t[0][i];
        x[1][i] = start[i] - reach * corner->t[1][i];
    }
    int error =
        offset_finish(offset, element, is_straight(element) ? x[0] : end);
    if (error) {
        return error;
    }
    if (!is_straight(element)) {
        offset_corner_line(offset, &element->row, x[0]);
    }
    if (fabs(corner->turn) > 0.5 * OFFSET_PI + 1e-9) {
        offset_corner_line(offset, &element->row, x[1]);
    }
    if (!is_straight(element_b)) {
        offset_corner_line(offset, &element->row, start);
    }
    memcpy(element_b->start,
           is_straight(element_b) ? x[1] : start,
           sizeof element_b->start);
    return 0;
}

static int corner_with_arc(nc_offset *offset,
                           nc_element *element,
                           nc_element *element_b,
                           const struct corner *corner) {
    double end[2];
    offset_point(corner->point, corner->t[0], corner->distance, end);
    offset_point(corner->point,
                 corner->t[1],
                 corner->distance,
                 element_b->start);
    int error = offset_finish(offset, element, end);
    if (!error) {
        corner_arc(offset, &element->row, corner, element_b->start);
    }
    return error;
}

static struct corner corner_between(const nc_element *element,
                                    const nc_element *element_b) {
    struct corner corner = {
        .point = {element_b->p[0][0], element_b->p[0][1]},
        .curvature = {element->curvature, element_b->curvature},
        .distance = element->d[1]};
    memcpy(corner.t[0], element->t[1], sizeof corner.t[0]);
    memcpy(corner.t[1], element_b->t[0], sizeof corner.t[1]);
    corner.turn = offset_turn(corner.t[0], corner.t[1]);
    return corner;
}

static int join_corner(nc_offset *offset,
                       nc_element *element,
                       nc_element *element_b,
                       const struct corner *corner) {
    if (offset_is_outer(corner)
        && fabs(corner->distance * corner->turn) > OFFSET_JOIN_MM) {
        return (offset->corner == NC_OFFSET_ARCS
                    ? corner_with_arc
                    : corner_with_lines)(offset, element, element_b, corner);
    }
    if (corner->distance == 0.0) {
        memcpy(element_b->start, corner->point, sizeof element_b->start);
    } else if (!offset_meet(corner, element_b->start)) {
        return offset_fail(offset,
                           is_straight(element) || is_straight(element_b)
                               ? NC_ERROR_DAMAGE
                               : NC_ERROR_CIRCLES,
                           &element_b->row);
    }
    return offset_finish(offset, element, element_b->start);
}

/* Both meet beside the corner: perpendicular to the contour element of the two.
 */
static int join_direct(nc_offset *offset,
                       nc_element *element,
                       nc_element *element_b) {
    if (element_b->role == OFFSET_CONTOUR) {
        offset_point(element_b->p[0],
                     element_b->t[0],
                     element_b->d[0],
                     element_b->start);
    } else {
        offset_point(element->p[1],
                     element->t[1],
                     element->d[1],
                     element_b->start);
    }
    if (is_tangential(element, OFFSET_APPROACH)
        && element_b->role == OFFSET_CONTOUR) {
        return finish_tangential(offset,
                                 element,
                                 element_b->start,
                                 element_b->t[0]);
    }
    return offset_finish(offset, element, element_b->start);
}

/* End the element held back where the next one begins, and write it, the corner
 * and the rows behind it. */
int offset_join(nc_offset *offset, nc_element *next) {
    nc_element *prev = &offset->prev;
    struct corner corner = corner_between(prev, next);
    int error;
    int inside = prev->role == OFFSET_CONTOUR && next->role == OFFSET_CONTOUR;
    int mode = prev->role == OFFSET_APPROACH ? prev->mode
               : next->role == OFFSET_LEAVE  ? next->mode
                                             : 0;
    if (inside || (mode == NC_OFFSET_INDIRECT && offset_is_outer(&corner))) {
        error = join_corner(offset, prev, next, &corner);
    } else {
        error = join_direct(offset, prev, next);
    }
    if (!error) {
        offset_release(offset);
    }
    return error;
}

/* Nothing follows: the element held back ends beside its programmed end. */
int offset_end_perpendicular(nc_offset *offset) {
    double end[2];
    offset_point(offset->prev.p[1], offset->prev.t[1], offset->prev.d[1], end);
    int error = offset_finish(offset, &offset->prev, end);
    if (!error) {
        offset_release(offset);
    }
    offset->has_prev = 0;
    return error;
}
