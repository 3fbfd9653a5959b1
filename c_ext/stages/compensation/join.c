/* Two neighbouring elements and what lies between them. Rows of a corner carry the numbers of the block before it. */
#include <math.h>
#include <string.h>

#include "stages/compensation/state.h"

const int OFFSET_PLANE_AXES[3][3] = {{0, 1, 2}, {2, 0, 1}, {1, 2, 0}};

/* Channel axis of the plane's i-th axis. */
int offset_axis(const nc_offset *o, int i)
{
    return o->main_axis[OFFSET_PLANE_AXES[o->plane - 17][i]];
}

int offset_fail(nc_offset *o, int error, const nc_block *place)
{
    o->place = *place;
    return error;
}

void offset_emit(nc_offset *o, const nc_block *row)
{
    if (o->made < o->room)
        o->out[o->made] = *row;
    o->made++;
    if (row->type <= NC_POLYNOMIAL)
        memcpy(o->pos, row->end, sizeof o->pos);
}

/* Distance from the last row's end over the main axes, or over the others. */
static double distance(const nc_offset *o, const double *end, int over_main)
{
    double sum = 0.0;
    for (int i = 0; i < o->axes; i++) {
        int is_main = i == o->main_axis[0] || i == o->main_axis[1] || i == o->main_axis[2];
        if (is_main == over_main)
            sum += (end[i] - o->pos[i]) * (end[i] - o->pos[i]);
    }
    return sqrt(sum);
}

void offset_set_length(const nc_offset *o, nc_block *row)
{
    if (row->type == NC_CIRCULAR) {
        int third = offset_axis(o, 2);
        double dz = third < 0 ? 0.0 : row->end[third] - o->pos[third];
        row->length = sqrt(row->radius * row->angle * row->radius * row->angle + dz * dz);
    } else {
        row->length = distance(o, row->end, 1);
        if (row->length < OFFSET_ZERO_MM)
            row->length = distance(o, row->end, 0);
        if (row->length < OFFSET_ZERO_MM)
            row->length = 0.0;
    }
    row->length_min = row->length;
}

static void set_end(const nc_offset *o, nc_block *row, const double end[2])
{
    row->end[offset_axis(o, 0)] = end[0];
    row->end[offset_axis(o, 1)] = end[1];
}

/* A row in the plane from where the tool stands, with numbers and feed of another one. */
static nc_block row_like(const nc_offset *o, const nc_block *like, const double end[2])
{
    nc_block row = *like;
    memcpy(row.end, o->pos, sizeof row.end);
    set_end(o, &row, end);
    row.type = NC_LINEAR;
    row.flags &= (uint16_t)~NC_EXACT_STOP;
    row.radius = row.programmed_radius = row.angle = row.center[0] = row.center[1] = 0.0;
    row.plane = o->plane;
    return row;
}

void offset_corner_line(nc_offset *o, const nc_block *like, const double end[2])
{
    nc_block row = row_like(o, like, end);
    row.plane = 0;
    offset_set_length(o, &row);
    if (row.length > 0.0)
        offset_emit(o, &row);
}

static void corner_arc(nc_offset *o, const nc_block *like, const corner *c, const double end[2])
{
    nc_block row = row_like(o, like, end);
    row.type = NC_CIRCULAR;
    row.center[0] = c->p[0];
    row.center[1] = c->p[1];
    row.radius = fabs(c->d);
    row.angle = -copysign(fabs(c->turn), c->d);
    offset_set_length(o, &row);
    offset_emit(o, &row);
}

/* Rows that stood behind the element held back; those that move (other axes) stay at its end in the plane. */
void offset_release(nc_offset *o)
{
    for (size_t i = 0; i < o->held; i++) {
        nc_block *row = &o->rows[i];
        if (row->type <= NC_POLYNOMIAL)
            set_end(o, row, (double[2]){o->pos[offset_axis(o, 0)], o->pos[offset_axis(o, 1)]});
        offset_emit(o, row);
    }
    o->held = 0;
}

/* How long the element's offset is, along its own direction; negative: it has vanished. */
static double signed_length(const nc_element *e, const double end[2])
{
    return (end[0] - e->start[0]) * e->t[0][0] + (end[1] - e->start[1]) * e->t[0][1];
}

static int finish_arc(nc_offset *o, nc_element *e, nc_block *row, const double end[2])
{
    double sense = row->angle > 0.0 ? 1.0 : -1.0, radius = row->radius - sense * e->d[1];
    double sweep = offset_sweep(e, e->start, end);
    if (sweep * radius < -OFFSET_DAMAGE_MM)
        return offset_fail(o, NC_ERROR_DAMAGE, row);
    if (o->contour_feed)
        row->feed *= radius / row->radius;
    row->radius = radius;
    row->angle = sense * sweep;
    if (sweep * radius < OFFSET_DAMAGE_MM) { /* nothing is left in the plane */
        row->type = NC_LINEAR;
        row->plane = 0;
        row->radius = row->programmed_radius = row->angle = row->center[0] = row->center[1] = 0.0;
    }
    return 0;
}

/* A selection or deselection block with G05: one tangential arc. */
static int is_tangential(const nc_element *e, int role)
{
    return e->mode == NC_OFFSET_TANGENTIAL && e->role == role;
}

/* Write the element from its compensated start to `end`. Nothing is written when nothing of it is left. */
int offset_finish(nc_offset *o, nc_element *e, const double end[2])
{
    nc_block row = e->row;
    int error = 0;
    if (row.type == NC_CIRCULAR)
        error = finish_arc(o, e, &row, end);
    else if (is_tangential(e, OFFSET_LEAVE) && o->has_prev)
        error = offset_tangent_arc(e->start, end, o->prev.t[1], 0, &row) ? 0 : NC_ERROR_TANGENTIAL;
    else if (e->role == OFFSET_CONTOUR && signed_length(e, end) < -OFFSET_DAMAGE_MM)
        error = NC_ERROR_DAMAGE;
    if (error)
        return offset_fail(o, error, &e->row);
    if (row.type == NC_CIRCULAR)
        row.plane = o->plane;
    int gone = e->role == OFFSET_CONTOUR && row.type == NC_LINEAR && signed_length(e, end) < OFFSET_DAMAGE_MM;
    set_end(o, &row, gone && e->row.type == NC_LINEAR ? e->start : end);
    offset_set_length(o, &row);
    if (row.length > 0.0)
        offset_emit(o, &row);
    return 0;
}

/* The selection block with G05 ends tangentially to the element behind it. */
static int finish_tangential(nc_offset *o, nc_element *e, const double end[2], const double t[2])
{
    nc_block row = e->row;
    if (!offset_tangent_arc(e->start, end, t, 1, &row))
        return offset_fail(o, NC_ERROR_TANGENTIAL, &e->row);
    if (row.type == NC_CIRCULAR)
        row.plane = o->plane;
    set_end(o, &row, end);
    offset_set_length(o, &row);
    if (row.length > 0.0)
        offset_emit(o, &row);
    return 0;
}

static int is_straight(const nc_element *e)
{
    return e->row.type == NC_LINEAR;
}

/* Outer corner with lines (G25). Lines run on along their tangent, arcs get a line there; beyond a right angle both run
 * on by the tool radius and one line joins them. */
static int corner_with_lines(nc_offset *o, nc_element *a, nc_element *b, const corner *c)
{
    double end[2], start[2], x[2][2];
    offset_point(c->p, c->t[0], c->d, end);
    offset_point(c->p, c->t[1], c->d, start);
    double reach = fabs(c->d) * tan(0.5 * fmin(fabs(c->turn), 0.5 * OFFSET_PI));
    for (int i = 0; i < 2; i++) {
        x[0][i] = end[i] + reach * c->t[0][i];
        x[1][i] = start[i] - reach * c->t[1][i];
    }
    int error = offset_finish(o, a, is_straight(a) ? x[0] : end);
    if (error)
        return error;
    if (!is_straight(a))
        offset_corner_line(o, &a->row, x[0]);
    if (fabs(c->turn) > 0.5 * OFFSET_PI + 1e-9)
        offset_corner_line(o, &a->row, x[1]);
    if (!is_straight(b))
        offset_corner_line(o, &a->row, start);
    memcpy(b->start, is_straight(b) ? x[1] : start, sizeof b->start);
    return 0;
}

static int corner_with_arc(nc_offset *o, nc_element *a, nc_element *b, const corner *c)
{
    double end[2];
    offset_point(c->p, c->t[0], c->d, end);
    offset_point(c->p, c->t[1], c->d, b->start);
    int error = offset_finish(o, a, end);
    if (!error)
        corner_arc(o, &a->row, c, b->start);
    return error;
}

static corner corner_between(const nc_element *a, const nc_element *b)
{
    corner c = {.p = {b->p[0][0], b->p[0][1]}, .curvature = {a->curvature, b->curvature}, .d = a->d[1]};
    memcpy(c.t[0], a->t[1], sizeof c.t[0]);
    memcpy(c.t[1], b->t[0], sizeof c.t[1]);
    c.turn = offset_turn(c.t[0], c.t[1]);
    return c;
}

static int join_corner(nc_offset *o, nc_element *a, nc_element *b, const corner *c)
{
    if (offset_is_outer(c) && fabs(c->d * c->turn) > OFFSET_JOIN_MM)
        return (o->corner == NC_OFFSET_ARCS ? corner_with_arc : corner_with_lines)(o, a, b, c);
    if (c->d == 0.0)
        memcpy(b->start, c->p, sizeof b->start);
    else if (!offset_meet(c, b->start))
        return offset_fail(o, is_straight(a) || is_straight(b) ? NC_ERROR_DAMAGE : NC_ERROR_CIRCLES, &b->row);
    return offset_finish(o, a, b->start);
}

/* Both meet beside the corner: perpendicular to the contour element of the two. */
static int join_direct(nc_offset *o, nc_element *a, nc_element *b)
{
    if (b->role == OFFSET_CONTOUR)
        offset_point(b->p[0], b->t[0], b->d[0], b->start);
    else
        offset_point(a->p[1], a->t[1], a->d[1], b->start);
    if (is_tangential(a, OFFSET_APPROACH) && b->role == OFFSET_CONTOUR)
        return finish_tangential(o, a, b->start, b->t[0]);
    return offset_finish(o, a, b->start);
}

/* End the element held back where the next one begins, and write it, the corner and the rows behind it. */
int offset_join(nc_offset *o, nc_element *next)
{
    nc_element *prev = &o->prev;
    corner c = corner_between(prev, next);
    int error, inside = prev->role == OFFSET_CONTOUR && next->role == OFFSET_CONTOUR;
    int mode = prev->role == OFFSET_APPROACH ? prev->mode : next->role == OFFSET_LEAVE ? next->mode : 0;
    if (inside || (mode == NC_OFFSET_INDIRECT && offset_is_outer(&c)))
        error = join_corner(o, prev, next, &c);
    else
        error = join_direct(o, prev, next);
    if (!error)
        offset_release(o);
    return error;
}

/* Nothing follows: the element held back ends beside its programmed end. */
int offset_end_perpendicular(nc_offset *o)
{
    double end[2];
    offset_point(o->prev.p[1], o->prev.t[1], o->prev.d[1], end);
    int error = offset_finish(o, &o->prev, end);
    if (!error)
        offset_release(o);
    o->has_prev = 0;
    return error;
}
