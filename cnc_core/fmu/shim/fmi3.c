/* FMI 3.0 for co-simulation, over wire.c.  Names, types and states are those of
   the standard (fmi-standard.org, FMI 3.0, sections 2.2 and 4.2). */
#include <stdbool.h>
#include <stdlib.h>
#include <string.h>

#include "instance.h"

typedef void *component, *environment;
typedef const char *string;
typedef const uint8_t *binary;
typedef void (*message)(environment, int, string, string);

typedef struct {
    instance common;
    message log;
    environment to;
} component3;

static void to_logger(void *to, const char *text) {
    component3 *c = to;
    if (c->log) {
        c->log(c->to, (int)ERROR, "logStatusError", text);
    }
}

EXPORT string fmi3GetVersion(void) {
    return "3.0";
}

EXPORT void fmi3FreeInstance(component given) {
    component3 *c = given;
    if (c) {
        slave_free(c->common.cell);
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
    component3 *c = calloc(1, sizeof *c);
    if (!c) {
        return NULL;
    }
    c->common.log = to_logger;
    c->log = log;
    c->to = to;
    const char *wrong = instance_open(&c->common, token, resources);
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
    (void)has_tolerance;
    (void)tolerance;
    (void)has_stop;
    (void)stop;
    status out = instance_enter(given);
    if (out == OK) {
        ((instance *)given)->time = start;
    }
    return out;
}

EXPORT status fmi3ExitInitializationMode(component given) {
    return instance_start(given);
}

EXPORT status fmi3Terminate(component given) {
    return instance_stop(given);
}

EXPORT status fmi3Reset(component given) {
    return instance_reset(given);
}

EXPORT status fmi3DoStep(component given,
                         double at,
                         double step,
                         bool no_set_state,
                         bool *event,
                         bool *end,
                         bool *early,
                         double *reached) {
    (void)no_set_state;
    *event = *end = *early = false;
    *reached = at;
    status out = instance_step(given, at, step);
    if (out == OK) {
        *reached = at + step;
    }
    return out;
}

/* ---- values */
#define MORE , size_t numbers
#define NUMBERS numbers
#define HLI (MODEL_VALUES + 1)

GETTER(fmi3GetFloat64, REAL, double, to_real)
SETTER(fmi3SetFloat64, REAL, double)
GETTER(fmi3GetInt32, WHOLE, int32_t, to_whole)
SETTER(fmi3SetInt32, WHOLE, int32_t)
GETTER(fmi3GetBoolean, FLAG, bool, to_flag)
SETTER(fmi3SetBoolean, FLAG, bool)

EXPORT status fmi3GetString(component given,
                            const reference at[],
                            size_t n,
                            string to[],
                            size_t numbers) {
    access wanted = {at, n, numbers, TEXT, 0};
    return instance_text(given, wanted, to);
}

EXPORT status fmi3SetString(component given,
                            const reference at[],
                            size_t n,
                            const string from[],
                            size_t numbers) {
    access wanted = {at, n, numbers, TEXT, 1};
    return instance_set_text(given, wanted, from);
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
        sizes[i] = MODEL_HLI_SIZE;
        to[i] = c->cell->page->hli;
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
