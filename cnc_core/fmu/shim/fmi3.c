/* FMI 3.0 for co-simulation, over wire.c.  Names, types and states are those of
   the standard (fmi-standard.org, FMI 3.0, sections 2.2 and 4.2). */
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "wire.h"

#define EXPORT __attribute__((visibility("default")))

typedef void *component, *environment;
typedef uint32_t reference;
typedef const char *string;
typedef const uint8_t *binary;
typedef enum {
    OK,
    WARNING,
    DISCARD,
    ERROR,
    FATAL
} status;
typedef void (*message)(environment, status, string, string);

typedef struct {
    slave *cell;
    message log;
    environment to;
    double time;
    enum {
        FRESH,
        RUNNING,
        BROKEN
    } state;
} instance;

static void to_logger(void *to, const char *text) {
    instance *c = to;
    if (c->log) {
        c->log(c->to, ERROR, "logStatusError", text);
    }
}

static status refuse(component given, const char *text) {
    to_logger(given, text);
    return ERROR;
}

EXPORT string fmi3GetVersion(void) {
    return "3.0";
}

EXPORT void fmi3FreeInstance(component given) {
    instance *c = given;
    if (c) {
        slave_free(c->cell);
        free(c);
    }
}

EXPORT component fmi3InstantiateCoSimulation(string name,
                                             string token,
                                             string resources,
                                             bool visible,
                                             bool logging,
                                             bool events,
                                             bool early,
                                             const reference between[],
                                             size_t n,
                                             environment to,
                                             message log,
                                             void *update) {
    (void)name;
    (void)visible;
    (void)logging;
    (void)events;
    (void)early;
    (void)between;
    (void)n;
    (void)update;
    instance *c = calloc(1, sizeof *c);
    if (!c) {
        return NULL;
    }
    c->log = log;
    c->to = to;
    c->cell = slave_new(resources, to_logger, c);
    const char *wrong = NULL;
    if (!token || strcmp(token, MODEL_GUID) != 0) {
        wrong = "the instantiation token is of another FMU";
    } else if (!c->cell) {
        wrong = "no resources, or no memory";
    }
    if (wrong) {
        to_logger(c, wrong);
        fmi3FreeInstance(c);
        return NULL;
    }
    return c;
}

EXPORT component fmi3InstantiateModelExchange(string name) {
    (void)name;
    return NULL;
}

EXPORT component fmi3InstantiateScheduledExecution(string name) {
    (void)name;
    return NULL;
}

EXPORT status fmi3SetDebugLogging(component given,
                                  bool on,
                                  size_t n,
                                  const string categories[]) {
    (void)given;
    (void)on;
    (void)n;
    (void)categories;
    return OK;
}

EXPORT status fmi3EnterInitializationMode(component given,
                                          bool has_tolerance,
                                          double tolerance,
                                          double start,
                                          bool has_stop,
                                          double stop) {
    instance *c = given;
    (void)has_tolerance;
    (void)tolerance;
    (void)has_stop;
    (void)stop;
    if (c->state != FRESH) {
        return refuse(given, "the instance has been initialized");
    }
    c->time = start;
    return OK;
}

EXPORT status fmi3ExitInitializationMode(component given) {
    instance *c = given;
    c->state = slave_setup(c->cell) == 0 ? RUNNING : BROKEN;
    return c->state == RUNNING ? OK : ERROR;
}

EXPORT status fmi3Terminate(component given) {
    slave_stop(((instance *)given)->cell);
    return OK;
}

EXPORT status fmi3Reset(component given) {
    instance *c = given;
    slave *fresh = slave_new(c->cell->resources, to_logger, c);
    if (!fresh) {
        return ERROR;
    }
    slave_free(c->cell);
    c->cell = fresh;
    c->state = FRESH;
    return OK;
}

EXPORT status fmi3DoStep(component given,
                         double at,
                         double step,
                         bool no_set_state,
                         bool *event,
                         bool *end,
                         bool *early,
                         double *reached) {
    instance *c = given;
    (void)no_set_state;
    *event = *end = *early = false;
    *reached = at;
    if (c->state != RUNNING) {
        return refuse(given, "the instance is not initialized");
    }
    if (slave_step(c->cell, step) != 0) {
        return ERROR;
    }
    c->time = *reached = at + step;
    return OK;
}

/* ---- values */
#define TIME MODEL_VALUES
#define HLI (MODEL_VALUES + 1)
#define ARRAYS_END (MODEL_FIRST_ARRAY + MODEL_ARRAYS * MODEL_ARRAY_SIZE)

/* How many numbers a variable has; 0: there is none. */
static size_t size_of(reference at) {
    if (at >= MODEL_VALUES) {
        return 0;
    }
    if (at < MODEL_FIRST_ARRAY || at >= ARRAYS_END) {
        return 1;
    }
    return (at - MODEL_FIRST_ARRAY) % MODEL_ARRAY_SIZE ? 0 : MODEL_ARRAY_SIZE;
}

static status known(component given,
                    const reference at[],
                    size_t n,
                    size_t numbers,
                    bool writing) {
    size_t count = 0;
    for (size_t i = 0; i < n; i++) {
        size_t size = at[i] == TIME && !writing ? 1 : size_of(at[i]);
        if (size == 0) {
            return refuse(given,
                          "no variable of this value reference and type");
        }
        if (writing && at[i] >= MODEL_FIRST_OUTPUT) {
            return refuse(given, "an output cannot be set");
        }
        if (writing && at[i] < MODEL_FIRST_INPUT
            && ((instance *)given)->state != FRESH) {
            return refuse(given,
                          "a parameter is set before the initialization");
        }
        count += size;
    }
    return count == numbers
               ? OK
               : refuse(given,
                        "the number of values is not that of the variables");
}

EXPORT status fmi3GetFloat64(component given,
                             const reference at[],
                             size_t n,
                             double to[],
                             size_t numbers) {
    instance *c = given;
    status out = known(given, at, n, numbers, false);
    for (size_t i = 0; out == OK && i < n; i++) {
        if (at[i] == TIME) {
            *to++ = c->time;
            continue;
        }
        size_t size = size_of(at[i]);
        memcpy(to, c->cell->values + at[i], size * sizeof *to);
        to += size;
    }
    return out;
}

EXPORT status fmi3SetFloat64(component given,
                             const reference at[],
                             size_t n,
                             const double from[],
                             size_t numbers) {
    status out = known(given, at, n, numbers, true);
    for (size_t i = 0; out == OK && i < n; i++) {
        ((instance *)given)->cell->values[at[i]] = from[i];
    }
    return out;
}

EXPORT status fmi3GetInt32(component given,
                           const reference at[],
                           size_t n,
                           int32_t to[],
                           size_t numbers) {
    status out = known(given, at, n, numbers, false);
    for (size_t i = 0; out == OK && i < n; i++) {
        to[i] = (int32_t)((instance *)given)->cell->values[at[i]];
    }
    return out;
}

EXPORT status fmi3SetInt32(component given,
                           const reference at[],
                           size_t n,
                           const int32_t from[],
                           size_t numbers) {
    status out = known(given, at, n, numbers, true);
    for (size_t i = 0; out == OK && i < n; i++) {
        ((instance *)given)->cell->values[at[i]] = from[i];
    }
    return out;
}

EXPORT status fmi3GetBoolean(component given,
                             const reference at[],
                             size_t n,
                             bool to[],
                             size_t numbers) {
    status out = known(given, at, n, numbers, false);
    for (size_t i = 0; out == OK && i < n; i++) {
        to[i] = ((instance *)given)->cell->values[at[i]] != 0.0;
    }
    return out;
}

EXPORT status fmi3SetBoolean(component given,
                             const reference at[],
                             size_t n,
                             const bool from[],
                             size_t numbers) {
    status out = known(given, at, n, numbers, true);
    for (size_t i = 0; out == OK && i < n; i++) {
        ((instance *)given)->cell->values[at[i]] = from[i];
    }
    return out;
}

/* The channel's HLI, as it is now. */
EXPORT status fmi3GetBinary(component given,
                            const reference at[],
                            size_t n,
                            size_t sizes[],
                            binary to[],
                            size_t numbers) {
    instance *c = given;
    for (size_t i = 0; i < n; i++) {
        if (at[i] != HLI || numbers != n) {
            return refuse(given,
                          "no variable of this value reference and type");
        }
        if (slave_hli(c->cell) != 0) {
            return ERROR;
        }
        sizes[i] = c->cell->hli_size;
        to[i] = c->cell->hli;
    }
    return OK;
}

/* ---- refused by name.  Arguments are not looked at, so that they are left out
   here; the calling convention of the platform allows it. */
#define NO_VARIABLES(type)                                                     \
    EXPORT status fmi3Get##type(component given,                               \
                                const reference at[],                          \
                                size_t n) {                                    \
        (void)at;                                                              \
        return n == 0 ? OK : refuse(given, "no variables of type " #type);     \
    }                                                                          \
    EXPORT status fmi3Set##type(component given,                               \
                                const reference at[],                          \
                                size_t n) {                                    \
        (void)at;                                                              \
        return n == 0 ? OK : refuse(given, "no variables of type " #type);     \
    }

#define REFUSED(name, why)                                                     \
    EXPORT status fmi3##name(component given) {                                \
        return refuse(given, "fmi3" #name " is not supported: " why);          \
    }

#define STATE "the state of a cell lies in processes of its own"
#define DERIVATIVES "a cell has no derivatives"
#define CLOCKS "a cell has no clocks"
#define EXCHANGE "a cell is for co-simulation only"

NO_VARIABLES(Float32)
NO_VARIABLES(Int8)
NO_VARIABLES(UInt8)
NO_VARIABLES(Int16)
NO_VARIABLES(UInt16)
NO_VARIABLES(UInt32)
NO_VARIABLES(Int64)
NO_VARIABLES(UInt64)
NO_VARIABLES(String)
NO_VARIABLES(Clock)
REFUSED(SetBinary, "the HLI is an output")
REFUSED(GetFMUState, STATE)
REFUSED(SetFMUState, STATE)
REFUSED(SerializedFMUStateSize, STATE)
REFUSED(SerializeFMUState, STATE)
REFUSED(DeserializeFMUState, STATE)
REFUSED(GetDirectionalDerivative, DERIVATIVES)
REFUSED(GetAdjointDerivative, DERIVATIVES)
REFUSED(GetOutputDerivatives, DERIVATIVES)
REFUSED(GetNumberOfVariableDependencies, "they do not change")
REFUSED(GetVariableDependencies, "they do not change")
REFUSED(EnterConfigurationMode, "there are no structural parameters")
REFUSED(ExitConfigurationMode, "there are no structural parameters")
REFUSED(EnterEventMode, "a cell has no events")
REFUSED(EnterStepMode, "a cell has no events")
REFUSED(GetIntervalDecimal, CLOCKS)
REFUSED(GetIntervalFraction, CLOCKS)
REFUSED(GetShiftDecimal, CLOCKS)
REFUSED(GetShiftFraction, CLOCKS)
REFUSED(SetIntervalDecimal, CLOCKS)
REFUSED(SetIntervalFraction, CLOCKS)
REFUSED(SetShiftDecimal, CLOCKS)
REFUSED(SetShiftFraction, CLOCKS)
REFUSED(ActivateModelPartition, CLOCKS)
REFUSED(EvaluateDiscreteStates, EXCHANGE)
REFUSED(UpdateDiscreteStates, EXCHANGE)
REFUSED(EnterContinuousTimeMode, EXCHANGE)
REFUSED(CompletedIntegratorStep, EXCHANGE)
REFUSED(SetTime, EXCHANGE)
REFUSED(SetContinuousStates, EXCHANGE)
REFUSED(GetContinuousStateDerivatives, EXCHANGE)
REFUSED(GetEventIndicators, EXCHANGE)
REFUSED(GetContinuousStates, EXCHANGE)
REFUSED(GetNominalsOfContinuousStates, EXCHANGE)
REFUSED(GetNumberOfEventIndicators, EXCHANGE)
REFUSED(GetNumberOfContinuousStates, EXCHANGE)

EXPORT status fmi3FreeFMUState(component given, void **at) {
    return at && *at
               ? refuse(given, "fmi3FreeFMUState is not supported: " STATE)
               : OK;
}
