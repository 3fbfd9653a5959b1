/* The bytes of an input, read from their front; zeros behind their end. */
#ifndef FUZZ_BYTES_H
#define FUZZ_BYTES_H
#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

struct bytes {
    const uint8_t *next;
    size_t left;
};

static inline uint8_t take_byte(struct bytes *bytes) {
    if (!bytes->left) {
        return 0;
    }
    bytes->left--;
    return *bytes->next++;
}

static inline uint16_t take_word(struct bytes *bytes) {
    uint16_t low = take_byte(bytes);
    return (uint16_t)(low | take_byte(bytes) << 8);
}

static inline int take_signed(struct bytes *bytes) {
    return (int8_t)take_byte(bytes);
}

/* Hundredths, -327.68 to 327.67. */
static inline double take_mm(struct bytes *bytes) {
    return (int16_t)take_word(bytes) / 100.0;
}

/* Any number: a special one, any eight bytes, or a small one. */
static inline double take_number(struct bytes *bytes) {
    static const double special[] = {0,
                                     -0.0,
                                     1e-9,
                                     1e-12,
                                     1e-6,
                                     1e6,
                                     -1e6,
                                     1e12,
                                     1e300,
                                     -1e300,
                                     INFINITY,
                                     -INFINITY,
                                     NAN,
                                     5e-324,
                                     4294967296.0,
                                     0.001};
    uint8_t kind = take_byte(bytes);
    if (kind < 16) {
        return special[kind];
    }
    if (kind < 24) {
        uint8_t raw[8];
        double number;
        for (int i = 0; i < 8; i++) {
            raw[i] = take_byte(bytes);
        }
        memcpy(&number, raw, sizeof number);
        return number;
    }
    return (int16_t)take_word(bytes) / (kind < 128 ? 100.0 : 1.0);
}

#endif
