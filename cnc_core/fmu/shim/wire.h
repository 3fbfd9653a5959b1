/* The process behind an FMU instance, and what is said to it; wire.py says the
   same in Python.  Own declarations; no header of the standard is needed. */
#ifndef HLI_COSIM_FMU_WIRE_H
#define HLI_COSIM_FMU_WIRE_H

#include <stddef.h>
#include <stdint.h>
#include <sys/types.h>

#include "model.h" /* made at the export: counts, start values, cycle */

enum {
    WIRE_SETUP = 1,
    WIRE_STEP = 2,
    WIRE_END = 3,
    WIRE_HLI = 4
};

typedef void (*wire_log)(void *to, const char *text);

/* One instance.  `values`: parameters, inputs, outputs in one row. */
typedef struct slave {
    int handle;
    pid_t pid;
    char *resources;
    double values[MODEL_VALUES];
    uint8_t *hli; /* the channel's memory, as it was asked for last */
    size_t hli_size;
    wire_log log;
    void *log_to;
} slave;

slave *slave_new(const char *resources, wire_log log, void *log_to);

/* 0, or -1: the reason has been logged. */
int slave_setup(slave *s);
int slave_step(slave *s, double step);

/* Fetches the channel's memory into `hli`; the same results. */
int slave_hli(slave *s);

/* Ends the process, if there is one, and waits for it. */
void slave_stop(slave *s);
void slave_free(slave *s);

/* The path of a file: URI, or of a plain path; the caller frees it. */
char *path_of_uri(const char *uri);

#endif
