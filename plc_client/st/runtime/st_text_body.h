/* The text functions for one width of characters: UNIT is the character,
 * NAME(x) its function's name. */

static st_i64 NAME(length_of)(const UNIT *text) {
    st_i64 n = 0;
    while (text[n] != 0) {
        n++;
    }
    return n;
}

/* Append n characters of a text to `to`, which holds `at` of at most `size`. */
static st_i64 NAME(
    append)(UNIT *to, st_i64 at, st_i64 size, const UNIT *from, st_i64 n) {
    if (n > size - at) {
        n = size - at;
    }
    if (n <= 0) {
        return at;
    }
    memmove(to + at, from, (size_t)n * sizeof(UNIT));
    return at + n;
}

static st_i64 NAME(limited)(st_i64 value, st_i64 low, st_i64 high) {
    return value < low ? low : value > high ? high : value;
}

void NAME(copy)(st_ptr to, st_i64 length, st_ptr from) {
    const UNIT *source = (const UNIT *)from;
    st_i64 n = 0;
    while (n < length && source[n] != 0) {
        n++;
    }
    memmove(to, from, (size_t)n * sizeof(UNIT));
    ((UNIT *)to)[n] = 0;
}

int NAME(compare)(st_ptr a, st_ptr b) {
    const UNIT *x = (const UNIT *)a, *y = (const UNIT *)b;
    while (*x != 0 && *x == *y) {
        x++;
        y++;
    }
    return *x < *y ? -1 : *x > *y;
}

st_i64 NAME(len)(st_ptr text) {
    return NAME(length_of)((const UNIT *)text);
}

st_i64 NAME(find)(st_ptr text, st_ptr part) {
    const UNIT *a = (const UNIT *)text, *b = (const UNIT *)part;
    st_i64 n = NAME(length_of)(a), m = NAME(length_of)(b);
    for (st_i64 i = 0; m > 0 && i + m <= n; i++) {
        if (memcmp(a + i, b, (size_t)m * sizeof(UNIT)) == 0) {
            return i + 1;
        }
    }
    return 0;
}

static void NAME(close)(UNIT *to, st_i64 at) {
    to[at] = 0;
}

void NAME(left)(st_ptr to, st_i64 size, st_ptr text, st_i64 n) {
    const UNIT *a = (const UNIT *)text;
    n = NAME(limited)(n, 0, NAME(length_of)(a));
    NAME(close)((UNIT *)to, NAME(append)((UNIT *)to, 0, size, a, n));
}

void NAME(right)(st_ptr to, st_i64 size, st_ptr text, st_i64 n) {
    const UNIT *a = (const UNIT *)text;
    st_i64 length = NAME(length_of)(a);
    n = NAME(limited)(n, 0, length);
    NAME(close)((UNIT *)to,
                NAME(append)((UNIT *)to, 0, size, a + length - n, n));
}

void NAME(mid)(st_ptr to, st_i64 size, st_ptr text, st_i64 n, st_i64 from) {
    const UNIT *a = (const UNIT *)text;
    st_i64 length = NAME(length_of)(a);
    if (from < 1 || from > length) {
        NAME(close)((UNIT *)to, 0);
        return;
    }
    n = NAME(limited)(n, 0, length - from + 1);
    NAME(close)((UNIT *)to, NAME(append)((UNIT *)to, 0, size, a + from - 1, n));
}

void NAME(concat)(st_ptr to, st_i64 size, st_ptr a, st_ptr b) {
    const UNIT *x = (const UNIT *)a, *y = (const UNIT *)b;
    st_i64 at = NAME(append)((UNIT *)to, 0, size, x, NAME(length_of)(x));
    at = NAME(append)((UNIT *)to, at, size, y, NAME(length_of)(y));
    NAME(close)((UNIT *)to, at);
}

void NAME(insert)(st_ptr to, st_i64 size, st_ptr a, st_ptr b, st_i64 behind) {
    const UNIT *x = (const UNIT *)a, *y = (const UNIT *)b;
    st_i64 n = NAME(length_of)(x);
    behind = NAME(limited)(behind, 0, n);
    st_i64 at = NAME(append)((UNIT *)to, 0, size, x, behind);
    at = NAME(append)((UNIT *)to, at, size, y, NAME(length_of)(y));
    at = NAME(append)((UNIT *)to, at, size, x + behind, n - behind);
    NAME(close)((UNIT *)to, at);
}

void NAME(delete)(st_ptr to, st_i64 size, st_ptr text, st_i64 n, st_i64 from) {
    UNIT nothing[1] = {0};
    NAME(replace)(to, size, text, (st_ptr)nothing, n, from);
}

void NAME(replace)(st_ptr to,
                   st_i64 size,
                   st_ptr a,
                   st_ptr b,
                   st_i64 n,
                   st_i64 from) {
    const UNIT *x = (const UNIT *)a, *y = (const UNIT *)b;
    st_i64 length = NAME(length_of)(x);
    from = NAME(limited)(from, 1, length + 1);
    n = NAME(limited)(n, 0, length - from + 1);
    st_i64 at = NAME(append)((UNIT *)to, 0, size, x, from - 1);
    at = NAME(append)((UNIT *)to, at, size, y, NAME(length_of)(y));
    at = NAME(
        append)((UNIT *)to, at, size, x + from - 1 + n, length - from + 1 - n);
    NAME(close)((UNIT *)to, at);
}
