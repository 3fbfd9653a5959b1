/* Numbers: rounding, powers. */
#include "st_runtime.h"

st_i64 st_clamped(double value) {
    if (value != value) {
        return 0;
    }
    if (value >= 9223372036854775807.0) {
        return INT64_MAX;
    }
    if (value <= -9223372036854775808.0) {
        return INT64_MIN;
    }
    return (st_i64)value;
}

st_u64 st_round_u64(double value) {
    double whole = rint(value);
    if (whole >= 18446744073709551615.0) {
        return UINT64_MAX;
    }
    return whole >= 9223372036854775808.0 ? (st_u64)whole
                                          : (st_u64)st_clamped(whole);
}

st_i64 st_power(st_i64 base, st_i64 exponent) {
    st_u64 result = 1, factor = (st_u64)base;
    if (exponent < 0) {
        return base == 1 ? 1 : base == -1 ? (exponent % 2 != 0 ? -1 : 1) : 0;
    }
    for (; exponent > 0; exponent >>= 1) {
        if (exponent & 1) {
            result *= factor;
        }
        factor *= factor;
    }
    return (st_i64)result;
}
