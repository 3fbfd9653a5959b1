/* See instance.h. */
#include "instance.h"

#include <stdio.h>

#define ARRAYS_END (MODEL_FIRST_ARRAY + MODEL_ARRAYS * MODEL_ARRAY_SIZE)

static const char kinds[MODEL_VALUES + 1] = MODEL_KINDS;

status refuse(void *given, const char *text) {
    ((instance *)given)->log(given, text);
    return ERROR;
}

/* ---- life */
const char *instance_open(instance *c,
                          const char *guid,
                          const char *resources) {
    if (!guid || strcmp(guid, MODEL_GUID) != 0) {
        return "the GUID is of another FMU";
    }
    c->cell = slave_new(resources, c->log, c);
    return c->cell ? NULL : "no resources, or no memory";
}

status instance_enter(void *given) {
    instance *c = given;
    return c->state == FRESH ? OK
                             : refuse(c, "the instance has been initialized");
}

status instance_start(void *given) {
    instance *c = given;
    if (c->state != FRESH) {
        return refuse(c, "the instance has been initialized");
    }
    c->state = slave_setup(c->cell) == 0 ? RUNNING : BROKEN;
    return c->state == RUNNING ? OK : ERROR;
}

status instance_reset(void *given) {
    instance *c = given;
    slave *fresh = slave_new(c->cell->resources, c->log, c);
    if (!fresh) {
        return refuse(c, "no memory");
    }
    slave_free(c->cell);
    c->cell = fresh;
    c->state = FRESH;
    c->time = 0.0;
    return OK;
}

status instance_step(void *given, double at, double step) {
    instance *c = given;
    if (c->state != RUNNING) {
        return refuse(c,
                      c->state == BROKEN ? "the cell has ended"
                                         : "the instance is not initialized");
    }
    int failed = slave_step(c->cell, step);
    if (failed) {
        c->state = failed == WIRE_ENDED ? BROKEN : RUNNING;
        return ERROR;
    }
    c->time = at + step;
    return OK;
}

status instance_stop(void *given) {
    instance *c = given;
    slave_stop(c->cell);
    c->state = c->state == FRESH ? FRESH : BROKEN;
    return OK;
}

/* ---- values */
size_t size_of(reference at) {
#if MODEL_ARRAYS > 0
    if (at >= MODEL_FIRST_ARRAY && at < ARRAYS_END) {
        return MODEL_ARRAY_SIZE;
    }
#endif
    return at <= TIME;
}

/* Inside of an array there is no variable. */
static int is_there(reference at, char kind) {
    if (at == TIME && MODEL_FMI == 3) {
        return kind == REAL;
    }
    if (at >= MODEL_VALUES || kinds[at] != kind) {
        return 0;
    }
    return size_of(at) == 1 || (at - MODEL_FIRST_ARRAY) % MODEL_ARRAY_SIZE == 0;
}

double *values_of(void *given, reference at) {
    instance *c = given;
    return at == TIME ? &c->time : c->cell->page->values + at;
}

status instance_known(void *given, access wanted) {
    size_t count = 0;
    for (size_t i = 0; i < wanted.n; i++) {
        reference at = wanted.at[i];
        if (!is_there(at, wanted.kind)) {
            char text[100];
            snprintf(text,
                     sizeof text,
                     "there is no variable of this type with the value"
                     " reference %u",
                     (unsigned)at);
            return refuse(given, text);
        }
        if (wanted.writing && at >= MODEL_FIRST_OUTPUT) {
            return refuse(given, "an output cannot be set");
        }
        if (wanted.writing && at < MODEL_FIRST_INPUT
            && ((instance *)given)->state != FRESH) {
            return refuse(given,
                          "a parameter is set before the initialization");
        }
        count += size_of(at);
    }
    return count == wanted.numbers
               ? OK
               : refuse(given,
                        "the number of values is not that of the variables");
}

status instance_text(void *given, access wanted, const char *to[]) {
    status out = instance_known(given, wanted);
    const char *set = ((instance *)given)->cell->page->program;
    for (size_t i = 0; out == OK && i < wanted.n; i++) {
        to[i] = *set ? set : MODEL_PROGRAM;
    }
    return out;
}

status instance_set_text(void *given, access wanted, const char *const from[]) {
    status out = instance_known(given, wanted);
    char *to = ((instance *)given)->cell->page->program;
    for (size_t i = 0; out == OK && i < wanted.n; i++) {
        if (!from[i] || strlen(from[i]) >= WIRE_TEXT) {
            return refuse(given, "the program's name is too long");
        }
        strcpy(to, from[i]);
    }
    return out;
}
