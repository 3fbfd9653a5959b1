/* What generated C of Structured Text stands on: types, checked addresses,
 * traps. */
#ifndef ST_RUNTIME_H
#define ST_RUNTIME_H

#include <math.h>
#include <stddef.h>
#include <stdint.h>
#include <string.h>

#define ST_ANY __attribute__((aligned(1), may_alias))
typedef uint8_t st_u8 ST_ANY;
typedef uint16_t st_u16 ST_ANY;
typedef uint32_t st_u32 ST_ANY;
typedef uint64_t st_u64 ST_ANY;
typedef int8_t st_i8 ST_ANY;
typedef int16_t st_i16 ST_ANY;
typedef int32_t st_i32 ST_ANY;
typedef int64_t st_i64 ST_ANY;
typedef float st_f32 ST_ANY;
typedef double st_f64 ST_ANY;
typedef uint8_t st_bool ST_ANY;
typedef uint8_t st_byte;
typedef st_byte *st_ptr ST_ANY;
typedef uintptr_t st_uptr;

#define ST_HIDDEN __attribute__((visibility("hidden")))
#define ST_COLD __attribute__((noreturn, cold, noinline)) ST_HIDDEN
#define ST_BOOL(p) (*(st_u8 *)(p) != 0)
#define ST_LOCAL(name, size) st_byte name[size] __attribute__((aligned(8)))
#define ST_BUFFER(name, size) st_byte name[size] __attribute__((aligned(8)))
#define ST_ADD(a, b, sum) __builtin_add_overflow(a, b, sum)

/* -- classes */
typedef struct {
    const char *interface;
    void *const *methods;
} st_interface_of;

typedef struct {
    const char *name;
    void *body;
    void *const *methods;
    const st_interface_of *interfaces;
} st_class;

/* -- state of the program; one shared object is one program */
extern st_i64 st_now ST_HIDDEN;    /* the cell's clock in ns */
extern int32_t st_turns ST_HIDDEN; /* turns of loops until the clock is read */
extern uintptr_t st_deepest ST_HIDDEN;
extern uintptr_t st_memory_low ST_HIDDEN, st_memory_high ST_HIDDEN;
extern uintptr_t st_hli_low ST_HIDDEN, st_hli_high ST_HIDDEN;
extern uintptr_t st_stack_high ST_HIDDEN;
extern st_i64 st_image ST_HIDDEN; /* from the memory to the input image */

/* -- traps: they do not return */
/* The user's last call of a block or function of the library. */
typedef struct {
    const char *pou;
    int line;
    const char *name; /* what is called */
} st_call;
extern const st_call *st_caller ST_HIDDEN;
ST_COLD void st_trap_bound(const char *pou,
                           int line,
                           st_i64 value,
                           st_i64 low,
                           st_i64 high);
ST_COLD void st_trap_range(const char *pou,
                           int line,
                           st_i64 value,
                           st_i64 low,
                           st_i64 high);
ST_COLD void st_trap_null(const char *pou, int line, const char *name);
ST_COLD void st_trap_wild(const char *pou,
                          int line,
                          const char *name,
                          uintptr_t address,
                          st_i64 size);
ST_COLD void st_trap_divide(const char *pou, int line, double dividend);
ST_COLD void st_trap_stack(const char *pou);
ST_COLD void st_trap_abstract(void);
ST_COLD void st_trap_area(const char *pou,
                          int line,
                          const char *name,
                          st_i64 index);
/* The library refuses an input. */
ST_COLD void st_refuse(st_ptr text);
void st_loop_spent(const char *pou, int line) ST_HIDDEN;
void st_failed(st_ptr text) ST_HIDDEN;
extern const char *st_site_pou
    ST_HIDDEN; /* the call of an assertion that runs */
extern int st_site_line ST_HIDDEN;
st_ptr st_move(st_ptr pointer, st_i64 by, const char *pou, int line) ST_HIDDEN;

#define ST_LOOP(pou, line)                                                     \
    do {                                                                       \
        if (--st_turns < 0)                                                    \
            st_loop_spent(pou, line);                                          \
    } while (0)
#define ST_ENTER()                                                             \
    do {                                                                       \
        if ((uintptr_t)__builtin_frame_address(0) < st_deepest)                \
            st_trap_stack(st_here);                                            \
    } while (0)
#define ST_LEAVE() (void)0

/* -- addresses */
static inline int st_readable(uintptr_t p, st_i64 size) {
    uintptr_t end = p + (uintptr_t)size;
    if (p >= st_memory_low && end <= st_memory_high) {
        return 1;
    }
    if (p >= st_hli_low && end <= st_hli_high) {
        return 1;
    }
    uintptr_t shown = p - (uintptr_t)st_image;
    if (shown >= st_hli_low && shown + (uintptr_t)size <= st_hli_high) {
        return 1;
    }
    return p >= st_deepest && end <= st_stack_high;
}

static inline st_ptr st_deref(st_ptr p,
                              st_i64 size,
                              const char *pou,
                              int line,
                              const char *name) {
    if (__builtin_expect(p == 0, 0)) {
        st_trap_null(pou, line, name);
    }
    if (__builtin_expect(!st_readable((uintptr_t)p, size), 0)) {
        st_trap_wild(pou, line, name, (uintptr_t)p, size);
    }
    return p;
}

static inline st_ptr st_set(st_ptr p,
                            const char *pou,
                            int line,
                            const char *name) {
    if (__builtin_expect(p == 0, 0)) {
        st_trap_null(pou, line, name);
    }
    return p;
}

static inline st_ptr st_bound_named(st_ptr p,
                                    const char *pou,
                                    int line,
                                    const char *name) {
    return st_set(p, pou, line, name);
}

static inline st_ptr st_bound(st_ptr p, const char *pou, int line) {
    return st_set(p, pou, line, "reference");
}

static inline st_i64 st_index(st_i64 value,
                              st_i64 low,
                              st_i64 high,
                              const char *pou,
                              int line) {
    if (__builtin_expect(value < low || value > high, 0)) {
        st_trap_bound(pou, line, value, low, high);
    }
    return value - low;
}

/* An index of one of the HLI's arrays of pointers. */
static inline st_i64 st_area_index(st_i64 value,
                                   st_i64 low,
                                   st_i64 high,
                                   const char *pou,
                                   int line,
                                   const char *name) {
    if (__builtin_expect(value < low || value > high, 0)) {
        st_trap_area(pou, line, name, value);
    }
    return value - low;
}

/* The area behind an element of such an array. */
static inline st_ptr st_area(st_ptr element,
                             st_ptr array,
                             const char *pou,
                             int line,
                             const char *name) {
    st_ptr found = *(st_ptr *)element;
    if (__builtin_expect(found == 0, 0)) {
        st_trap_area(pou, line, name, (element - array) / 8);
    }
    return found;
}

static inline st_i64 st_range(st_i64 value,
                              st_i64 low,
                              st_i64 high,
                              const char *pou,
                              int line) {
    if (__builtin_expect(value < low || value > high, 0)) {
        st_trap_range(pou, line, value, low, high);
    }
    return value;
}

static inline void st_set_bit(st_ptr p, int bit, int value) {
    *p = (st_byte)((*p & ~(1u << bit)) | ((unsigned)(value != 0) << bit));
}

/* -- classes */
static inline void *st_method(st_ptr self, int slot) {
    const st_class *cls = *(const st_class *const *)(const void *)self;
    void *found = cls != 0 ? cls->methods[slot] : 0;
    if (__builtin_expect(found == 0, 0)) {
        st_trap_abstract();
    }
    return found;
}

void *st_interface(st_ptr self, const char *interface, int slot) ST_HIDDEN;
int st_query(st_ptr self, const char *interface, st_ptr target) ST_HIDDEN;
void st_body(st_ptr self) ST_HIDDEN;

/* -- the HLI: the named functions of the memory ordering, two words of the
 * segment, and how far the input image is behind the memory (0: none) */
typedef struct {
    uint8_t (*load_u8)(const void *);
    void (*store_u8)(void *, uint8_t);
    void (*ring)(void *);
    int (*snapshot)(const void *, const void *, void *, size_t, uint32_t);
    int (*ahead_claim)(void *, uint32_t);
    void (*ahead_ask)(void *, void *, uint32_t, uint32_t);
    int (*ahead_take)(void *, uint32_t, uint32_t, void *, void *, void *);
    void *bell;
    const uint32_t *generation;
    const uint64_t *techno_again;
    const uint8_t *axis_again;
    int64_t image;
} st_services;

extern st_services st_hli ST_HIDDEN;
void st_ring(void) ST_HIDDEN;
/* ``area``: of gpCh[area], or of gpAx[-1 - area]. */
st_u64 st_techno_again(st_i64 area) ST_HIDDEN;
int st_snapshot(st_ptr seq, st_ptr from, st_ptr to, st_i64 size) ST_HIDDEN;
int st_ahead_claim(st_ptr area) ST_HIDDEN;
void st_ahead_ask(st_ptr area, st_i64 slot) ST_HIDDEN;
int st_ahead_take(st_ptr area,
                  st_i64 slot,
                  st_ptr blocks,
                  st_ptr details,
                  st_ptr facts) ST_HIDDEN;
static inline st_bool st_load_flag(st_ptr p) {
    return st_hli.load_u8(p) != 0;
}
static inline void st_store_flag(st_ptr p, int value) {
    st_hli.store_u8(p, value != 0);
}
/* Where the input image has what the CNC shows at an address of the memory. */
static inline st_ptr st_latched(st_ptr p) {
    uintptr_t at = (uintptr_t)p;
    return at >= st_hli_low && at < st_hli_high ? p + st_image : p;
}

/* -- numbers */
static inline st_i64 st_div_i(st_i64 a, st_i64 b, const char *pou, int line) {
    if (__builtin_expect(b == 0, 0)) {
        st_trap_divide(pou, line, (double)a);
    }
    return b == -1 ? (st_i64)(0 - (st_u64)a) : a / b;
}

static inline st_i64 st_mod_i(st_i64 a, st_i64 b, const char *pou, int line) {
    if (__builtin_expect(b == 0, 0)) {
        st_trap_divide(pou, line, (double)a);
    }
    return b == -1 ? 0 : a % b;
}

static inline st_u64 st_div_u(st_u64 a, st_u64 b, const char *pou, int line) {
    if (__builtin_expect(b == 0, 0)) {
        st_trap_divide(pou, line, (double)a);
    }
    return a / b;
}

static inline st_u64 st_mod_u(st_u64 a, st_u64 b, const char *pou, int line) {
    if (__builtin_expect(b == 0, 0)) {
        st_trap_divide(pou, line, (double)a);
    }
    return a % b;
}

static inline double st_div_f(double a, double b, const char *pou, int line) {
    if (__builtin_expect(b == 0.0, 0)) {
        st_trap_divide(pou, line, a);
    }
    return a / b;
}

st_i64 st_clamped(double value) ST_HIDDEN;
st_u64 st_round_u64(double value) ST_HIDDEN;
st_i64 st_power(st_i64 base, st_i64 exponent) ST_HIDDEN;
static inline st_i64 st_round(double value) {
    return st_clamped(rint(value));
}
static inline st_i64 st_truncate(double value) {
    return st_clamped(trunc(value));
}
static inline double st_frac(double value) {
    return value - trunc(value);
}
static inline double st_sqrt(double value) {
    return sqrt(value);
}
static inline st_i64 st_abs(st_i64 value) {
    return value < 0 ? (st_i64)(0 - (st_u64)value) : value;
}

static inline st_u64 st_shl(st_u64 value, st_i64 n, int bits) {
    return n < 0 || n >= bits ? 0 : value << n;
}

static inline st_u64 st_shr(st_u64 value, st_i64 n, int bits) {
    return n < 0 || n >= bits ? 0 : value >> n;
}

static inline st_i64 st_sar(st_i64 value, st_i64 n, int bits) {
    if (n < 0) {
        return 0;
    }
    return value >> (n >= bits ? bits - 1 : n);
}

static inline st_u64 st_rol(st_u64 value, st_i64 n, int bits) {
    int by = (int)(((n % bits) + bits) % bits);
    return by == 0 ? value : (value << by) | (value >> (bits - by));
}

static inline st_u64 st_ror(st_u64 value, st_i64 n, int bits) {
    return st_rol(value, bits - n % bits, bits);
}

static inline st_i64 st_day(st_i64 time, st_i64 by, st_i64 day) {
    st_i64 moved = (time + by % day) % day;
    return moved < 0 ? moved + day : moved;
}

/* -- texts */
void st_copy(st_ptr to, st_i64 length, st_ptr from) ST_HIDDEN;
void st_wcopy(st_ptr to, st_i64 length, st_ptr from) ST_HIDDEN;
int st_compare(st_ptr a, st_ptr b) ST_HIDDEN;
int st_wcompare(st_ptr a, st_ptr b) ST_HIDDEN;
void st_widen(st_ptr to, st_i64 length, st_ptr from) ST_HIDDEN;
void st_narrow(st_ptr to, st_i64 length, st_ptr from) ST_HIDDEN;
st_i64 st_len(st_ptr text) ST_HIDDEN;
st_i64 st_wlen(st_ptr text) ST_HIDDEN;
st_i64 st_find(st_ptr text, st_ptr part) ST_HIDDEN;
st_i64 st_wfind(st_ptr text, st_ptr part) ST_HIDDEN;
#define ST_TEXT_FUNCTIONS(p)                                                   \
    void p##left(st_ptr to, st_i64 size, st_ptr text, st_i64 n) ST_HIDDEN;     \
    void p##right(st_ptr to, st_i64 size, st_ptr text, st_i64 n) ST_HIDDEN;    \
    void p##mid(st_ptr to, st_i64 size, st_ptr text, st_i64 n, st_i64 from)    \
        ST_HIDDEN;                                                             \
    void p##concat(st_ptr to, st_i64 size, st_ptr a, st_ptr b) ST_HIDDEN;      \
    void p##insert(st_ptr to, st_i64 size, st_ptr a, st_ptr b, st_i64 behind)  \
        ST_HIDDEN;                                                             \
    void p##delete (st_ptr to,                                                 \
                    st_i64 size,                                               \
                    st_ptr text,                                               \
                    st_i64 n,                                                  \
                    st_i64 from)ST_HIDDEN;                                     \
    void p##replace(st_ptr to,                                                 \
                    st_i64 size,                                               \
                    st_ptr a,                                                  \
                    st_ptr b,                                                  \
                    st_i64 n,                                                  \
                    st_i64 from) ST_HIDDEN;
ST_TEXT_FUNCTIONS(st_)
ST_TEXT_FUNCTIONS(st_w)

/* -- texts of values and values of texts; a text has room for 80 characters */
void st_text_bool(st_ptr to, int value) ST_HIDDEN;
void st_text_signed(st_ptr to, st_i64 value) ST_HIDDEN;
void st_text_unsigned(st_ptr to, st_u64 value) ST_HIDDEN;
void st_text_f32(st_ptr to, double value) ST_HIDDEN;
void st_text_f64(st_ptr to, double value) ST_HIDDEN;
void st_text_time(st_ptr to, st_u64 ms) ST_HIDDEN;
void st_text_ltime(st_ptr to, st_u64 ns) ST_HIDDEN;
void st_text_date(st_ptr to, st_u64 seconds) ST_HIDDEN;
void st_text_ldate(st_ptr to, st_u64 ns) ST_HIDDEN;
void st_text_time_of_day(st_ptr to, st_u64 ms) ST_HIDDEN;
void st_text_ltime_of_day(st_ptr to, st_u64 ns) ST_HIDDEN;
void st_text_date_and_time(st_ptr to, st_u64 seconds) ST_HIDDEN;
void st_text_ldate_and_time(st_ptr to, st_u64 ns) ST_HIDDEN;
st_i64 st_parse_whole(st_ptr text) ST_HIDDEN;
double st_parse_real(st_ptr text) ST_HIDDEN;
int st_parse_bool(st_ptr text) ST_HIDDEN;
st_i64 st_parse_time(st_ptr text) ST_HIDDEN;

/* -- dates */
st_i64 st_concat_date(st_i64 year, st_i64 month, st_i64 day) ST_HIDDEN;
st_i64 st_concat_tod(st_i64 hour,
                     st_i64 minute,
                     st_i64 second,
                     st_i64 ms) ST_HIDDEN;
st_i64 st_concat_dt(st_i64 year,
                    st_i64 month,
                    st_i64 day,
                    st_i64 hour,
                    st_i64 minute,
                    st_i64 second,
                    st_i64 ms) ST_HIDDEN;

/* -- blocks of memory */
st_i64 st_memcpy(st_ptr to,
                 st_ptr from,
                 st_i64 n,
                 const char *pou,
                 int line) ST_HIDDEN;
st_i64 st_memmove(st_ptr to,
                  st_ptr from,
                  st_i64 n,
                  const char *pou,
                  int line) ST_HIDDEN;
st_i64 st_memset(st_ptr to,
                 st_i64 byte,
                 st_i64 n,
                 const char *pou,
                 int line) ST_HIDDEN;
st_i64 st_memcmp(st_ptr a,
                 st_ptr b,
                 st_i64 n,
                 const char *pou,
                 int line) ST_HIDDEN;
#endif
