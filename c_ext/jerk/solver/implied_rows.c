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

/* Whether p c + q d is the row, but for `miss`. */
static bool comes_to(const double *row,
                     const double *one,
                     const double *other,
                     double p,
                     double q,
                     double miss) {
    for (int i = 0; i < 3; i++) {
        if (!(fabs(row[i] - p * one[i] - q * other[i]) <= miss)) {
            return false;
        }
    }
    return true;
}

static bool one_implies(const double *row, const double *one, double miss) {
    double square = one[0] * one[0] + one[1] * one[1] + one[2] * one[2];
    double product = row[0] * one[0] + row[1] * one[1] + row[2] * one[2];
    double p = product / square;
    return square > 0.0 && fabs(p) <= 1.0 + SAME_ROW
           && comes_to(row, one, one, p, 0.0, miss);
}

/* By the two components in which the two rows differ most. */
static bool two_imply(const double *row,
                      const double *one,
                      const double *other,
                      double miss) {
    double best = 0.0;
    int at = 0;
    for (int i = 0; i < 3; i++) {
        int next = (i + 1) % 3;
        double det = one[i] * other[next] - one[next] * other[i];
        if (fabs(det) > fabs(best)) {
            best = det;
            at = i;
        }
    }
    if (best == 0.0) {
        return false;
    }
    int next = (at + 1) % 3;
    double p = (row[at] * other[next] - row[next] * other[at]) / best;
    double q = (one[at] * row[next] - one[next] * row[at]) / best;
    return fabs(p) + fabs(q) <= 1.0 && comes_to(row, one, other, p, q, miss);
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
