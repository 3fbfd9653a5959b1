/* The process behind an FMU instance, and what is said to it; wire.py says the
   same in Python.  Own declarations; no header of the standard is needed. */
#ifndef HLI_COSIM_FMU_WIRE_H
#define HLI_COSIM_FMU_WIRE_H

#include <stdint.h>
#include <sys/types.h>

#include "model.h" /* made at the export: counts, start values, cycle */

enum { WIRE_SETUP = 1, WIRE_STEP = 2, WIRE_END = 3 };

typedef void (*wire_log)(void *to, const char *text);

/* One instance.  `values`: parameters, inputs, outputs in one row. */
typedef struct slave {
    int handle;
    pid_t pid;
    char *resources;
    double values[MODEL_VALUES];
    wire_log log;
    void *log_to;
} slave;

slave *slave_new(const char *resources, wire_log log, void *log_to);

/* 0, or -1: the reason has been logged. */
int slave_setup(slave *s);
int slave_step(slave *s, double step);

/* Ends the process, if there is one, and waits for it. */
void slave_stop(slave *s);
void slave_free(slave *s);

/* The path of a file: URI, or of a plain path; the caller frees it. */
char *path_of_uri(const char *uri);

#endif
