/* Rows that others of the same stage imply. */
#ifndef JERK_IMPLIED_ROWS_H
#define JERK_IMPLIED_ROWS_H

/* Takes out of rows |b z| <= 1 those that the rest imply; one stays at the
 * least. Returns how many are left, at the front. */
int without_implied(double rows[][3], int count);
#endif
