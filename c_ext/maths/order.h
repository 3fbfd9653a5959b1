/* The greater and the lesser of two numbers, neither of which is NAN: compilers
 * call the library for fmax and fmin.  These stay where a bound has to hold for
 * NAN too. */
#ifndef MATHS_ORDER_H
#define MATHS_ORDER_H

static inline double lesser(double a, double b) {
    return a < b ? a : b;
}
static inline double greater(double a, double b) {
    return a > b ? a : b;
}
#endif
