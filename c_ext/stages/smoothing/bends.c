/* Chords that stand for a piece of a curve (NC_BENT). */
#include "stages/smoothing/nodes.h"

#define POINTS_MAX 64
#define LOOKS 8 /* places where the distance from the chord is looked at */

static double dot3(const double *a, const double *b) {
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

bool is_bent_row(const nc_block *row) {
    return row->type == NC_LINEAR
           && (row->degree == NC_BENT || row->degree == NC_BENT_FIRST);
}

/* From the chord, by the share of it: a cubic between the directions at its
 * ends. */
static void from_start(const bend *bend, double share, double *out) {
    double rest = 1.0 - share;
    for (int i = 0; i < 3; i++) {
        out[i] = share * share * (3.0 - 2.0 * share) * bend->chord[i]
                 + share * rest * (rest * bend->into[i] - share * bend->out[i]);
    }
}

static double bulge_of(const bend *bend) {
    double most = 0.0;
    for (int k = 1; k < LOOKS; k++) {
        double at[3];
        from_start(bend, (double)k / LOOKS, at);
        double along = dot3(at, bend->chord) / dot3(bend->chord, bend->chord);
        for (int i = 0; i < 3; i++) {
            at[i] -= along * bend->chord[i];
        }
        most = fmax(most, sqrt(dot3(at, at)));
    }
    return most;
}

/* Largest second derivative: it is linear, so at one of the ends. */
static double second_of(const bend *bend) {
    double ends[2] = {0.0, 0.0};
    for (int i = 0; i < 3; i++) {
        double first =
            6.0 * bend->chord[i] - 4.0 * bend->into[i] - 2.0 * bend->out[i];
        double last =
            6.0 * bend->chord[i] - 2.0 * bend->into[i] - 4.0 * bend->out[i];
        ends[0] += first * first;
        ends[1] += last * last;
    }
    return sqrt(fmax(ends[0], ends[1]));
}

/* The directions as long as they are on an arc between the ends. */
static void stretch(bend *bend, double length) {
    double half = sqrt(fmax(0.0, 0.5 * (1.0 + dot3(bend->into, bend->out))));
    double size = length * 2.0 / (1.0 + half);
    for (int i = 0; i < 3; i++) {
        bend->into[i] *= size;
        bend->out[i] *= size;
    }
}

bool bend_of(nc_smooth *smooth, const nc_block *row, bend *out) {
    bool goes_on = smooth->is_bent && row->degree == NC_BENT;
    const double toward[3] = {row->center[0], row->center[1], row->radius};
    smooth->is_bent = false;
    if (!is_bent_row(row)) {
        return false;
    }
    for (int i = 0; i < 3; i++) {
        int axis = smooth->cfg.main_axis[i];
        out->from[i] = axis >= 0 ? smooth->last[axis] : 0.0;
        out->chord[i] =
            axis >= 0 ? row->end[axis] * smooth->scale[axis] - out->from[i]
                      : 0.0;
    }
    double length = sqrt(dot3(out->chord, out->chord));
    if (!(length > ZERO)) {
        return false;
    }
    double mirror = 2.0 * dot3(toward, out->chord) / (length * length);
    for (int i = 0; i < 3; i++) {
        out->out[i] = toward[i];
        out->into[i] =
            goes_on ? smooth->bent[i] : mirror * out->chord[i] - toward[i];
        smooth->bent[i] = toward[i];
    }
    smooth->is_bent = true;
    if (dot3(out->into, out->chord) < BEND_COS * length
        || dot3(out->out, out->chord) < BEND_COS * length) {
        return false;
    }
    stretch(out, length);
    double bulge = bulge_of(out);
    if (bulge <= BULGE * smooth->tol) {
        return false;
    }
    double second = second_of(out);
    double count = ceil(sqrt(second / (8.0 * SAGITTA * smooth->tol)));
    out->count = (int)fmin(fmax(count, 2.0), POINTS_MAX);
    out->sagitta = second / 8.0 / out->count / out->count;
    if (out->sagitta > BULGE * smooth->tol) {
        return false; /* too long for so many points */
    }
    smooth->bulge = fmax(smooth->bulge, bulge);
    return true;
}

void bend_at(const nc_smooth *smooth,
             const bend *bend,
             double share,
             double *position) {
    double at[3];
    from_start(bend, share, at);
    for (int i = 0; i < 3 && share < 1.0; i++) {
        int axis = smooth->cfg.main_axis[i];
        if (axis >= 0) {
            position[axis] = bend->from[i] + at[i];
        }
    }
}
