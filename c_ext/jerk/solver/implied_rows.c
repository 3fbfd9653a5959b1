/* Rows that others imply: |b z| <= 1 holds where b = p c + q d, |p| + |q| <= 1,
 * and the rows c and d hold. On a line all axes ask for the same, on a plane
 * curve two of three axes often say all.
 */
#include <math.h>
#include <stdbool.h>
#include <string.h>
#include "jerk/solver/implied_rows.h"
#include "jerk/state/tuning.h"
#include "maths/order.h"

static double size_of(const double *row) {
    double largest = greater(fabs(row[1]), fabs(row[2]));
    return greater(fabs(row[0]), largest);
}

/* Whether p c is the row, but for `miss`. */
static bool one_implies(const double *row, const double *one, double miss) {
    double square = one[0] * one[0] + one[1] * one[1] + one[2] * one[2];
    double product = row[0] * one[0] + row[1] * one[1] + row[2] * one[2];
    if (!(fabs(product) <= (1.0 + SAME_ROW) * square)) {
        return false;
    }
    for (int i = 0; i < 3; i++) {
        if (!(fabs(row[i] * square - product * one[i]) <= miss * square)) {
            return false;
        }
    }
    return square > 0.0;
}

/* Whether p c + q d is the row, but for `miss`, by the two components in which
 * the two rows differ most. A row that is not in their plane is another one. */
static bool two_imply(const double *row,
                      const double *one,
                      const double *other,
                      double miss) {
    const double normal[3] = {one[1] * other[2] - one[2] * other[1],
                              one[2] * other[0] - one[0] * other[2],
                              one[0] * other[1] - one[1] * other[0]};
    double most = size_of(normal);
    double off = row[0] * normal[0] + row[1] * normal[1] + row[2] * normal[2];
    if (!(fabs(off) <= miss * most) || most == 0.0) {
        return false;
    }
    int at = fabs(normal[2]) == most ? 0 : fabs(normal[0]) == most ? 1 : 2;
    int next = (at + 1) % 3;
    double by_one = row[at] * other[next] - row[next] * other[at];
    double by_other = one[at] * row[next] - one[next] * row[at];
    return fabs(by_one) + fabs(by_other) <= most;
}

static bool implied(double rows[][3], int count, int i) {
    double size = size_of(rows[i]);
    double miss = SAME_ROW * size;
    if (size == 0.0) {
        return true;
    }
    for (int k = 0; k < count; k++) {
        if (k != i && one_implies(rows[i], rows[k], miss)) {
            return true;
        }
    }
    for (int k = 0; k < count; k++) {
        for (int m = 0; m < k; m++) {
            if (k != i && m != i
                && two_imply(rows[i], rows[k], rows[m], miss)) {
                return true;
            }
        }
    }
    return false;
}

int without_implied(double rows[][3], int count) {
    for (int i = count - 1; i >= 0 && count > 1; i--) {
        if (implied(rows, count, i)) {
            count--;
            memmove(rows[i], rows[count], sizeof rows[i]);
        }
    }
    return count;
}
