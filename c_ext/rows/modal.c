/* Words of one block -> modal state and at most one motion row. */
#include "rows/scan.h"
#include "maths/plain.h"

#include <math.h>
#include <string.h>

#define RANGE_MM 1e9  /* largest coordinate, radius and feed word */
#define ZERO_MM 1e-9  /* shorter motions do not move */
#define TURNS_MAX 1e6 /* of one helix */
/* rad: an arc about a kept centre that sweeps less is a full turn */
#define SAME_ANGLE 1e-6
/* G164: largest difference of the radii at start and end */
#define UNCORRECTED_MM 0.01
#define PI 3.14159265358979323846
#define CENTRE_WORDS (NC_WORD_I | NC_WORD_J | NC_WORD_K)

/* first, second, third axis of G17, G18, G19 among X, Y, Z */
static const int PLANE_AXES[3][3] = {
    {0, 1, 2},
    {2, 0, 1},
    {1, 2, 0},
};

/* A circle in its plane. The chord runs from the start to the end, `height` is
 * the centre's distance from the chord, positive on its left. */
typedef struct arc {
    double start[2], chord[2];
    double width; /* of the chord */
    double sense; /* +1 counter-clockwise, -1 clockwise */
    double scale; /* of words in the plane */
    double center[2];
    double radius;
    double sweep;
} arc;

static int in_range(double value) {
    return fabs(value) <= RANGE_MM; /* false for NaN */
}

void nc_modal_init(nc_modal *modal) {
    memset(modal, 0, sizeof *modal);
    memset(modal->letter_axis, -1, sizeof modal->letter_axis);
    for (int i = 0; i < 3; i++) {
        modal->main_axis[i] = -1;
    }
    for (int i = 0; i < NC_AXES; i++) {
        modal->mirror[i] = 1.0;
        modal->share[i] = 1.0;
    }
    modal->unit = 1.0;
    modal->feed_unit = 1.0;
    modal->feed_factor = 1.0;
    for (int i = 0; i < 3; i++) {
        modal->arc_scale[i] = 1.0;
    }
    modal->plane = 17;
    modal->absolute = 1;
    modal->centre_limit = 2.0;
    modal->centre_ratio = 0.05;
}

void nc_words_init(nc_words *words) {
    memset(words, 0, sizeof *words);
    words->motion = -1;
    words->plane = -1;
    words->absolute = -1;
    words->inch = -1;
    words->centre_absolute = -1;
    words->exact_stop = -1;
}

/* Build offset_next again after a change of plane, tool length or zero offset.
 */
void nc_modal_offsets(nc_modal *modal) {
    int third = modal->main_axis[PLANE_AXES[modal->plane - 17][2]];
    for (int i = 0; i < NC_AXES; i++) {
        modal->offset_next[i] =
            modal->zero[i] + (i == third ? modal->tool_length : 0.0);
    }
}

static void update_codes(nc_modal *modal, const nc_words *words) {
    if (words->motion >= 0) {
        modal->motion = (uint8_t)words->motion;
    }
    if (words->absolute >= 0) {
        modal->absolute = (uint8_t)words->absolute;
    }
    if (words->centre_absolute >= 0) {
        modal->centre_absolute = (uint8_t)words->centre_absolute;
    }
    if (words->exact_stop >= 0) {
        modal->exact_stop = (uint8_t)words->exact_stop;
    }
    if (words->inch >= 0) {
        modal->unit = words->inch ? 25.4 : 1.0;
    }
    if (words->plane >= 0 && words->plane != modal->plane) {
        modal->plane = (uint8_t)words->plane;
        nc_modal_offsets(modal);
    }
}

static int update_values(nc_modal *modal, const nc_words *words) {
    if (modal->rules & NC_RULE_RADIUS_ONCE) {
        modal->has_radius = 0;
    }
    if (words->set & NC_WORD_F) {
        if (!in_range(words->f)) {
            return NC_ERROR_RANGE;
        }
        modal->feed = words->f;
        modal->feed_unit = modal->unit;
    }
    for (int i = 0; i < 3; i++) {
        if (words->set & (NC_WORD_I << i)) {
            modal->centre_word[i] = words->centre[i];
        }
    }
    if (words->set & NC_WORD_R) {
        if (!in_range(words->r * modal->unit)) {
            return NC_ERROR_RANGE;
        }
        modal->radius = words->r * modal->unit;
        modal->has_radius = 1;
    }
    return 0;
}

static int find_target(nc_modal *modal, const nc_words *words, double *target) {
    memcpy(target, modal->pos, sizeof modal->pos);
    for (int i = 0; i < modal->axes; i++) {
        if (!(words->axis_set & (1u << i))) {
            continue;
        }
        double word = words->axis[i] * modal->mirror[i] * modal->share[i];
        double value = modal->rotary[i] ? word : word * modal->unit;
        if (modal->absolute) {
            modal->offset[i] = modal->offset_next[i];
        }
        double end =
            value + (modal->absolute ? modal->offset[i] : modal->pos[i]);
        if (!in_range(value) || !in_range(end)) {
            return NC_ERROR_RANGE;
        }
        target[i] = end;
    }
    return 0;
}

/* Squared distance over the main axes, or over the others. */
static double distance2(const nc_modal *modal,
                        const double *target,
                        int over_main) {
    double sum = 0.0;
    for (int i = 0; i < modal->axes; i++) {
        int is_main = i == modal->main_axis[0] || i == modal->main_axis[1]
                      || i == modal->main_axis[2];
        double difference = target[i] - modal->pos[i];
        if (is_main == over_main) {
            sum += difference * difference;
        }
    }
    return sum;
}

/* Such a line is driven in degrees a minute. */
static int only_rotary_axes_move(const nc_modal *modal, const double *target) {
    if (modal->motion >= 2) {
        return 0;
    }
    for (int i = 0; i < modal->axes; i++) {
        if (target[i] != modal->pos[i] && !modal->rotary[i]) {
            return 0;
        }
    }
    return 1;
}

static int line_motion(const nc_modal *modal,
                       const double *target,
                       nc_block *out) {
    double length = sqrt(distance2(modal, target, 1));
    if (length < ZERO_MM) {
        length = sqrt(distance2(modal, target, 0));
    }
    out->type = NC_LINEAR;
    out->length = length < ZERO_MM ? 0.0 : length;
    return 0;
}

/* Centre, radius and sweep of the circle whose centre lies on the chord's
 * bisector at `height`. */
static void arc_on_bisector(struct arc *arc, double height) {
    double half = 0.5 * arc->width;
    arc->center[0] = arc->start[0] + 0.5 * arc->chord[0]
                     - height * arc->chord[1] / arc->width;
    arc->center[1] = arc->start[1] + 0.5 * arc->chord[1]
                     + height * arc->chord[0] / arc->width;
    arc->radius = sqrt(half * half + height * height);
    arc->sweep = arc->sense * 2.0 * plain_atan2(half, arc->sense * height);
}

static int arc_by_radius(const nc_modal *modal, struct arc *arc) {
    double radius = fabs(modal->radius) * arc->scale;
    double half = 0.5 * arc->width;
    double excess = half - radius;
    if (radius < ZERO_MM || arc->width < ZERO_MM) {
        return NC_ERROR_CIRCLE;
    }
    if (excess > modal->centre_limit && excess > modal->centre_ratio * radius) {
        return NC_ERROR_CIRCLE;
    }
    double height =
        excess >= 0.0 ? 0.0 : sqrt((radius - half) * (radius + half));
    arc_on_bisector(arc,
                    modal->radius > 0.0 ? arc->sense * height
                                        : -arc->sense * height);
    if (excess < 0.0) {
        arc->radius = radius;
    }
    return 0;
}

/* The centre as programmed; the arc reaches the end point's angle, not quite
 * its radius. */
static void arc_about_centre(struct arc *arc, double r_start) {
    double first = plain_atan2(arc->start[1] - arc->center[1],
                               arc->start[0] - arc->center[0]);
    double last = plain_atan2(arc->start[1] + arc->chord[1] - arc->center[1],
                              arc->start[0] + arc->chord[0] - arc->center[0]);
    double sweep = fmod(arc->sense * (last - first) + 4.0 * PI, 2.0 * PI);
    arc->radius = r_start;
    arc->sweep = arc->sense * (sweep < SAME_ANGLE ? 2.0 * PI : sweep);
}

/* Put a->center on the bisector (G165); an error if it is too far away from it.
 */
static int correct_centre(const nc_modal *modal,
                          struct arc *arc,
                          double r_start) {
    double given[2] = {arc->center[0], arc->center[1]};
    double ux = arc->chord[0] / arc->width;
    double uy = arc->chord[1] / arc->width;
    const double *chord = arc->chord;
    double mx = given[0] - (arc->start[0] + 0.5 * chord[0]);
    double my = given[1] - (arc->start[1] + 0.5 * chord[1]);
    double along = mx * ux + my * uy;
    double height = my * ux - mx * uy;
    double r_end = hypot(mx - 0.5 * chord[0], my - 0.5 * chord[1]);
    if (modal->rules & NC_RULE_NO_CORRECTION) {
        if (fabs(r_end - r_start) > UNCORRECTED_MM) {
            return NC_ERROR_RADII;
        }
        arc_about_centre(arc, r_start);
        return 0;
    }
    int keep = modal->rules & NC_RULE_KEEP_CENTRE;
    double deviation = fmax(keep ? 0.0 : fabs(along), fabs(r_end - r_start));
    if (deviation > modal->centre_limit
        && deviation > modal->centre_ratio * r_start) {
        return NC_ERROR_CIRCLE;
    }
    if (keep && fabs(along) > modal->centre_limit) {
        arc_about_centre(arc, r_start);
        return 0;
    }
    arc_on_bisector(arc, height);
    if (fabs(along) < ZERO_MM) { /* keep the programmed numbers where there is
                                    nothing to correct */
        arc->center[0] = given[0];
        arc->center[1] = given[1];
        arc->radius = r_start;
    }
    return 0;
}

static int arc_by_centre(const nc_modal *modal, struct arc *arc) {
    double radius =
        hypot(arc->center[0] - arc->start[0], arc->center[1] - arc->start[1]);
    if (radius < ZERO_MM) {
        return NC_ERROR_CIRCLE;
    }
    if (arc->width >= ZERO_MM) {
        return correct_centre(modal, arc, radius);
    }
    arc->radius = radius;
    arc->sweep = arc->sense * 2.0 * PI;
    return 0;
}

/* Full turns of a helix with programmed pitch, added to the sweep. */
static int add_turns(struct arc *arc, double dz, double pitch) {
    double turns = pitch > 0.0 ? floor(fabs(dz) / pitch + 1e-9) : 0.0;
    if (turns > TURNS_MAX) {
        return NC_ERROR_RANGE;
    }
    if (turns >= 1.0 && arc->width < ZERO_MM) {
        arc->sweep = 0.0; /* the end lies above the start: nothing remains after
                             the full turns */
    }
    arc->sweep += arc->sense * 2.0 * PI * turns;
    return 0;
}

/* Centre from the words, in machine coordinates. */
static int programmed_centre(const nc_modal *modal,
                             const nc_words *words,
                             const int *plane,
                             const int *axis,
                             struct arc *arc) {
    int absolute =
        modal->centre_absolute
        && (modal->absolute || !(modal->rules & NC_RULE_CENTRE_DISTANCE));
    for (int i = 0; i < 2; i++) {
        int letter = modal->rules & NC_RULE_PLANE_CENTRE ? i : plane[i];
        double word = words->set & (NC_WORD_I << letter)
                          ? words->centre[letter] * modal->unit * arc->scale
                                * modal->mirror[axis[i]]
                          : 0.0;
        arc->center[i] =
            word + (absolute ? modal->offset[axis[i]] : arc->start[i]);
        if (!in_range(word) || !in_range(arc->center[i])) {
            return NC_ERROR_RANGE;
        }
    }
    return 0;
}

/* Place of the centre word that is none of the plane's. */
static int third_letter(const nc_modal *modal, const int *plane) {
    return modal->rules & NC_RULE_PLANE_CENTRE ? 2 : plane[2];
}

static int find_arc(const nc_modal *modal,
                    const nc_words *words,
                    const int *plane,
                    const int *axis,
                    struct arc *arc) {
    uint32_t third = NC_WORD_I << third_letter(modal, plane);
    uint32_t in_plane = words->set & CENTRE_WORDS & ~third;
    if ((words->set & third) && (modal->rules & NC_RULE_NO_PITCH)
        && (words->centre[third_letter(modal, plane)] != 0.0 || !in_plane)) {
        return NC_ERROR_NO_CENTRE;
    }
    if (!in_plane && modal->has_radius) {
        return arc_by_radius(modal, arc);
    }
    if (!in_plane && !(words->set & third)) {
        return NC_ERROR_NO_CENTRE;
    }
    int error = programmed_centre(modal, words, plane, axis, arc);
    return error ? error : arc_by_centre(modal, arc);
}

static int circle_motion(const nc_modal *modal,
                         const nc_words *words,
                         const double *target,
                         nc_block *out) {
    const int *plane = PLANE_AXES[modal->plane - 17];
    int axis[3] = {modal->main_axis[plane[0]],
                   modal->main_axis[plane[1]],
                   modal->main_axis[plane[2]]};
    if (axis[0] < 0 || axis[1] < 0) {
        return NC_ERROR_PLANE_AXIS;
    }
    double scale = modal->arc_scale[plane[0]];
    if (modal->arc_scale[plane[1]] != scale) {
        return NC_ERROR_SCALED_CIRCLE;
    }
    struct arc arc = {.scale = scale,
                      .sense = (modal->motion == 3 ? 1.0 : -1.0)
                               * modal->mirror[axis[0]]
                               * modal->mirror[axis[1]]};
    for (int i = 0; i < 2; i++) {
        arc.start[i] = modal->pos[axis[i]];
        arc.chord[i] = target[axis[i]] - arc.start[i];
    }
    arc.width = hypot(arc.chord[0], arc.chord[1]);
    int error = find_arc(modal, words, plane, axis, &arc);
    if (!error && arc.radius > RANGE_MM) {
        error = NC_ERROR_RANGE;
    }
    double dz = axis[2] < 0 ? 0.0 : target[axis[2]] - modal->pos[axis[2]];
    if (!error && (words->set & (NC_WORD_I << plane[2]))
        && !(modal->rules & NC_RULE_PLANE_CENTRE)) {
        error = add_turns(&arc,
                          dz,
                          fabs(words->centre[plane[2]] * modal->unit
                               * modal->arc_scale[plane[2]]));
    }
    if (error) {
        return error;
    }
    double in_plane = arc.radius * arc.sweep;
    out->type = NC_CIRCULAR;
    out->plane = modal->plane;
    out->center[0] = arc.center[0];
    out->center[1] = arc.center[1];
    out->radius = out->programmed_radius = arc.radius;
    out->angle = arc.sweep;
    out->length = sqrt(in_plane * in_plane + dz * dz);
    return 0;
}

static int set_feed(const nc_modal *modal,
                    const double *target,
                    nc_block *out) {
    if (modal->motion == 0) {
        out->flags |= NC_RAPID;
        return 0;
    }
    if (!(modal->feed > 0.0)) {
        return NC_ERROR_FEED;
    }
    out->feed =
        modal->feed * modal->feed_factor
        * (only_rotary_axes_move(modal, target) ? 1.0 : modal->feed_unit)
        / 60.0;
    if (modal->feed_limit > 0.0 && out->feed > modal->feed_limit) {
        out->feed = modal->feed_limit;
    }
    return 0;
}

static void begin_row(const nc_modal *modal,
                      const nc_words *words,
                      const double *target,
                      nc_block *out) {
    memset(out, 0, sizeof *out);
    memcpy(out->end, target, sizeof out->end);
    out->n = words->n;
    out->line = modal->line;
    out->count = modal->count;
    out->file = modal->file;
    if (modal->exact_stop || words->block_stop) {
        out->flags |= NC_EXACT_STOP;
    }
}

static int motion_row(const nc_modal *modal,
                      const nc_words *words,
                      const double *target,
                      nc_block *out) {
    begin_row(modal, words, target, out);
    int error = set_feed(modal, target, out);
    if (!error) {
        error = modal->motion >= 2 ? circle_motion(modal, words, target, out)
                                   : line_motion(modal, target, out);
    }
    out->length_min = out->length;
    return error;
}

/* Returns 0 or an error number. `*emitted`: `out` holds a row. Of a wrong block
 * the codes stay in force and its target becomes the position, so that the
 * blocks after it can still be checked. */
int nc_block_from_words(nc_modal *modal,
                        const nc_words *words,
                        nc_block *out,
                        int *emitted) {
    double target[NC_AXES];
    *emitted = 0;
    if (words->n) {
        modal->n = words->n;
    }
    int plane_error =
        modal->compensated && words->plane >= 0 && words->plane != modal->plane
            ? NC_ERROR_PLANE_COMPENSATED
            : 0;
    update_codes(modal, words);
    int error = update_values(modal, words);
    if (plane_error) {
        error = plane_error;
    }
    if (!error && (words->set & CENTRE_WORDS) && (words->set & NC_WORD_R)) {
        error = NC_ERROR_CENTRE_AND_RADIUS;
    }
    uint32_t circle_words =
        CENTRE_WORDS | (modal->rules & NC_RULE_RADIUS_ONCE ? NC_WORD_R : 0);
    if (!error && (words->set & circle_words) && modal->motion < 2) {
        error = NC_ERROR_CENTRE_WITHOUT_CIRCLE;
    }
    int place_error = find_target(modal, words, target);
    if (place_error) {
        return error ? error : place_error;
    }
    if (!error && (words->axis_set || (words->set & CENTRE_WORDS))) {
        error = motion_row(modal, words, target, out);
        *emitted = !error && out->length > 0.0;
    }
    memcpy(modal->pos, target, sizeof modal->pos);
    return error;
}
