/* Plain motion lines of a text buffer -> rows. */
#define _GNU_SOURCE
#include "rows/scan.h"

#include <stdlib.h>
#include <string.h>

#define FAST_DIGITS 15 /* an integer of so many digits is exact in a double ... */
#define FAST_FRACTION 22 /* ... and so is this power of ten: their quotient is correctly rounded */

static const double POWER_OF_TEN[FAST_FRACTION + 1] = {
    1e0,  1e1,  1e2,  1e3,  1e4,  1e5,  1e6,  1e7,  1e8,  1e9,  1e10, 1e11,
    1e12, 1e13, 1e14, 1e15, 1e16, 1e17, 1e18, 1e19, 1e20, 1e21, 1e22};

/* One line: [at, end), end excludes the line break and trailing blanks. */
typedef struct cursor {
    const char *begin, *at, *end;
} cursor;

static int is_digit(char c)
{
    return c >= '0' && c <= '9';
}

static int is_blank(char c)
{
    return c == ' ' || c == '\t';
}

static char upper(char c)
{
    return c >= 'a' && c <= 'z' ? (char)(c - 'a' + 'A') : c;
}

static void skip_blanks(cursor *c)
{
    while (c->at < c->end && is_blank(*c->at))
        c->at++;
}

/* Digits without leading zeros, and how many of them stand behind the point. */
typedef struct decimal {
    char digits[NC_BLOCK_CHARACTERS];
    size_t count, fraction;
    uint64_t value; /* of the first FAST_DIGITS digits */
} decimal;

static int read_digits(cursor *c, decimal *d, size_t *fraction)
{
    const char *from = c->at;
    for (; c->at < c->end && is_digit(*c->at); c->at++) {
        if (fraction)
            ++*fraction;
        if (d->count == 0 && *c->at == '0')
            continue;
        if (d->count < FAST_DIGITS)
            d->value = d->value * 10 + (uint64_t)(*c->at - '0');
        d->digits[d->count++] = *c->at;
    }
    return c->at > from;
}

/* strtod of digits and an exponent: no decimal point, so the locale does not matter. */
static double slow_value(const decimal *d)
{
    char text[NC_BLOCK_CHARACTERS + 16];
    memcpy(text, d->digits, d->count);
    char *p = text + d->count;
    *p++ = 'e';
    *p++ = '-';
    size_t divisor = 1000;
    for (; divisor; divisor /= 10)
        *p++ = (char)('0' + d->fraction / divisor % 10);
    *p = 0;
    return strtod(text, NULL);
}

/* [+-]?(digits[.digits*]|.digits), correctly rounded. */
static int read_number(cursor *c, double *value)
{
    decimal d;
    d.count = d.fraction = 0;
    d.value = 0;
    int negative = c->at < c->end && *c->at == '-';
    if (c->at < c->end && (*c->at == '-' || *c->at == '+'))
        c->at++;
    int found = read_digits(c, &d, NULL);
    if (c->at < c->end && *c->at == '.') {
        c->at++;
        found |= read_digits(c, &d, &d.fraction);
    }
    if (!found)
        return 0;
    int fast = d.count <= FAST_DIGITS && d.fraction <= FAST_FRACTION;
    *value = fast ? (double)d.value / POWER_OF_TEN[d.fraction] : d.count ? slow_value(&d) : 0.0;
    if (negative)
        *value = -*value;
    return 1;
}

static int read_integer(cursor *c, uint32_t *value)
{
    uint64_t sum = 0;
    const char *from = c->at;
    for (; c->at < c->end && is_digit(*c->at); c->at++) {
        sum = sum * 10 + (uint64_t)(*c->at - '0');
        if (sum > UINT32_MAX)
            return 0;
    }
    *value = (uint32_t)sum;
    return c->at > from && !(c->at < c->end && *c->at == '.');
}

static int set_code(int8_t *code, int value)
{
    if (*code >= 0)
        return 0; /* twice: the parser reports it */
    *code = (int8_t)value;
    return 1;
}

static int read_g(cursor *c, uint32_t rules, nc_words *w)
{
    uint32_t code;
    if (!read_integer(c, &code))
        return 0;
    if (code <= 3)
        return set_code(&w->motion, (int)code);
    if (code >= 17 && code <= 19 && !(rules & NC_RULE_NO_PLANES))
        return set_code(&w->plane, (int)code);
    if (code == 90 || code == 91)
        return set_code(&w->absolute, code == 90);
    return 0;
}

static int read_value(cursor *c, uint32_t rules, double *value)
{
    if (c->at < c->end && *c->at == '=' && !(rules & NC_RULE_NO_EQUALS)) {
        c->at++;
        skip_blanks(c);
    }
    return read_number(c, value);
}

/* A word that may stand once; `seen` holds the bits of those that stood already. */
static int read_once(cursor *c, uint32_t rules, uint32_t *seen, uint32_t bit, double *value)
{
    if (*seen & bit)
        return 0;
    *seen |= bit;
    return read_value(c, rules, value);
}

static int read_axis(cursor *c, const nc_modal *m, char letter, nc_words *w)
{
    int axis = letter >= 'A' && letter <= 'Z' ? m->letter_axis[letter - 'A'] : -1;
    return axis >= 0 && read_once(c, m->rules, &w->axis_set, 1u << axis, &w->axis[axis]);
}

static int read_word(cursor *c, const nc_modal *m, nc_words *w)
{
    uint32_t column = (uint32_t)(c->at - c->begin) + 1;
    char letter = upper(*c->at++);
    skip_blanks(c);
    switch (letter) {
    case 'G':
        return read_g(c, m->rules, w);
    case 'N':
        if (w->set & NC_WORD_N)
            return 0;
        w->set |= NC_WORD_N;
        return read_integer(c, &w->n);
    case 'F':
        return read_once(c, m->rules, &w->set, NC_WORD_F, &w->f) && (w->f > 0.0 || !(m->rules & NC_RULE_FEED_POSITIVE));
    default:
        if (!w->column)
            w->column = column;
    }
    if (letter == 'R')
        return read_once(c, m->rules, &w->set, NC_WORD_R, &w->r);
    if (letter >= 'I' && letter <= 'K')
        return read_once(c, m->rules, &w->set, (uint32_t)NC_WORD_I << (letter - 'I'), &w->centre[letter - 'I']);
    return read_axis(c, m, letter, w);
}

/* Past a closed comment without a bracket inside, and without a comma where that may be a message. */
static int skip_comment(cursor *c, uint32_t rules)
{
    if (rules & NC_RULE_NO_BRACKETS)
        return 0;
    char stop = rules & NC_RULE_MESSAGES ? ',' : '(';
    for (c->at++; c->at < c->end && *c->at != '(' && *c->at != stop; c->at++)
        if (*c->at == ')') {
            c->at++;
            return 1;
        }
    return 0;
}

static int read_line(cursor *c, const nc_modal *m, nc_words *w)
{
    if (c->at < c->end && c->end[-1] == '\\')
        return 0; /* continued */
    for (skip_blanks(c); c->at < c->end && *c->at != ';'; skip_blanks(c))
        if (!(*c->at == '(' ? skip_comment(c, m->rules) : read_word(c, m, w)))
            return 0;
    return 1;
}

/* The line at `text`: its bytes without line break and trailing blanks. */
static cursor line_at(const char *text, size_t length)
{
    const char *end = text + length;
    if (end > text && end[-1] == '\r')
        end--;
    while (end > text && is_blank(end[-1]))
        end--;
    return (cursor){text, text, end};
}

/* One line into at most one row; 0 to go on, NC_SCAN_OTHER or NC_SCAN_ERROR with the modal state as before. */
static int scan_line(nc_modal *m, const char *text, size_t length, nc_block *out, nc_scan_result *result)
{
    nc_words w;
    nc_words_init(&w);
    cursor c = line_at(text, length);
    if (c.end - c.begin > NC_BLOCK_CHARACTERS || !read_line(&c, m, &w))
        return NC_SCAN_OTHER;
    if (!w.axis_set && (w.set & NC_WORD_R) && !(w.set & (NC_WORD_I | NC_WORD_I << 1 | NC_WORD_I << 2)))
        return NC_SCAN_OTHER; /* a radius that leads nowhere: the dialect knows what to say */
    nc_modal before = *m;
    int emitted;
    m->line++;
    m->count++;
    m->programmed += w.set || w.axis_set || w.motion >= 0 || w.plane >= 0 || w.absolute >= 0;
    result->error = nc_block_from_words(m, &w, out, &emitted);
    if (result->error) {
        *m = before;
        result->column = w.column ? w.column : 1;
        return NC_SCAN_ERROR;
    }
    result->rows += (size_t)emitted;
    return 0;
}

/* Reads plain lines until something else stands there; returns why (NC_SCAN_...), details in `result`. `final`: a last
 * line without line break is whole. */
int nc_scan(nc_modal *m, const char *text, size_t size, int final, nc_block *out, size_t room, nc_scan_result *result)
{
    memset(result, 0, sizeof *result);
    while (result->consumed < size && result->stop == 0) {
        const char *line = text + result->consumed;
        size_t left = size - result->consumed;
        const char *end = memchr(line, '\n', left);
        size_t length = end ? (size_t)(end - line) : left;
        if (result->rows == room)
            result->stop = NC_SCAN_FULL;
        else if (!end && !final && length <= NC_BLOCK_CHARACTERS)
            break;
        else
            result->stop = end || final ? scan_line(m, line, length, out + result->rows, result) : NC_SCAN_OTHER;
        if (result->stop == 0)
            result->consumed += length + (end ? 1 : 0);
    }
    return result->stop;
}
