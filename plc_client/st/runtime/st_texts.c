/* Texts of both widths, texts of values, values of texts. */
#include "st_runtime.h"

#include <stdio.h>
#include <stdlib.h>

#define ROOM 81
#define UNIT st_u8
#define NAME(x) st_##x
#include "st_text_body.h"
#undef UNIT
#undef NAME
#define UNIT st_u16
#define NAME(x) st_w##x
#include "st_text_body.h"

void st_widen(st_ptr to, st_i64 length, st_ptr from) {
    st_u16 *wide = (st_u16 *)to;
    st_i64 n = 0;
    for (; n < length && from[n] != 0; n++) {
        wide[n] = from[n];
    }
    wide[n] = 0;
}

void st_narrow(st_ptr to, st_i64 length, st_ptr from) {
    const st_u16 *wide = (const st_u16 *)from;
    st_i64 n = 0;
    for (; n < length && wide[n] != 0; n++) {
        to[n] = wide[n] < 256 ? (st_byte)wide[n] : (st_byte)'?';
    }
    to[n] = 0;
}

void st_text_bool(st_ptr to, int value) {
    snprintf((char *)to, ROOM, "%s", value ? "TRUE" : "FALSE");
}
void st_text_signed(st_ptr to, st_i64 value) {
    snprintf((char *)to, ROOM, "%lld", (long long)value);
}
void st_text_unsigned(st_ptr to, st_u64 value) {
    snprintf((char *)to, ROOM, "%llu", (unsigned long long)value);
}

static void text_real(st_ptr to, double value, int digits, int single) {
    char *text = (char *)to;
    for (int n = 6; n <= digits; n++) {
        snprintf(text, ROOM, "%.*g", n, value);
        double back = strtod(text, NULL);
        if (single ? (float)back == (float)value : back == value) {
            break;
        }
    }
    if (strpbrk(text, ".eni") == NULL) {
        strcat(text, ".0");
    }
}

void st_text_f32(st_ptr to, double value) {
    text_real(to, value, 9, 1);
}
void st_text_f64(st_ptr to, double value) {
    text_real(to, value, 17, 0);
}

/* -- times */
static void text_duration(st_ptr to, const char *prefix, st_u64 ns, int fine) {
    static const struct {
        const char *unit;
        st_u64 ns;
    } parts[] = {{"d", 86400000000000ull},
                 {"h", 3600000000000ull},
                 {"m", 60000000000ull},
                 {"s", 1000000000ull},
                 {"ms", 1000000ull},
                 {"us", 1000ull},
                 {"ns", 1ull}};
    char *text = (char *)to;
    int at = snprintf(text, ROOM, "%s", prefix), empty = at;
    for (int i = 0; i < (fine ? 7 : 5); i++) {
        st_u64 count = ns / parts[i].ns;
        ns %= parts[i].ns;
        if (count != 0) {
            at += snprintf(text + at,
                           (size_t)(ROOM - at),
                           "%llu%s",
                           (unsigned long long)count,
                           parts[i].unit);
        }
    }
    if (at == empty) {
        snprintf(text + at, (size_t)(ROOM - at), "%s", fine ? "0ns" : "0ms");
    }
}

void st_text_time(st_ptr to, st_u64 ms) {
    text_duration(to, "T#", ms * 1000000u, 0);
}
void st_text_ltime(st_ptr to, st_u64 ns) {
    text_duration(to, "LTIME#", ns, 1);
}

/* Day since 1970 as year, month, day (proleptic Gregorian calendar). */
static void civil(st_i64 days, int *year, int *month, int *day) {
    st_i64 z = days + 719468, era = z / 146097, within = z - era * 146097;
    st_i64 y =
        (within - within / 1460 + within / 36524 - within / 146096) / 365;
    st_i64 of_year = within - (365 * y + y / 4 - y / 100),
           m = (5 * of_year + 2) / 153;
    *day = (int)(of_year - (153 * m + 2) / 5 + 1);
    *month = (int)(m < 10 ? m + 3 : m - 9);
    *year = (int)(y + era * 400 + (*month <= 2));
}

static st_i64 days_of(st_i64 year, st_i64 month, st_i64 day) {
    st_i64 y = year - (month <= 2), era = (y >= 0 ? y : y - 399) / 400,
           of_era = y - era * 400;
    st_i64 of_year = (153 * (month + (month > 2 ? -3 : 9)) + 2) / 5 + day - 1;
    return era * 146097 + of_era * 365 + of_era / 4 - of_era / 100 + of_year
           - 719468;
}

static int text_day(char *text, const char *prefix, st_u64 days) {
    int year, month, day;
    civil((st_i64)days, &year, &month, &day);
    return snprintf(text, ROOM, "%s%04d-%02d-%02d", prefix, year, month, day);
}

static void text_clock(char *text, int at, st_u64 ns, int digits) {
    st_u64 s = ns / 1000000000u, rest = ns % 1000000000u;
    unsigned h = (unsigned)(s / 3600 % 24), m = (unsigned)(s / 60 % 60),
             sec = (unsigned)(s % 60);
    at += snprintf(text + at, (size_t)(ROOM - at), "%02u:%02u:%02u", h, m, sec);
    if (digits == 3 && rest != 0) {
        snprintf(text + at,
                 (size_t)(ROOM - at),
                 ".%03u",
                 (unsigned)(rest / 1000000u));
    }
    if (digits == 9 && rest != 0) {
        snprintf(text + at, (size_t)(ROOM - at), ".%09u", (unsigned)rest);
    }
}

static void text_moment(st_ptr to,
                        const char *prefix,
                        st_u64 seconds,
                        st_u64 rest,
                        int digits) {
    char *text = (char *)to;
    int at = text_day(text, prefix, seconds / 86400u);
    at += snprintf(text + at, (size_t)(ROOM - at), "-");
    text_clock(text, at, seconds % 86400u * 1000000000u + rest, digits);
}

void st_text_date(st_ptr to, st_u64 seconds) {
    text_day((char *)to, "D#", seconds / 86400u);
}
void st_text_ldate(st_ptr to, st_u64 ns) {
    text_day((char *)to, "LDATE#", ns / 86400000000000u);
}

void st_text_time_of_day(st_ptr to, st_u64 ms) {
    int at = snprintf((char *)to, ROOM, "TOD#");
    text_clock((char *)to, at, ms * 1000000u, 3);
}

void st_text_ltime_of_day(st_ptr to, st_u64 ns) {
    int at = snprintf((char *)to, ROOM, "LTOD#");
    text_clock((char *)to, at, ns, 9);
}

void st_text_date_and_time(st_ptr to, st_u64 seconds) {
    text_moment(to, "DT#", seconds, 0, 0);
}

void st_text_ldate_and_time(st_ptr to, st_u64 ns) {
    text_moment(to, "LDT#", ns / 1000000000u, ns % 1000000000u, 9);
}

/* -- values of texts */
static const char *behind_blanks(st_ptr text) {
    const char *p = (const char *)text;
    while (*p == ' ' || *p == '\t') {
        p++;
    }
    return p;
}

static int digit_of(char c) {
    if (c >= '0' && c <= '9') {
        return c - '0';
    }
    if (c >= 'a' && c <= 'f') {
        return c - 'a' + 10;
    }
    return c >= 'A' && c <= 'F' ? c - 'A' + 10 : 99;
}

st_i64 st_parse_whole(st_ptr text) {
    const char *p = behind_blanks(text);
    int negative = *p == '-', base = 10;
    if (*p == '-' || *p == '+') {
        p++;
    }
    const char *hash = strchr(p, '#');
    if (hash != NULL && hash - p <= 2 && hash > p) {
        int given = atoi(p);
        if (given == 2 || given == 8 || given == 16) {
            base = given;
            p = hash + 1;
        }
    }
    st_u64 value = 0;
    for (; *p == '_' || digit_of(*p) < base; p++) {
        if (*p != '_') {
            value = value * (st_u64)base + (st_u64)digit_of(*p);
        }
    }
    return (st_i64)(negative ? 0 - value : value);
}

double st_parse_real(st_ptr text) {
    const char *p = behind_blanks(text);
    char clean[ROOM];
    int n = 0;
    for (; n < ROOM - 1 && *p != 0 && strchr("+-0123456789.eE", *p) != NULL;
         p++) {
        clean[n++] = *p;
    }
    clean[n] = 0;
    return strtod(clean, NULL);
}

int st_parse_bool(st_ptr text) {
    const char *p = behind_blanks(text);
    const char *word = "true";
    if (*p == '1') {
        return p[1] == 0;
    }
    while (*word && (*p | 32) == *word) {
        p++;
        word++;
    }
    return *word == 0 && *p == 0;
}

static st_i64 unit_ns(const char **p) {
    static const struct {
        const char *name;
        st_i64 ns;
    } units[] = {{"ms", 1000000},
                 {"us", 1000},
                 {"ns", 1},
                 {"d", 86400000000000},
                 {"h", 3600000000000},
                 {"m", 60000000000},
                 {"s", 1000000000}};
    for (unsigned i = 0; i < sizeof units / sizeof *units; i++) {
        size_t n = strlen(units[i].name);
        int same = 1;
        for (size_t k = 0; k < n; k++) {
            same = same && ((*p)[k] | 32) == units[i].name[k];
        }
        if (same) {
            *p += n;
            return units[i].ns;
        }
    }
    return 0;
}

static st_i64 parse_date(const char *p) {
    long long y = 0, m = 1, d = 1, hour = 0, minute = 0;
    double second = 0;
    int n = sscanf(p,
                   "%lld-%lld-%lld-%lld:%lld:%lf",
                   &y,
                   &m,
                   &d,
                   &hour,
                   &minute,
                   &second);
    if (n < 3) {
        return 0;
    }
    return ((days_of(y, m, d) * 24 + hour) * 60 + minute) * 60000000000ll
           + (st_i64)llround(second * 1e9);
}

/* Duration, date or time of day in ns. */
st_i64 st_parse_time(st_ptr text) {
    const char *p = behind_blanks(text), *hash = strchr(p, '#');
    st_i64 total = 0;
    if (hash != NULL) {
        p = hash + 1;
    }
    if (strchr(p, '-') != NULL && *p != '-') {
        return parse_date(p);
    }
    if (strchr(p, ':') != NULL) {
        long long hour = 0, minute = 0;
        double second = 0;
        sscanf(p, "%lld:%lld:%lf", &hour, &minute, &second);
        return (hour * 60 + minute) * 60000000000ll
               + (st_i64)llround(second * 1e9);
    }
    while ((*p >= '0' && *p <= '9') || *p == '.') {
        char *end;
        double value = strtod(p, &end);
        p = end;
        st_i64 unit = unit_ns(&p);
        if (unit == 0) {
            break;
        }
        total += (st_i64)llround(value * (double)unit);
    }
    return total;
}

/* -- dates from their parts */
st_i64 st_concat_date(st_i64 year, st_i64 month, st_i64 day) {
    return days_of(year, month, day) * 86400;
}

st_i64 st_concat_tod(st_i64 hour, st_i64 minute, st_i64 second, st_i64 ms) {
    return ((hour * 60 + minute) * 60 + second) * 1000 + ms;
}

st_i64 st_concat_dt(st_i64 year,
                    st_i64 month,
                    st_i64 day,
                    st_i64 hour,
                    st_i64 minute,
                    st_i64 second,
                    st_i64 ms) {
    (void)ms;
    return days_of(year, month, day) * 86400 + (hour * 60 + minute) * 60
           + second;
}
