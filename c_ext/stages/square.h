/* Arithmetic that the stages share. */
#ifndef STAGES_SQUARE_H
#define STAGES_SQUARE_H

static inline double square(double value) {
    return value * value;
}
#endif
