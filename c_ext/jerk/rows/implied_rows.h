/* Rows that others imply: |b z| <= 1 holds where b = p c + q d, |p| + |q| <= 1,
 * and the rows c and d hold. On a line all axes ask for the same, on a plane
 * curve two of three axes often say all.
 */
#ifndef JERK_IMPLIED_ROWS_H
#define JERK_IMPLIED_ROWS_H
#include "jerk/state/vectors.h"
#include "jerk/state/api.h"
#include "jerk/state/tuning.h"

/* Rows of LANES stages, before they are written. */
typedef struct forms {
    vec coef[2 * JERK_AXES][3];
    ivec there[2 * JERK_AXES]; /* lanes that have the row */
    int count;
} forms;

/* Largest component of each lane. */
static inline vec size_of_row(const vec *row) {
    vec inputs = vmax(size_of(row[1]), size_of(row[2]));
    return vmax(inputs, size_of(row[0]));
}

/* The normal of the plane in which two rows lie, and its largest component. */
typedef struct plane {
    vec normal[3], most;
} plane;

#define PAIRS (2 * JERK_AXES * 2 * JERK_AXES)

/* The planes of all pairs of rows, and their sizes. */
typedef struct planes {
    vec size[2 * JERK_AXES];
    plane of[PAIRS];
} planes;

static inline plane *plane_of(struct planes *planes, int i, int k) {
    int more = i > k ? i : k;
    int less = i > k ? k : i;
    return &planes->of[more * 2 * JERK_AXES + less];
}

static inline void cross(const vec *one, const vec *other, vec out[3]) {
    out[0] = one[1] * other[2] - one[2] * other[1];
    out[1] = one[2] * other[0] - one[0] * other[2];
    out[2] = one[0] * other[1] - one[1] * other[0];
}

static inline void find_planes(const struct forms *forms, planes *out) {
    for (int i = 0; i < forms->count; i++) {
        out->size[i] = size_of_row(forms->coef[i]);
        for (int k = 0; k < i; k++) {
            plane *plane = plane_of(out, i, k);
            cross(forms->coef[i], forms->coef[k], plane->normal);
            plane->most = size_of_row(plane->normal);
        }
    }
}

/* Where p times row k is row i. */
static inline ivec one_implies(struct planes *planes, int i, int k) {
    vec size = planes->size[i];
    vec other = planes->size[k];
    return (plane_of(planes, i, k)->most <= SAME_ROW * size * other)
           & (size <= (1.0 + SAME_ROW) * other) & (other > 0.0);
}

/* Where p times row k and q times row m are row i, by Cramer's rule for the two
 * components in which the two rows differ most. A row that is not in their
 * plane is another one. */
static inline ivec two_imply(const struct forms *forms,
                             struct planes *planes,
                             int i,
                             int k,
                             int m) {
    const vec *row = forms->coef[i];
    const plane *plane = plane_of(planes, k, m);
    const vec *normal = plane->normal;
    vec off = row[0] * normal[0] + row[1] * normal[1] + row[2] * normal[2];
    ivec out = (size_of(off) <= SAME_ROW * planes->size[i] * plane->most)
               & (plane->most > 0.0);
    if (!any_of(out)) {
        return out;
    }
    const vec *by_one = plane_of(planes, i, m)->normal;
    const vec *by_other = plane_of(planes, i, k)->normal;
    vec sum = size_of(by_one[1]) + size_of(by_other[1]);
    for (int n = 0; n < 3; n += 2) {
        ivec here = size_of(normal[n]) == plane->most;
        sum = chosen(here, size_of(by_one[n]) + size_of(by_other[n]), sum);
    }
    return out & (sum <= plane->most);
}

/* Lanes in which the rest implies row i. */
static inline ivec implied(const struct forms *forms,
                           struct planes *planes,
                           int i) {
    const ivec *there = forms->there;
    ivec out = planes->size[i] == 0.0;
    for (int k = 0; k < forms->count; k++) {
        if (k != i) {
            out |= there[k] & one_implies(planes, i, k);
        }
    }
    for (int k = 0; k < forms->count; k++) {
        if (!any_of(there[i] & ~out)) {
            break;
        }
        for (int m = 0; m < k; m++) {
            if (k != i && m != i) {
                out |= there[k] & there[m] & two_imply(forms, planes, i, k, m);
            }
        }
    }
    return out;
}

/* Takes out the rows that the rest implies; one stays at the least. */
static inline void without_implied(struct forms *forms) {
    struct planes planes;
    ivec left = {0, 0, 0, 0};
    find_planes(forms, &planes);
    for (int i = 0; i < forms->count; i++) {
        left -= forms->there[i];
    }
    for (int i = forms->count - 1; i >= 0; i--) {
        ivec gone = forms->there[i] & (left > 1);
        if (any_of(gone)) {
            gone &= implied(forms, &planes, i);
            forms->there[i] &= ~gone;
            left += gone;
        }
    }
}
#endif
