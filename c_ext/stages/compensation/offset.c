/* Which row is what: selection, compensation, change of side and radius, deselection. */
#include "stages/compensation/offset.h"

#include <math.h>
#include <string.h>

#include "stages/compensation/state.h"
#include "rows/scan.h"

void nc_offset_init(nc_offset *o)
{
    memset(o, 0, sizeof *o);
    o->plane = 17;
    o->mode = NC_OFFSET_INDIRECT;
    o->corner = NC_OFFSET_LINES;
}

/* Rows may pass as they are. */
int nc_offset_idle(const nc_offset *o)
{
    return o->state == OFFSET_OFF && !o->shifted;
}

/* Does the row move an axis of the plane? */
static int is_planar(const nc_offset *o, const nc_block *row)
{
    if (row->type != NC_LINEAR)
        return 1;
    for (int i = 0; i < 2; i++) {
        int axis = offset_axis(o, i);
        if (fabs(row->end[axis] - o->last[axis]) > OFFSET_ZERO_MM)
            return 1;
    }
    return 0;
}

static void set_arc_tangents(nc_element *e)
{
    double sense = e->row.angle > 0.0 ? 1.0 : -1.0;
    for (int i = 0; i < 2; i++) {
        double r[2] = {e->p[i][0] - e->row.center[0], e->p[i][1] - e->row.center[1]}, length = hypot(r[0], r[1]);
        e->t[i][0] = -sense * r[1] / length;
        e->t[i][1] = sense * r[0] / length;
    }
    e->curvature = sense / e->row.radius;
}

static void set_line_tangents(nc_element *e)
{
    double v[2] = {e->p[1][0] - e->p[0][0], e->p[1][1] - e->p[0][1]}, length = hypot(v[0], v[1]);
    for (int i = 0; i < 2; i++) {
        e->t[i][0] = length > 0.0 ? v[0] / length : 1.0;
        e->t[i][1] = length > 0.0 ? v[1] / length : 0.0;
    }
}

/* The row as an element; the offsets are those in force. */
static nc_element element_of(const nc_offset *o, const nc_block *row, int role)
{
    nc_element e = {.row = *row, .role = role, .mode = o->mode, .d = {o->offset, o->offset_next}};
    const double *from = role == OFFSET_APPROACH ? o->pos : o->last;
    for (int i = 0; i < 2; i++) {
        int axis = offset_axis(o, i);
        e.p[0][i] = from[axis];
        e.p[1][i] = row->end[axis];
        e.start[i] = o->pos[axis];
    }
    if (row->type == NC_CIRCULAR)
        set_arc_tangents(&e);
    else
        set_line_tangents(&e);
    return e;
}

static int check_arc(nc_offset *o, const nc_element *e)
{
    double sense = e->row.angle > 0.0 ? 1.0 : -1.0;
    o->detail[0] = e->row.radius;
    o->detail[1] = fabs(e->d[0]);
    return e->row.radius - sense * e->d[0] < OFFSET_ZERO_MM ? offset_fail(o, NC_ERROR_INNER_RADIUS, &e->row) : 0;
}

/* Join the element to the one held back and hold it back in its place. */
static int take(nc_offset *o, nc_element *e)
{
    int error = 0;
    if (e->role == OFFSET_CONTOUR && e->row.type == NC_CIRCULAR)
        error = check_arc(o, e);
    if (!error && o->has_prev)
        error = offset_join(o, e);
    if (error)
        return error;
    o->prev = *e;
    o->has_prev = 1;
    o->offset = o->offset_next;
    return 0;
}

/* A row that does not move in the plane: behind the element held back, or out; the plane's axes stay where they are. */
static int pass(nc_offset *o, const nc_block *row)
{
    if (o->held == NC_OFFSET_HELD)
        return offset_fail(o, NC_ERROR_HELD, row);
    o->rows[o->held++] = *row;
    if (!o->has_prev)
        offset_release(o);
    return 0;
}

/* G237: a line perpendicular to the path, under the number of the block that selected or deselected. */
static void perpendicular_line(nc_offset *o, const nc_block *feed_of, const double end[2])
{
    nc_block like = *feed_of;
    like.n = o->select.n;
    like.line = o->select.line;
    like.count = o->select.count;
    like.file = o->select.file;
    offset_corner_line(o, &like, end);
}

/* The first compensated block behind G237, of any type. */
static int begin_perpendicular(nc_offset *o, const nc_block *row)
{
    o->offset = o->offset_next;
    nc_element e = element_of(o, row, OFFSET_CONTOUR);
    offset_point(e.p[0], e.t[0], e.d[0], e.start);
    o->state = OFFSET_ACTIVE;
    perpendicular_line(o, row, e.start);
    return take(o, &e);
}

static int select_with(nc_offset *o, const nc_block *row)
{
    o->shifted = 0;
    if (o->mode == NC_OFFSET_PERPENDICULAR)
        return begin_perpendicular(o, row);
    if (row->type == NC_CIRCULAR)
        return offset_fail(o, NC_ERROR_SELECTION, row);
    o->state = OFFSET_ACTIVE;
    o->offset = o->offset_next;
    nc_element e = element_of(o, row, OFFSET_APPROACH);
    return take(o, &e);
}

/* From one side to the other: deselection and selection in one line. */
static int change_side(nc_offset *o, const nc_block *row)
{
    if (o->mode == NC_OFFSET_PERPENDICULAR) {
        double p[2] = {o->last[offset_axis(o, 0)], o->last[offset_axis(o, 1)]};
        int error = offset_end_perpendicular(o);
        if (error)
            return error;
        perpendicular_line(o, row, p);
        return begin_perpendicular(o, row);
    }
    nc_block line = *row;
    if (row->type == NC_CIRCULAR) {
        line.type = NC_LINEAR;
        line.plane = 0;
        line.radius = line.programmed_radius = line.angle = line.center[0] = line.center[1] = 0.0;
        o->warning = NC_WARNING_LINEARIZED;
        o->place = *row;
    }
    nc_element e = element_of(o, &line, OFFSET_SWITCH);
    return take(o, &e);
}

static int compensate(nc_offset *o, const nc_block *row)
{
    if (!o->has_prev)
        return offset_fail(o, NC_ERROR_SYNC, row);
    if (o->offset * o->offset_next < 0.0)
        return change_side(o, row);
    if (o->offset != o->offset_next && row->type == NC_CIRCULAR)
        return offset_fail(o, NC_ERROR_RADIUS_CHANGE, row);
    nc_element e = element_of(o, row, OFFSET_CONTOUR);
    return take(o, &e);
}

/* The line from the compensated back to the programmed path. */
static int leave(nc_offset *o, const nc_block *row)
{
    if (row->type == NC_CIRCULAR)
        return offset_fail(o, NC_ERROR_DESELECTION, row);
    nc_element e = element_of(o, row, OFFSET_LEAVE);
    int error = o->has_prev ? offset_join(o, &e) : 0;
    if (!error)
        error = offset_finish(o, &e, e.p[1]);
    o->has_prev = 0;
    o->state = OFFSET_OFF;
    return error;
}

/* Behind G40 of G239: an axis of the plane stays beside its programmed position until it is programmed. */
static int go_home(nc_offset *o, const nc_block *row)
{
    nc_block line = *row;
    if (row->type != NC_LINEAR)
        return offset_fail(o, NC_ERROR_DESELECTION, row);
    o->shifted = 0;
    for (int i = 0; i < 2; i++) {
        int axis = offset_axis(o, i);
        if (line.end[axis] == o->last[axis])
            line.end[axis] = o->pos[axis];
        o->shifted |= line.end[axis] != row->end[axis];
    }
    offset_set_length(o, &line);
    offset_emit(o, &line);
    return 0;
}

static int motion(nc_offset *o, const nc_block *row)
{
    if (o->state != OFFSET_OFF && row->type == NC_POLYNOMIAL)
        return offset_fail(o, NC_ERROR_UNSUPPORTED_ROW, row);
    if (o->state != OFFSET_OFF && row->type == NC_CIRCULAR && row->plane != o->plane)
        return offset_fail(o, NC_ERROR_PLANE, row);
    if (o->state == OFFSET_OFF && o->shifted)
        return go_home(o, row);
    if (o->state == OFFSET_OFF) {
        offset_emit(o, row);
        return 0;
    }
    if (!is_planar(o, row))
        return pass(o, row);
    if (o->state == OFFSET_ARMED)
        return select_with(o, row);
    return o->state == OFFSET_LEAVING ? leave(o, row) : compensate(o, row);
}

/* Does the tool stand on the programmed path? */
static int is_home(const nc_offset *o)
{
    int first = offset_axis(o, 0), second = offset_axis(o, 1);
    return o->pos[first] == o->last[first] && o->pos[second] == o->last[second];
}

/* G40 */
static int deselect(nc_offset *o, const nc_block *row)
{
    int error = 0;
    if (o->state == OFFSET_ARMED)
        o->state = o->shifted || is_home(o) ? OFFSET_OFF : OFFSET_LEAVING;
    if (o->state != OFFSET_ACTIVE)
        return 0;
    if (row->pool != NC_OFFSET_PERPENDICULAR && row->pool != NC_OFFSET_WITHOUT_BLOCK) {
        o->state = OFFSET_LEAVING;
        return 0;
    }
    nc_block feed_of = o->prev.row;
    if (o->has_prev)
        error = offset_end_perpendicular(o);
    o->state = OFFSET_OFF;
    if (row->pool == NC_OFFSET_PERPENDICULAR)
        perpendicular_line(o, &feed_of, (double[2]){o->last[offset_axis(o, 0)], o->last[offset_axis(o, 1)]});
    else
        o->shifted = 1;
    return error;
}

static int select_side(nc_offset *o, const nc_block *row)
{
    int error = 0;
    if (o->state == OFFSET_ACTIVE && row->plane != o->plane)
        return offset_fail(o, NC_ERROR_PLANE, row);
    if (o->state == OFFSET_LEAVING && o->has_prev)
        error = offset_end_perpendicular(o);
    o->plane = row->plane;
    if (offset_axis(o, 0) < 0 || offset_axis(o, 1) < 0)
        return offset_fail(o, NC_ERROR_PLANE_AXIS, row);
    if (o->state != OFFSET_ACTIVE)
        o->state = OFFSET_ARMED;
    o->offset_next = row->code == 41 ? row->value : -row->value;
    return error;
}

static int compensation(nc_offset *o, const nc_block *row)
{
    o->select = *row;
    o->contour_feed = (row->flags & NC_CONTOUR_FEED) != 0;
    o->corner = row->degree;
    int error = row->code == 40 ? deselect(o, row) : select_side(o, row);
    o->mode = (int32_t)row->pool;
    return error;
}

static int step(nc_offset *o, const nc_block *row)
{
    if (row->type == NC_COMPENSATION)
        return compensation(o, row);
    if (row->type <= NC_POLYNOMIAL) {
        int error = motion(o, row);
        memcpy(o->last, row->end, sizeof o->last);
        return error;
    }
    int flush = row->type == NC_FLUSH || (row->type == NC_MARKER && row->code == NC_MARKER_CLEAR);
    if (flush && o->state == OFFSET_ACTIVE)
        return offset_fail(o, NC_ERROR_SYNC, row);
    if (o->state != OFFSET_OFF && (row->type == NC_RT_LOOP_BEGIN || row->type == NC_RT_LOOP_END))
        return offset_fail(o, NC_ERROR_UNSUPPORTED_ROW, row);
    if (flush && o->has_prev) {
        int error = offset_end_perpendicular(o);
        if (error)
            return error;
    }
    return pass(o, row);
}

static void bind(nc_offset *o, nc_block *out, size_t room)
{
    o->out = out;
    o->made = 0;
    o->room = room;
    o->warning = 0;
}

/* Reads rows until one is wrong (error number; it counts as taken) or has a warning. `room`: NC_OFFSET_GROWTH rows for
 * each row read and one for each row held, at least. */
int nc_offset_push(nc_offset *o, const nc_block *in, size_t count, size_t *taken, nc_block *out, size_t room, size_t *made)
{
    int error = 0;
    bind(o, out, room);
    for (*taken = 0; *taken < count && !error && !o->warning; ++*taken)
        error = step(o, &in[*taken]);
    *made = o->made;
    return error;
}

/* Everything held back; what follows in the plane while compensation is active is an error. */
int nc_offset_drain(nc_offset *o, nc_block *out, size_t room, size_t *made)
{
    bind(o, out, room);
    int error = o->has_prev ? offset_end_perpendicular(o) : 0;
    *made = o->made;
    return error;
}

/* The machine stands elsewhere. */
void nc_offset_resync(nc_offset *o, const double *position)
{
    o->has_prev = 0;
    o->held = 0;
    memcpy(o->pos, position, sizeof o->pos);
    if (nc_offset_idle(o))
        memcpy(o->last, position, sizeof o->last);
}

/* Go on behind an error: nothing held back, rows pass as they are until the next selection. */
void nc_offset_forget(nc_offset *o)
{
    o->has_prev = 0;
    o->held = 0;
    o->shifted = 0;
    o->state = OFFSET_OFF;
    memcpy(o->pos, o->last, sizeof o->pos);
}
