/* What an instance is in both versions of the standard: its states, its
   variables, its steps. */
#ifndef HLI_COSIM_FMU_INSTANCE_H
#define HLI_COSIM_FMU_INSTANCE_H

#include <stdint.h>
#include <string.h>

#include "wire.h"

#define EXPORT __attribute__((visibility("default")))

typedef uint32_t reference;
typedef enum {
    OK,
    WARNING,
    DISCARD,
    ERROR
} status;

/* What an importer's instance begins with; `log` tells its logger. */
typedef struct instance {
    slave *cell;
    void (*log)(void *to, const char *text);
    double time;
    enum {
        FRESH,
        RUNNING,
        BROKEN
    } state;
} instance;

/* Logged, and always ERROR. */
status refuse(void *given, const char *text);

/* NULL, or what is wrong with the importer's words. */
const char *instance_open(instance *c, const char *guid, const char *resources);
status instance_enter(void *given);
status instance_start(void *given);
status instance_reset(void *given);
status instance_step(void *given, double at, double step);
status instance_stop(void *given);

/* ---- values: a variable is a row of numbers of one kind */
#define REAL 'R'
#define WHOLE 'I'
#define FLAG 'B'
#define TEXT 'S'
#define TIME MODEL_VALUES /* the independent variable of FMI 3.0 */

typedef struct {
    const reference *at;
    size_t n;       /* variables */
    size_t numbers; /* of all of them */
    char kind;
    int writing;
} access;

/* OK, or refused: no such variable, not of this kind, not to be written. */
status instance_known(void *given, access wanted);
/* How many numbers a variable has. */
size_t size_of(reference at);
/* Where they stand. */
double *values_of(void *given, reference at);

static inline double to_real(double number) {
    return number;
}
/* What is beyond 32 bits stays at the bound. */
static inline int32_t to_whole(double number) {
    if (!(number > INT32_MIN)) {
        return INT32_MIN;
    }
    return number < INT32_MAX ? (int32_t)number : INT32_MAX;
}
static inline int to_flag(double number) {
    return number != 0.0;
}

/* A getter and a setter of one type.  MORE are the parameters behind the
   values, NUMBERS says how many values there are. */
#define GETTER(name, letter, type, to_type)                                    \
    EXPORT status name(void *given,                                            \
                       const reference at[],                                   \
                       size_t n,                                               \
                       type to[] MORE) {                                       \
        access wanted = {at, n, NUMBERS, letter, 0};                           \
        status out = instance_known(given, wanted);                            \
        for (size_t i = 0; out == OK && i < n; i++) {                          \
            const double *from = values_of(given, at[i]);                      \
            for (size_t k = size_of(at[i]); k > 0; k--) {                      \
                *to++ = to_type(*from++);                                      \
            }                                                                  \
        }                                                                      \
        return out;                                                            \
    }
#define SETTER(name, letter, type)                                             \
    EXPORT status name(void *given,                                            \
                       const reference at[],                                   \
                       size_t n,                                               \
                       const type from[] MORE) {                               \
        access wanted = {at, n, NUMBERS, letter, 1};                           \
        status out = instance_known(given, wanted);                            \
        for (size_t i = 0; out == OK && i < n; i++) {                          \
            *values_of(given, at[i]) = (double)from[i];                        \
        }                                                                      \
        return out;                                                            \
    }

/* The only text is the program's name. */
status instance_text(void *given, access wanted, const char *to[]);
status instance_set_text(void *given, access wanted, const char *const from[]);

/* Why something is refused. */
#define STATE "the state of a cell lies in processes of its own"
#define DERIVATIVES "a cell has no derivatives"

#endif
