/* State of the program, entry of a scan, traps, checked blocks of memory. */
#ifndef _GNU_SOURCE
#define _GNU_SOURCE
#endif
#include "st_runtime.h"

#include <pthread.h>
#include <setjmp.h>
#include <stddef.h>
#include <stdio.h>
#include <stdlib.h>
#include <time.h>
#include <unistd.h>

#define ST_API __attribute__((visibility("default")))
#define TURNS 200000
#define TOLD_NS 2000000000LL /* a loop that lasts so long is told */
#define STACK_RESERVE (256u * 1024u)
#define STACK_LIMIT (4u * 1024u * 1024u)

st_i64 st_now;
int32_t st_turns = TURNS;
uintptr_t st_deepest, st_memory_low, st_memory_high, st_hli_low, st_hli_high,
    st_stack_high;
st_i64 st_image;
st_services st_hli;

enum {
    TRAP_NONE,
    TRAP_BOUND,
    TRAP_RANGE,
    TRAP_NULL,
    TRAP_WILD,
    TRAP_DIVIDE,
    TRAP_STACK,
    TRAP_LOOP,
    TRAP_ABSTRACT,
    TRAP_AREA,
    TRAP_REFUSED
};

typedef struct {
    int32_t kind;
    int32_t line;
    char pou[128];
    char name[128];
    int64_t values[3];
    double real;
    char caller_pou[128]; /* the user's call of the library; empty: none */
    char caller_name[128];
    int32_t caller_line;
} st_trap_report;

ST_API st_trap_report st_trap;
const st_call *st_caller;
static jmp_buf way_out;
ST_API int st_tell_on = STDERR_FILENO; /* a loop that lasts is told there */
static int running, told;
static int64_t deadline_ns, allowed_ns = 10000000000LL;

/* The memory and its objects are defined by the generated program. */
extern st_byte st_memory[];
extern const st_i64 st_memory_size;
extern const uint32_t st_objects[];
extern const uint32_t st_object_count;

static int64_t clock_ns(void) {
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (int64_t)t.tv_sec * 1000000000LL + t.tv_nsec;
}

__attribute__((noreturn)) static void leave(int kind,
                                            const char *pou,
                                            int line,
                                            const char *name) {
    st_trap.kind = kind;
    st_trap.line = line;
    snprintf(st_trap.pou, sizeof st_trap.pou, "%s", pou);
    snprintf(st_trap.name, sizeof st_trap.name, "%s", name);
    static const st_call nobody = {"", 0, ""};
    const st_call *caller = st_caller != 0 ? st_caller : &nobody;
    char *caller_pou = st_trap.caller_pou, *caller_name = st_trap.caller_name;
    snprintf(caller_pou, sizeof st_trap.caller_pou, "%s", caller->pou);
    snprintf(caller_name, sizeof st_trap.caller_name, "%s", caller->name);
    st_trap.caller_line = caller->line;
    if (!running) {
        abort();
    }
    longjmp(way_out, 1);
}

static void values(st_i64 a, st_i64 b, st_i64 c) {
    st_trap.values[0] = a;
    st_trap.values[1] = b;
    st_trap.values[2] = c;
}

void st_trap_bound(const char *pou,
                   int line,
                   st_i64 value,
                   st_i64 low,
                   st_i64 high) {
    values(value, low, high);
    leave(TRAP_BOUND, pou, line, "");
}

void st_trap_range(const char *pou,
                   int line,
                   st_i64 value,
                   st_i64 low,
                   st_i64 high) {
    values(value, low, high);
    leave(TRAP_RANGE, pou, line, "");
}

void st_trap_null(const char *pou, int line, const char *name) {
    leave(TRAP_NULL, pou, line, name);
}

void st_trap_wild(const char *pou,
                  int line,
                  const char *name,
                  uintptr_t address,
                  st_i64 size) {
    values((st_i64)address, size, 0);
    leave(TRAP_WILD, pou, line, name);
}

void st_trap_divide(const char *pou, int line, double dividend) {
    st_trap.real = dividend;
    leave(TRAP_DIVIDE, pou, line, "");
}

void st_trap_stack(const char *pou) {
    leave(TRAP_STACK, pou, 0, "");
}

void st_trap_abstract(void) {
    leave(TRAP_ABSTRACT, "", 0, "");
}

void st_trap_area(const char *pou, int line, const char *name, st_i64 index) {
    values(index, 0, 0);
    leave(TRAP_AREA, pou, line, name);
}

void st_refuse(st_ptr text) {
    leave(TRAP_REFUSED, "", 0, (const char *)text);
}

void st_loop_spent(const char *pou, int line) {
    st_turns = TURNS;
    int64_t now_ns = clock_ns();
    if (!told && now_ns > deadline_ns - allowed_ns + TOLD_NS) {
        told = 1;
        dprintf(st_tell_on,
                "a loop in %s has not ended for %d s\n",
                pou,
                (int)(TOLD_NS / 1000000000LL));
    }
    if (now_ns < deadline_ns) {
        return;
    }
    values(allowed_ns / 1000000, 0, 0);
    leave(TRAP_LOOP, pou, line, "");
}

/* -- assertions of tests */
#define FAILURES 20

typedef struct {
    int32_t line;
    char pou[128];
    char text[256];
} st_failure;

ST_API st_failure st_failures[FAILURES];
ST_API int32_t st_failure_count;
const char *st_site_pou = "";
int st_site_line;

void st_failed(st_ptr text) {
    if (st_failure_count < FAILURES) {
        st_failure *failure = &st_failures[st_failure_count];
        failure->line = st_site_line;
        snprintf(failure->pou, sizeof failure->pou, "%s", st_site_pou);
        snprintf(failure->text, sizeof failure->text, "%s", (const char *)text);
    }
    st_failure_count++;
}

/* -- classes */
void *st_interface(st_ptr self, const char *interface, int slot) {
    const st_class *cls = *(const st_class *const *)(const void *)self;
    if (cls == 0) {
        st_trap_abstract();
    }
    for (const st_interface_of *i = cls->interfaces; i->interface != 0; i++) {
        if (i->interface == interface && i->methods[slot] != 0) {
            return i->methods[slot];
        }
    }
    st_trap_abstract();
}

int st_query(st_ptr self, const char *interface, st_ptr target) {
    const st_class *cls =
        self == 0 ? 0 : *(const st_class *const *)(const void *)self;
    st_ptr found = 0;
    if (cls != 0) {
        for (const st_interface_of *i = cls->interfaces; i->interface != 0;
             i++) {
            if (i->interface == interface) {
                found = self;
            }
        }
    }
    *(st_ptr *)target = found;
    return found != 0;
}

void st_body(st_ptr self) {
    const st_class *cls = *(const st_class *const *)(const void *)self;
    if (cls == 0 || cls->body == 0) {
        st_trap_abstract();
    }
    ((void (*)(st_ptr))cls->body)(self);
}

/* -- the HLI; the library alone calls these */
#define TRIES 1000
#define GENERATIONS 0xFFFFFFu

void st_ring(void) {
    if (st_hli.bell != 0) {
        st_hli.ring(st_hli.bell);
    }
}

int st_snapshot(st_ptr seq, st_ptr from, st_ptr to, st_i64 size) {
    return st_hli.snapshot(seq, from, to, (size_t)size, TRIES) == 0;
}

static uint32_t generation(void) {
    return *st_hli.generation & GENERATIONS;
}

st_u64 st_techno_again(st_i64 area) {
    if (st_hli.techno_again == 0) {
        return 0;
    }
    return area < 0
               ? __atomic_load_n(&st_hli.axis_again[-1 - area],
                                 __ATOMIC_RELAXED)
               : __atomic_load_n(&st_hli.techno_again[area], __ATOMIC_RELAXED);
}

int st_ahead_claim(st_ptr area) {
    return st_hli.ahead_claim(area, generation());
}

void st_ahead_ask(st_ptr area, st_i64 slot) {
    st_hli.ahead_ask(area, st_hli.bell, (uint32_t)slot, generation());
}

int st_ahead_take(st_ptr area,
                  st_i64 slot,
                  st_ptr blocks,
                  st_ptr details,
                  st_ptr facts) {
    return st_hli
        .ahead_take(area, (uint32_t)slot, generation(), blocks, details, facts);
}

/* -- pointers */
/* The object an address lies in: its first byte and the byte behind it. */
static int object_of(uintptr_t p, uintptr_t *low, uintptr_t *high) {
    uintptr_t offset = p - st_memory_low;
    uint32_t first = 0, last = st_object_count;
    if (p < st_memory_low || p > st_memory_high || last == 0) {
        return 0;
    }
    while (last - first > 1) {
        uint32_t middle = (first + last) / 2;
        if (st_objects[middle] <= offset) {
            first = middle;
        } else {
            last = middle;
        }
    }
    *low = st_memory_low + st_objects[first];
    *high = first + 1 < st_object_count ? st_memory_low + st_objects[first + 1]
                                        : st_memory_high;
    return 1;
}

st_ptr st_move(st_ptr pointer, st_i64 by, const char *pou, int line) {
    uintptr_t from = (uintptr_t)pointer, to = from + (uintptr_t)by, low, high;
    if (from != 0 && object_of(from, &low, &high)
        && (to + 1 < low || to > high)) {
        st_trap_wild(pou, line, "pointer arithmetic", to, by);
    }
    return (st_ptr)to;
}

static void check(st_ptr p,
                  st_i64 n,
                  const char *pou,
                  int line,
                  const char *name) {
    if (n < 0) {
        st_trap_wild(pou, line, name, (uintptr_t)p, n);
    }
    if (n > 0) {
        (void)st_deref(p, n, pou, line, name);
    }
}

st_i64 st_memcpy(st_ptr to, st_ptr from, st_i64 n, const char *pou, int line) {
    check(to, n, pou, line, "destAddr");
    check(from, n, pou, line, "srcAddr");
    memmove(to, from, (size_t)n);
    return n;
}

st_i64 st_memmove(st_ptr to, st_ptr from, st_i64 n, const char *pou, int line) {
    return st_memcpy(to, from, n, pou, line);
}

st_i64 st_memset(st_ptr to, st_i64 byte, st_i64 n, const char *pou, int line) {
    check(to, n, pou, line, "destAddr");
    memset(to, (int)(byte & 255), (size_t)n);
    return n;
}

st_i64 st_memcmp(st_ptr a, st_ptr b, st_i64 n, const char *pou, int line) {
    check(a, n, pou, line, "pBuf1");
    check(b, n, pou, line, "pBuf2");
    int found = n == 0 ? 0 : memcmp(a, b, (size_t)n);
    return found < 0 ? -1 : found > 0;
}

/* -- what the loader calls */
static void measure_stack(void) {
    pthread_attr_t attributes;
    void *low;
    size_t size;
    uintptr_t here = (uintptr_t)__builtin_frame_address(0);
    if (st_stack_high != 0 && here < st_stack_high && here > st_deepest) {
        return;
    }
    if (pthread_getattr_np(pthread_self(), &attributes) != 0) {
        return;
    }
    pthread_attr_getstack(&attributes, &low, &size);
    pthread_attr_destroy(&attributes);
    st_stack_high = (uintptr_t)low + size;
    uintptr_t deepest = (uintptr_t)low + STACK_RESERVE;
    st_deepest = here - STACK_LIMIT > deepest ? here - STACK_LIMIT : deepest;
    if (here < STACK_LIMIT) {
        st_deepest = deepest;
    }
}

ST_API void st_attach(void *hli, int64_t size, const st_services *services) {
    st_hli_low = (uintptr_t)hli;
    st_hli_high = st_hli_low + (uintptr_t)size;
    st_hli = *services;
    st_image = services->image;
    st_memory_low = (uintptr_t)st_memory;
    st_memory_high = st_memory_low + (uintptr_t)st_memory_size;
}

ST_API void st_allow(int64_t ns) {
    allowed_ns = ns;
}

ST_API int32_t st_guarded(void (*entry)(void), int64_t now_ns) {
    measure_stack();
    st_now = now_ns;
    st_turns = TURNS;
    deadline_ns = clock_ns() + allowed_ns;
    st_trap.kind = TRAP_NONE;
    st_caller = 0;
    told = 0;
    running = 1;
    if (setjmp(way_out) == 0) {
        entry();
    }
    running = 0;
    return st_trap.kind;
}
