/* Which row is what: selection, compensation, change of side and radius,
 * deselection. */
#include "stages/compensation/offset.h"

#include <math.h>
#include <string.h>

#include "stages/compensation/state.h"
#include "rows/planes.h"
#include "rows/scan.h"

void nc_offset_init(nc_offset *offset) {
    memset(offset, 0, sizeof *offset);
    offset->plane = 17;
    offset->mode = NC_OFFSET_INDIRECT;
    offset->corner = NC_OFFSET_LINES;
}

/* Rows may pass as they are. */
int nc_offset_idle(const nc_offset *offset) {
    return offset->state == OFFSET_OFF && !offset->shifted;
}

/* Does the row move an axis of the plane? */
static int is_planar(const nc_offset *offset, const nc_block *row) {
    if (row->type != NC_LINEAR) {
        return 1;
    }
    for (int i = 0; i < 2; i++) {
        int axis = offset_axis(offset, i);
        if (fabs(row->end[axis] - offset->last[axis]) > OFFSET_ZERO_MM) {
            return 1;
        }
    }
    return 0;
}

static void set_arc_tangents(nc_element *element) {
    double sense = element->row.angle > 0.0 ? 1.0 : -1.0;
    for (int i = 0; i < 2; i++) {
        double radius[2] = {element->p[i][0] - element->row.center[0],
                            element->p[i][1] - element->row.center[1]};
        double length = hypot(radius[0], radius[1]);
        element->t[i][0] = -sense * radius[1] / length;
        element->t[i][1] = sense * radius[0] / length;
    }
    element->curvature = sense / element->row.radius;
}

static void set_line_tangents(nc_element *element) {
    double v[2] = {element->p[1][0] - element->p[0][0],
                   element->p[1][1] - element->p[0][1]};
    double length = hypot(v[0], v[1]);
    for (int i = 0; i < 2; i++) {
        element->t[i][0] = length > 0.0 ? v[0] / length : 1.0;
        element->t[i][1] = length > 0.0 ? v[1] / length : 0.0;
    }
}

/* The row as an element; the offsets are those in force. */
static nc_element element_of(const nc_offset *offset,
                             const nc_block *row,
                             int role) {
    nc_element element = {.row = *row,
                          .role = role,
                          .mode = offset->mode,
                          .d = {offset->offset, offset->offset_next}};
    const double *from = role == OFFSET_APPROACH ? offset->pos : offset->last;
    for (int i = 0; i < 2; i++) {
        int axis = offset_axis(offset, i);
        element.p[0][i] = from[axis];
        element.p[1][i] = row->end[axis];
        element.start[i] = offset->pos[axis];
    }
    if (row->type == NC_CIRCULAR) {
        set_arc_tangents(&element);
    } else {
        set_line_tangents(&element);
    }
    return element;
}

static int check_arc(nc_offset *offset, const nc_element *element) {
    double sense = element->row.angle > 0.0 ? 1.0 : -1.0;
    offset->detail[0] = element->row.radius;
    offset->detail[1] = fabs(element->d[0]);
    return element->row.radius - sense * element->d[0] < OFFSET_ZERO_MM
               ? offset_fail(offset, NC_ERROR_INNER_RADIUS, &element->row)
               : 0;
}

/* Join the element to the one held back and hold it back in its place. */
static int take(nc_offset *offset, nc_element *element) {
    int error = 0;
    if (element->role == OFFSET_CONTOUR && element->row.type == NC_CIRCULAR) {
        error = check_arc(offset, element);
    }
    if (!error && offset->has_prev) {
        error = offset_join(offset, element);
    }
    if (error) {
        return error;
    }
    offset->prev = *element;
    offset->has_prev = 1;
    offset->offset = offset->offset_next;
    return 0;
}

/* A row that does not move in the plane: behind the element held back, or out;
 * the plane's axes stay where they are. */
static int pass(nc_offset *offset, const nc_block *row) {
    if (offset->held == NC_OFFSET_HELD) {
        return offset_fail(offset, NC_ERROR_HELD, row);
    }
    offset->rows[offset->held++] = *row;
    if (!offset->has_prev) {
        offset_release(offset);
    }
    return 0;
}

/* G237: a line perpendicular to the path, under the number of the block that
 * selected or deselected. */
static void perpendicular_line(nc_offset *offset,
                               const nc_block *feed_of,
                               const double end[2]) {
    nc_block like = *feed_of;
    like.n = offset->select.n;
    like.line = offset->select.line;
    like.count = offset->select.count;
    like.file = offset->select.file;
    offset_corner_line(offset, &like, end);
}

/* The first compensated block behind G237, of any type. */
static int begin_perpendicular(nc_offset *offset, const nc_block *row) {
    offset->offset = offset->offset_next;
    nc_element element = element_of(offset, row, OFFSET_CONTOUR);
    offset_point(element.p[0], element.t[0], element.d[0], element.start);
    offset->state = OFFSET_ACTIVE;
    perpendicular_line(offset, row, element.start);
    return take(offset, &element);
}

static int select_with(nc_offset *offset, const nc_block *row) {
    offset->shifted = 0;
    if (offset->mode == NC_OFFSET_PERPENDICULAR) {
        return begin_perpendicular(offset, row);
    }
    if (row->type == NC_CIRCULAR) {
        return offset_fail(offset, NC_ERROR_SELECTION, row);
    }
    offset->state = OFFSET_ACTIVE;
    offset->offset = offset->offset_next;
    nc_element element = element_of(offset, row, OFFSET_APPROACH);
    return take(offset, &element);
}

/* From one side to the other: deselection and selection in one line. */
static int change_side(nc_offset *offset, const nc_block *row) {
    if (offset->mode == NC_OFFSET_PERPENDICULAR) {
        double point[2] = {offset->last[offset_axis(offset, 0)],
                           offset->last[offset_axis(offset, 1)]};
        int error = offset_end_perpendicular(offset);
        if (error) {
            return error;
        }
        perpendicular_line(offset, row, point);
        return begin_perpendicular(offset, row);
    }
    nc_block line = *row;
    if (row->type == NC_CIRCULAR) {
        line.type = NC_LINEAR;
        line.plane = 0;
        line.radius = 0.0;
        line.programmed_radius = 0.0;
        line.angle = 0.0;
        line.center[0] = 0.0;
        line.center[1] = 0.0;
        offset->warning = NC_WARNING_LINEARIZED;
        offset->place = *row;
    }
    nc_element element = element_of(offset, &line, OFFSET_SWITCH);
    return take(offset, &element);
}

static int compensate(nc_offset *offset, const nc_block *row) {
    if (!offset->has_prev) {
        return offset_fail(offset, NC_ERROR_SYNC, row);
    }
    if (offset->offset * offset->offset_next < 0.0) {
        return change_side(offset, row);
    }
    if (offset->offset != offset->offset_next && row->type == NC_CIRCULAR) {
        return offset_fail(offset, NC_ERROR_RADIUS_CHANGE, row);
    }
    nc_element element = element_of(offset, row, OFFSET_CONTOUR);
    return take(offset, &element);
}

/* The line from the compensated back to the programmed path. */
static int leave(nc_offset *offset, const nc_block *row) {
    if (row->type == NC_CIRCULAR) {
        return offset_fail(offset, NC_ERROR_DESELECTION, row);
    }
    nc_element element = element_of(offset, row, OFFSET_LEAVE);
    int error = offset->has_prev ? offset_join(offset, &element) : 0;
    if (!error) {
        error = offset_finish(offset, &element, element.p[1]);
    }
    offset->has_prev = 0;
    offset->state = OFFSET_OFF;
    return error;
}

/* Behind G40 of G239: an axis of the plane stays beside its programmed position
 * until it is programmed. */
static int go_home(nc_offset *offset, const nc_block *row) {
    nc_block line = *row;
    if (row->type != NC_LINEAR) {
        return offset_fail(offset, NC_ERROR_DESELECTION, row);
    }
    offset->shifted = 0;
    for (int i = 0; i < 2; i++) {
        int axis = offset_axis(offset, i);
        if (line.end[axis] == offset->last[axis]) {
            line.end[axis] = offset->pos[axis];
        }
        offset->shifted |= line.end[axis] != row->end[axis];
    }
    offset_set_length(offset, &line);
    offset_emit(offset, &line);
    return 0;
}

static int motion(nc_offset *offset, const nc_block *row) {
    if (offset->state != OFFSET_OFF && row->type == NC_POLYNOMIAL) {
        return offset_fail(offset, NC_ERROR_UNSUPPORTED_ROW, row);
    }
    if (offset->state != OFFSET_OFF && row->type == NC_CIRCULAR
        && row->plane != offset->plane) {
        return offset_fail(offset, NC_ERROR_PLANE, row);
    }
    if (offset->state == OFFSET_OFF && offset->shifted) {
        return go_home(offset, row);
    }
    if (offset->state == OFFSET_OFF) {
        offset_emit(offset, row);
        return 0;
    }
    if (!is_planar(offset, row)) {
        return pass(offset, row);
    }
    if (offset->state == OFFSET_ARMED) {
        return select_with(offset, row);
    }
    return offset->state == OFFSET_LEAVING ? leave(offset, row)
                                           : compensate(offset, row);
}

/* Does the tool stand on the programmed path? */
static int is_home(const nc_offset *offset) {
    int first = offset_axis(offset, 0);
    int second = offset_axis(offset, 1);
    return offset->pos[first] == offset->last[first]
           && offset->pos[second] == offset->last[second];
}

/* G40 */
static int deselect(nc_offset *offset, const nc_block *row) {
    int error = 0;
    if (offset->state == OFFSET_ARMED) {
        offset->state =
            offset->shifted || is_home(offset) ? OFFSET_OFF : OFFSET_LEAVING;
    }
    if (offset->state != OFFSET_ACTIVE) {
        return 0;
    }
    if (row->pool != NC_OFFSET_PERPENDICULAR
        && row->pool != NC_OFFSET_WITHOUT_BLOCK) {
        offset->state = OFFSET_LEAVING;
        return 0;
    }
    nc_block feed_of = offset->prev.row;
    if (offset->has_prev) {
        error = offset_end_perpendicular(offset);
    }
    offset->state = OFFSET_OFF;
    if (row->pool == NC_OFFSET_PERPENDICULAR) {
        perpendicular_line(offset,
                           &feed_of,
                           (double[2]){offset->last[offset_axis(offset, 0)],
                                       offset->last[offset_axis(offset, 1)]});
    } else {
        offset->shifted = 1;
    }
    return error;
}

static int select_side(nc_offset *offset, const nc_block *row) {
    int error = 0;
    if (offset->state == OFFSET_ACTIVE && row->plane != offset->plane) {
        return offset_fail(offset, NC_ERROR_PLANE, row);
    }
    if (offset->state == OFFSET_LEAVING && offset->has_prev) {
        error = offset_end_perpendicular(offset);
    }
    if (!plane_is_there(row->plane, offset->main_axis)) {
        return offset_fail(offset, NC_ERROR_PLANE_AXIS, row);
    }
    offset->plane = row->plane;
    if (offset->state != OFFSET_ACTIVE) {
        offset->state = OFFSET_ARMED;
    }
    offset->offset_next = row->code == 41 ? row->value : -row->value;
    return error;
}

static int compensation(nc_offset *offset, const nc_block *row) {
    offset->select = *row;
    offset->contour_feed = (row->flags & NC_CONTOUR_FEED) != 0;
    offset->corner = row->degree;
    int error =
        row->code == 40 ? deselect(offset, row) : select_side(offset, row);
    offset->mode = (int32_t)row->pool;
    return error;
}

static int step(nc_offset *offset, const nc_block *row) {
    if (row->type == NC_COMPENSATION) {
        return compensation(offset, row);
    }
    if (row->type <= NC_POLYNOMIAL) {
        int error = motion(offset, row);
        memcpy(offset->last, row->end, sizeof offset->last);
        return error;
    }
    int flush = row->type == NC_FLUSH
                || (row->type == NC_MARKER && row->code == NC_MARKER_CLEAR);
    if (flush && offset->state == OFFSET_ACTIVE) {
        return offset_fail(offset, NC_ERROR_SYNC, row);
    }
    if (offset->state != OFFSET_OFF
        && (row->type == NC_RT_LOOP_BEGIN || row->type == NC_RT_LOOP_END)) {
        return offset_fail(offset, NC_ERROR_UNSUPPORTED_ROW, row);
    }
    if (flush && offset->has_prev) {
        int error = offset_end_perpendicular(offset);
        if (error) {
            return error;
        }
    }
    return pass(offset, row);
}

static void bind(nc_offset *offset, nc_block *out, size_t room) {
    offset->out = out;
    offset->made = 0;
    offset->room = room;
    offset->warning = 0;
}

/* Reads rows until one is wrong (error number; it counts as taken) or has a
 * warning. `room`: NC_OFFSET_GROWTH rows for each row read and one for each row
 * held, at least. */
int nc_offset_push(nc_offset *offset,
                   const nc_block *in,
                   size_t count,
                   size_t *taken,
                   nc_block *out,
                   size_t room,
                   size_t *made) {
    int error = 0;
    bind(offset, out, room);
    for (*taken = 0; *taken < count && !error && !offset->warning; ++*taken) {
        error = step(offset, &in[*taken]);
    }
    *made = offset->made;
    return error;
}

/* Everything held back; what follows in the plane while compensation is active
 * is an error. */
int nc_offset_drain(nc_offset *offset,
                    nc_block *out,
                    size_t room,
                    size_t *made) {
    bind(offset, out, room);
    int error = offset->has_prev ? offset_end_perpendicular(offset) : 0;
    *made = offset->made;
    return error;
}

/* The machine stands elsewhere. */
void nc_offset_resync(nc_offset *offset, const double *position) {
    offset->has_prev = 0;
    offset->held = 0;
    memcpy(offset->pos, position, sizeof offset->pos);
    if (nc_offset_idle(offset)) {
        memcpy(offset->last, position, sizeof offset->last);
    }
}

/* Go on behind an error: nothing held back, rows pass as they are until the
 * next selection. */
void nc_offset_forget(nc_offset *offset) {
    offset->has_prev = 0;
    offset->held = 0;
    offset->shifted = 0;
    offset->state = OFFSET_OFF;
    memcpy(offset->pos, offset->last, sizeof offset->pos);
}
