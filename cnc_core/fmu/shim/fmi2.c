/* FMI 2.0 for co-simulation, over wire.c.  Names, types and states are those of
   the standard (fmi-standard.org, FMI 2.0.4, sections 2.1 and 4.2). */
#include <stdlib.h>
#include <string.h>

#include "wire.h"

#define EXPORT __attribute__((visibility("default")))

typedef void *component, *environment, *fmu_state;
typedef unsigned int reference;
typedef double real;
typedef int integer, boolean;
typedef const char *string;
typedef enum { OK, WARNING, DISCARD, ERROR, FATAL, PENDING } status;
typedef enum { MODEL_EXCHANGE, CO_SIMULATION } type;
typedef enum { DO_STEP, PENDING_STATUS, LAST_TIME, TERMINATED } status_kind;

typedef struct {
    void (*logger)(environment, string, status, string, string, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(environment, status);
    environment to;
} callbacks;

typedef struct {
    slave *cell;
    callbacks calls;
    char *name;
    double time;
    enum { FRESH, RUNNING, BROKEN } state;
} instance;

static void to_logger(void *to, const char *text) {
    instance *c = to;
    if (c->calls.logger) {
        c->calls.logger(c->calls.to, c->name, ERROR, "logStatusError", "%s",
                        text);
    }
}

static status refuse(component given, const char *text) {
    to_logger(given, text);
    return ERROR;
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
    instance *c = given;
    if (c) {
        slave_free(c->cell);
        free(c->name);
        free(c);
    }
}

EXPORT component fmi2Instantiate(string name, type kind, string guid,
                                 string resources, const callbacks *calls,
                                 boolean visible, boolean logging) {
    (void)visible;
    (void)logging;
    if (!calls) {
        return NULL;
    }
    instance *c = calloc(1, sizeof *c);
    if (!c) {
        return NULL;
    }
    c->calls = *calls;
    c->name = copy_of(name);
    c->cell = slave_new(resources, to_logger, c);
    const char *wrong = NULL;
    if (kind != CO_SIMULATION) {
        wrong = "a cell is for co-simulation only";
    } else if (!guid || strcmp(guid, MODEL_GUID) != 0) {
        wrong = "the GUID is of another FMU";
    } else if (!c->name || !c->cell) {
        wrong = "no resources, or no memory";
    }
    if (wrong) {
        to_logger(c, wrong);
        fmi2FreeInstance(c);
        return NULL;
    }
    return c;
}

EXPORT status fmi2SetDebugLogging(component given, boolean on, size_t n,
                                  const string categories[]) {
    (void)given;
    (void)on;
    (void)n;
    (void)categories;
    return OK;
}

EXPORT status fmi2SetupExperiment(component given, boolean has_tolerance,
                                  real tolerance, real start, boolean has_stop,
                                  real stop) {
    (void)has_tolerance;
    (void)tolerance;
    (void)has_stop;
    (void)stop;
    ((instance *)given)->time = start;
    return OK;
}

EXPORT status fmi2EnterInitializationMode(component given) {
    return ((instance *)given)->state == FRESH
               ? OK
               : refuse(given, "the instance has been initialized");
}

EXPORT status fmi2ExitInitializationMode(component given) {
    instance *c = given;
    c->state = slave_setup(c->cell) == 0 ? RUNNING : BROKEN;
    return c->state == RUNNING ? OK : ERROR;
}

EXPORT status fmi2Terminate(component given) {
    slave_stop(((instance *)given)->cell);
    return OK;
}

EXPORT status fmi2Reset(component given) {
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

EXPORT status fmi2DoStep(component given, real at, real step,
                         boolean no_set_state) {
    instance *c = given;
    (void)no_set_state;
    if (c->state != RUNNING) {
        return refuse(given, "the instance is not initialized");
    }
    if (slave_step(c->cell, step) != 0) {
        return ERROR;
    }
    c->time = at + step;
    return OK;
}

/* ---- values */
static status known(component given, const reference at[], size_t n,
                    int writing) {
    for (size_t i = 0; i < n; i++) {
        if (at[i] >= MODEL_VALUES) {
            return refuse(given, "no variable of this value reference");
        }
        if (writing && at[i] >= MODEL_FIRST_OUTPUT) {
            return refuse(given, "an output cannot be set");
        }
        if (writing && at[i] < MODEL_FIRST_INPUT
            && ((instance *)given)->state != FRESH) {
            return refuse(given, "a parameter is set before the initialization");
        }
    }
    return OK;
}

EXPORT status fmi2GetReal(component given, const reference at[], size_t n,
                          real to[]) {
    status out = known(given, at, n, 0);
    for (size_t i = 0; out == OK && i < n; i++) {
        to[i] = ((instance *)given)->cell->values[at[i]];
    }
    return out;
}

EXPORT status fmi2SetReal(component given, const reference at[], size_t n,
                          const real from[]) {
    status out = known(given, at, n, 1);
    for (size_t i = 0; out == OK && i < n; i++) {
        ((instance *)given)->cell->values[at[i]] = from[i];
    }
    return out;
}

EXPORT status fmi2GetInteger(component given, const reference at[], size_t n,
                             integer to[]) {
    status out = known(given, at, n, 0);
    for (size_t i = 0; out == OK && i < n; i++) {
        to[i] = (integer)((instance *)given)->cell->values[at[i]];
    }
    return out;
}

EXPORT status fmi2SetInteger(component given, const reference at[], size_t n,
                             const integer from[]) {
    status out = known(given, at, n, 1);
    for (size_t i = 0; out == OK && i < n; i++) {
        ((instance *)given)->cell->values[at[i]] = from[i];
    }
    return out;
}

EXPORT status fmi2GetBoolean(component given, const reference at[], size_t n,
                             boolean to[]) {
    status out = known(given, at, n, 0);
    for (size_t i = 0; out == OK && i < n; i++) {
        to[i] = ((instance *)given)->cell->values[at[i]] != 0.0;
    }
    return out;
}

EXPORT status fmi2SetBoolean(component given, const reference at[], size_t n,
                             const boolean from[]) {
    status out = known(given, at, n, 1);
    for (size_t i = 0; out == OK && i < n; i++) {
        ((instance *)given)->cell->values[at[i]] = from[i] != 0;
    }
    return out;
}

EXPORT status fmi2GetString(component given, const reference at[], size_t n,
                            string to[]) {
    (void)at;
    (void)to;
    return n == 0 ? OK : refuse(given, "there are no variables of type String");
}

EXPORT status fmi2SetString(component given, const reference at[], size_t n,
                            const string from[]) {
    (void)at;
    (void)from;
    return n == 0 ? OK : refuse(given, "there are no variables of type String");
}

/* ---- refused by name */
#define NO_STATE "not supported: the state of a cell lies in processes of its own"
#define NO_DERIVATIVES "not supported: a cell has no derivatives"

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

EXPORT status fmi2SerializedFMUstateSize(component given, fmu_state from,
                                         size_t *to) {
    (void)from;
    (void)to;
    return refuse(given, "fmi2SerializedFMUstateSize is " NO_STATE);
}

EXPORT status fmi2SerializeFMUstate(component given, fmu_state from, char to[],
                                    size_t n) {
    (void)from;
    (void)to;
    (void)n;
    return refuse(given, "fmi2SerializeFMUstate is " NO_STATE);
}

EXPORT status fmi2DeSerializeFMUstate(component given, const char from[],
                                      size_t n, fmu_state *to) {
    (void)from;
    (void)n;
    (void)to;
    return refuse(given, "fmi2DeSerializeFMUstate is " NO_STATE);
}

EXPORT status fmi2GetDirectionalDerivative(component given,
                                           const reference unknown[], size_t n,
                                           const reference variables[],
                                           size_t m, const real seed[],
                                           real to[]) {
    (void)unknown;
    (void)n;
    (void)variables;
    (void)m;
    (void)seed;
    (void)to;
    return refuse(given, "fmi2GetDirectionalDerivative is " NO_DERIVATIVES);
}

EXPORT status fmi2SetRealInputDerivatives(component given, const reference at[],
                                          size_t n, const integer order[],
                                          const real from[]) {
    (void)at;
    (void)n;
    (void)order;
    (void)from;
    return refuse(given, "fmi2SetRealInputDerivatives is " NO_DERIVATIVES);
}

EXPORT status fmi2GetRealOutputDerivatives(component given,
                                           const reference at[], size_t n,
                                           const integer order[], real to[]) {
    (void)at;
    (void)n;
    (void)order;
    (void)to;
    return refuse(given, "fmi2GetRealOutputDerivatives is " NO_DERIVATIVES);
}

EXPORT status fmi2CancelStep(component given) {
    return refuse(given, "fmi2CancelStep is not supported: steps are not"
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

EXPORT status fmi2GetIntegerStatus(component given, status_kind kind,
                                   integer *to) {
    (void)given;
    (void)kind;
    (void)to;
    return DISCARD;
}

EXPORT status fmi2GetBooleanStatus(component given, status_kind kind,
                                   boolean *to) {
    if (kind != TERMINATED) {
        return DISCARD;
    }
    *to = ((instance *)given)->state == BROKEN;
    return OK;
}

EXPORT status fmi2GetStringStatus(component given, status_kind kind,
                                  string *to) {
    (void)given;
    (void)kind;
    (void)to;
    return DISCARD;
}
