/* Words of one block -> modal state and at most one motion row. */
#include "rows/scan.h"

#include <math.h>
#include <string.h>

#define RANGE_MM 1e9  /* largest coordinate, radius and feed word */
#define ZERO_MM 1e-9  /* shorter motions do not move */
#define TURNS_MAX 1e6 /* of one helix */
#define SAME_ANGLE 1e-6 /* rad: an arc about a kept centre that sweeps less is a full turn */
#define UNCORRECTED_MM 0.01 /* G164: largest difference of the radii at start and end */
#define PI 3.14159265358979323846
#define CENTRE_WORDS (NC_WORD_I | NC_WORD_J | NC_WORD_K)

/* first, second, third axis of G17, G18, G19 among X, Y, Z */
static const int PLANE_AXES[3][3] = {{0, 1, 2}, {2, 0, 1}, {1, 2, 0}};

/* A circle in its plane. The chord runs from the start to the end, `height` is the centre's distance from the chord,
 * positive on its left. */
typedef struct arc {
    double start[2], chord[2];
    double width; /* of the chord */
    double sense; /* +1 counter-clockwise, -1 clockwise */
    double center[2];
    double radius;
    double sweep;
} arc;

static int in_range(double value)
{
    return fabs(value) <= RANGE_MM; /* false for NaN */
}

void nc_modal_init(nc_modal *m)
{
    memset(m, 0, sizeof *m);
    memset(m->letter_axis, -1, sizeof m->letter_axis);
    for (int i = 0; i < 3; i++)
        m->main_axis[i] = -1;
    for (int i = 0; i < NC_AXES; i++)
        m->mirror[i] = m->share[i] = 1.0;
    m->unit = m->feed_unit = m->feed_factor = m->arc_scale = 1.0;
    m->plane = 17;
    m->absolute = 1;
    m->centre_limit = 2.0;
    m->centre_ratio = 0.05;
}

void nc_words_init(nc_words *w)
{
    memset(w, 0, sizeof *w);
    w->motion = w->plane = w->absolute = w->inch = w->centre_absolute = w->exact_stop = -1;
}

/* Build offset_next again after a change of plane, tool length or zero offset. */
void nc_modal_offsets(nc_modal *m)
{
    int third = m->main_axis[PLANE_AXES[m->plane - 17][2]];
    for (int i = 0; i < NC_AXES; i++)
        m->offset_next[i] = m->zero[i] + (i == third ? m->tool_length : 0.0);
}

static void update_codes(nc_modal *m, const nc_words *w)
{
    if (w->motion >= 0)
        m->motion = (uint8_t)w->motion;
    if (w->absolute >= 0)
        m->absolute = (uint8_t)w->absolute;
    if (w->centre_absolute >= 0)
        m->centre_absolute = (uint8_t)w->centre_absolute;
    if (w->exact_stop >= 0)
        m->exact_stop = (uint8_t)w->exact_stop;
    if (w->inch >= 0)
        m->unit = w->inch ? 25.4 : 1.0;
    if (w->plane >= 0 && w->plane != m->plane) {
        m->plane = (uint8_t)w->plane;
        nc_modal_offsets(m);
    }
}

static int update_values(nc_modal *m, const nc_words *w)
{
    if (m->rules & NC_RULE_RADIUS_ONCE)
        m->has_radius = 0;
    if (w->set & NC_WORD_F) {
        if (!in_range(w->f))
            return NC_ERROR_RANGE;
        m->feed = w->f;
        m->feed_unit = m->unit;
    }
    for (int i = 0; i < 3; i++)
        if (w->set & (NC_WORD_I << i))
            m->centre_word[i] = w->centre[i];
    if (w->set & NC_WORD_R) {
        if (!in_range(w->r * m->unit))
            return NC_ERROR_RANGE;
        m->radius = w->r * m->unit;
        m->has_radius = 1;
    }
    return 0;
}

static int find_target(nc_modal *m, const nc_words *w, double *target)
{
    memcpy(target, m->pos, sizeof m->pos);
    for (int i = 0; i < m->axes; i++) {
        if (!(w->axis_set & (1u << i)))
            continue;
        double word = w->axis[i] * m->mirror[i] * m->share[i];
        double value = m->rotary[i] ? word : word * m->unit;
        if (m->absolute)
            m->offset[i] = m->offset_next[i];
        double end = value + (m->absolute ? m->offset[i] : m->pos[i]);
        if (!in_range(value) || !in_range(end))
            return NC_ERROR_RANGE;
        target[i] = end;
    }
    return 0;
}

/* Squared distance over the main axes, or over the others. */
static double distance2(const nc_modal *m, const double *target, int over_main)
{
    double sum = 0.0;
    for (int i = 0; i < m->axes; i++) {
        int is_main = i == m->main_axis[0] || i == m->main_axis[1] || i == m->main_axis[2];
        double d = target[i] - m->pos[i];
        if (is_main == over_main)
            sum += d * d;
    }
    return sum;
}

/* Such a line is driven in degrees a minute. */
static int only_rotary_axes_move(const nc_modal *m, const double *target)
{
    if (m->motion >= 2)
        return 0;
    for (int i = 0; i < m->axes; i++)
        if (target[i] != m->pos[i] && !m->rotary[i])
            return 0;
    return 1;
}

static int line_motion(const nc_modal *m, const double *target, nc_block *out)
{
    double length = sqrt(distance2(m, target, 1));
    if (length < ZERO_MM)
        length = sqrt(distance2(m, target, 0));
    out->type = NC_LINEAR;
    out->length = length < ZERO_MM ? 0.0 : length;
    return 0;
}

/* Centre, radius and sweep of the circle whose centre lies on the chord's bisector at `height`. */
static void arc_on_bisector(arc *a, double height)
{
    double half = 0.5 * a->width;
    a->center[0] = a->start[0] + 0.5 * a->chord[0] - height * a->chord[1] / a->width;
    a->center[1] = a->start[1] + 0.5 * a->chord[1] + height * a->chord[0] / a->width;
    a->radius = sqrt(half * half + height * height);
    a->sweep = a->sense * 2.0 * atan2(half, a->sense * height);
}

static int arc_by_radius(const nc_modal *m, arc *a)
{
    double r = fabs(m->radius) * m->arc_scale, half = 0.5 * a->width, excess = half - r;
    if (r < ZERO_MM || a->width < ZERO_MM)
        return NC_ERROR_CIRCLE;
    if (excess > m->centre_limit && excess > m->centre_ratio * r)
        return NC_ERROR_CIRCLE;
    double height = excess >= 0.0 ? 0.0 : sqrt((r - half) * (r + half));
    arc_on_bisector(a, m->radius > 0.0 ? a->sense * height : -a->sense * height);
    if (excess < 0.0)
        a->radius = r;
    return 0;
}

/* The centre as programmed; the arc reaches the end point's angle, not quite its radius. */
static void arc_about_centre(arc *a, double r_start)
{
    double first = atan2(a->start[1] - a->center[1], a->start[0] - a->center[0]);
    double last = atan2(a->start[1] + a->chord[1] - a->center[1], a->start[0] + a->chord[0] - a->center[0]);
    double sweep = fmod(a->sense * (last - first) + 4.0 * PI, 2.0 * PI);
    a->radius = r_start;
    a->sweep = a->sense * (sweep < SAME_ANGLE ? 2.0 * PI : sweep);
}

/* Put a->center on the bisector (G165); an error if it is too far away from it. */
static int correct_centre(const nc_modal *m, arc *a, double r_start)
{
    double given[2] = {a->center[0], a->center[1]};
    double ux = a->chord[0] / a->width, uy = a->chord[1] / a->width;
    double mx = given[0] - (a->start[0] + 0.5 * a->chord[0]);
    double my = given[1] - (a->start[1] + 0.5 * a->chord[1]);
    double along = mx * ux + my * uy, height = my * ux - mx * uy;
    double r_end = hypot(mx - 0.5 * a->chord[0], my - 0.5 * a->chord[1]);
    if (m->rules & NC_RULE_NO_CORRECTION) {
        if (fabs(r_end - r_start) > UNCORRECTED_MM)
            return NC_ERROR_RADII;
        arc_about_centre(a, r_start);
        return 0;
    }
    int keep = m->rules & NC_RULE_KEEP_CENTRE;
    double deviation = fmax(keep ? 0.0 : fabs(along), fabs(r_end - r_start));
    if (deviation > m->centre_limit && deviation > m->centre_ratio * r_start)
        return NC_ERROR_CIRCLE;
    if (keep && fabs(along) > m->centre_limit) {
        arc_about_centre(a, r_start);
        return 0;
    }
    arc_on_bisector(a, height);
    if (fabs(along) < ZERO_MM) { /* keep the programmed numbers where there is nothing to correct */
        a->center[0] = given[0];
        a->center[1] = given[1];
        a->radius = r_start;
    }
    return 0;
}

static int arc_by_centre(const nc_modal *m, arc *a)
{
    double radius = hypot(a->center[0] - a->start[0], a->center[1] - a->start[1]);
    if (radius < ZERO_MM)
        return NC_ERROR_CIRCLE;
    if (a->width >= ZERO_MM)
        return correct_centre(m, a, radius);
    a->radius = radius;
    a->sweep = a->sense * 2.0 * PI;
    return 0;
}

/* Full turns of a helix with programmed pitch, added to the sweep. */
static int add_turns(arc *a, double dz, double pitch)
{
    double turns = pitch > 0.0 ? floor(fabs(dz) / pitch + 1e-9) : 0.0;
    if (turns > TURNS_MAX)
        return NC_ERROR_RANGE;
    if (turns >= 1.0 && a->width < ZERO_MM)
        a->sweep = 0.0; /* the end lies above the start: nothing remains after the full turns */
    a->sweep += a->sense * 2.0 * PI * turns;
    return 0;
}

/* Centre from the words, in machine coordinates. */
static int programmed_centre(const nc_modal *m, const nc_words *w, const int *plane, const int *axis, arc *a)
{
    int absolute = m->centre_absolute && (m->absolute || !(m->rules & NC_RULE_CENTRE_DISTANCE));
    for (int i = 0; i < 2; i++) {
        int letter = m->rules & NC_RULE_PLANE_CENTRE ? i : plane[i];
        double word = w->set & (NC_WORD_I << letter) ? w->centre[letter] * m->unit * m->arc_scale * m->mirror[axis[i]] : 0.0;
        a->center[i] = word + (absolute ? m->offset[axis[i]] : a->start[i]);
        if (!in_range(word) || !in_range(a->center[i]))
            return NC_ERROR_RANGE;
    }
    return 0;
}

/* Place of the centre word that is none of the plane's. */
static int third_letter(const nc_modal *m, const int *plane)
{
    return m->rules & NC_RULE_PLANE_CENTRE ? 2 : plane[2];
}

static int find_arc(const nc_modal *m, const nc_words *w, const int *plane, const int *axis, arc *a)
{
    uint32_t third = NC_WORD_I << third_letter(m, plane);
    uint32_t in_plane = w->set & CENTRE_WORDS & ~third;
    if ((w->set & third) && (m->rules & NC_RULE_NO_PITCH) && (w->centre[third_letter(m, plane)] != 0.0 || !in_plane))
        return NC_ERROR_NO_CENTRE;
    if (!in_plane && m->has_radius)
        return arc_by_radius(m, a);
    if (!in_plane && !(w->set & third))
        return NC_ERROR_NO_CENTRE;
    int error = programmed_centre(m, w, plane, axis, a);
    return error ? error : arc_by_centre(m, a);
}

static int circle_motion(const nc_modal *m, const nc_words *w, const double *target, nc_block *out)
{
    const int *plane = PLANE_AXES[m->plane - 17];
    int axis[3] = {m->main_axis[plane[0]], m->main_axis[plane[1]], m->main_axis[plane[2]]};
    if (axis[0] < 0 || axis[1] < 0)
        return NC_ERROR_PLANE_AXIS;
    if (m->arc_scale == 0.0)
        return NC_ERROR_SCALED_CIRCLE;
    arc a = {.sense = (m->motion == 3 ? 1.0 : -1.0) * m->mirror[axis[0]] * m->mirror[axis[1]]};
    for (int i = 0; i < 2; i++) {
        a.start[i] = m->pos[axis[i]];
        a.chord[i] = target[axis[i]] - a.start[i];
    }
    a.width = hypot(a.chord[0], a.chord[1]);
    int error = find_arc(m, w, plane, axis, &a);
    if (!error && a.radius > RANGE_MM)
        error = NC_ERROR_RANGE;
    double dz = axis[2] < 0 ? 0.0 : target[axis[2]] - m->pos[axis[2]];
    if (!error && (w->set & (NC_WORD_I << plane[2])) && !(m->rules & NC_RULE_PLANE_CENTRE))
        error = add_turns(&a, dz, fabs(w->centre[plane[2]] * m->unit * m->arc_scale));
    if (error)
        return error;
    double in_plane = a.radius * a.sweep;
    out->type = NC_CIRCULAR;
    out->plane = m->plane;
    out->center[0] = a.center[0];
    out->center[1] = a.center[1];
    out->radius = out->programmed_radius = a.radius;
    out->angle = a.sweep;
    out->length = sqrt(in_plane * in_plane + dz * dz);
    return 0;
}

static int set_feed(const nc_modal *m, const double *target, nc_block *out)
{
    if (m->motion == 0) {
        out->flags |= NC_RAPID;
        return 0;
    }
    if (!(m->feed > 0.0))
        return NC_ERROR_FEED;
    out->feed = m->feed * m->feed_factor * (only_rotary_axes_move(m, target) ? 1.0 : m->feed_unit) / 60.0;
    if (m->feed_limit > 0.0 && out->feed > m->feed_limit)
        out->feed = m->feed_limit;
    return 0;
}

static void begin_row(const nc_modal *m, const nc_words *w, const double *target, nc_block *out)
{
    memset(out, 0, sizeof *out);
    memcpy(out->end, target, sizeof out->end);
    out->n = w->n;
    out->line = m->line;
    out->count = m->count;
    out->file = m->file;
    if (m->exact_stop || w->block_stop)
        out->flags |= NC_EXACT_STOP;
}

static int motion_row(const nc_modal *m, const nc_words *w, const double *target, nc_block *out)
{
    begin_row(m, w, target, out);
    int error = set_feed(m, target, out);
    if (!error)
        error = m->motion >= 2 ? circle_motion(m, w, target, out) : line_motion(m, target, out);
    out->length_min = out->length;
    return error;
}

/* Returns 0 or an error number. `*emitted`: `out` holds a row. Of a wrong block the codes stay in force and its target
 * becomes the position, so that the blocks after it can still be checked. */
int nc_block_from_words(nc_modal *m, const nc_words *w, nc_block *out, int *emitted)
{
    double target[NC_AXES];
    *emitted = 0;
    if (w->n)
        m->n = w->n;
    int plane_error = m->compensated && w->plane >= 0 && w->plane != m->plane ? NC_ERROR_PLANE_COMPENSATED : 0;
    update_codes(m, w);
    int error = update_values(m, w);
    if (plane_error)
        error = plane_error;
    if (!error && (w->set & CENTRE_WORDS) && (w->set & NC_WORD_R))
        error = NC_ERROR_CENTRE_AND_RADIUS;
    uint32_t circle_words = CENTRE_WORDS | (m->rules & NC_RULE_RADIUS_ONCE ? NC_WORD_R : 0);
    if (!error && (w->set & circle_words) && m->motion < 2)
        error = NC_ERROR_CENTRE_WITHOUT_CIRCLE;
    int place_error = find_target(m, w, target);
    if (place_error)
        return error ? error : place_error;
    if (!error && (w->axis_set || (w->set & CENTRE_WORDS))) {
        error = motion_row(m, w, target, out);
        *emitted = !error && out->length > 0.0;
    }
    memcpy(m->pos, target, sizeof m->pos);
    return error;
}
