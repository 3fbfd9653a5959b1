/* FMI 2.0 for co-simulation, over wire.c.  Names, types and states are those of
   the standard (fmi-standard.org, FMI 2.0.4, sections 2.1 and 4.2). */
#include <stdlib.h>
#include <string.h>

#include "instance.h"

typedef void *component, *environment, *fmu_state;
typedef double real;
typedef int integer, boolean;
typedef const char *string;
typedef enum {
    MODEL_EXCHANGE,
    CO_SIMULATION
} type;
typedef enum {
    DO_STEP,
    PENDING_STATUS,
    LAST_TIME,
    TERMINATED
} status_kind;

typedef struct {
    void (*logger)(environment, string, int, string, string, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(environment, status);
    environment to;
} callbacks;

typedef struct {
    instance common;
    callbacks calls;
    char *name;
} component2;

/* The text is the format: not every importer looks at what stands behind it. */
static void to_logger(void *to, const char *text) {
    component2 *c = to;
    char format[2 * WIRE_TEXT], *end = format;
    for (; *text && end < format + sizeof format - 2; text++) {
        if (*text == '%') {
            *end++ = '%';
        }
        *end++ = *text;
    }
    *end = 0;
    if (c->calls.logger) {
        c->calls.logger(c->calls.to,
                        c->name,
                        (int)ERROR,
                        "logStatusError",
                        format);
    }
}

static char *copy_of(const char *text) {
    size_t size = text ? strlen(text) + 1 : 1;
    char *out = calloc(1, size);
    if (out && text) {
        memcpy(out, text, size);
    }
    return out;
}

EXPORT string fmi2GetTypesPlatform(void) {
    return "default";
}

EXPORT string fmi2GetVersion(void) {
    return "2.0";
}

EXPORT void fmi2FreeInstance(component given) {
    component2 *c = given;
    if (c) {
        slave_free(c->common.cell);
        free(c->name);
        free(c);
    }
}

EXPORT component fmi2Instantiate(string name,
                                 type kind,
                                 string guid,
                                 string resources,
                                 const callbacks *calls,
                                 boolean visible,
                                 boolean logging) {
    (void)visible;
    (void)logging;
    if (!calls) {
        return NULL;
    }
    component2 *c = calloc(1, sizeof *c);
    if (!c) {
        return NULL;
    }
    c->common.log = to_logger;
    c->calls = *calls;
    c->name = copy_of(name);
    const char *wrong = kind == CO_SIMULATION
                            ? instance_open(&c->common, guid, resources)
                            : "a cell is for co-simulation only";
    if (!c->name) {
        wrong = "no memory";
    }
    if (wrong) {
        to_logger(c, wrong);
        fmi2FreeInstance(c);
        return NULL;
    }
    return c;
}

EXPORT status fmi2SetDebugLogging(component given,
                                  boolean on,
                                  size_t n,
                                  const string categories[]) {
    (void)given;
    (void)on;
    (void)n;
    (void)categories;
    return OK;
}

EXPORT status fmi2SetupExperiment(component given,
                                  boolean has_tolerance,
                                  real tolerance,
                                  real start,
                                  boolean has_stop,
                                  real stop) {
    (void)has_tolerance;
    (void)tolerance;
    (void)has_stop;
    (void)stop;
    ((instance *)given)->time = start;
    return OK;
}

EXPORT status fmi2EnterInitializationMode(component given) {
    return instance_enter(given);
}

EXPORT status fmi2ExitInitializationMode(component given) {
    return instance_start(given);
}

EXPORT status fmi2Terminate(component given) {
    return instance_stop(given);
}

EXPORT status fmi2Reset(component given) {
    return instance_reset(given);
}

EXPORT status fmi2DoStep(component given,
                         real at,
                         real step,
                         boolean no_set_state) {
    (void)no_set_state;
    return instance_step(given, at, step);
}

/* ---- values */
#define MORE
#define NUMBERS n

GETTER(fmi2GetReal, REAL, real, to_real)
SETTER(fmi2SetReal, REAL, real)
GETTER(fmi2GetInteger, WHOLE, integer, to_whole)
SETTER(fmi2SetInteger, WHOLE, integer)
GETTER(fmi2GetBoolean, FLAG, boolean, to_flag)
SETTER(fmi2SetBoolean, FLAG, boolean)

EXPORT status fmi2GetString(component given,
                            const reference at[],
                            size_t n,
                            string to[]) {
    access wanted = {at, n, n, TEXT, 0};
    return instance_text(given, wanted, to);
}

EXPORT status fmi2SetString(component given,
                            const reference at[],
                            size_t n,
                            const string from[]) {
    access wanted = {at, n, n, TEXT, 1};
    return instance_set_text(given, wanted, from);
}

/* ---- refused by name */
#define NO_STATE "not supported: " STATE
#define NO_DERIVATIVES "not supported: " DERIVATIVES

EXPORT status fmi2GetFMUstate(component given, fmu_state *to) {
    (void)to;
    return refuse(given, "fmi2GetFMUstate is " NO_STATE);
}

EXPORT status fmi2SetFMUstate(component given, fmu_state from) {
    (void)from;
    return refuse(given, "fmi2SetFMUstate is " NO_STATE);
}

EXPORT status fmi2FreeFMUstate(component given, fmu_state *at) {
    return at && *at ? refuse(given, "fmi2FreeFMUstate is " NO_STATE) : OK;
}

EXPORT status fmi2SerializedFMUstateSize(component given,
                                         fmu_state from,
                                         size_t *to) {
    (void)from;
    (void)to;
    return refuse(given, "fmi2SerializedFMUstateSize is " NO_STATE);
}

EXPORT status fmi2SerializeFMUstate(component given,
                                    fmu_state from,
                                    char to[],
                                    size_t n) {
    (void)from;
    (void)to;
    (void)n;
    return refuse(given, "fmi2SerializeFMUstate is " NO_STATE);
}

EXPORT status fmi2DeSerializeFMUstate(component given,
                                      const char from[],
                                      size_t n,
                                      fmu_state *to) {
    (void)from;
    (void)n;
    (void)to;
    return refuse(given, "fmi2DeSerializeFMUstate is " NO_STATE);
}

EXPORT status fmi2GetDirectionalDerivative(component given,
                                           const reference unknown[],
                                           size_t n,
                                           const reference variables[],
                                           size_t m,
                                           const real seed[],
                                           real to[]) {
    (void)unknown;
    (void)n;
    (void)variables;
    (void)m;
    (void)seed;
    (void)to;
    return refuse(given, "fmi2GetDirectionalDerivative is " NO_DERIVATIVES);
}

EXPORT status fmi2SetRealInputDerivatives(component given,
                                          const reference at[],
                                          size_t n,
                                          const integer order[],
                                          const real from[]) {
    (void)at;
    (void)n;
    (void)order;
    (void)from;
    return refuse(given, "fmi2SetRealInputDerivatives is " NO_DERIVATIVES);
}

EXPORT status fmi2GetRealOutputDerivatives(component given,
                                           const reference at[],
                                           size_t n,
                                           const integer order[],
                                           real to[]) {
    (void)at;
    (void)n;
    (void)order;
    (void)to;
    return refuse(given, "fmi2GetRealOutputDerivatives is " NO_DERIVATIVES);
}

EXPORT status fmi2CancelStep(component given) {
    return refuse(given,
                  "fmi2CancelStep is not supported: steps are not"
                  " asynchronous");
}

EXPORT status fmi2GetStatus(component given, status_kind kind, status *to) {
    (void)kind;
    (void)to;
    (void)given;
    return DISCARD;
}

EXPORT status fmi2GetRealStatus(component given, status_kind kind, real *to) {
    if (kind != LAST_TIME) {
        return DISCARD;
    }
    *to = ((instance *)given)->time;
    return OK;
}

EXPORT status fmi2GetIntegerStatus(component given,
                                   status_kind kind,
                                   integer *to) {
    (void)given;
    (void)kind;
    (void)to;
    return DISCARD;
}

EXPORT status fmi2GetBooleanStatus(component given,
                                   status_kind kind,
                                   boolean *to) {
    if (kind != TERMINATED) {
        return DISCARD;
    }
    *to = ((instance *)given)->state == BROKEN;
    return OK;
}

EXPORT status fmi2GetStringStatus(component given,
                                  status_kind kind,
                                  string *to) {
    (void)given;
    (void)kind;
    (void)to;
    return DISCARD;
}
