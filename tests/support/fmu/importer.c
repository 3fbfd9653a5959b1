/* A plain importer of FMI 2.0: LIBRARY GUID RESOURCES MODE.
   run: 300 steps of 1 ms of two instances, a line of values each; the second
   one has feed hold from step 100 on.
   refuse: what is refused, by the importer's logger.
   hang: one step, then wait to be killed.
   lives: LIVES instances (100), each makes a step.
   orphan: a step, then the cell's process is killed, then a step. */
#include <dlfcn.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

typedef void *component;
typedef struct {
    void (*logger)(void *, const char *, int, const char *, const char *, ...);
    void *(*allocate)(size_t, size_t);
    void (*release)(void *);
    void (*step_finished)(void *, int);
    void *to;
} callbacks;

static void logger(void *to,
                   const char *name,
                   int status,
                   const char *category,
                   const char *text,
                   ...) {
    va_list rest;
    (void)to;
    va_start(rest, text);
    printf("log %s %d %s: ", name, status, category);
    vprintf(text, rest);
    printf("\n");
    va_end(rest);
}

static void *library;
static const char *guid, *resources;

#define CALL(name, type, ...) ((type)dlsym(library, "fmi2" name))(__VA_ARGS__)
typedef component (*make)(const char *,
                          int,
                          const char *,
                          const char *,
                          const callbacks *,
                          int,
                          int);
typedef int (*plain)(component);
typedef void (*release)(component);
typedef int (*setup)(component, int, double, double, int, double);
typedef int (*step)(component, double, double, int);
typedef int (*real)(component, const unsigned *, size_t, double *);
typedef int (*boolean)(component, const unsigned *, size_t, int *);
typedef int (*state)(component, void **);

static component made(const char *name) {
    static const callbacks calls = {logger, calloc, free, NULL, NULL};
    return CALL("Instantiate", make, name, 1, guid, resources, &calls, 0, 0);
}

static component started(const char *name) {
    component c = made(name);
    if (!c || CALL("SetupExperiment", setup, c, 0, 0.0, 0.0, 0, 0.0) != 0
        || CALL("EnterInitializationMode", plain, c) != 0
        || CALL("ExitInitializationMode", plain, c) != 0) {
        exit(1);
    }
    return c;
}

static void ended(component c) {
    CALL("Terminate", plain, c);
    CALL("FreeInstance", release, c);
}

static int run(unsigned x, unsigned hold) {
    component one = started("one"), two = started("two");
    for (int i = 0; i < 300; i++) {
        double at[2];
        int on = i >= 100;
        CALL("SetBoolean", boolean, two, &hold, 1, &on);
        if (CALL("DoStep", step, one, i * 1e-3, 1e-3, 1) != 0
            || CALL("DoStep", step, two, i * 1e-3, 1e-3, 1) != 0) {
            return 1;
        }
        CALL("GetReal", real, one, &x, 1, &at[0]);
        CALL("GetReal", real, two, &x, 1, &at[1]);
        printf("%.17g %.17g\n", at[0], at[1]);
    }
    ended(one);
    ended(two);
    return 0;
}

static int refuse(unsigned x) {
    void *kept = NULL;
    double value = 1.0;
    for (int i = 0; i < 100; i++) {
        CALL("FreeInstance", release, made("free"));
    }
    component c = started("one");
    int wrong = CALL("DoStep", step, c, 0.0, 1.5e-3, 1) == 3;
    wrong += CALL("GetFMUstate", state, c, &kept) == 3;
    wrong += CALL("SetReal", real, c, &x, 1, &value) == 3;
    wrong += CALL("DoStep", step, c, 0.0, 2e-3, 1) == 0;
    ended(c);
    return wrong == 4 ? 0 : 1;
}

/* The logger says why the second step fails. */
static int orphan(void) {
    char line[64];
    component c = started("one");
    printf("%d\n", CALL("DoStep", step, c, 0.0, 1e-3, 1));
    fflush(stdout);
    if (!fgets(line, sizeof line, stdin)) {
        return 2;
    }
    printf("%d\n", CALL("DoStep", step, c, 1e-3, 1e-3, 1));
    printf("%d\n", CALL("DoStep", step, c, 1e-3, 1e-3, 1));
    ended(c);
    return 0;
}

static int lives(void) {
    const char *count = getenv("LIVES");
    int n = count ? atoi(count) : 100;
    for (int i = 0; i < n; i++) {
        component c = started("one");
        if (CALL("DoStep", step, c, 0.0, 1e-3, 1) != 0) {
            return 1;
        }
        CALL("FreeInstance", release, c);
    }
    return 0;
}

int main(int n, char **given) {
    if (n != 7) {
        return 2;
    }
    library = dlopen(given[1], RTLD_NOW | RTLD_LOCAL);
    guid = given[2];
    resources = given[3];
    unsigned x = (unsigned)atoi(given[5]), hold = (unsigned)atoi(given[6]);
    switch (library ? given[4][0] : 0) {
    case 'r':
        return run(x, hold);
    case 'f':
        return refuse(x);
    case 'l':
        return lives();
    case 'o':
        return orphan();
    case 'h':
        CALL("DoStep", step, started("one"), 0.0, 1e-3, 1);
        printf("stands\n");
        fflush(stdout);
        return (int)sleep(600);
    default:
        return 2;
    }
}
