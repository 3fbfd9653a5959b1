/* Plain motion lines of a text buffer -> rows. */
#define _GNU_SOURCE
#include "rows/scan.h"

#include <stdlib.h>
#include <string.h>

/* an integer of so many digits is exact in a double ... */
#define FAST_DIGITS 15
/* ... and so is this power of ten: their quotient is correctly rounded */
#define FAST_FRACTION 22

static const double POWER_OF_TEN[FAST_FRACTION + 1] = {
    1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

/* One line: [at, end), end excludes the line break and trailing blanks. */
typedef struct cursor {
    const char *begin, *at, *end;
} cursor;

static int is_digit(char letter) {
    return letter >= '0' && letter <= '9';
}

static int is_blank(char letter) {
    return letter == ' ' || letter == '\t';
}

static char upper(char letter) {
    return letter >= 'a' && letter <= 'z' ? (char)(letter - 'a' + 'A') : letter;
}

static void skip_blanks(struct cursor *cursor) {
    while (cursor->at < cursor->end && is_blank(*cursor->at)) {
        cursor->at++;
    }
}

/* Digits without leading zeros, and how many of them stand behind the point. */
typedef struct decimal {
    char digits[NC_BLOCK_CHARACTERS];
    size_t count, fraction;
    uint64_t value; /* of the first FAST_DIGITS digits */
} decimal;

static int read_digits(struct cursor *cursor,
                       struct decimal *decimal,
                       size_t *fraction) {
    const char *from = cursor->at;
    for (; cursor->at < cursor->end && is_digit(*cursor->at); cursor->at++) {
        if (fraction) {
            ++*fraction;
        }
        if (decimal->count == 0 && *cursor->at == '0') {
            continue;
        }
        if (decimal->count < FAST_DIGITS) {
            decimal->value =
                decimal->value * 10 + (uint64_t)(*cursor->at - '0');
        }
        decimal->digits[decimal->count++] = *cursor->at;
    }
    return cursor->at > from;
}

/* strtod of digits and an exponent: no decimal point, so the locale does not
 * matter. */
static double slow_value(const struct decimal *decimal) {
    char text[NC_BLOCK_CHARACTERS + 16];
    memcpy(text, decimal->digits, decimal->count);
    char *at = text + decimal->count;
    *at++ = 'e';
    *at++ = '-';
    size_t divisor = 1000;
    for (; divisor; divisor /= 10) {
        *at++ = (char)('0' + decimal->fraction / divisor % 10);
    }
    *at = 0;
    return strtod(text, NULL);
}

/* [+-]?(digits[.digits*]|.digits), correctly rounded. */
static int read_number(struct cursor *cursor, double *value) {
    struct decimal decimal;
    decimal.count = 0;
    decimal.fraction = 0;
    decimal.value = 0;
    int negative = cursor->at < cursor->end && *cursor->at == '-';
    if (cursor->at < cursor->end
        && (*cursor->at == '-' || *cursor->at == '+')) {
        cursor->at++;
    }
    int found = read_digits(cursor, &decimal, NULL);
    if (cursor->at < cursor->end && *cursor->at == '.') {
        cursor->at++;
        found |= read_digits(cursor, &decimal, &decimal.fraction);
    }
    if (!found) {
        return 0;
    }
    int fast =
        decimal.count <= FAST_DIGITS && decimal.fraction <= FAST_FRACTION;
    *value = fast ? (double)decimal.value / POWER_OF_TEN[decimal.fraction]
             : decimal.count ? slow_value(&decimal)
                             : 0.0;
    if (negative) {
        *value = -*value;
    }
    return 1;
}

static int read_integer(struct cursor *cursor, uint32_t *value) {
    uint64_t sum = 0;
    const char *from = cursor->at;
    for (; cursor->at < cursor->end && is_digit(*cursor->at); cursor->at++) {
        sum = sum * 10 + (uint64_t)(*cursor->at - '0');
        if (sum > UINT32_MAX) {
            return 0;
        }
    }
    *value = (uint32_t)sum;
    return cursor->at > from
           && !(cursor->at < cursor->end && *cursor->at == '.');
}

static int set_code(int8_t *code, int value) {
    if (*code >= 0) {
        return 0; /* twice: the parser reports it */
    }
    *code = (int8_t)value;
    return 1;
}

static int read_g(struct cursor *cursor, uint32_t rules, nc_words *words) {
    uint32_t code;
    if (!read_integer(cursor, &code)) {
        return 0;
    }
    if (code <= 3) {
        return set_code(&words->motion, (int)code);
    }
    if (code >= 17 && code <= 19 && !(rules & NC_RULE_NO_PLANES)) {
        return set_code(&words->plane, (int)code);
    }
    if (code == 90 || code == 91) {
        return set_code(&words->absolute, code == 90);
    }
    return 0;
}

static int read_value(struct cursor *cursor, uint32_t rules, double *value) {
    if (cursor->at < cursor->end && *cursor->at == '='
        && !(rules & NC_RULE_NO_EQUALS)) {
        cursor->at++;
        skip_blanks(cursor);
    }
    return read_number(cursor, value);
}

/* A word that may stand once; `seen` holds the bits of those that stood
 * already. */
static int read_once(struct cursor *cursor,
                     uint32_t rules,
                     uint32_t *seen,
                     uint32_t bit,
                     double *value) {
    if (*seen & bit) {
        return 0;
    }
    *seen |= bit;
    return read_value(cursor, rules, value);
}

static int read_axis(struct cursor *cursor,
                     const nc_modal *modal,
                     char letter,
                     nc_words *words) {
    int axis =
        letter >= 'A' && letter <= 'Z' ? modal->letter_axis[letter - 'A'] : -1;
    return axis >= 0
           && read_once(cursor,
                        modal->rules,
                        &words->axis_set,
                        1u << axis,
                        &words->axis[axis]);
}

static int read_word(struct cursor *cursor,
                     const nc_modal *modal,
                     nc_words *words) {
    uint32_t column = (uint32_t)(cursor->at - cursor->begin) + 1;
    char letter = upper(*cursor->at++);
    skip_blanks(cursor);
    switch (letter) {
    case 'G':
        return read_g(cursor, modal->rules, words);
    case 'N':
        if (words->set & NC_WORD_N) {
            return 0;
        }
        words->set |= NC_WORD_N;
        return read_integer(cursor, &words->n);
    case 'F':
        return read_once(cursor,
                         modal->rules,
                         &words->set,
                         NC_WORD_F,
                         &words->f)
               && (words->f > 0.0 || !(modal->rules & NC_RULE_FEED_POSITIVE));
    default:
        if (!words->column) {
            words->column = column;
        }
    }
    if (letter == 'R') {
        return read_once(cursor,
                         modal->rules,
                         &words->set,
                         NC_WORD_R,
                         &words->r);
    }
    if (letter >= 'I' && letter <= 'K') {
        return read_once(cursor,
                         modal->rules,
                         &words->set,
                         (uint32_t)NC_WORD_I << (letter - 'I'),
                         &words->centre[letter - 'I']);
    }
    return read_axis(cursor, modal, letter, words);
}

/* Past a closed comment without a bracket inside, and without a comma where
 * that may be a message. */
static int skip_comment(struct cursor *cursor, uint32_t rules) {
    if (rules & NC_RULE_NO_BRACKETS) {
        return 0;
    }
    char stop = rules & NC_RULE_MESSAGES ? ',' : '(';
    for (cursor->at++;
         cursor->at < cursor->end && *cursor->at != '(' && *cursor->at != stop;
         cursor->at++) {
        if (*cursor->at == ')') {
            cursor->at++;
            return 1;
        }
    }
    return 0;
}

static int read_line(struct cursor *cursor,
                     const nc_modal *modal,
                     nc_words *words) {
    if (cursor->at < cursor->end && cursor->end[-1] == '\\') {
        return 0; /* continued */
    }
    for (skip_blanks(cursor); cursor->at < cursor->end && *cursor->at != ';';
         skip_blanks(cursor)) {
        if (!(*cursor->at == '(' ? skip_comment(cursor, modal->rules)
                                 : read_word(cursor, modal, words))) {
            return 0;
        }
    }
    return 1;
}

/* The line at `text`: its bytes without line break and trailing blanks. */
static struct cursor line_at(const char *text, size_t length) {
    const char *end = text + length;
    if (end > text && end[-1] == '\r') {
        end--;
    }
    while (end > text && is_blank(end[-1])) {
        end--;
    }
    return (struct cursor){text, text, end};
}

/* One line into at most one row; 0 to go on, NC_SCAN_OTHER or NC_SCAN_ERROR
 * with the modal state as before. */
static int scan_line(nc_modal *modal,
                     const char *text,
                     size_t length,
                     nc_block *out,
                     nc_scan_result *result) {
    nc_words words;
    nc_words_init(&words);
    struct cursor cursor = line_at(text, length);
    if (cursor.end - cursor.begin > NC_BLOCK_CHARACTERS
        || !read_line(&cursor, modal, &words)) {
        return NC_SCAN_OTHER;
    }
    if (!words.axis_set && (words.set & NC_WORD_R)
        && !(words.set & (NC_WORD_I | NC_WORD_I << 1 | NC_WORD_I << 2))) {
        return NC_SCAN_OTHER; /* a radius that leads nowhere: the dialect knows
                                 what to say */
    }
    nc_modal before = *modal;
    int emitted;
    modal->line++;
    modal->count++;
    modal->programmed += words.set || words.axis_set || words.motion >= 0
                         || words.plane >= 0 || words.absolute >= 0;
    result->error = nc_block_from_words(modal, &words, out, &emitted);
    if (result->error) {
        *modal = before;
        result->column = words.column ? words.column : 1;
        return NC_SCAN_ERROR;
    }
    result->rows += (size_t)emitted;
    return 0;
}

/* Reads plain lines until something else stands there; returns why
 * (NC_SCAN_...), details in `result`. `final`: a last line without line break
 * is whole. */
int nc_scan(nc_modal *modal,
            const char *text,
            size_t size,
            int final,
            nc_block *out,
            size_t room,
            nc_scan_result *result) {
    memset(result, 0, sizeof *result);
    while (result->consumed < size && result->stop == 0) {
        const char *line = text + result->consumed;
        size_t left = size - result->consumed;
        const char *end = memchr(line, '\n', left);
        size_t length = end ? (size_t)(end - line) : left;
        if (result->rows == room) {
            result->stop = NC_SCAN_FULL;
        } else if (!end && !final && length <= NC_BLOCK_CHARACTERS) {
            break;
        } else {
            result->stop =
                end || final
                    ? scan_line(modal, line, length, out + result->rows, result)
                    : NC_SCAN_OTHER;
        }
        if (result->stop == 0) {
            result->consumed += length + (end ? 1 : 0);
        }
    }
    return result->stop;
}
